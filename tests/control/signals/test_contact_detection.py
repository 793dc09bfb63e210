from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import ContactDetector, ImpactDetector, TouchdownDetector
from pronk_pin.errors import InvalidInput
from pronk_pin.robot import Robot

DETECTOR = ContactDetector(touchdown=0.3, liftoff=0.1)


def phases(*pieces: tuple[float, int]) -> Array:
    """A load that stays at each value for so many ticks."""
    return np.concatenate([np.full(ticks, value) for value, ticks in pieces])[None]


def contacts(detector: ContactDetector, load: Array) -> Array:
    """Number of contacts one after the other, from loads (n, ticks), shape (n,)."""
    before = np.zeros((len(load), 1), dtype=int)
    return (np.diff(detector.contact(load).astype(int), axis=1, prepend=before) == 1).sum(axis=1)


def test_a_contact_begins_above_one_load_and_ends_below_another() -> None:
    load = np.array([[0.0, 0.2, 0.29, 0.31, 0.2, 0.11, 0.09, 0.2, 0.4]])
    assert DETECTOR.contact(load).tolist() == [
        [False, False, False, True, True, True, False, False, True]
    ]


def test_noise_around_one_threshold_makes_no_more_contacts() -> None:
    rng = np.random.default_rng(0)
    load = np.linspace(0.0, 2.0, 200) + 0.03 * rng.normal(size=(50, 200))
    with_hysteresis = contacts(DETECTOR, load)
    without = contacts(ContactDetector(touchdown=0.3, liftoff=0.3), load)
    assert np.all(with_hysteresis == 1)
    assert without.mean() > 2.0


def test_a_sensor_that_fails_leaves_the_contact_as_it_was() -> None:
    load = np.array([[np.nan, 0.5, np.nan, 0.2, 0.0, np.nan]])
    assert DETECTOR.contact(load).tolist() == [[False, True, True, True, False, False]]


def test_a_bounce_makes_two_contacts_and_is_still_a_stance() -> None:
    load, length = phases((2.0, 2), (0.0, 62), (2.0, 96)), np.array([160])
    stance = DETECTOR.stance(load, length)
    assert (stance.gap[0], contacts(DETECTOR, load)[0]) == (62, 2)
    assert stance.share[0] == pytest.approx(98 / 160)
    assert not DETECTOR.false_touchdown(stance, length)[0]
    assert not DETECTOR.contact_lost(stance)[0]


@pytest.mark.parametrize("blow", [0.0, 2.0])
def test_a_stance_that_begins_in_the_air_is_none(blow: float) -> None:
    load, length = phases((blow, 3), (0.0, 75), (2.0, 82)), np.array([160])
    stance = DETECTOR.stance(load, length)
    assert DETECTOR.false_touchdown(stance, length)[0]
    assert not DETECTOR.contact_lost(stance)[0]


def test_a_stance_in_the_air_has_lost_its_contact() -> None:
    load, length = np.vstack([phases((2.0, 10), (0.0, 150)), np.zeros((1, 160))]), np.full(2, 160)
    stance = DETECTOR.stance(load, length)
    assert stance.gap.tolist() == [150, 160]
    assert DETECTOR.contact_lost(stance).all()


def test_a_chattering_contact_is_a_stance() -> None:
    load, length = phases(*[(2.0, 5), (0.0, 3)] * 20), np.array([160])
    stance = DETECTOR.stance(load, length)
    assert (stance.gap[0], contacts(DETECTOR, load)[0]) == (3, 20)
    assert not DETECTOR.false_touchdown(stance, length)[0]


def test_ticks_behind_the_end_of_a_stance_do_not_count() -> None:
    load, length = np.ones((2, 100)), np.array([100, 40])
    load[1, 40:] = 0.0
    assert DETECTOR.stance(load, length).share.tolist() == [1.0, 1.0]


@pytest.mark.parametrize(
    "wrong",
    [
        {"touchdown": 0.1, "liftoff": 0.2},
        {"liftoff": 0.0},
        {"touchdown": float("nan")},
        {"least": 1.5},
        {"longest": -0.1},
    ],
)
def test_a_detector_that_cannot_work_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match=r"contact detection(:.*; give a number| needs liftoff)"):
        ContactDetector(**wrong)


FLIGHT, NEVER = 60, np.array([1000])
"""Ticks of a flight, and the end of a reference that does not end in it."""


def rates(*steps: tuple[int, float]) -> Array:
    """Rates of a robot's joints that step at ticks by so much in each, on a swing at 3 rad/s^2."""
    ticks = np.arange(FLIGHT)
    one = 0.003 * ticks + sum(jump * (ticks >= tick) for tick, jump in steps)
    return np.repeat(one[None, :, None], 12, axis=2)


