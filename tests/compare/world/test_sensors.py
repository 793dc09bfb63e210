from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Sensors, SensorSuite
from pronk_pin.compare.world.mismatch import NOISE
from pronk_pin.errors import InvalidInput


def errors(suite: SensorSuite, rows: list[int], times: int) -> dict[str, Array]:
    """Errors of repeated readings, of each quantity (times, m, ...)."""
    rng, m = np.random.default_rng(5), len(rows)
    angle, rate = rng.normal(size=(2, m, 12))
    force, turning, specific = rng.normal(size=(m, 4, 3)), *rng.normal(size=(2, m, 1, 3))
    who, found = np.array(rows), []
    for _ in range(times):
        encoders = suite.encoders(who, angle, rate)
        imu = suite.imu(who, turning, specific)
        found.append((*encoders, suite.feet(who, force), *imu))
    names = ("angle", "rate", "force", "gyro", "accelerometer")
    return {
        name: np.stack(values) - true
        for name, true, *values in zip(
            names, (angle, rate, force, turning, specific), *found, strict=True
        )
    }


def test_perfect_sensors_tell_the_truth() -> None:
    assert Sensors().perfect
    suite = SensorSuite(Sensors(), 2, np.random.default_rng(0))
    assert all(not error.any() for error in errors(suite, [0, 1], 1).values())


def test_noise_is_white_and_has_its_standard_deviation() -> None:
    suite = SensorSuite(NOISE, 3, np.random.default_rng(0))
    found = errors(suite, [0, 1, 2], 4000)
    for name, expected in (
        ("angle", NOISE.encoder_noise),
        ("rate", NOISE.rate_noise),
        ("force", NOISE.force_noise),
        ("gyro", NOISE.gyro_noise),
        ("accelerometer", NOISE.accelerometer_noise),
    ):
        error = found[name]
        np.testing.assert_allclose(error.std(axis=0), expected, rtol=0.06)
        centred = error - error.mean(axis=0)
        lagged = (centred[1:] * centred[:-1]).mean(axis=0) / expected**2
        assert np.abs(lagged).max() < 0.08


def test_a_bias_stays_and_is_another_for_each_robot_and_joint() -> None:
    biased = Sensors(encoder_bias=0.002, gyro_bias=0.005, accelerometer_bias=0.1)
    suite = SensorSuite(biased, 400, np.random.default_rng(0))
    found = errors(suite, list(range(400)), 2)
    for name, expected in (("angle", 0.002), ("gyro", 0.005), ("accelerometer", 0.1)):
        np.testing.assert_allclose(found[name][0], found[name][1], atol=1e-15)
        assert found[name][0].std() == pytest.approx(expected, rel=0.06)
    assert not found["rate"].any()


def test_what_a_robot_measures_does_not_depend_on_how_often_others_are_asked() -> None:
    alone, among = (SensorSuite(NOISE, 2, np.random.default_rng(7)) for _ in range(2))
    zero = np.zeros((2, 12))
    for _ in range(3):
        among.encoders(np.array([1]), zero[:1], zero[:1])
    one, both = (suite.encoders(np.array([0, 1]), zero, zero)[0] for suite in (alone, among))
    np.testing.assert_array_equal(one[0], both[0])
    assert np.any(one[1] != both[1])


def test_a_touchdown_is_late_by_the_latency_and_up_to_the_jitter_alike() -> None:
    suite = SensorSuite(Sensors(), 3, np.random.default_rng(0), latency=2, jitter=4)
    drawn = np.array([suite.touchdown_lateness(np.arange(3)) for _ in range(2000)])
    assert (drawn.min(), drawn.max()) == (2, 6)
    for robot in drawn.T:
        np.testing.assert_allclose(np.bincount(robot - 2) / 2000, 0.2, atol=0.03)
    assert np.any(drawn[:, 0] != drawn[:, 1])
    punctual = SensorSuite(Sensors(), 3, np.random.default_rng(0), latency=3)
    assert punctual.touchdown_lateness(np.array([2, 0])).tolist() == [3, 3]


def test_a_robots_jitter_is_its_own_and_leaves_its_noise_as_it_is() -> None:
    alone, among = (SensorSuite(NOISE, 2, np.random.default_rng(7), jitter=4) for _ in range(2))
    zero = np.zeros((2, 12))
    for _ in range(3):
        among.touchdown_lateness(np.array([1]))
    one, both = (suite.encoders(np.array([0, 1]), zero, zero)[0] for suite in (alone, among))
    np.testing.assert_array_equal(one, both)
    first, second = (
        [suite.touchdown_lateness(np.array([0]))[0] for _ in range(9)] for suite in (alone, among)
    )
    assert first == second


@pytest.mark.parametrize("wrong", [{"latency": -1}, {"jitter": 0.5}])
def test_a_lateness_that_cannot_be_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput, match=r"(latency=-1|jitter=0.5 is a float); give a whole"):
        SensorSuite(Sensors(), 1, np.random.default_rng(0), **wrong)


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_a_noise_that_cannot_be_is_refused(value: float) -> None:
    with pytest.raises(
        InvalidInput, match=r"sensors: gyro_noise=.*; give a number from 0 to 100 rad/s"
    ):
        Sensors(gyro_noise=value)
