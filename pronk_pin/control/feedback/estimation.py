"""Estimation of the trunk's speed (leg odometry) and attitude (gyro and accelerometer).

Speed: leg odometry and a first-order filter. In stance the feet do not slip, so the joint encoders
tell the trunk's speed; in flight it stays as it was at lift-off. Section II.E of the paper. With an
IMU the filter follows changes of the speed at once, and smooths the odometry's noise only.

Attitude, where the trunk may turn: the gyro's integral, held upright by the accelerometer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..._checks import POSITIVE, Interval, instance_of, keep_reals, real
from ..._typing import Array, IntArray
from ...kinematics import leg_odometry
from ...robot import Robot, rotation_matrix
from ..signals import PhaseLog, first_order

SPEED_FILTER = Interval(0, 10, "s")
"""Time constants that a filter of the speed can have."""


class SpeedEstimator:
    """Estimator of the forward speed of n robots, one estimate a stride (section II.E).

    Leg odometry through a first-order low-pass, `T v' = v_legs - v`, over the ticks of stance.

    Attributes:
        speed: The estimates [m/s], shape (n,).
        sideways: Those of the speed to the left, in the world [m/s], shape (n,).
        upward: Those of the speed upward at lift-off [m/s], shape (n,).
    """

    def __init__(self, robot: Robot, n: int, *, time_constant: float, timestep: float) -> None:
        time_constant = real("speed filter: time_constant", time_constant, SPEED_FILTER)
        self._robot, self._time_constant, self._timestep = robot, time_constant, timestep
        self.speed, self.sideways, self.upward = np.zeros((3, n))

    def update(self, rows: IntArray, log: PhaseLog) -> Array:
        """Update the estimates of robots that have just finished a stance, and return them [m/s].

        With an accelerometer it is the complementary filter `T v' = v_legs - v + T a`: the legs'
        speed at low, the integrated acceleration at high frequencies.

        Where a sensor failed the estimate stays as it was.
        """
        n, ticks = len(rows), int(log.length.max())
        used = np.arange(ticks) < log.length[:, None]
        pose, twist = _trunk(log, n, ticks)
        valid = np.isfinite(log.joints[:, :ticks] + log.joint_rates[:, :ticks]).all(axis=-1)
        trunk_valid = np.isfinite(pose.sum(axis=-1) + twist.sum(axis=-1)) & used
        pose[~trunk_valid], twist[~trunk_valid] = _LEVEL, 0.0
        valid = (valid & trunk_valid) | ~used
        if not valid.all():
            log = replace(
                log,
                joints=np.nan_to_num(log.joints, posinf=0.0, neginf=0.0),
                joint_rates=np.nan_to_num(log.joint_rates, posinf=0.0, neginf=0.0),
            )
        q = np.concatenate([pose, log.joints[:, :ticks]], axis=-1)
        v = np.concatenate([twist, log.joint_rates[:, :ticks]], axis=-1)
        velocity = leg_odometry(
            self._robot, q.reshape(n * ticks, -1), v.reshape(n * ticks, -1), contact="rolling"
        )
        forward = velocity[:, 0].reshape(n, ticks)
        if log.specific_force is not None:  # gravity does not show in the world's x
            along = rotation_matrix(pose[..., 3:])[..., 0, :]
            acceleration = np.einsum("nti,nti->nt", along, log.specific_force[:, :ticks])
            forward = forward + self._time_constant * acceleration
            valid &= np.isfinite(forward) | ~used
            forward = np.where(used, forward, 0.0)
        aside, upward = velocity[:, 1:].T.reshape(2, n, ticks)
        for measured, speeds in (
            (forward, self.speed),
            (aside, self.sideways),
            (upward, self.upward),
        ):
            filtered = first_order(
                measured,
                speeds[rows],
                time_constant=self._time_constant,
                timestep=self._timestep,
            )
            latest = filtered[np.arange(n), log.length - 1]
            speeds[rows] = np.where(valid.all(axis=1), latest, speeds[rows])
        return self.speed[rows]


@dataclass(frozen=True)
class AttitudeFilter:
    """The explicit complementary filter on SO(3) of Mahony, Hamel and Pflimlin (2008).

    With the attitude R, the gyro's rate w, the specific force f and gravity g,

        R' = R (w - b_w + k (f - b_f) / g x R^T e_z)^,

    where b_w and b_f are the biases at rest and e_z is the vertical.

    The accelerometer's vector is not normalised: in flight it tells nothing and weighs nothing,
    and over a stride of steady pronking, which begins and ends at the same speed, its mean is the
    vertical. Nothing holds the heading but a gyro whose bias was taken away at rest.

    Before it stands up a robot lies still, its trunk level. What its IMU then says beyond gravity
    is, in the mean, taken for the bias.

    Attributes:
        gain: Gain k of the correction by the accelerometer [1/s].
        rest: Time at rest in which the biases are estimated [s].
    """

    gain: float = 0.1
    rest: float = 2.0

    def __post_init__(self) -> None:
        checks = {"gain": Interval(0, 100, "1/s"), "rest": Interval(0, 600, "s", above=True)}
        keep_reals(self, checks, "attitude filter: ")


class TrunkEstimate(NamedTuple):
    """What m robots know of their trunks at one tick."""

    pose: Array
    """Position and quaternion xyzw, shape (m, 7); an IMU says nothing of the position: zero."""
    twist: Array
    """Velocity in the trunk's own axes, shape (m, 6); nor of the linear one."""
    specific_force: Array
    """What the accelerometer says, trunk's axes [m/s^2], shape (m, 3); zero without one."""


