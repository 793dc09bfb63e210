"""Ways to play tapes: how many ticks in one go, and where the torques come from.

| way | when | in one go |
|---|---|---|
| `ServoPlayback` | the law is affine in the joints' angles and velocities | a phase |
| `DelayedPlayback` | it would be, but for motors that are late | as many ticks as they are late |
| `FeedbackPlayback` | else: noise, a speed-torque curve, turning trunk, tick controller | a tick |

The first two make the same motion as the third, faster.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from ..._typing import Array, IntArray
from ...control import (
    AttitudeEstimator,
    Balance,
    ControllerSpec,
    Gains,
    Observation,
    Tape,
    TickLoop,
    TrunkEstimate,
    clip_torque,
)
from ..world import InertialUnit, Motion, Motors, SensorSuite, World
from .log import TickLog

_EXPECTED_TOUCHDOWN = 0.9
"""Phase of flight up to which it is played in one go."""

_CHUNK = 8
"""Ticks that are played in one go from then on; what comes after a touchdown is thrown away."""


class Segment(NamedTuple):
    """The piece of m robots' tapes that is played in one go."""

    rows: IntArray
    """Which robots, shape (m,)."""
    tape: Tape
    """Their commands at the segment's ticks."""
    tick: int
    """Tick of the phase at which it begins."""
    part: int | None
    """Part of the stride, an index into `PARTS`; None for the start-up."""


class Played(NamedTuple):
    """Motion along a segment; the robots stay where they are until the world is advanced."""

    motion: Motion
    """As it truly is."""
    measured: Motion
    """As the robots measure it."""


class Playback(Protocol):
    """A way to play tapes.

    Attributes:
        sensed: The phase as the robots know it: the true log itself, where nothing is noisy.
    """

    sensed: TickLog

    def next_stop(self, rows: IntArray, tick: int, part: int | None) -> int:
        """Tick up to which to play in one go from a tick on, if the tapes do not end before."""

    def play(self, segment: Segment) -> Played:
        """Play a segment."""

    def advanced(self, segment: Segment, motion: Motion, ticks: IntArray) -> None:
        """Take note that robots were advanced by so many ticks (m,) along a motion."""


class ServoPlayback(Playback):
    """Servos at the joints play set points, `Tape.setpoint`.

    It applies where nothing comes between tape and torque but what is affine in the joints' angles
    and velocities (`Scenario.affine`), and trunks are locked. A stance is played in one go; a
    flight up to shortly before its touchdown, and then a few ticks at once.

    Args:
        world: The robots, with servos at their joints.
        gains: Those of the servos.
        log: The true log.
        flight: How long the gaits' flights last [s], shape (n,).
    """

    def __init__(self, world: World, gains: Gains, log: TickLog, flight: Array) -> None:
        self._world, self._gains, self.sensed = world, gains, log
        expected = np.round(_EXPECTED_TOUCHDOWN * flight / world.scenario.timestep)
        self._expected = expected.astype(np.intp)

    def next_stop(self, rows: IntArray, tick: int, part: int | None) -> int:
        """See `Playback`."""
        if part != 1:
            return self.sensed.size
        expected = int(self._expected[rows].min())
        return expected if tick < expected else tick + _CHUNK

    def play(self, segment: Segment) -> Played:
        """See `Playback`."""
        motion = self._world.play(segment.rows, segment.tape.setpoint(self._gains))
        return Played(motion, measured=motion)

    def advanced(self, segment: Segment, motion: Motion, ticks: IntArray) -> None:
        """The servos need not know."""


class DelayedPlayback(Playback):
    """Motors give the torques that are on their way to them, and are told the next ones after that.

    It applies where motors are late and what they are told follows from the state alone
    (`Scenario.foreseeable`), and trunks are locked: the torques of as many ticks as the delay has
    are known beforehand.

    Args:
        world: The robots.
        motors: Theirs, with a delay.
        gains: Those of the feedback.
        log: The true log.
    """

    def __init__(self, world: World, motors: Motors, gains: Gains, log: TickLog) -> None:
        self._world, self._motors, self._gains, self.sensed = world, motors, gains, log

    def next_stop(self, rows: IntArray, tick: int, part: int | None) -> int:
        """See `Playback`."""
        return tick + self._world.scenario.delay_ticks

    def play(self, segment: Segment) -> Played:
        """See `Playback`."""
        torque = self._motors.coming(segment.rows, segment.tape.ticks)
        motion = self._world.play(segment.rows, torque)
        return Played(motion, measured=motion)

    def advanced(self, segment: Segment, motion: Motion, ticks: IntArray) -> None:
        """Tell the motors the torques of the feedback law along the motion."""
        tape = segment.tape
        feedback = self._gains.feedback(
            tape.position - motion.joints, tape.velocity - motion.joint_rates
        )
        torque = clip_torque(feedback, tape.feedforward, self._world.robot.tau_max)
        self._motors.command(segment.rows, torque, ticks)


