from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import AttitudeEstimator, AttitudeFilter, PhaseLog, roll_pitch_yaw
from pronk_pin.control.feedback.estimation import SpeedEstimator
from pronk_pin.errors import InvalidInput
from pronk_pin.robot import Robot
from pronk_pin.robot.conventions import rotation_matrix

DT = 0.001


@pytest.fixture
def rolling(robot: Robot, phase_log: Callable[..., PhaseLog]) -> Callable[..., PhaseLog]:
    """Logs of stances in which the feet roll on the ground under trunks of given speeds."""

    def rates(speed: float) -> Array:
        """Joint rates that let each foot's sphere roll, from Pinocchio's Jacobians."""
        joint_rates = np.zeros(12)
        for leg, foot in enumerate(robot.foot_ids):
            jacobian = pin.computeFrameJacobian(
                robot.model, robot.data, robot.standing, foot, pin.LOCAL_WORLD_ALIGNED
            )
            sagittal = jacobian[np.ix_([0, 2], [6 + 3 * leg + 1, 6 + 3 * leg + 2])]
            # A sphere that turns with the calf about y rolls with r times that rate.
            sagittal[0] -= robot.foot_radius
            joint_rates[3 * leg + 1 : 3 * leg + 3] = np.linalg.solve(sagittal, [-speed, 0.0])
        return joint_rates

    def build(*speeds: float, ticks: int = 160) -> PhaseLog:
        joint_rates = np.repeat([[rates(speed)] for speed in speeds], ticks, axis=1)
        joints = np.broadcast_to(robot.standing[7:], joint_rates.shape)
        return phase_log(joints.copy(), joint_rates)

    return build


