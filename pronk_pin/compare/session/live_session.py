"""A live session: one to three robots side by side that somebody teaches, loads and pushes."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, wait
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TypeVar

import numpy as np

from ..._checks import Interval, flag, instance_of, known_name, real, whole
from ..._typing import Array
from ...control import ControllerSpec, TorqueLibrary, load_controller
from ...errors import InvalidInput, SpeedOutOfRange
from ..experiment import Experiment
from ..results import Results
from ..world import KNOWN, Scenario, load_scenario
from .live_clock import LiveClock
from .live_recording import write_recording
from .live_robot import LiveRobot, LiveStride, Moment

MOST_ROBOTS = 3
"""Robots that are simulated beside each other."""

IMPULSE = Interval(-30.0, 30.0, "N s")
"""What a push can give: the A1 weighs 12.5 kg."""

_LOOK = 0.05
"""How often who waits for a touchdown looks whether one will come [s]."""

Outcome = TypeVar("Outcome")


class _Interrupted(Exception):
    """A stride is given up in its midst, as the robot begins anew."""


class _Seat:
    """A robot's place in the session: what is asked of it, and the thread that simulates it."""

    def __init__(self, robot: LiveRobot | None = None) -> None:
        self._robot = robot
        self.asked: SimpleQueue[Callable[[], object]] = SimpleQueue()
        self.pushes: SimpleQueue[Array] = SimpleQueue()
        self.interrupted = threading.Event()
        self.strides_to_go: int | None = None  # None: as many as come
        self._lock = threading.Lock()

    @property
    def robot(self) -> LiveRobot:
        """The robot."""
        assert self._robot is not None
        return self._robot

    @robot.setter
    def robot(self, robot: LiveRobot) -> None:
        self._robot = robot

    def answer(self) -> None:
        """Do what was asked."""
        with self._lock:
            self.interrupted.clear()
            while True:
                try:
                    self.asked.get_nowait()()
                except Empty:
                    return

    def pushes_now(self) -> Iterator[Array]:
        """The pushes asked for so far, which are taken."""
        with suppress(Empty):
            while True:
                yield self.pushes.get_nowait()

    def interrupt(self, do: Callable[[], object]) -> None:
        """Have the robot give up its stride and its pushes, and something done then."""
        with self._lock:
            for _ in self.pushes_now():
                pass
            self.asked.put(do)
            self.interrupted.set()


