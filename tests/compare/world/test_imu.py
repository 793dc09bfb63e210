from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.compare import MujocoWorld, Sensors, SensorSuite, World, load_scenario
from pronk_pin.compare.world.imu import InertialUnit
from pronk_pin.compare.world.mismatch import NOISE
from pronk_pin.control import AttitudeEstimator, AttitudeFilter, TrunkEstimate, attitude_angle
from pronk_pin.robot import Robot
from pronk_pin.robot.conventions import rotation_matrix

N = 3
ROWS = np.arange(N)
PITCH = -0.2


def unit(robot: Robot, sensors: Sensors | None = None) -> tuple[World, Callable[[], TrunkEstimate]]:
    """Robots in the air, pitched, and what they know by their IMUs; they know the pitch."""
    world = MujocoWorld(robot, load_scenario("ideal"), N, base="free")
    world.reset(np.tile([0.0, 2.0], (N, 1)), np.tile(robot.standing[7:], (N, 1)), pitch=PITCH)
    suite = SensorSuite(sensors or Sensors(), N, np.random.default_rng(0))
    attitude = np.tile(pin.rpy.rpyToMatrix(0.0, PITCH, 0.0), (N, 1, 1))
    imu, spec = InertialUnit(world, suite), AttitudeFilter()
    at_rest = imu.at_rest(spec.rest)
    estimator = AttitudeEstimator(spec, attitude, at_rest, timestep=0.001, gravity=9.81)

    def read() -> TrunkEstimate:
        gyro, force = imu.read(ROWS)
        estimator.update(ROWS, gyro, force)
        return estimator.trunk(ROWS, force)

    return world, read


def off(world: World, quaternion: np.ndarray) -> np.ndarray:
    """Angles between estimated and true attitudes [rad]."""
    return attitude_angle(rotation_matrix(quaternion), rotation_matrix(world.pose[:, 3:]))


def test_an_accelerometer_feels_nothing_in_free_fall_and_the_ground_when_it_stands(
    robot: Robot,
) -> None:
    world, imu = unit(robot)
    for _ in range(50):
        falling = imu().specific_force
        world.step(np.zeros((N, 12)))
    # The trunk's centre is next to the robot's centre of mass, not in it.
    np.testing.assert_allclose(falling, 0.0, atol=0.2)
    height = robot.standing[2]
    world.reset(np.tile([0.0, height], (N, 1)), np.tile(robot.standing[7:], (N, 1)))
    for _ in range(2000):
        hold = 60.0 * (robot.standing[7:] - world.joints) - 2.0 * world.joint_rates
        standing = imu().specific_force
        world.step(hold)
    rotation = rotation_matrix(world.pose[:, 3:])
    upward = np.einsum("nij,nj->ni", rotation, standing)
    np.testing.assert_allclose(upward, np.tile([0.0, 0.0, 9.81], (N, 1)), atol=0.05)


def test_the_attitude_of_a_tumbling_robot_is_known(robot: Robot) -> None:
    world, imu = unit(robot)
    rng = np.random.default_rng(2)
    for _ in range(300):
        known = imu()
        np.testing.assert_allclose(known.twist[:, 3:], world.twist[:, 3:], atol=1e-9)
        assert off(world, known.pose[:, 3:]).max() < 2e-3
        world.step(2.0 * rng.standard_normal((N, 12)))
    true = rotation_matrix(world.pose[:, 3:])
    assert attitude_angle(true, pin.rpy.rpyToMatrix(0.0, PITCH, 0.0)).min() > 0.02  # it tumbled


def test_biases_that_show_at_rest_do_no_harm(robot: Robot) -> None:
    world, imu = unit(robot, NOISE)
    errors = []
    for _ in range(600):
        known, true = imu(), world.twist[:, 3:]
        errors.append(known.twist[:, 3:] - true)
        last = off(world, known.pose[:, 3:])
        world.step(np.zeros((N, 12)))
    assert last.max() < 0.003
    assert np.std(errors) == pytest.approx(NOISE.gyro_noise, rel=0.05)
    # What is left of the bias is less than its mean size, whatever the noise of 600 readings.
    assert np.abs(np.mean(errors, axis=0)).max() < 0.6 * NOISE.gyro_bias
