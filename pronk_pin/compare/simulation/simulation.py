"""Simulation of n robots, one controller and one scenario, at 1 kHz, from event to event.

A stance ends by time, as its reference does; a flight ends with the touchdown that the feet feel.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeAlias

import numpy as np
import xarray as xr

from ..._checks import Interval, flag, instance_of, known_name, whole
from ..._typing import Array, BoolArray, IntArray
from ..._workers import count_steps
from ...control import (
    Controller,
    ControllerSpec,
    ControlTime,
    InitialFeedforward,
    SpeedCommand,
    TorqueLibrary,
)
from ...errors import InvalidInput
from ...gait import Gait, known_gaits
from ...robot import BASES, Robot
from ..world import Scenario, World
from .dataset import to_dataset
from .log import StrideLog
from .memory import check_memory
from .player import Player
from .schedule import Schedule

Progress: TypeAlias = Callable[[int], object]
"""Called with the number of time steps done since the last call."""


class Simulation:
    """Simulation of n robots at their own speeds under one controller in one scenario.

    All robots are played from event to event together, each on a clock of its own: one goes on in
    its stride while another already waits for the next. Each makes as many strides as begin before
    the end of the schedule.

    Args:
        robot: The robot.
        gaits: The gait of each of the n robots.
        spec: The controller.
        scenario: The scenario.
        schedule: What happens when.
        rng: Source of the scatter at the start.
        feedforward: Feedforward to begin with [N m], shape (n, 2, samples, 12).
        flight: How long the references of the flights last at first [s], shape (n,); by default as
            the gaits plan them.
        base: How the trunks may move: "locked" to x and z, "sagittal" with pitch, or "free".
        chunked: Let servos play whole tapes, as MuJoCo can where the law is affine between two
            events, or as many ticks as the motors are late by. Otherwise the feedback is computed
            tick by tick, as it always is where the scenario is neither. The motion is the same.
        threads: Threads that share the robots, whose trunks must be locked for that: each goes
            through the strides of its own ones, and what one computes hides behind the others'
            physics. By default the caller's only, as simulations run side by side in processes.
        command: Commanded speeds, for which the robots' gaits change at each stride, on a locked
            base; by default they keep theirs. Their first gaits are `command.first_gaits`.
        library: Torque library that the feedforward is from, if it is one of conditions that are to
            be estimated.
    """

    def __init__(
        self,
        robot: Robot,
        gaits: Sequence[Gait],
        spec: ControllerSpec,
        scenario: Scenario,
        *,
        schedule: Schedule,
        rng: np.random.Generator,
        feedforward: Array | None = None,
        flight: Array | None = None,
        base: str = "locked",
        chunked: bool = True,
        threads: int = 1,
        command: SpeedCommand | None = None,
        library: TorqueLibrary | None = None,
    ) -> None:
        gaits = known_gaits(robot, gaits)
        instance_of("scenario", scenario, Scenario, "a Scenario, as load_scenario() returns it")
        instance_of("schedule", schedule, Schedule)
        instance_of("rng", rng, np.random.Generator, "a numpy.random.Generator")
        threads = whole("threads", threads, Interval(high=1024))
        flag("chunked", chunked)
        known_name("base", base, BASES)
        check_memory(gaits, schedule.duration)
        n, dt = len(gaits), scenario.timestep
        if threads < 1 or (threads > 1 and base != "locked"):
            raise InvalidInput("threads must be 1 or more, and 1 where the base is not locked")
        self.schedule, self._gaits, self._dt = schedule, tuple(gaits), dt
        self.controller = Controller(
            robot,
            gaits,
            spec,
            timestep=dt,
            feedforward=feedforward,
            flight=flight,
            base=base,
            command=command,
            library=library,
        )
        self._command = command
        self._threads = threads
        self._chunked, self._base = chunked, base
        self.player = self._player(scenario, rng)
        self.strides = StrideLog(
            gaits,
            schedule.duration,
            dt,
            others=() if command is None else command.all_gaits,
            conditions=0 if library is None else len(library.conditions),
        )
        self._clock = np.zeros(n, dtype=np.intp)  # ticks since the first stride began
        self._stand(robot, rng)

    def _player(self, scenario: Scenario, rng: np.random.Generator) -> Player:
        return Player(
            self.controller.robot,
            self._gaits,
            self.controller.spec,
            scenario,
            ticks=self.controller.max_ticks,
            rng=rng.spawn(1)[0],
            base=self._base,
            balance=self.controller.balance,
            tick_loop=self.controller.tick_loop,
            chunked=self._chunked,
        )

    @property
    def world(self) -> World:
        """The robots in the scenario's engine."""
        return self.player.world

    @property
    def upright(self) -> BoolArray:
        """Which robots have not fallen, shape (n,)."""
        return self.player.upright

    def change_scenario(self, scenario: Scenario, rng: np.random.Generator) -> None:
        """Go on in another scenario from the robots' touchdowns on, with all that they have.

        Robots and motors keep their state, controllers what they estimate and have learned. Trunks
        must be locked, and time steps the same.

        Args:
            scenario: The scenario.
            rng: Source of the sensors' noise in it.
        """
        self._check_goes_on(scenario)
        player = self._player(scenario, rng)
        player.take_over(self.player)
        self.player = player

    def change_controller(
        self, spec: ControllerSpec, command: SpeedCommand, rng: np.random.Generator
    ) -> None:
        """Go on under another controller from the robots' touchdowns on, with a memory of its own.

        Args:
            spec: The controller.
            command: The speeds that it follows, and its memory.
            rng: Source of the sensors' noise from then on.
        """
        scenario, before = self.world.scenario, self.controller
        self._check_goes_on(scenario)
        if self._command is not None:
            command.speed[:] = self._command.speed  # of the gaits that they land in
        self.controller = Controller(
            before.robot,
            command.first_gaits,
            spec,
            timestep=self._dt,
            **command.initial_feedforward._asdict(),
            command=command,
        )
        self.controller.take_over(before)
        self._command = command
        player = self._player(scenario, rng)
        player.take_over(self.player)
        self.player = player

    def _check_goes_on(self, scenario: Scenario) -> None:
        if self._base != "locked" or scenario.timestep != self._dt:
            raise InvalidInput(
                "a simulation goes on in another scenario, or under another controller, on base "
                f"'locked' with the same time step of {self._dt:g} s; make a new one"
            )

    def _stand(self, robot: Robot, rng: np.random.Generator) -> None:
        """Set the robots on the ground in the posture of their first stride."""
        start = np.array([0.0])
        joints = np.stack([gait.stance.joint_reference(start)[0][0] for gait in self._gaits])
        base = np.array([gait.stance.base_reference(start)[0][0] for gait in self._gaits])
        joints += self.schedule.scatter * rng.standard_normal(joints.shape)
        place = np.column_stack([np.zeros(len(joints)), base[:, 1]])
        self.world.reset(place, joints, pitch=base[:, 2])

    def run(
        self,
        progress: Progress | None = None,
        before_stride: Callable[[IntArray], object] | None = None,
    ) -> StrideLog:
        """Simulate to the end of the schedule.

        Args:
            progress: Called with the number of steps done since the last call; by default whoever
                listens to this process (`_workers.listening`) is told.
            before_stride: Called with the robots that are about to begin a stride, each as often.
        """
        schedule = self.schedule
        steps = round((schedule.baseline + schedule.learning) / self._dt)
        done, lock = 0, threading.Lock()
        tell = self._count if progress is None else progress

        def report() -> None:
            nonlocal done
            with lock:
                before, done = done, min(int(self._clock.mean()), steps)
                if done > before:
                    tell(done - before)

        def strides(rows: IntArray) -> None:
            while (going := rows[self._clock[rows] < steps]).size:
                if before_stride is not None:
                    before_stride(going)
                start = self._clock[going]
                learning = start >= round(schedule.baseline / self._dt)
                self._strides(going, learning, self._seconds(steps - start))
                report()

        with self.world.running(), ThreadPoolExecutor(self._threads) as pool:
            self.start_up()
            shares = np.array_split(np.arange(len(self._gaits)), self._threads)
            side_by_side = pool.map if self._threads > 1 else map
            list(side_by_side(strides, shares))  # an error in a thread is raised here
        tell(steps - done)
        self.strides.finish(self.upright)
        return self.strides

    def _count(self, steps: int) -> None:
        count_steps(steps * len(self._gaits))

    @property
    def control_time(self) -> ControlTime:
        """How long the controller has computed, at events and at ticks, for how many ticks."""
        events, loop = self.controller.time, self.controller.tick_loop
        seconds = events.seconds + (0.0 if loop is None else loop.time.seconds)
        return ControlTime(seconds, int(self._clock.sum()))

    @property
    def clock(self) -> float:
        """Simulated time since the first stride began, of the robot that is ahead [s]."""
        return float(self._clock.max() * self._dt)

    def restart_log(self) -> None:
        """Forget all strides, and count strides and time from here on."""
        self.strides.restart()
        self._clock -= self._clock.max()

    def start_up(self) -> None:
        """Stand; the last ticks are as if the first stance's touchdown had been sensed late."""
        rows, late = np.arange(len(self._gaits)), self.controller.spec.touchdown_ticks
        ticks = round(self.schedule.startup / self._dt) + late
        for piece in np.array_split(np.arange(ticks), -(-ticks // self.player.log.size)):
            self.player.play(rows, self.controller.stand(len(piece)), part=None)
        self.player.rewind(rows, np.full(len(rows), len(piece) - late))

    def stride(self, *, learning: bool) -> None:
        """Simulate one more stride of every robot, beyond any schedule, after `start_up`.

        Args:
            learning: Whether they learn from the one before.
        """
        rows = np.arange(len(self._gaits))
        self._strides(rows, np.full(len(rows), learning), np.zeros(len(rows)))

    def _strides(self, rows: IntArray, learning: BoolArray, remaining: Array) -> None:
        """Simulate one stride of some robots, with so much to go (m,) [s]."""
        late = self.player.late[rows]
        for ticks in np.unique(late):  # those that are equally late together
            alike = late == ticks
            self._stride(rows[alike], learning[alike], remaining[alike], late=int(ticks))

    def _stride(self, rows: IntArray, learning: BoolArray, remaining: Array, *, late: int) -> None:
        """Simulate one stride of some robots, from touchdown to touchdown.

        The first was felt late by so many ticks.
        """
        controller, strides, player = self.controller, self.strides, self.player
        log = player.log
        start = self._clock[rows]
        learning = learning & controller.learns
        strides.begin(rows, self._seconds(start), learning, remaining=remaining)

        with controller.time.measured():
            tape = controller.touchdown(rows, learning, late=late)
        if controller.conditions is not None:
            strides["conditions"][rows, strides.count[rows]] = controller.conditions.values[rows]
        if self._command is not None:
            gaits = [controller.gaits[row] for row in rows]
            commanded = self._command.commanded(rows, self._seconds(start))
            strides.change(rows, gaits, commanded)
        stance = player.play(rows, tape, part=0)
        measured_log = player.measured(rows, stance, sensed=late)
        with controller.time.measured():
            tape, record = controller.liftoff(
                rows, measured_log, self._commanded(rows, start + stance)
            )
        if self._command is not None:
            strides["landing_speed"][rows, strides.count[rows]] = self._command.speed[rows]
        if player.sensed is not log:  # what is kept is the truth
            record = controller.record(0, rows, log.phase(rows, stance, sensed=late))
        strides.stance(rows, record, log, stance)
        tilt = player.tilt(0, rows, stance)

        # A touchdown is felt late: the last ticks of the flight's tape are the next stance's.
        flight = player.play(rows, tape, part=1)
        flight -= player.late[rows]
        duration, upright = self._seconds(stance + flight), self.upright[rows]
        tilt = np.maximum(tilt, player.tilt(1, rows, flight))
        measured_log = player.measured(rows, flight)
        with controller.time.measured():
            record = controller.landing(rows, measured_log, duration, upright)
        if player.sensed is not log:
            record = controller.record(1, rows, log.phase(rows, flight))
        strides.flight(rows, record, log, flight)
        player.rewind(rows, flight)
        strides.end(
            rows,
            duration,
            log.base[rows, 0, 0],
            upright,
            controller.skipped[rows],
            tilt=tilt,
            heading=log.attitude(rows, flight, np.zeros((len(rows), 1)))[:, 0, 2],
            flight_reference=controller.flight[rows],
        )
        self._clock[rows] = start + stance + flight

    def _commanded(self, rows: IntArray, clock: IntArray) -> Array | None:
        """Speeds that are commanded when robots land that lift off now; None without a command."""
        if self._command is None:
            return None
        landing = self._seconds(clock) + self.controller.flight[rows]
        return self._command.commanded(rows, landing)

    def _seconds(self, ticks: IntArray) -> Array:
        return np.asarray(ticks * self._dt, dtype=float)


def simulate(
    robot: Robot,
    gaits: Sequence[Gait],
    spec: ControllerSpec,
    scenario: Scenario,
    *,
    schedule: Schedule,
    rng: np.random.Generator,
    initial: InitialFeedforward | None = None,
    base: str = "locked",
    attributes: Mapping[str, str | int | float] | None = None,
    progress: Progress | None = None,
    control_time: ControlTime | None = None,
    command: SpeedCommand | None = None,
) -> xr.Dataset:
    """Simulate robots under one controller in one scenario, and label their strides.

    Args:
        robot: The robot.
        gaits: The gait of each robot.
        spec: The controller.
        scenario: The scenario.
        schedule: What happens when.
        rng: Source of the scatter at the start, and of the sensors' noise.
        initial: Torques that the controller begins with; by default none.
        base: How the trunks may move: "locked" to x and z, "sagittal" with pitch, or "free".
        attributes: Attributes of the dataset; by default the name of the robot.
        progress: Called with the number of time steps done since the last call.
        control_time: Takes how long the controller computed.
        command: Commanded speeds, see `Simulation`.

    Returns:
        The strides, see `to_dataset`.
    """
    initial = InitialFeedforward() if initial is None else initial
    simulation = Simulation(
        robot,
        gaits,
        spec,
        scenario,
        schedule=schedule,
        rng=rng,
        feedforward=initial.feedforward,
        flight=initial.flight,
        base=base,
        command=command,
        library=initial.library,
    )
    attributes = {"robot": robot.name} if attributes is None else attributes
    log = simulation.run(progress)
    if control_time is not None:
        control_time.add(simulation.control_time)
    return to_dataset(
        log, robot, gaits, attributes=attributes, command=command, library=initial.library
    )