class LiveSession:
    """Robots that go on stride by stride while their controllers, speed and world are changed.

    Each has a controller of its own; speed, scenario and pushes are of all of them alike. Without
    `running`, `stride` simulates at once, as scripts and tests do; with it they go in real time,
    each on a thread of its own, and what is asked takes effect at their next touchdowns, a push
    within 10 ms.

    Args:
        experiment: Robot, gaits and apex; its controllers, one robot each; its first scenario.
        speed: Commanded speed to begin with [m/s]; by default the experiment's that is nearest to
            0.5.
        on_moment: Called with the number of a robot and each of its moments, on its thread.
        on_stride: Called with the number of a robot and each stride that it has finished, likewise.
        on_trouble: Called with an error that has ended a robot's thread; by default it is raised
            where the session ends.

    Raises:
        InvalidInput: There are more than three controllers, or one cannot be played live.
    """

    def __init__(
        self,
        experiment: Experiment,
        *,
        speed: float | None = None,
        on_moment: Callable[[int, Moment], object] | None = None,
        on_stride: Callable[[int, LiveStride], object] | None = None,
        on_trouble: Callable[[BaseException], object] | None = None,
    ) -> None:
        self.experiment = instance_of("experiment", experiment, Experiment)
        names = experiment.controller_names
        if len(names) > MOST_ROBOTS:
            raise InvalidInput(
                f"{len(names)} controllers, one robot each; name {MOST_ROBOTS} or fewer"
            )
        if experiment.base != "locked" or experiment.mjcf:
            raise InvalidInput("a live session is of base 'locked', and of the robot's own URDF")
        self._library = experiment.library
        if speed is None:
            speed = min(experiment.speeds, key=lambda each: abs(each - 0.5))
        self._speed = self._known_speed(speed)
        self.base_scenario = experiment.scenario(experiment.scenario_names[0])
        self._scenario, self._values = self.base_scenario, dict[str, float]()
        self._specs = [experiment.controller(name) for name in names]  # as was asked last
        self._learning = [False for _ in names]
        self._on_moment, self._on_stride, self._on_trouble = on_moment, on_stride, on_trouble
        self.clock = LiveClock()
        self._running = False
        self._troubles: list[BaseException] = []
        self._recording: Path | None = None
        self._counting = threading.Lock()
        self._seats = [_Seat() for _ in names]
        for number, (seat, spec) in enumerate(zip(self._seats, self._specs, strict=True)):
            seat.robot = LiveRobot(
                experiment.model,
                self._library,
                spec,
                self._scenario,
                speed=self._speed,
                seed=experiment.seeds[0],
                apex=experiment.apex,
                look=self._looker(number),
            )

    @property
    def robots(self) -> tuple[LiveRobot, ...]:
        """The robots; while the session runs, each belongs to its own thread."""
        return tuple(seat.robot for seat in self._seats)

    @property
    def controllers(self) -> tuple[ControllerSpec, ...]:
        """The controller of each robot, as was asked last."""
        return tuple(self._specs)

    @property
    def learning(self) -> tuple[bool, ...]:
        """Whether each robot is to learn, as was asked last."""
        return tuple(self._learning)

    @property
    def speed(self) -> float:
        """The commanded speed [m/s]."""
        return self._speed

    @property
    def speeds(self) -> tuple[float, float]:
        """Slowest and fastest speed that can be commanded [m/s]."""
        return float(self._library.speeds[0]), float(self._library.speeds[-1])

    @property
    def scenario(self) -> Scenario:
        """The scenario."""
        return self._scenario

    @property
    def mismatches(self) -> dict[str, float]:
        """What was changed in the scenario, by the names of the mismatches."""
        return dict(self._values)

    @property
    def recording(self) -> Path | None:
        """The folder that is recorded to; None if none is."""
        return self._recording

    def watch(
        self,
        *,
        on_moment: Callable[[int, Moment], object],
        on_stride: Callable[[int, LiveStride], object],
        on_trouble: Callable[[BaseException], object],
    ) -> None:
        """Have others told what happens, see the class, in place of those before."""
        self._on_moment, self._on_stride, self._on_trouble = on_moment, on_stride, on_trouble

    # --- going -------------------------------------------------------------------------------

    def stride(self, count: int = 1) -> list[list[LiveStride]]:
        """Simulate strides of every robot at once, as fast as can be.

        Returns:
            For each robot its strides, oldest first.
        """
        count = whole("count", count, Interval(1, 1_000_000))
        if self._running:
            raise InvalidInput("the session runs by itself; use step(), or end it first")
        with self._seats[0].robot.simulation.world.running():
            return [[seat.robot.stride() for _ in range(count)] for seat in self._seats]

    @contextmanager
    def running(self, *, rate: float = 1.0) -> Iterator[LiveSession]:
        """Let the robots go by the clock while the context lasts; then their threads end.

        Args:
            rate: Simulated seconds for each second of the wall's.
        """
        if self._running:
            raise InvalidInput("the session runs already")
        self.clock = LiveClock(rate)
        self.clock.set(min(seat.robot.time for seat in self._seats))
        self._running = True
        self._troubles.clear()
        threads = [
            threading.Thread(target=self._go, args=(k,), name=f"pronk_pin robot {k}", daemon=True)
            for k in self._numbers
        ]
        with self._seats[0].robot.simulation.world.running():
            self.clock.paused = False
            for thread in threads:
                thread.start()
            try:
                yield self
            finally:
                self._running = False
                self.clock.end()
                for thread in threads:
                    thread.join()
        if self._troubles and self._on_trouble is None:
            raise self._troubles[0]

    def _go(self, number: int) -> None:
        """A robot's thread."""
        seat = self._seats[number]
        try:
            while self._running:
                try:
                    seat.answer()
                    stride = seat.robot.stride()
                    if self._on_stride is not None:
                        self._on_stride(number, stride)
                    self._stepped(seat)
                except _Interrupted:
                    continue
        except BaseException as error:
            self._troubles.append(error)
            if self._on_trouble is not None:
                self._on_trouble(error)
            self._running = False
            self.clock.end()

    def _looker(self, number: int) -> Callable[[Moment], None]:
        """What a robot calls at each of its moments."""
        seat = self._seats[number]

        def look(moment: Moment) -> None:
            if self._on_moment is not None:
                self._on_moment(number, moment)
            if not self._running:
                return
            self.clock.wait(moment.time, seat.interrupted)
            if seat.interrupted.is_set():
                raise _Interrupted
            for push in seat.pushes_now():
                seat.robot.push(push)

        return look

    def _stepped(self, seat: _Seat) -> None:
        """Stop a robot that has made the single stride asked for; the last one stops the clock."""
        if seat.strides_to_go is None:
            return
        with self._counting:
            seat.strides_to_go -= 1
            if all(each.strides_to_go == 0 for each in self._seats):
                self.clock.paused = True
                for each in self._seats:
                    each.strides_to_go = None
                self.clock.wake()
                return
        while self._waits(seat) and not seat.interrupted.wait(0.005):
            pass

    def _waits(self, seat: _Seat) -> bool:
        """Whether a robot waits for the others to make their single strides."""
        return self._running and seat.strides_to_go == 0

    def step(self) -> None:
        """Let every robot go on to its next touchdown, and pause there."""
        self._check_runs("step")
        with self._counting:
            for seat in self._seats:
                seat.strides_to_go = 1
        self.clock.paused = False

    def pause(self, paused: bool = True) -> None:
        """Pause, or go on."""
        self._check_runs("pause")
        with self._counting:
            for seat in self._seats:
                seat.strides_to_go = None
        self.clock.paused = flag("paused", paused)

    def _check_runs(self, what: str) -> None:
        if not self._running:
            raise InvalidInput(f"{what} is for a session that runs; use it within running()")

    # --- controls ----------------------------------------------------------------------------

    def set_speed(self, speed: float) -> None:
        """Command another speed of all robots [m/s].

        Raises:
            SpeedOutOfRange: There are no gaits for it.
        """
        self._speed = speed = self._known_speed(speed)
        for seat in self._seats:
            self._ask(seat, seat.robot.set_speed, speed)

    def set_learning(self, on: bool, robot: int | None = None) -> None:
        """Switch the learning of a robot on or off; by default of all whose controllers learn."""
        on = flag("learning", on)
        for seat in self._chosen(robot):
            self._learning[self._seats.index(seat)] = on
            self._ask(seat, setattr, seat.robot, "learning", on)

    def set_controller(self, robot: int, name: str) -> None:
        """Go on under another controller, of whose name no other robot has one.

        Raises:
            UnknownName: There is none.
            InvalidInput: It cannot be played live, or another robot has it.
        """
        (seat,) = self._chosen(robot)
        spec = load_controller(name)
        if spec.name in [each.name for k, each in enumerate(self._specs) if k != robot]:
            raise InvalidInput(f"another robot has the controller '{spec.name}'; choose another")
        seat.robot.check_controller(spec)
        self._check_not_recording()
        self._specs[robot] = spec
        self._ask(seat, seat.robot.set_controller, spec)

    def set_mismatches(self, values: Mapping[str, float]) -> None:
        """Go on in the session's scenario with these mismatches, of all those of `KNOWN`.

        Args:
            values: The mismatches' values in their units; what is not in it is as it was at first.

        Raises:
            UnknownName, InvalidInput: A name is not known, or a value is out of range.
        """
        for name in values:
            known_name("mismatch", name, KNOWN)
        self._check_not_recording()
        scenario = self.base_scenario
        if values:
            numbers = {name: repr(float(value)) for name, value in values.items()}
            words = "+".join(f"{name}={text}" for name, text in numbers.items()).replace("e+", "e")
            nominal = scenario == load_scenario("nominal")
            scenario = load_scenario(words) if nominal else scenario + load_scenario(words)
        self._values, self._scenario = dict(values), scenario
        for seat in self._seats:
            self._ask(seat, seat.robot.set_scenario, scenario)

    def forget(self, robot: int | None = None) -> None:
        """Have a robot play again what its controller began with; by default all."""
        for seat in self._chosen(robot):
            self._ask(seat, seat.robot.forget)

    def skill(self, robot: int) -> TorqueLibrary:
        """What a robot plays, by speed; where it goes, as of its next touchdown."""
        (seat,) = self._chosen(robot)
        return self._asked(seat, lambda: seat.robot.skill)

    def load_skill(self, robot: int, skill: TorqueLibrary) -> None:
        """Have a robot play other torques.

        Raises:
            InvalidInput: They are not of this robot.
        """
        (seat,) = self._chosen(robot)
        instance_of("skill", skill, TorqueLibrary)
        seat.robot.check_skill(skill)
        self._ask(seat, seat.robot.load, skill)

    def push(self, impulse: Sequence[float] | Array, robot: int | None = None) -> None:
        """Push a robot's trunk at once, by default all [N s], world frame, shape (3,)."""
        values = np.array([real("push", value, IMPULSE) for value in impulse])
        if values.shape != (3,):
            raise InvalidInput(f"a push of {len(values)} numbers; give its x, y and z [N s]")
        for seat in self._chosen(robot):
            if self._running:
                seat.pushes.put(values)
            else:
                seat.robot.push(values)

    def reset(self, *, forget: bool = True) -> None:
        """Stand all robots up again, by default with nothing learned and the learning off."""
        self._check_not_recording()
        if forget:
            self._learning = [False for _ in self._seats]
        if self._running:
            self.clock.set(-self.robots[0].startup)
        for seat in self._seats:
            reset = partial(seat.robot.reset, forget=forget)
            if self._running:
                seat.interrupt(reset)
            else:
                reset()
        self.clock.wake()

    # --- recording ---------------------------------------------------------------------------

    def record(self, folder: Path | str) -> None:
        """Record strides to a results folder, from the next touchdowns on, until `save`.

        What comes after two minutes is not kept. Controllers and the scenario stay as they are
        meanwhile.

        Raises:
            InvalidInput: One is recorded already, or the folder is there.
        """
        self._check_not_recording()
        folder = Path(folder)
        if folder.exists():
            raise InvalidInput(f"{folder} is there already; record to another folder")
        self._recording = folder
        for seat in self._seats:
            self._ask(seat, seat.robot.begin_recording)

    def save(self) -> Results:
        """Write what was recorded, which `view` and `report` open.

        Raises:
            InvalidInput: Nothing is recorded, or less than a second of it.
            FileProblem: It cannot be written.
        """
        folder = self._recording
        if folder is None:
            raise InvalidInput("nothing is recorded; begin with record()")
        try:  # scenario and controllers stay as they are until the last robot has answered
            datasets = [self._asked(seat, seat.robot.recorded) for seat in self._seats]
        finally:
            self._recording = None
        experiment = dataclasses.replace(
            self.experiment,
            controllers=self.controllers,
            scenarios=(self._scenario,),
            seeds=self.experiment.seeds[:1],
            speeds=(),
            batches=(),
            commands=(str(datasets[0]["command"].item()),),
        )
        return write_recording(experiment, folder, datasets)

    def _check_not_recording(self) -> None:
        if self._recording is not None:
            raise InvalidInput(
                f"what is recorded to {self._recording} is of one scenario and these controllers; "
                "save it first"
            )

    # --- asking ------------------------------------------------------------------------------

    @property
    def _numbers(self) -> range:
        return range(len(self._seats))

    def _chosen(self, robot: int | None) -> list[_Seat]:
        if robot is None:
            return list(self._seats)
        return [self._seats[whole("robot", robot, Interval(0, len(self._seats) - 1))]]

    def _known_speed(self, speed: float) -> float:
        speed, (slowest, fastest) = round(real("speed", speed), 3), self.speeds
        if not slowest <= speed <= fastest:
            raise SpeedOutOfRange(speed, slowest, fastest)
        return speed

    def _ask(self, seat: _Seat, do: Callable[..., object], *arguments: object) -> None:
        """Have something done at a robot's next touchdown, or now if it stands still."""
        if self._running:
            seat.asked.put(lambda: do(*arguments))
        else:
            do(*arguments)

    def _asked(self, seat: _Seat, do: Callable[[], Outcome]) -> Outcome:
        """Have something done at a robot's next touchdown, and wait for what comes of it.

        Raises:
            InvalidInput: The session has ended meanwhile.
        """
        if not self._running:
            return do()
        outcome: Future[Outcome] = Future()

        def answer() -> None:
            if not outcome.set_running_or_notify_cancel():
                return
            try:
                outcome.set_result(do())
            except Exception as error:
                outcome.set_exception(error)

        seat.asked.put(answer)
        while not wait([outcome], _LOOK).done:
            if not self._running:
                raise InvalidInput("the session ended before the next touchdown; ask again")
            if self.clock.paused and outcome.cancel():
                return do()  # its thread waits, amid a stride that does not count yet
        return outcome.result()
