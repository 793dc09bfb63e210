"""Which conditions a robot is in, from the torques that it needs."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import SAMPLES, TorqueLibrary
from pronk_pin.control.learning import FIRST_STRIDES, ConditionEstimate

SPEEDS = np.array([0.0, 0.4])
SLOPES, LOADS = np.array([-0.1, 0.0, 0.1]), np.array([0.0, 1.0, 3.0])
ONE = np.array([0])


def library_of(conditions: dict[str, Array], *, feedback: float = 0.0) -> TorqueLibrary:
    """Torques of their own at each node; the same numbers each time."""
    rng = np.random.default_rng(7)
    shape = (len(SPEEDS), *map(len, conditions.values()))
    torque = rng.normal(size=(*shape, 2, SAMPLES, 12))
    # Along each condition mostly one change, as gravity's torque is.
    for k, axis in enumerate(conditions.values()):
        change = rng.normal(size=(2, SAMPLES, 12))
        place = axis.reshape(-1, *[1] * (len(conditions) - k - 1), 1, 1, 1)
        torque += 10.0 * place / np.ptp(axis) * change
    return TorqueLibrary(
        SPEEDS,
        torque,
        np.zeros_like(torque),
        np.full(shape, 0.2),
        feedback * np.ones_like(torque),
        conditions,
    )


@pytest.mark.parametrize("slope", [-0.1, -0.03, 0.0, 0.07, 0.1])
def test_a_robot_that_needs_the_torque_of_a_place_is_found_there(slope: float) -> None:
    library = library_of({"slope": SLOPES})
    estimate, speed = ConditionEstimate(library, 1), np.array([0.25])
    assert estimate.values.tolist() == [[0.0]]
    estimate.update(ONE, speed, library.at(speed, {"slope": slope}))
    assert estimate.values[0, 0] == pytest.approx(slope, abs=1e-12)
    found = estimate.memory(ONE, speed)
    np.testing.assert_allclose(found.feedforward, library.at(speed, {"slope": slope}))


def test_it_is_the_nearest_place_where_the_torque_is_of_none() -> None:
    """Against a search on a fine grid."""
    library, speed = library_of({"slope": SLOPES, "payload": LOADS}), np.array([0.1])
    rng = np.random.default_rng(3)
    needed = library.at(speed, {"slope": 0.06, "payload": 0.4}) + 2.0 * rng.normal(
        size=(1, 2, SAMPLES, 12)
    )
    estimate = ConditionEstimate(library, 1)
    estimate.update(ONE, speed, needed)
    grid = [
        {"slope": slope, "payload": load}
        for slope, load in product(np.linspace(-0.1, 0.1, 41), np.linspace(0.0, 3.0, 61))
    ]
    squares = [float(np.sum((library.at(speed, place) - needed) ** 2)) for place in grid]
    best = grid[int(np.argmin(squares))]
    slope, load = estimate.values[0]
    here = library.at(speed, {"slope": slope, "payload": load})
    assert float(np.sum((here - needed) ** 2)) <= min(squares)
    assert (slope, load) == pytest.approx((best["slope"], best["payload"]), abs=0.05)


def test_a_torque_beyond_all_places_is_at_the_end() -> None:
    library, speed = library_of({"payload": LOADS}), SPEEDS[:1]
    heavy = library.at(speed, {"payload": 3.0}) * 2.0 - library.at(speed, {"payload": 1.0})
    estimate = ConditionEstimate(library, 1)
    estimate.update(ONE, speed, heavy)
    assert estimate.values[0, 0] == 3.0


def test_half_of_the_practised_feedback_is_expected_again() -> None:
    library = library_of({"slope": SLOPES}, feedback=0.8)
    estimate, speed = ConditionEstimate(library, 1), np.array([0.25])
    estimate.update(ONE, speed, library.at(speed, {"slope": 0.04}) + 0.4)
    assert estimate.values[0, 0] == pytest.approx(0.04, abs=1e-12)


def test_later_strides_are_averaged_and_robots_are_told_apart() -> None:
    library, speed = library_of({"slope": SLOPES}), np.array([0.25])
    estimate = ConditionEstimate(library, 2)
    for _ in range(FIRST_STRIDES):
        estimate.update(ONE + 1, speed, library.at(speed, {"slope": 0.1}))
    assert estimate.values.tolist() == [[0.0], [pytest.approx(0.1)]]
    estimate.update(ONE + 1, speed, library.at(speed, {"slope": 0.0}))
    assert 0.0 < estimate.values[1, 0] < 0.1
    assert estimate.strides.tolist() == [0, FIRST_STRIDES + 1]


def test_a_later_stride_counts_three_tenths() -> None:
    library, speed = library_of({"slope": SLOPES}), np.array([0.25])
    estimate = ConditionEstimate(library, 1)
    for _ in range(FIRST_STRIDES):
        estimate.update(ONE, speed, library.at(speed, {"slope": 0.1}))
    estimate.update(ONE, speed, library.at(speed, {"slope": 0.0}))
    assert estimate.values[0, 0] == pytest.approx(0.7 * 0.1)


def constant_library(torque: Array, conditions: dict[str, Array]) -> TorqueLibrary:
    """The same torques at both speeds, (m_1 .. m_d, 2, samples, 12)."""
    both = np.stack([torque] * len(SPEEDS))
    shape = both.shape[:-3]
    return TorqueLibrary(SPEEDS, both, np.zeros_like(both), np.full(shape, 0.2), None, conditions)


def test_a_piece_is_not_followed_beyond_its_end() -> None:
    first, second = np.zeros((2, 2, SAMPLES, 12))
    first[..., 0], second[..., 1] = 1.0, 1.0
    library = constant_library(np.stack([0.0 * first, first, first + second]), {"slope": SLOPES})
    estimate = ConditionEstimate(library, 1)
    estimate.update(ONE, SPEEDS[:1], 2.0 * first[None])
    assert estimate.values[0, 0] == pytest.approx(0.0, abs=1e-12)


def test_conditions_whose_torques_are_alike_are_told_apart() -> None:
    rng = np.random.default_rng(5)
    one, own = rng.normal(size=(2, 2, SAMPLES, 12))
    other = 0.8 * one + 0.6 * own
    slopes, loads = (x.reshape(-1, 1, 1, 1) for x in (SLOPES / 0.2, LOADS / 3.0))
    torque = (slopes * one)[:, None] + (loads * other)[None]
    library = constant_library(torque, {"slope": SLOPES, "payload": LOADS})
    estimate, place = ConditionEstimate(library, 1), {"slope": 0.05, "payload": 0.6}
    estimate.update(ONE, SPEEDS[:1], library.at(SPEEDS[:1], place))
    assert estimate.values[0] == pytest.approx(list(place.values()), abs=1e-3)


def test_conditions_that_need_nearly_the_same_torque_are_told_apart() -> None:
    """Of a correlation of 0.99, from a torque that is exactly one of them."""
    rng = np.random.default_rng(1)
    one, other = rng.normal(size=(2, 2, SAMPLES, 12))
    changes = [one, 0.99 * one + np.sqrt(1.0 - 0.99**2) * other]
    slopes, loads = np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 3)
    torque = slopes[:, None, None, None, None] * changes[0]
    torque = torque + loads[:, None, None, None] * changes[1]
    torque = np.stack([torque, torque])
    library = TorqueLibrary(
        SPEEDS,
        torque,
        np.zeros_like(torque),
        np.full((2, 3, 3), 0.2),
        conditions={"slope": slopes, "payload": loads},
    )
    estimate, speed = ConditionEstimate(library, 1), SPEEDS[:1]
    estimate.update(ONE, speed, library.at(speed, {"slope": 0.9, "payload": 0.2}))
    np.testing.assert_allclose(estimate.values[0], [0.9, 0.2], atol=0.02)