class AttitudeEstimator:
    """Attitude estimator of n robots by an `AttitudeFilter`, tick by tick.

    Args:
        spec: The filter.
        attitude: Attitudes to begin with, shape (n, 3, 3).
        at_rest: Readings while the robots lie still and level: gyros [rad/s] and accelerometers
            [m/s^2], each of shape (n, ticks, 3).
        timestep: Time between two readings [s].
        gravity: Acceleration of gravity [m/s^2].

    Attributes:
        quaternion: The estimates, xyzw, shape (n, 4).
        rate: The angular velocities without the gyros' bias, trunk's axes [rad/s], shape (n, 3).
    """

    def __init__(
        self,
        spec: AttitudeFilter,
        attitude: Array,
        at_rest: tuple[Array, Array],
        *,
        timestep: float,
        gravity: float,
    ) -> None:
        instance_of("spec", spec, AttitudeFilter)
        timestep = real("timestep", timestep, POSITIVE)
        gravity = real("gravity", gravity, POSITIVE)
        self._timestep, self._weight = timestep, spec.gain / gravity
        turning, force = (readings.mean(axis=1) for readings in at_rest)
        self._bias = turning, force - np.array([0.0, 0.0, gravity])
        self.quaternion = Rotation.from_matrix(attitude).as_quat()
        self.rate = np.zeros_like(turning)

    def update(self, rows: IntArray, gyro: Array, specific_force: Array) -> None:
        """Update by one reading of some robots' IMUs; one that is not finite changes nothing.

        Args:
            rows: Which robots.
            gyro: Angular velocities, trunk's axes [rad/s], shape (m, 3).
            specific_force: Accelerations less gravity, trunk's axes [m/s^2], shape (m, 3).
        """
        valid = np.isfinite(gyro.sum(axis=1) + specific_force.sum(axis=1))
        rows = rows[valid]
        rate, force = gyro[valid] - self._bias[0][rows], specific_force[valid] - self._bias[1][rows]
        upward = rotation_matrix(self.quaternion[rows])[:, 2]  # the vertical in the trunk's axes
        turn = 0.5 * (self.rate[rows] + rate) + self._weight * np.cross(force, upward)
        self.rate[rows] = rate
        if rows.size:
            before = Rotation.from_quat(self.quaternion[rows])
            after = before * Rotation.from_rotvec(self._timestep * turn)
            self.quaternion[rows] = after.as_quat()

    def trunk(self, rows: IntArray, specific_force: Array) -> TrunkEstimate:
        """What some robots know of their trunks.

        Args:
            rows: Which robots.
            specific_force: What their accelerometers say, shape (m, 3).
        """
        nothing = np.zeros((len(rows), 3))
        return TrunkEstimate(
            np.hstack([nothing, self.quaternion[rows]]),
            np.hstack([nothing, self.rate[rows]]),
            specific_force,
        )


_LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def _trunk(log: PhaseLog, n: int, ticks: int) -> tuple[Array, Array]:
    """Trunk's pose (n, ticks, 7) and velocity (n, ticks, 6), level where the log has none."""
    if log.pose is not None and log.twist is not None:
        return log.pose[:, :ticks].copy(), log.twist[:, :ticks].copy()
    return np.tile(_LEVEL, (n, ticks, 1)), np.zeros((n, ticks, 6))
