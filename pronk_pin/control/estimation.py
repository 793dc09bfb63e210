"""What the controller believes about its speed: leg odometry and a first-order filter.

In stance the feet do not slip, so the joint encoders tell the trunk's speed; in flight it stays as
it was at lift-off. Section II.E of the paper. With an IMU the filter follows changes of the speed
at once, and smooths the odometry's noise only.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .._typing import Array, IntArray
from ..errors import InvalidInput
from ..kinematics import leg_odometry
from ..robot import Robot
from .filters import first_order
from .record import PhaseLog


class SpeedEstimator:
    """Forward speed of n robots, one estimate a stride.

    Attributes:
        speed: The estimates [m/s], shape (n,).
        sideways: Those of the speed to the left, in the world [m/s], shape (n,).
    """

    def __init__(self, robot: Robot, n: int, *, time_constant: float, timestep: float) -> None:
        if time_constant < 0.0:
            raise InvalidInput("the time constant of the speed filter must not be negative")
        self._robot, self._time_constant, self._timestep = robot, time_constant, timestep
        self.speed, self.sideways = np.zeros((2, n))

    def update(self, rows: IntArray, log: PhaseLog) -> Array:
        """Take in a stance that some robots have just finished; their new estimates [m/s].

        With an accelerometer it is the complementary filter T v' = v_legs - v + T a: that of the
        legs' speed at low, of the integrated acceleration at high frequencies.

        Where a sensor failed the estimate stays as it was.
        """
        n, ticks = len(rows), int(log.length.max())
        used = np.arange(ticks) < log.length[:, None]
        pose, twist = _trunk(log, n, ticks)
        sound = np.isfinite(log.joints[:, :ticks] + log.joint_rates[:, :ticks]).all(axis=-1)
        known = np.isfinite(pose.sum(axis=-1) + twist.sum(axis=-1)) & used
        pose[~known], twist[~known] = _LEVEL, 0.0
        sound = (sound & known) | ~used
        if not sound.all():
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
        if log.specific_force is not None:  # gravity does not show in x: the base is level
            forward = forward + self._time_constant * log.specific_force[:, :ticks, 0]
            sound &= np.isfinite(forward) | ~used
            forward = np.where(used, forward, 0.0)
        aside = velocity[:, 1].reshape(n, ticks)
        for measured, speeds in ((forward, self.speed), (aside, self.sideways)):
            filtered = first_order(
                measured,
                speeds[rows],
                time_constant=self._time_constant,
                timestep=self._timestep,
            )
            latest = filtered[np.arange(n), log.length - 1]
            speeds[rows] = np.where(sound.all(axis=1), latest, speeds[rows])
        return self.speed[rows]


_LEVEL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def _trunk(log: PhaseLog, n: int, ticks: int) -> tuple[Array, Array]:
    """Trunk's pose (n, ticks, 7) and velocity (n, ticks, 6): level where nothing else is known."""
    if log.pose is not None and log.twist is not None:
        return log.pose[:, :ticks].copy(), log.twist[:, :ticks].copy()
    return np.tile(_LEVEL, (n, ticks, 1)), np.zeros((n, ticks, 6))
