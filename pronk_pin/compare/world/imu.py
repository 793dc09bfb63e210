"""IMUs: on trunks that may turn, read tick by tick; on level ones, a phase at a time."""

from __future__ import annotations

import numpy as np

from ..._typing import Array, IntArray
from ...robot import rotation_matrix
from .engine import World
from .scenario import Scenario
from .sensors import SensorSuite


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


def level_specific_force(scenario: Scenario, base_rate: Array, length: IntArray) -> Array:
    """Compute the specific force on trunks that stay level, at each tick of a phase [m/s^2].

    Their frame is the world's. What acts in a tick shows in the next one's rate; the last tick, at
    which the log ends, has the force of the one before.

    Args:
        scenario: The scenario, whose gravity acts.
        base_rate: Rates of the trunks' x and z [m/s], shape (m, ticks + 1, 2), or without the
            tick after the longest phase, (m, ticks, 2).
        length: Ticks of each robot's phase, shape (m,).

    Returns:
        Shape (m, ticks, 3).
    """
    if base_rate.shape[1] == int(length.max()):
        base_rate = np.concatenate([base_rate, base_rate[:, -1:]], axis=1)
    force = np.zeros((*base_rate[:, 1:].shape[:2], 3))
    force[..., [0, 2]] = np.diff(base_rate, axis=1) / scenario.timestep
    last = np.arange(len(length)), length - 1
    force[last] = force[last[0], np.maximum(length - 2, 0)]
    force -= scenario.gravity_vector
    return force
