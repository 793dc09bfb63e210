from __future__ import annotations

import math

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Reading, Sensors, SensorSuite
from pronk_pin.compare.mismatch import NOISE
from pronk_pin.errors import InvalidInput


def truth(n: int) -> Reading:
    rng = np.random.default_rng(5)
    return Reading(
        joints=rng.normal(size=(n, 12)),
        joint_rates=rng.normal(size=(n, 12)),
        force=rng.normal(size=(n, 4, 3)),
        angular_velocity=rng.normal(size=(n, 3)),
        specific_force=rng.normal(size=(n, 3)),
    )


def errors(suite: SensorSuite, rows: list[int], times: int) -> list[Array]:
    """Errors of repeated readings, of each quantity (times, m, ...)."""
    true = truth(len(rows))
    readings = [suite.read(np.array(rows), true) for _ in range(times)]
    return [
        np.stack(values) - exact
        for values, exact in zip(zip(*readings, strict=True), true, strict=True)
    ]


def test_perfect_sensors_tell_the_truth() -> None:
    assert Sensors().perfect
    suite = SensorSuite(Sensors(), 2, np.random.default_rng(0))
    assert all(not error.any() for error in errors(suite, [0, 1], 1))


def test_noise_is_white_and_has_its_standard_deviation() -> None:
    suite = SensorSuite(NOISE, 3, np.random.default_rng(0))
    angle, rate, force, gyro, accelerometer = errors(suite, [0, 1, 2], 4000)
    for error, expected in (
        (angle, NOISE.encoder_noise),
        (rate, NOISE.rate_noise),
        (force, NOISE.force_noise),
        (gyro, NOISE.gyro_noise),
        (accelerometer, NOISE.accelerometer_noise),
    ):
        np.testing.assert_allclose(error.std(axis=0), expected, rtol=0.06)
        centred = error - error.mean(axis=0)
        lagged = (centred[1:] * centred[:-1]).mean(axis=0) / expected**2
        assert np.abs(lagged).max() < 0.08


def test_a_bias_stays_and_is_another_for_each_robot_and_joint() -> None:
    biased = Sensors(encoder_bias=0.002, gyro_bias=0.005, accelerometer_bias=0.1)
    suite = SensorSuite(biased, 400, np.random.default_rng(0))
    angle, rate, _, gyro, accelerometer = errors(suite, list(range(400)), 2)
    for error, expected in (
        (angle, 0.002),
        (gyro, 0.005),
        (accelerometer, 0.1),
    ):
        np.testing.assert_allclose(error[0], error[1], atol=1e-15)
        assert error[0].std() == pytest.approx(expected, rel=0.06)
    assert not rate.any()


def test_what_a_robot_measures_does_not_depend_on_how_often_others_are_asked() -> None:
    alone, among = (SensorSuite(NOISE, 2, np.random.default_rng(7)) for _ in range(2))
    true = truth(2)
    for _ in range(3):
        among.read(np.array([1]), Reading(*(value[1:] for value in true)))
    one, both = alone.read(np.array([0, 1]), true), among.read(np.array([0, 1]), true)
    np.testing.assert_array_equal(one.joints[0], both.joints[0])
    assert np.any(one.joints[1] != both.joints[1])


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_a_noise_that_cannot_be_is_refused(value: float) -> None:
    with pytest.raises(InvalidInput, match="gyro_noise must be finite and not negative"):
        Sensors(gyro_noise=value)