def test_a_step_of_the_rates_is_an_impact_at_its_tick_and_the_next() -> None:
    """J is 12 joints times 8 rad/s, as on firm ground; the swing before it has none."""
    impact = ImpactDetector().impact(rates((50, 8.0)), np.arange(2, FLIGHT), NEVER)
    assert (2 + np.flatnonzero(impact[0])).tolist() == [50, 51]
    assert not ImpactDetector(threshold=97.0).impact(rates((50, 8.0)), np.arange(58), NEVER).any()


@pytest.mark.parametrize(("jump", "found"), [(2.2, False), (8.0, True)])
def test_where_the_reference_ends_it_takes_more(jump: float, found: bool) -> None:
    """12 times 2.2 rad/s is the step of the reference; motors that are late make it later."""
    for tick in (46, 50):
        impact = ImpactDetector().impact(rates((tick, jump)), np.arange(2, FLIGHT), np.array([45]))
        assert impact.any() == found
        assert ImpactDetector().impact(rates((tick, jump)), np.arange(2, FLIGHT), np.array([tick]))[
            0, tick - 2
        ]


def test_encoders_that_are_noisy_or_fail_make_no_impact() -> None:
    noisy = rates() + 0.05 * np.random.default_rng(0).normal(size=(400, FLIGHT, 12))
    never = np.repeat(NEVER, 400)
    assert not ImpactDetector(threshold=4.0).impact(noisy, np.arange(58), never).any()
    noisy[:, 20:, 3], noisy[:, 30:, 4] = np.nan, np.inf
    assert not ImpactDetector().impact(noisy, np.arange(58), never).any()


@pytest.fixture
def touchdowns(robot: Robot) -> TouchdownDetector:
    """Of two robots, whose flights are planned to last 60 ms."""
    flight = np.full(2, FLIGHT / 1000)
    return TouchdownDetector(ContactDetector(), robot, flight, timestep=0.001, lateness=2)


def test_a_touchdown_is_load_late_enough_in_a_flight(
    touchdowns: TouchdownDetector, robot: Robot
) -> None:
    force = np.zeros((2, FLIGHT, 4, 3))
    force[:, :5, :, 2] = robot.mass * robot.gravity  # not yet lifted off
    force[1, 50:, :, 2] = 0.08 * robot.mass * robot.gravity  # 0.32 on four feet
    felt = touchdowns.load(np.arange(2), force, 1 + np.arange(FLIGHT))
    assert [np.flatnonzero(row).tolist() for row in felt] == [[], list(range(50, FLIGHT))]
    late = touchdowns.load(np.array([1]), force[1:], 1 + np.arange(FLIGHT) - np.array([[30]]))
    assert not late[0, :60].any()


def test_an_impact_is_a_touchdown_late_enough_in_a_flight(touchdowns: TouchdownDetector) -> None:
    both = np.concatenate([rates((20, 8.0)), rates((50, 8.0))])
    rows, end = np.arange(2), np.repeat(NEVER, 2)
    felt = touchdowns.impact(rows, both, slice(0, FLIGHT), end)
    assert [np.flatnonzero(row).tolist() for row in felt] == [[], [50, 51]]
    for ticks in (slice(48, 51), slice(50, 51), slice(0, 1)):  # however many are played at once
        np.testing.assert_array_equal(touchdowns.impact(rows, both, ticks, end), felt[:, ticks])


@pytest.mark.parametrize(
    ("felt", "late"),
    [
        (50, 2),  # by the load, which tells one tick before the rates do
        (51, 3),  # by the impact, at once
        (54, 6),  # by a contact sensor that is 4 ms late
        (62, 14),
        (63, 14),  # the rate's second jump, which is the last thing in the window
        (64, 2),  # too long ago to be this touchdown
    ],
)
def test_the_log_tells_by_how_much_a_touchdown_was_felt_late(
    touchdowns: TouchdownDetector, felt: int, late: int
) -> None:
    """Rates that have changed at tick 50 show a contact that began between the ticks 48 and 49."""
    measured = np.repeat(np.pad(rates((50, 8.0)), [(0, 0), (0, 10), (0, 0)], mode="edge"), 2, 0)
    found = touchdowns.lateness(np.array([1]), measured, np.array([felt]), NEVER)
    assert found.tolist() == [late]


def test_without_encoders_a_touchdown_is_as_late_as_the_load(robot: Robot) -> None:
    spec, rows = ContactDetector(impact=None), np.array([0])
    alone = TouchdownDetector(spec, robot, np.array([0.06]), timestep=0.001, lateness=2)
    assert not alone.impact(rows, rates((50, 8.0)), slice(0, FLIGHT), NEVER).any()
    assert alone.lateness(rows, rates((50, 8.0)), np.array([54]), NEVER).tolist() == [2]


@pytest.mark.parametrize(
    "wrong", [{"threshold": 0.0}, {"reference_end": float("nan")}, {"window": -1}]
)
def test_an_impact_detector_that_cannot_work_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput, match=r"impact detection: .*; give a"):
        ImpactDetector(**wrong)
    with pytest.raises(InvalidInput, match="contact detection: impact"):
        ContactDetector(impact=12.0)  # type: ignore[arg-type]
