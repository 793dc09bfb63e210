"""Player of tapes: n robots in their world, until a tape ends or a touchdown is sensed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from ..._typing import Array, BoolArray, IntArray
from ...control import (
    Balance,
    ControllerSpec,
    PhaseLog,
    Tape,
    TickLoop,
    TouchdownDetector,
)
from ...gait import Gait
from ...robot import Robot
from ..world import (
    ENGINES,
    Motion,
    Motors,
    Scenario,
    SensorSuite,
    check_motion,
    level_specific_force,
    make_world,
)
from .fall import FallDetector
from .log import TickLog
from .playback import (
    DelayedPlayback,
    FeedbackPlayback,
    Playback,
    Segment,
    ServoPlayback,
)

PIECE = 10
"""Most ticks that are played in one go where somebody is asked before each."""

BeforePiece: TypeAlias = Callable[[IntArray, Tape, int], object]
"""Called before ticks are played in one go: with which robots (m,), their tapes, and the tick."""


class Player:
    """Plays tapes of n robots, and logs the motion, the torques and the sensors' readings.

    Several threads may play at once, each its own robots, where the trunks are locked.

    Args:
        robot: The robot.
        gaits: The gait of each of the n robots.
        spec: The controller, whose gains and balance act at every tick.
        scenario: The scenario.
        ticks: Length of the longest tape.
        rng: Source of the sensors' noise.
        base: How the trunks may move, see `build_model`.
        balance: What keeps a trunk up that may turn; None where it is locked.
        tick_loop: What asks the tick controller; None where tapes and gains make the torques.
        chunked: Play many ticks at once where that is possible; the motion is the same.

    Attributes:
        world: The robots in the scenario's engine.
        motors, sensors: Theirs.
        log: The phase that they are in, as it truly is.
        sensed: The same as the robots know it: the log itself, where nothing is noisy.
        falls: Detects falls.
        upright: Which robots have not fallen, shape (n,).
        late: Ticks by which their last touchdowns were felt late, as far as they know, shape (n,).
        before_piece: Called before each `PIECE` ticks at most; None plays as many as can be.
    """

    def __init__(
        self,
        robot: Robot,
        gaits: Sequence[Gait],
        spec: ControllerSpec,
        scenario: Scenario,
        *,
        ticks: int,
        rng: np.random.Generator,
        base: str,
        balance: Balance | None,
        tick_loop: TickLoop | None = None,
        chunked: bool,
    ) -> None:
        n, level = len(gaits), balance is None
        known = chunked and level and scenario.foreseeable  # torques, before they act
        known &= tick_loop is None
        gains = spec.gains_of(robot)
        servo = gains if known and scenario.affine else None
        self.world = make_world(robot, scenario, n, base=base, servo=servo)
        self._own_engine = scenario.engine not in ENGINES
        self.motors = Motors(scenario, robot.tau_max, n)
        dt = scenario.timestep
        self.sensors = SensorSuite(
            scenario.sensors,
            n,
            rng,
            joints=robot.nu,
            latency=round(scenario.touchdown_latency / dt),
            jitter=round(scenario.touchdown_jitter / dt),
        )
        self.log = TickLog(n, ticks, robot, turns=not level)
        flight = np.array([gait.flight.duration for gait in gaits])
        self._playback: Playback
        if servo is not None:
            self._playback = ServoPlayback(self.world, servo, self.log, flight)
        elif known and scenario.delay_ticks:
            self._playback = DelayedPlayback(self.world, self.motors, gains, self.log)
        else:
            self._playback = FeedbackPlayback(
                self.world,
                self.motors,
                self.sensors,
                spec,
                balance=balance,
                tick_loop=tick_loop,
                ticks=ticks,
            )
        self.sensed = self._playback.sensed
        self._gains, self._balance, self._tick_loop = gains, balance, tick_loop
        self._level_imu = spec.imu and level  # read a phase at a time
        self.late = np.full(n, spec.touchdown_ticks, dtype=np.intp)
        self._touchdown = TouchdownDetector(
            spec.contact, robot, flight, timestep=dt, lateness=spec.touchdown_ticks
        )
        self._sensor_late, self._reference_end = np.zeros((2, n), dtype=np.intp)  # of each flight
        self.falls = FallDetector(gaits)
        self.upright = np.ones(n, dtype=bool)
        self.before_piece: BeforePiece | None = None

    def take_over(self, before: Player) -> None:
        """Go on where another player of the same robots has got to, at their touchdowns.

        What the world is in, the commands on their way to the motors, what was felt late, and who
        has fallen is as it was; trunks are locked.
        """
        world, others, felt = self.world, before.world, int(before.late.max())
        rows = np.arange(world.n)
        world.reset(others.base, others.joints, others.base_rate, others.joint_rates)
        world.force[:] = others.force
        self.motors.take_over(before.motors, before.log.torque(rows, slice(felt - 1, felt))[:, 0])
        self.log.take_over(before.log, felt)
        if self.sensed is not self.log:
            self.sensed.take_over(before.sensed, felt)
        self.late[:], self.upright[:] = before.late, before.upright
        self.before_piece = before.before_piece

    def play(self, rows: IntArray, tape: Tape, *, part: int | None) -> IntArray:
        """Play tapes into the log until they end, or a flight's touchdown is sensed.

        Args:
            rows: Whose.
            tape: The tapes.
            part: Part of the stride that they are, an index into `PARTS`; None for the start-up.

        Returns:
            How many ticks were played, shape (m,).
        """
        playback, log, sensed = self._playback, self.log, self.sensed
        airborne = part == 1
        if airborne:
            self._sensor_late[rows] = self.sensors.touchdown_lateness(rows)
            self._reference_end[rows] = tape.reference_end
        played, tick, going = tape.length.copy(), tape.begin, np.arange(len(rows))
        while going.size:
            who, end = rows[going], int(tape.length[going].max())
            stop = min(playback.next_stop(who, tick, part), end)
            if self.before_piece is not None:
                self.before_piece(who, tape, tick)
                stop = min(stop, tick + PIECE)
            if stop > tape.ticks:
                tape = tape.held(end)
            segment = Segment(who, _excerpt(tape, going, slice(tick, stop)), tick, part)
            motion, measured = playback.play(segment)
            if self._own_engine:
                check_motion(motion, self.world.robot, len(who), stop - tick)
            log.write(who, tick, motion)
            played[going] = self._ends(who, measured, tick, tape.length[going], airborne)
            count = np.minimum(played[going], stop) - tick
            self.world.advance(who, motion, count)
            playback.advanced(segment, motion, count)
            self._restart_broken(who[~motion.finite[np.arange(len(who)), count - 1]])
            going, tick = going[played[going] > stop], stop
        if airborne:
            self.late[rows] = self._touchdown.lateness(
                rows, sensed.joint_rates, played, self._reference_end[rows]
            )
            played = np.maximum(played, 1 + self.late[rows])  # even if it broke before
        tau_max = self.world.robot.tau_max
        if self._tick_loop is None:  # else they are in the log
            sensed.torques(rows, tape, self._gains, tau_max, int(played.max()))
        if sensed is not log:
            log.take_torques(rows, sensed)
        return played

    def _ends(
        self, rows: IntArray, motion: Motion, tick: int, length: IntArray, airborne: bool
    ) -> IntArray:
        """Detect the ticks at which phases end, beyond the motion where they do not end in it.

        Robots that fall in it are noted as such. One that misses its touchdown has not fallen: its
        flight ends late, with the legs held out, and the next stance begins.
        """
        count = tick + 1 + np.arange(motion.base.shape[1])  # ticks played after each step
        over, ends = count == length[:, None], np.full(len(rows), count[-1] + 1)
        if airborne:
            over |= self._felt(rows, count)
        if not motion.finite[:, -1].all():  # what is not finite stays so
            over |= ~motion.finite
        ended = over.any(axis=1)
        ends[ended] = count[np.argmax(over[ended], axis=1)]
        fallen = self.falls.fallen(rows, motion) & (count <= ends[:, None])
        self.upright[rows] &= ~fallen.any(axis=1)
        return ends

    def _felt(self, rows: IntArray, count: IntArray) -> BoolArray:
        """Whether touchdowns are felt after so many ticks (k,) of the flights, shape (m, k)."""
        detector, sensed = self._touchdown, self.sensed
        told = count - self._sensor_late[rows, None]  # (m, k)
        load = detector.load(rows, sensed.force[rows[:, None], np.maximum(told - 1, 0)], told)
        ticks = slice(int(count[0]) - 1, int(count[-1]))
        end = self._reference_end[rows]
        return load | detector.impact(rows, sensed.joint_rates, ticks, end)

    def _restart_broken(self, rows: IntArray) -> None:
        """Reset robots with states that are not finite to rest; they have fallen."""
        if rows.size:
            self.world.restart(rows)
            if self._tick_loop is not None:
                self._tick_loop.restart(rows)
            self.upright[rows] = False

    def measured(self, rows: IntArray, length: IntArray, *, sensed: int = 0) -> PhaseLog:
        """Log of the robots' measurements in a part of the stride of so many ticks (m,)."""
        phase = self.sensed.phase(rows, length, sensed=sensed)
        if not self._level_imu:
            return phase
        rate = self.log.base_rate[rows, : int(length.max()) + 1]
        force = level_specific_force(self.world.scenario, rate, length)
        _, force = self.sensors.imu(rows, np.zeros_like(force), force)
        return replace(phase, specific_force=force)

    def rewind(self, rows: IntArray, start: IntArray) -> None:
        """Give the ticks from `start` (m,) on, before a touchdown is sensed, to the next stance."""
        for log in {id(log): log for log in (self.log, self.sensed)}.values():
            log.rewind(rows, start, int(self.late[rows].max()))

    def tilt(self, part: int, rows: IntArray, length: IntArray) -> Array:
        """Largest angle between trunk and gait in a part of the stride [rad], shape (m,)."""
        if self._balance is None:
            return np.zeros(len(rows))
        pose = self.log.pose[rows, : int(length.max())]
        return self._balance.tilt(part, rows, pose, length)


def _excerpt(tape: Tape, rows: IntArray, ticks: slice) -> Tape:
    """Tapes of some of the robots at some of the ticks."""
    at = rows, ticks
    return Tape(
        tape.feedforward[at],
        tape.position[at],
        tape.velocity[at],
        tape.length[rows],
        acceleration=None if tape.acceleration is None else tape.acceleration[at],
        phase=None if tape.phase is None else tape.phase[at],
    )