def test_the_speed_over_rolling_feet_is_exact_without_a_filter(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    estimator = SpeedEstimator(robot, 3, time_constant=0.0, timestep=DT)
    speed = estimator.update(np.arange(3), rolling(-0.5, 0.0, 0.8))
    np.testing.assert_allclose(speed, [-0.5, 0.0, 0.8], atol=1e-12)


def test_the_estimate_approaches_the_speed_with_the_filters_time_constant(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    estimator = SpeedEstimator(robot, 1, time_constant=0.1, timestep=DT)
    speed = estimator.update(np.arange(1), rolling(1.0, ticks=100))
    assert speed[0] == pytest.approx(1.0 - np.exp(-1.0), abs=0.005)


def test_the_next_stance_goes_on_from_the_estimate_of_the_last_one(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    twice = SpeedEstimator(robot, 1, time_constant=0.1, timestep=DT)
    once = SpeedEstimator(robot, 1, time_constant=0.1, timestep=DT)
    for _ in range(2):
        twice.update(np.arange(1), rolling(0.6, ticks=80))
    once.update(np.arange(1), rolling(0.6, ticks=160))
    np.testing.assert_allclose(twice.speed, once.speed, rtol=1e-12)


def test_ticks_behind_the_end_of_a_stance_do_not_count(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    log, length = rolling(0.4, 0.4), np.array([120, 150])
    for stance, end in zip(log.joint_rates, length, strict=True):
        stance[end:] = 15.0
    log = replace(log, length=length)
    speed = SpeedEstimator(robot, 2, time_constant=0.02, timestep=DT).update(np.arange(2), log)
    np.testing.assert_allclose(speed, 0.4 * (1.0 - (20.0 / 21.0) ** length), rtol=1e-9)


def test_robots_that_are_not_asked_about_keep_their_estimates(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    estimator = SpeedEstimator(robot, 2, time_constant=0.0, timestep=DT)
    estimator.update(np.arange(2), rolling(0.1, 0.2))
    estimator.update(np.array([1]), rolling(0.7))
    np.testing.assert_allclose(estimator.speed, [0.1, 0.7], atol=1e-12)


def test_a_negative_time_constant_is_refused(robot: Robot) -> None:
    with pytest.raises(InvalidInput, match=r"time_constant=-0\.1; give a number from 0"):
        SpeedEstimator(robot, 1, time_constant=-0.1, timestep=DT)


def speeding_up(
    robot: Robot, rolling: Callable[..., PhaseLog], rate: float, ticks: int = 160
) -> tuple[PhaseLog, Array]:
    """A stance from rest with a constant acceleration, and its speeds [m/s]."""
    speed = rate * DT * np.arange(1, ticks + 1)
    log = rolling(1.0, ticks=ticks)
    log = replace(log, joint_rates=log.joint_rates * speed[:, None])
    force = np.tile([rate, 0.0, robot.gravity], (1, ticks, 1))
    return replace(log, specific_force=force), speed


def test_with_an_accelerometer_the_filter_does_not_lag_behind(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    log, speed = speeding_up(robot, rolling, 3.0)
    aided, alone = (
        SpeedEstimator(robot, 1, time_constant=0.05, timestep=DT).update(np.arange(1), each)[0]
        for each in (log, replace(log, specific_force=None))
    )
    assert aided == pytest.approx(speed[-1], abs=3.0 * DT)
    assert alone == pytest.approx(speed[-1] - 3.0 * 0.05, rel=0.05)  # the lag of a ramp


def test_a_biased_accelerometer_is_off_by_its_bias_times_the_time_constant(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    log = rolling(0.5, ticks=600)
    force = np.tile([0.2, 0.0, robot.gravity], (1, 600, 1))
    log = replace(log, specific_force=force)
    speed = SpeedEstimator(robot, 1, time_constant=0.05, timestep=DT).update(np.arange(1), log)
    assert speed[0] == pytest.approx(0.5 + 0.05 * 0.2, abs=1e-4)


def test_an_accelerometer_that_fails_leaves_the_estimate_as_it_was(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    log, _ = speeding_up(robot, rolling, 3.0)
    assert log.specific_force is not None
    log.specific_force[0, 30, 0] = np.nan
    estimator = SpeedEstimator(robot, 1, time_constant=0.05, timestep=DT)
    estimator.speed[0] = 0.25
    assert estimator.update(np.arange(1), log)[0] == 0.25


def test_gravity_on_a_pitched_trunk_is_no_acceleration(
    robot: Robot, rolling: Callable[..., PhaseLog]
) -> None:
    log, pitch = rolling(0.0), pin.rpy.rpyToMatrix(0.0, -0.2, 0.0)
    ticks = np.ones((*log.joints.shape[:2], 1))
    pose = np.concatenate([np.zeros(3), pin.Quaternion(pitch).coeffs()])
    log = replace(
        log,
        pose=ticks * pose,
        twist=ticks * np.zeros(6),
        specific_force=ticks * (pitch.T @ np.array([0.0, 0.0, 9.81])),
    )
    estimator = SpeedEstimator(robot, 1, time_constant=0.05, timestep=DT)
    assert estimator.update(np.arange(1), log)[0] == pytest.approx(0.0, abs=1e-9)


ONE = np.array([0])
UP = np.array([[0.0, 0.0, 9.81]])


def attitudes(
    spec: AttitudeFilter, bias: Array | float = 0.0, *, tilt: float = 0.0
) -> AttitudeEstimator:
    """One robot's estimator, which takes its trunk for level when it is rolled by `tilt`."""
    still = np.zeros((1, 200, 3))
    rest = still + bias, still + UP[0]
    begin = pin.rpy.rpyToMatrix(tilt, 0.0, 0.0)[None]
    return AttitudeEstimator(spec, begin, rest, timestep=DT, gravity=9.81)


def test_a_turn_is_the_integral_of_its_rate() -> None:
    estimator, rate = attitudes(AttitudeFilter(gain=0.0)), np.array([0.3, -2.0, 1.0])
    estimator.update(ONE, rate[None], UP)  # the rate before it was zero
    begin = rotation_matrix(estimator.quaternion)[0]
    for _ in range(500):
        estimator.update(ONE, rate[None], UP)
    turned = begin @ pin.exp3(0.5 * rate)
    np.testing.assert_allclose(rotation_matrix(estimator.quaternion)[0], turned, atol=1e-9)


def test_gravity_rights_a_wrong_attitude_with_the_filters_time_constant() -> None:
    estimator = attitudes(AttitudeFilter(gain=2.0), tilt=0.1)
    for _ in range(500):
        estimator.update(ONE, np.zeros((1, 3)), UP)
    roll = roll_pitch_yaw(rotation_matrix(estimator.quaternion))[0, 0]
    assert roll == pytest.approx(0.1 * np.exp(-1.0), rel=0.01)


def test_flights_and_shakes_that_come_and_go_do_not_tilt_it() -> None:
    """The mean over a stride counts: forward with 3 g on the legs, back with 1 g, and a flight."""
    estimator, quarter = attitudes(AttitudeFilter(gain=0.1)), np.arange(10000) // 100 % 4
    force = np.zeros((10000, 1, 3))
    force[..., 0, 0] = np.choose(quarter, [6.0, -6.0, 0.0, 0.0])
    force[..., 0, 2] = 9.81 * np.choose(quarter, [3.0, 1.0, 0.0, 0.0])
    for reading in force:
        estimator.update(ONE, np.zeros((1, 3)), reading)
    np.testing.assert_allclose(rotation_matrix(estimator.quaternion)[0], np.eye(3), atol=5e-3)


def test_what_a_gyro_says_at_rest_is_no_turn() -> None:
    bias = np.array([0.01, -0.02, 0.03])
    estimator = attitudes(AttitudeFilter(), bias)
    for _ in range(1000):
        estimator.update(ONE, bias[None], UP)
    np.testing.assert_allclose(estimator.rate, 0.0, atol=1e-12)
    np.testing.assert_allclose(rotation_matrix(estimator.quaternion)[0], np.eye(3), atol=1e-9)


@pytest.mark.parametrize("broken", [0, 1])
def test_a_reading_that_is_not_a_number_changes_nothing(broken: int) -> None:
    estimator, readings = attitudes(AttitudeFilter(), tilt=0.1), [np.ones((1, 3)), UP.copy()]
    before = estimator.quaternion.copy()
    readings[broken][0, 1] = np.nan
    estimator.update(ONE, *readings)
    np.testing.assert_array_equal(estimator.quaternion, before)


@pytest.mark.parametrize("wrong", [{"gain": -1.0}, {"gain": np.nan}, {"rest": 0.0}])
def test_an_attitude_filter_that_makes_no_sense_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match=r"attitude filter: .*; give a number"):
        AttitudeFilter(**wrong)
