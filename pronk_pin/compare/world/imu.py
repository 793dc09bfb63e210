"""IMUs on trunks that may turn, and the attitude estimated from them."""

from __future__ import annotations

import numpy as np

from ..._typing import Array, IntArray
from ...robot import rotation_matrix
from .sensors import SensorSuite
from .world import World


class InertialUnit:
    """IMUs on the trunks of n robots, read at every tick.

    Args:
        world: The robots.
        sensors: How far their sensors are from the truth.
    """

    def __init__(self, world: World, sensors: SensorSuite) -> None:
        scenario = world.scenario
        self._world, self._sensors, self._timestep = world, sensors, scenario.timestep
        self._gravity = np.array(scenario.gravity_vector)
        self._velocity = np.zeros((world.n, 3))  # of the trunks a tick ago, in the world

    def at_rest(self, duration: float) -> tuple[Array, Array]:
        """What gyros and accelerometers say while the robots lie still and level, each tick.

        Args:
            duration: For how long they lie there [s].

        Returns:
            Angular velocities [rad/s] and specific forces [m/s^2], each of shape (n, ticks, 3).
        """
        return self._sensors.at_rest(max(round(duration / self._timestep), 1), self._gravity)

    def read(self, rows: IntArray) -> tuple[Array, Array]:
        """Read the IMUs of some robots, once at each of their ticks.

        Returns:
            Angular velocities [rad/s] and specific forces [m/s^2] in the trunk's axes, each of
            shape (m, 3).
        """
        twist, rotation = self._world.twist[rows], rotation_matrix(self._world.pose[rows, 3:])
        velocity = np.einsum("nij,nj->ni", rotation, twist[:, :3])
        acceleration = (velocity - self._velocity[rows]) / self._timestep
        self._velocity[rows] = velocity
        force = np.einsum("nji,nj->ni", rotation, acceleration - self._gravity)
        gyro, force = self._sensors.imu(rows, twist[:, None, 3:], force[:, None])
        return gyro[:, 0], force[:, 0]
