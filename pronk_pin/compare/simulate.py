"""One simulation: n robots, one controller, one world, at 1 kHz, from event to event.

A stance ends by time, as its reference does; a flight ends with the touchdown that the feet feel.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from .._typing import Array, IntArray
from ..control import (
    Balance,
    Controller,
    ControllerSpec,
    PhaseLog,
    Tape,
    clip_torque,
    phase_grid,
)
from ..conventions import rotation_matrix
from ..errors import InvalidInput
from ..gait import Gait
from ..robot import Robot
from .motors import Motors
from .record import StrideLog, TickLog
from .scenario import Scenario
from .sensors import SensorSuite
from .world import Motion, World, finite, without_warnings

Progress: TypeAlias = Callable[[int], object]
"""Called with the number of time steps done since the last call."""

_EARLIEST_TOUCHDOWN = 0.5
"""Phase of flight before which contact is the lift-off's, not a touchdown."""

_EXPECTED_TOUCHDOWN = 0.9
"""Phase of flight up to which it is played in one go."""

_CHUNK = 8
"""Ticks that are played in one go from then on; what comes after a touchdown is thrown away."""

_FALLEN = 0.6
"""Trunk height, over that of the gait's lowest point, below which a robot has fallen."""


_TUMBLED = np.cos(np.radians(45.0))
"""Cosine of the angle between the trunk's axis and the vertical beyond which it has fallen."""

_SHORTEST = 1.0
"""Shortest practice and learning [s]: even a robot that lies on the ground finishes a stride."""


@dataclass(frozen=True)
class Schedule:
    """What happens when in a simulation: the paper's procedure (section III.A).

    Attributes:
        startup: Standing in the posture of the first stride [s].
        practice: Pronking without learning [s].
        learning: Pronking with the law switched on [s].
        scatter: Standard deviation of the joint angles at the start [rad].
    """

    startup: float = 0.5
    practice: float = 20.0
    learning: float = 20.0
    scatter: float = 0.01

    def __post_init__(self) -> None:
        values = (self.startup, self.practice, self.learning, self.scatter)
        if not all(0.0 <= value < np.inf for value in values):
            raise InvalidInput(
                "the durations and the scatter of a schedule must be finite and not negative"
            )
        if self.practice + self.learning < _SHORTEST:
            raise InvalidInput(
                f"practice and learning of {self.practice:g} + {self.learning:g} s are too short "
                f"for a stride; make them {_SHORTEST:g} s or more together"
            )

    @property
    def duration(self) -> float:
        """Duration of the whole simulation [s]."""
        return self.startup + self.practice + self.learning


