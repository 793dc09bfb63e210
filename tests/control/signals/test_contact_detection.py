from __future__ import annotations

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import ContactDetector
from pronk_pin.errors import InvalidInput

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