class FeedbackPlayback(Playback):
    """The feedback is computed tick by tick, from what the sensors say; so is the balance's torque.

    It applies everywhere: where sensors are noisy, motors lose torque with speed, trunks may turn,
    or a tick controller is asked instead, it is the only way.

    Args:
        world: The robots.
        motors: Theirs.
        sensors: Theirs.
        spec: The controller, whose gains act at every tick.
        balance: What keeps a trunk up that may turn; None where it is locked.
        tick_loop: What asks a tick controller, in place of gains and balance; None without one.
        ticks: Length of the longest tape.
    """

    def __init__(
        self,
        world: World,
        motors: Motors,
        sensors: SensorSuite,
        spec: ControllerSpec,
        *,
        balance: Balance | None,
        tick_loop: TickLoop | None = None,
        ticks: int,
    ) -> None:
        self._world, self._motors, self._sensors = world, motors, sensors
        self._gains, self._balance, self._tick_loop = spec.gains_of(world.robot), balance, tick_loop
        self._load = np.zeros(world.force.shape[:2])  # as measured in the tick before
        self._inertial = None  # without one the trunk's true state is known
        if balance is not None and spec.imu:
            scenario = world.scenario
            self._inertial = InertialUnit(world, sensors)
            self._estimator = AttitudeEstimator(
                spec.attitude_filter,
                balance.at_touchdown,
                self._inertial.at_rest(spec.attitude_filter.rest),
                timestep=scenario.timestep,
                gravity=float(np.linalg.norm(scenario.gravity_vector)),
            )
        turns, inertial = balance is not None, self._inertial is not None
        self.sensed = TickLog(world.n, ticks, world.robot, turns=turns, inertial=inertial)

    def next_stop(self, rows: IntArray, tick: int, part: int | None) -> int:
        """See `Playback`."""
        return tick + 1

    def play(self, segment: Segment) -> Played:
        """See `Playback`."""
        rows, tick, world = segment.rows, segment.tick, self._world
        joints, rates = self._sensors.encoders(rows, world.joints[rows], world.joint_rates[rows])
        trunk = None if self._balance is None else self._estimated_trunk(rows)
        if self._tick_loop is not None:
            torque = self._answer(self._tick_loop, segment, trunk, joints, rates)
        else:
            torque = self._feedback(segment, trunk, joints, rates)
        torque = self._motors.drive(rows, torque, world.joint_rates[rows])
        motion = world.play(rows, torque[:, None])
        measured = motion._replace(
            joints=joints[:, None],
            joint_rates=rates[:, None],
            force=self._sensors.feet(rows, motion.force),
        )
        self._load[rows] = measured.force[:, 0, :, 2]
        if trunk is not None:
            measured = measured._replace(pose=trunk.pose[:, None], twist=trunk.twist[:, None])
            if self._inertial is not None:
                self.sensed.specific_force[rows, tick] = trunk.specific_force
        self.sensed.write(rows, tick, measured)
        return Played(motion, measured)

    def advanced(self, segment: Segment, motion: Motion, ticks: IntArray) -> None:
        """Nothing is left to do: motors were told their torques before."""

    def _feedback(
        self, segment: Segment, trunk: TrunkEstimate | None, joints: Array, rates: Array
    ) -> Array:
        """Torques of gains, balance and feedforward, within their limits [N m], shape (m, 12)."""
        tape = segment.tape
        feedback = self._gains.feedback(tape.position[:, 0] - joints, tape.velocity[:, 0] - rates)
        if self._balance is not None and trunk is not None:
            balance = self._balance_torque(self._balance, segment, trunk, joints)
            self.sensed.balance[segment.rows, segment.tick] = balance
            feedback = feedback + balance
        return clip_torque(feedback, tape.feedforward[:, 0], self._world.robot.tau_max)

    def _answer(
        self,
        tick_loop: TickLoop,
        segment: Segment,
        trunk: TrunkEstimate | None,
        joints: Array,
        rates: Array,
    ) -> Array:
        """Torques of the tick controller, which go into the log here: no tape tells them."""
        rows, tick, tape = segment.rows, segment.tick, segment.tape
        assert tape.acceleration is not None  # the controller has written both for it
        assert tape.phase is not None
        observation = Observation(
            rows,
            segment.part,
            tick,
            tape.phase[:, 0],
            joints,
            rates,
            self._load[rows],
            trunk,
            tape.position[:, 0],
            tape.velocity[:, 0],
            tape.acceleration[:, 0],
            tape.feedforward[:, 0],
            tick_loop.previous[rows],
        )
        wanted = tick_loop.torque(observation)
        torque = tick_loop.previous[rows]
        self.sensed.feedforward[rows, tick] = observation.feedforward
        self.sensed.feedback[rows, tick] = wanted - observation.feedforward
        self.sensed.missing[rows, tick] = torque - wanted
        return torque

    def _estimated_trunk(self, rows: IntArray) -> TrunkEstimate:
        """Estimated state of trunks that may turn: by the IMU, or without one the true state."""
        if self._inertial is not None:
            gyro, force = self._inertial.read(rows)
            self._estimator.update(rows, gyro, force)
            return self._estimator.trunk(rows, force)
        return TrunkEstimate(
            self._world.pose[rows], self._world.twist[rows], np.zeros((len(rows), 3))
        )

    @staticmethod
    def _balance_torque(
        balance: Balance, segment: Segment, trunk: TrunkEstimate, joints: Array
    ) -> Array:
        """Torques that keep trunks up [N m], shape (m, 12); none in the start-up."""
        if segment.part is None:
            return np.zeros_like(joints)
        position = segment.tape.position[:, 0]
        return balance.torque(segment.part, segment.rows, segment.tick, trunk[:2], joints, position)
