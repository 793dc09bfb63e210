"""Player of tapes: n robots in their world, until a tape ends or a touchdown is sensed.

Where the law is affine servos play whole tapes; where the motors are late, as many ticks at once as
they are; else the feedback is computed tick by tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..._typing import Array, IntArray
from ...control import (
    AttitudeEstimator,
    Balance,
    ControllerSpec,
    PhaseLog,
    Tape,
    TouchdownDetector,
    TrunkEstimate,
    clip_torque,
    phase_grid,
)
from ...gait import Gait
from ...robot import Robot, rotation_matrix
from ..world import InertialUnit, Motion, Motors, Scenario, SensorSuite, World, finite
from .log import TickLog

_EXPECTED_TOUCHDOWN = 0.9
"""Phase of flight up to which it is played in one go."""

_CHUNK = 8
"""Ticks that are played in one go from then on; what comes after a touchdown is thrown away."""

_FALLEN = 0.6
"""Trunk height, over that of the gait's lowest point, below which a robot has fallen."""


_TUMBLED = np.cos(np.radians(45.0))
"""Cosine of the angle between the trunk's axis and the vertical beyond which it has fallen."""


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
        chunked: Play many ticks at once where that is possible; the motion is the same.

    Attributes:
        world: The robots in MuJoCo.
        motors, sensors: Theirs.
        log: The phase that they are in, as it truly is.
        sensed: The same as the robots know it: the log itself, where nothing is noisy.
        upright: Which robots have not fallen, shape (n,).
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
        chunked: bool,
    ) -> None:
        n, dt = len(gaits), scenario.timestep
        turns = balance is not None
        chunked = chunked and not turns
        self._gains, self._tau_max = spec.gains, robot.tau_max
        self._servos = chunked and scenario.affine
        # Ticks whose torques are known beforehand.
        self._ahead = scenario.delay_ticks if chunked and scenario.foreseeable else 0
        servo = spec.gains if self._servos else None
        self.world = World(robot, scenario, n, base=base, servo=servo)
        self.motors = Motors(scenario, robot.tau_max, n)
        self.sensors = SensorSuite(scenario.sensors, n, rng)
        self.log = self.sensed = TickLog(n, ticks, turns=turns)
        self._level_imu = spec.imu and balance is None  # read a phase at a time
        self._inertial = None  # read at each tick
        if balance is not None and spec.imu:
            self._inertial = InertialUnit(self.world, self.sensors)
            self._estimator = AttitudeEstimator(
                spec.attitude_filter,
                balance.at_touchdown,
                self._inertial.at_rest(spec.attitude_filter.rest),
                timestep=dt,
                gravity=float(np.linalg.norm(scenario.gravity_vector)),
            )
        if not self._servos and not self._ahead:
            inertial = self._inertial is not None
            self.sensed = TickLog(n, ticks, turns=turns, inertial=inertial)
        self._balance = balance
        self._touchdown_delay = spec.touchdown_ticks
        flight = np.array([gait.flight.duration for gait in gaits])
        self._touchdown = TouchdownDetector(spec.contact, robot, flight, timestep=dt)
        self._expected = np.round(_EXPECTED_TOUCHDOWN * flight / dt).astype(np.intp)
        heights = [gait.stance.base_reference(phase_grid())[0][:, 1] for gait in gaits]
        self._floor = _FALLEN * np.min(heights, axis=1)
        self.upright = np.ones(n, dtype=bool)

    def play(self, rows: IntArray, tape: Tape, *, part: int | None) -> IntArray:
        """Play tapes into the log until they end, or a flight's touchdown is sensed.

        Args:
            rows: Whose.
            tape: The tapes.
            part: Part of the stride that they are, an index into `PARTS`; None for the start-up.

        Returns:
            How many ticks were played, shape (m,).
        """
        world, log, sensed = self.world, self.log, self.sensed
        airborne = part == 1
        setpoints = tape.setpoint(self._gains) if self._servos else None
        played, tick, going = tape.length.copy(), tape.begin, np.arange(len(rows))
        while going.size:
            who, end = rows[going], int(tape.length[going].max())
            stop = min(self._next_stop(who, tick, airborne), end)
            if stop > tape.ticks:
                tape = tape.held(end)
                setpoints = setpoints if setpoints is None else tape.setpoint(self._gains)
            if setpoints is not None:
                motion = measured = world.play(who, setpoints[going, tick:stop])
            elif self._ahead:
                motion = measured = world.play(who, self.motors.coming(who, stop - tick))
            else:
                encoders = self.sensors.encoders(who, world.joints[who], world.joint_rates[who])
                trunk = self._estimated_trunk(who)
                torque = self._torque(who, encoders, trunk, tape, going, tick, part)
                torque = self.motors.drive(who, torque, world.joint_rates[who])
                motion = world.play(who, torque[:, None])
                measured = self._measured_motion(who, motion, encoders, trunk)
                if trunk is not None and sensed.inertial:
                    sensed.specific_force[who, tick] = trunk.specific_force
                sensed.write(who, tick, measured)
            log.write(who, tick, motion)
            played[going] = self._ends(who, measured, tick, tape.length[going], airborne)
            count = np.minimum(played[going], stop) - tick
            world.advance(who, motion, count)
            if self._ahead:
                self.motors.command(who, self._asked(motion, tape, going, tick), count)
            self._restart_broken(who)
            going, tick = going[played[going] > stop], stop
        if airborne:
            played = np.maximum(played, 1 + self._touchdown_delay)  # even if it broke before
        sensed.torques(rows, tape, self._gains, self._tau_max, int(played.max()))
        if sensed is not log:
            log.take_torques(rows, sensed)
        return played

    def _next_stop(self, rows: IntArray, tick: int, airborne: bool) -> int:
        """Tick up to which to play in one go, if the tapes do not end before."""
        if not self._servos:
            return tick + max(self._ahead, 1)
        if not airborne:
            return self.log.size
        expected = int(self._expected[rows].min())
        return expected if tick < expected else tick + _CHUNK

    def _asked(self, motion: Motion, tape: Tape, going: IntArray, tick: int) -> Array:
        """Commanded torques along a motion from a tick on [N m], shape (m, ticks, 12)."""
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
        trunk: TrunkEstimate | None,
        tape: Tape,
        going: IntArray,
        tick: int,
        part: int | None,
    ) -> Array:
        """Commanded torques at one tick, the balance's included [N m], shape (m, 12)."""
        joints, rates = encoders
        feedback = self._gains.feedback(
            tape.position[going, tick] - joints, tape.velocity[going, tick] - rates
        )
        if self._balance is not None and trunk is not None:
            balance = np.zeros_like(feedback)
            if part is not None:
                balance = self._balance.torque(
                    part, rows, tick, trunk[:2], joints, tape.position[going, tick]
                )
            self.sensed.balance[rows, tick] = balance
            feedback = feedback + balance
        return clip_torque(feedback, tape.feedforward[going, tick], self._tau_max)

    def _estimated_trunk(self, rows: IntArray) -> TrunkEstimate | None:
        """Estimated state of trunks that may turn: by the IMU, or without one the true state."""
        if self._balance is None:
            return None
        if self._inertial is not None:
            gyro, force = self._inertial.read(rows)
            self._estimator.update(rows, gyro, force)
            return self._estimator.trunk(rows, force)
        return TrunkEstimate(
            self.world.pose[rows], self.world.twist[rows], np.zeros((len(rows), 3))
        )

    def _measured_motion(
        self,
        rows: IntArray,
        motion: Motion,
        encoders: tuple[Array, Array],
        trunk: TrunkEstimate | None,
    ) -> Motion:
        """One tick's motion as the robots measure it."""
        joints, rates = encoders
        if trunk is not None:
            motion = motion._replace(pose=trunk.pose[:, None], twist=trunk.twist[:, None])
        return motion._replace(
            joints=joints[:, None],
            joint_rates=rates[:, None],
            force=self.sensors.feet(rows, motion.force),
        )

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
            over |= self._touchdown.felt(rows, motion.force, count)
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
        """Reset robots with states that are not finite to rest; they have fallen."""
        broken = rows[~finite(self.world.state[rows])]
        if broken.size:
            self.world.restart(broken)
            self.upright[broken] = False

    def measured(self, rows: IntArray, length: IntArray, *, sensed: int = 0) -> PhaseLog:
        """Log of the robots' measurements in a part of the stride of so many ticks (m,)."""
        phase = self.sensed.phase(rows, length, sensed=sensed)
        if not self._level_imu:
            return phase
        # The trunk's frame is the world's. What acts in a tick shows in the next one's rate.
        rate = self.log.base_rate[rows, : int(length.max()) + 1]
        if rate.shape[1] == int(length.max()):
            rate = np.concatenate([rate, rate[:, -1:]], axis=1)
        force = np.zeros((*rate[:, 1:].shape[:2], 3))
        force[..., [0, 2]] = np.diff(rate, axis=1) / self.world.scenario.timestep
        last = np.arange(len(rows)), length - 1
        force[last] = force[last[0], np.maximum(length - 2, 0)]  # the log ends there
        force -= self.world.scenario.gravity_vector
        _, force = self.sensors.imu(rows, np.zeros_like(force), force)
        return replace(phase, specific_force=force)

    def rewind(self, rows: IntArray, start: IntArray) -> None:
        """Give the ticks from `start` (m,) on, before a touchdown is sensed, to the next stance."""
        for log in {id(log): log for log in (self.log, self.sensed)}.values():
            log.rewind(rows, start, self._touchdown_delay)

    def tilt(self, part: int, rows: IntArray, length: IntArray) -> Array:
        """Largest angle between trunk and gait in a part of the stride [rad], shape (m,)."""
        if self._balance is None:
            return np.zeros(len(rows))
        pose = self.log.pose[rows, : int(length.max())]
        return self._balance.tilt(part, rows, pose, length)
