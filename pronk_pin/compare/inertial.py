"""IMUs on trunks that may turn, and the attitude estimated from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .._typing import Array, IntArray
from ..control import AttitudeEstimator, AttitudeFilter
from ..conventions import rotation_matrix
from .sensors import SensorSuite
from .world import World


class TrunkKnown(NamedTuple):
    """Estimated states of the trunks of m robots at one tick."""

    pose: Array
    """Position and quaternion xyzw, shape (m, 7); an IMU says nothing of the position: zero."""
    twist: Array
    """Velocity in the trunk's own axes, shape (m, 6); nor of the linear one."""
    specific_force: Array
    """Reading of the accelerometer, trunk's axes [m/s^2], shape (m, 3); zero without one."""


class InertialUnit:
    """IMUs on the trunks of n robots, read at every tick.

    Args:
        world: The robots.
        sensors: How far their sensors are from the truth.
        spec: How attitudes are made out of readings.
        attitude: What they take for their attitudes at first, shape (n, 3, 3).
    """

    def __init__(
        self, world: World, sensors: SensorSuite, spec: AttitudeFilter, attitude: Array
    ) -> None:
        scenario = world.scenario
        self._world, self._sensors, self._timestep = world, sensors, scenario.timestep
        self._gravity = np.array(scenario.gravity_vector)
        self._estimator = AttitudeEstimator(
            spec,
            attitude,
            sensors.at_rest(max(round(spec.rest / self._timestep), 1), self._gravity),
            timestep=self._timestep,
            gravity=float(np.linalg.norm(self._gravity)),
        )
        self._velocity = np.zeros((world.n, 3))  # of the trunks a tick ago, in the world

    def read(self, rows: IntArray) -> TrunkKnown:
        """Read the IMUs of some robots, once at each of their ticks."""
        twist, rotation = self._world.twist[rows], rotation_matrix(self._world.pose[rows, 3:])
        velocity = np.einsum("nij,nj->ni", rotation, twist[:, :3])
        acceleration = (velocity - self._velocity[rows]) / self._timestep
        self._velocity[rows] = velocity
        force = np.einsum("nji,nj->ni", rotation, acceleration - self._gravity)
        gyro, force = (
            reading[:, 0] for reading in self._sensors.imu(rows, twist[:, None, 3:], force[:, None])
        )
        self._estimator.update(rows, gyro, force)
        nothing = np.zeros((len(rows), 3))
        return TrunkKnown(
            np.hstack([nothing, self._estimator.quaternion[rows]]),
            np.hstack([nothing, self._estimator.rate[rows]]),
            force,
        )