class Simulation:
    """n robots that pronk at their own speeds under one controller in one world.

    All robots are played from event to event together, each on a clock of its own: one goes on in
    its stride while another already waits for the next. Each makes as many strides as begin before
    the end of the schedule.

    Args:
        robot: The robot.
        gaits: The gait of each of the n robots.
        spec: The controller.
        scenario: The world.
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
    ) -> None:
        n, dt = len(gaits), scenario.timestep
        if threads < 1 or (threads > 1 and base != "locked"):
            raise InvalidInput("threads must be 1 or more, and 1 where the base is not locked")
        self.schedule, self._gaits, self._dt = schedule, tuple(gaits), dt
        self.controller = Controller(
            robot, gaits, spec, timestep=dt, feedforward=feedforward, flight=flight, base=base
        )
        self._threads = threads
        self._gains, self._tau_max = spec.gains, robot.tau_max
        self._chunked = chunked and scenario.affine and base == "locked"
        servo = spec.gains if self._chunked else None
        self.world = World(robot, scenario, n, base=base, servo=servo)
        self._motors = Motors(scenario, robot.tau_max, n)
        late = scenario.delay_ticks if chunked and scenario.foreseeable and base == "locked" else 0
        self._ahead = 0 if self._chunked else late  # ticks whose torques are known beforehand
        self._sensors = SensorSuite(scenario.sensors, n, rng.spawn(1)[0])
        turns = base != "locked"
        self._log = TickLog(n, self.controller.max_ticks, turns=turns)
        # What the robots believe: the truth itself, where they compute nothing of their own.
        honest = self._chunked or self._ahead > 0
        self._seen = self._log if honest else TickLog(n, self.controller.max_ticks, turns=turns)
        self._balance = None
        if base != "locked":
            ticks = self.controller.max_ticks
            self._balance = Balance(
                robot, gaits, spec.balance, gains=spec.gains, ticks=ticks, timestep=dt
            )
        self._late = spec.touchdown_ticks
        self._load = spec.contact.touchdown * robot.mass * robot.gravity
        flight = np.array([gait.flight.duration for gait in gaits])
        self._earliest = np.round(_EARLIEST_TOUCHDOWN * flight / dt).astype(np.intp)
        self._expected = np.round(_EXPECTED_TOUCHDOWN * flight / dt).astype(np.intp)
        heights = [gait.stance.base_reference(phase_grid())[0][:, 1] for gait in gaits]
        self._floor = _FALLEN * np.min(heights, axis=1)
        self.upright = np.ones(n, dtype=bool)
        self.strides = StrideLog(gaits, schedule.duration, dt)
        self._clock = np.zeros(n, dtype=np.intp)  # ticks since the first stride began
        self._stand(robot, rng)

    def _stand(self, robot: Robot, rng: np.random.Generator) -> None:
        """Put the robots on the ground in the posture of their first stride."""
        start = np.array([0.0])
        joints = np.stack([gait.stance.joint_reference(start)[0][0] for gait in self._gaits])
        base = np.array([gait.stance.base_reference(start)[0][0] for gait in self._gaits])
        joints += self.schedule.scatter * rng.standard_normal(joints.shape)
        place = np.column_stack([np.zeros(len(joints)), base[:, 1]])
        self.world.reset(place, joints, pitch=base[:, 2])

    def run(self, progress: Progress | None = None) -> StrideLog:
        """Simulate to the end of the schedule.

        Args:
            progress: Called with the number of steps done since the last call.
        """
        schedule = self.schedule
        steps = round((schedule.practice + schedule.learning) / self._dt)
        done, lock = 0, threading.Lock()

        def report() -> None:
            nonlocal done
            with lock:
                before, done = done, min(int(self._clock.mean()), steps)
                if progress is not None and done > before:
                    progress(done - before)

        def strides(rows: IntArray) -> None:
            while (going := rows[self._clock[rows] < steps]).size:
                self._stride(going, steps=steps)
                report()

        with without_warnings(), ThreadPoolExecutor(self._threads) as pool:
            self._startup()
            shares = np.array_split(np.arange(len(self._gaits)), self._threads)
            side_by_side = pool.map if self._threads > 1 else map
            list(side_by_side(strides, shares))  # an error in a thread is raised here
        if progress is not None:
            progress(steps - done)
        self.strides.finish(self.upright)
        return self.strides

    def _startup(self) -> None:
        """Stand; the last ticks are as if the touchdown of the first stance had been felt late."""
        rows, late = np.arange(len(self._gaits)), self._late
        ticks = round(self.schedule.startup / self._dt) + late
        for piece in np.array_split(np.arange(ticks), -(-ticks // self._log.size)):
            self._play(rows, self.controller.stand(len(piece)), part=None)
        self._rewind(rows, np.full(len(rows), len(piece) - late))

    def _stride(self, rows: IntArray, *, steps: int) -> None:
        """One stride, from touchdown to touchdown, of those robots."""
        controller, strides, log = self.controller, self.strides, self._log
        seen, late = self._seen, self._late
        start = self._clock[rows]
        learning = start >= round(self.schedule.practice / self._dt)
        learning &= any(law is not None for law in controller.spec.laws)
        strides.begin(rows, self._seconds(start), learning, left=self._seconds(steps - start))

        stance = self._play(rows, controller.touchdown(rows, learning), part=0)
        tape, record = controller.liftoff(rows, self._measured(rows, stance, felt=late))
        if seen is not log:  # what is kept is the truth
            record = controller.record(0, rows, log.phase(rows, stance, felt=late))
        strides.stance(rows, record, log, stance)
        tilt = self._tilt(0, rows, stance)
        if self._balance is not None:
            self._balance.lift_off(rows, controller.sideways(rows))

        # A touchdown is felt late: the last ticks of the flight's tape are the next stance's.
        flight = self._play(rows, tape, part=1) - late
        duration, upright = self._seconds(stance + flight), self.upright[rows]
        tilt = np.maximum(tilt, self._tilt(1, rows, flight))
        known = self._measured(rows, flight)
        record = controller.landing(rows, known, duration, upright, tilt)
        if seen is not log:
            record = controller.record(1, rows, log.phase(rows, flight))
        strides.flight(rows, record, log, flight)
        self._rewind(rows, flight)
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

    def _measured(self, rows: IntArray, length: IntArray, *, felt: int = 0) -> PhaseLog:
        """What the robots measured in a part of the stride of so many ticks (m,)."""
        phase = self._seen.phase(rows, length, felt=felt)
        if not self.controller.spec.imu:
            return phase
        # The trunk's frame is the world's. What acts in a tick shows in the next one's rate.
        rate = self._log.base_rate[rows, : int(length.max()) + 1]
        if rate.shape[1] == int(length.max()):
            rate = np.concatenate([rate, rate[:, -1:]], axis=1)
        force = np.zeros((*rate[:, 1:].shape[:2], 3))
        force[..., [0, 2]] = np.diff(rate, axis=1) / self._dt
        last = np.arange(len(rows)), length - 1
        force[last] = force[last[0], np.maximum(length - 2, 0)]  # the log ends there
        force -= self.world.scenario.gravity_vector
        _, force = self._sensors.imu(rows, np.zeros_like(force), force)
        return replace(phase, specific_force=force)

    def _rewind(self, rows: IntArray, start: IntArray) -> None:
        """The ticks from `start` (m,) on, in which a touchdown was not felt, are the stance's."""
        for log in {id(log): log for log in (self._log, self._seen)}.values():
            log.rewind(rows, start, self._late)

    def _tilt(self, part: int, rows: IntArray, length: IntArray) -> Array:
        """Largest angle between trunk and gait in a part of the stride [rad], shape (m,)."""
        if self._balance is None:
            return np.zeros(len(rows))
        pose = self._log.pose[rows, : int(length.max())]
        return self._balance.tilt(part, rows, pose, length)

    def _seconds(self, ticks: IntArray) -> Array:
        return np.asarray(ticks * self._dt, dtype=float)

    def _play(self, rows: IntArray, tape: Tape, *, part: int | None) -> IntArray:
        """Play tapes into the log until they end, or a flight's touchdown is felt.

        Args:
            rows: Whose.
            tape: The tapes.
            part: Part of the stride that they are, an index into `PARTS`; None for the start-up.

        Returns:
            How many ticks were played, shape (m,).
        """
        world, log, seen = self.world, self._log, self._seen
        airborne = part == 1
        told = tape.setpoint(self._gains) if self._chunked else None
        played, tick, going = tape.length.copy(), tape.begin, np.arange(len(rows))
        while going.size:
            who, end = rows[going], int(tape.length[going].max())
            stop = min(self._next_stop(who, tick, airborne), end)
            if stop > tape.ticks:
                tape = tape.held(end)
                told = told if told is None else tape.setpoint(self._gains)
            if told is not None:
                motion = felt = world.play(who, told[going, tick:stop])
            elif self._ahead:
                motion = felt = world.play(who, self._motors.coming(who, stop - tick))
            else:
                encoders = self._sensors.encoders(who, world.joints[who], world.joint_rates[who])
                torque = self._torque(who, encoders, tape, going, tick, part)
                torque = self._motors.drive(who, torque, world.joint_rates[who])
                motion = world.play(who, torque[:, None])
                felt = self._felt(who, motion, encoders)
                seen.write(who, tick, felt)
            log.write(who, tick, motion)
            played[going] = self._ends(who, felt, tick, tape.length[going], airborne)
            count = np.minimum(played[going], stop) - tick
            world.advance(who, motion, count)
            if self._ahead:
                self._motors.command(who, self._asked(motion, tape, going, tick), count)
            self._restart_broken(who)
            going, tick = going[played[going] > stop], stop
        if airborne:
            played = np.maximum(played, 1 + self._late)  # even if it broke before
        seen.torques(rows, tape, self._gains, self._tau_max, int(played.max()))
        if seen is not log:
            log.take_torques(rows, seen)
        return played

    def _next_stop(self, rows: IntArray, tick: int, airborne: bool) -> int:
        """Up to which tick to play in one go, if the tapes do not end before."""
        if not self._chunked:
            return tick + max(self._ahead, 1)
        if not airborne:
            return self._log.size
        expected = int(self._expected[rows].min())
        return expected if tick < expected else tick + _CHUNK

    def _asked(self, motion: Motion, tape: Tape, going: IntArray, tick: int) -> Array:
        """Torques of the feedback law along a motion from a tick on, shape (m, ticks, 12)."""
        ticks = slice(tick, tick + motion.joints.shape[1])
        feedback = self._gains.feedback(
            tape.position[going, ticks] - motion.joints,
            tape.velocity[going, ticks] - motion.joint_rates,
        )
        return clip_torque(feedback, tape.feedforward[going, ticks], self._tau_max)

    def _torque(
        self,
        rows: IntArray,
        encoders: tuple[Array, Array],
        tape: Tape,
        going: IntArray,
        tick: int,
        part: int | None,
    ) -> Array:
        """Torques of the feedback law at one tick, and of the balance, shape (m, 12)."""
        joints, rates = encoders
        feedback = self._gains.feedback(
            tape.position[going, tick] - joints, tape.velocity[going, tick] - rates
        )
        if self._balance is not None:
            balance = np.zeros_like(feedback)
            if part is not None:
                balance = self._balance.torque(
                    part, rows, tick, self._believed(rows), joints, tape.position[going, tick]
                )
            self._seen.balance[rows, tick] = balance
            feedback = feedback + balance
        return clip_torque(feedback, tape.feedforward[going, tick], self._tau_max)

    def _believed(self, rows: IntArray) -> tuple[Array, Array]:
        """Pose (m, 7) and velocity (m, 6) of the trunk as the robots know them: the true ones."""
        return self.world.pose[rows], self.world.twist[rows]

    def _felt(self, rows: IntArray, motion: Motion, encoders: tuple[Array, Array]) -> Motion:
        """One tick's motion as the robots know it."""
        joints, rates = encoders
        return motion._replace(
            joints=joints[:, None],
            joint_rates=rates[:, None],
            force=self._sensors.feet(rows, motion.force),
        )

    def _ends(
        self, rows: IntArray, motion: Motion, tick: int, length: IntArray, airborne: bool
    ) -> IntArray:
        """Ticks after which the phases end, beyond the motion where they do not end in it.

        Robots that fall in it are noted as such. One that misses its touchdown has not fallen: its
        flight ends late, with the legs held out, and the next stance begins.
        """
        count = tick + 1 + np.arange(motion.base.shape[1])  # ticks played after each step
        over, ends = count == length[:, None], np.full(len(rows), count[-1] + 1)
        if airborne:
            load = motion.force[..., 2].sum(axis=-1) > self._load
            over |= load & (count > self._earliest[rows, None])
        if not finite(motion.path[:, -1]).all():  # what is not finite stays so
            over |= ~finite(motion.path[:, 1:])
        ended = over.any(axis=1)
        ends[ended] = count[np.argmax(over[ended], axis=1)]
        too_low = motion.base[..., 1] < self._floor[rows, None]
        if motion.pose is not None:
            too_low |= rotation_matrix(motion.pose[..., 3:])[..., 2, 2] < _TUMBLED
        self.upright[rows] &= ~(too_low & (count <= ends[:, None])).any(axis=1)
        return ends

    def _restart_broken(self, rows: IntArray) -> None:
        """Put robots that left the finite numbers back to rest; they have fallen."""
        broken = rows[~finite(self.world.state[rows])]
        if broken.size:
            self.world.restart(broken)
            self.upright[broken] = False
