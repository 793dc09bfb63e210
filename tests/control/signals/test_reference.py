from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control.signals.reference import FlightTiming, Reference
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait

DT = 0.001


def test_a_stretched_flight_passes_through_the_same_postures(gaits: list[Gait]) -> None:
    reference = Reference.of([gait.flight for gait in gaits], DT, 2.0)
    longer = 1.05 * reference.planned[1:]
    reference.stretch(np.array([1]), longer)
    np.testing.assert_array_equal(reference.duration, [reference.planned[0], longer[0]])
    end = np.searchsorted(reference.phase[1], 1.0)
    assert end * DT == pytest.approx(longer[0], abs=DT)
    expected, _ = gaits[1].flight.joint_reference(np.arange(len(reference.phase[1])) * DT / longer)
    np.testing.assert_allclose(reference.position[1, :end], expected[:end])
    at_touchdown, _ = gaits[1].flight.joint_reference(np.ones(1))
    np.testing.assert_allclose(
        reference.position[1, end:], np.repeat(at_touchdown, len(expected) - end, axis=0)
    )


def test_velocities_are_the_rates_of_a_stretched_flight(gaits: list[Gait]) -> None:
    reference = Reference.of([gait.flight for gait in gaits], DT, 2.0)
    reference.stretch(np.array([0]), 0.93 * reference.planned[:1])
    end = int(np.searchsorted(reference.phase[0], 1.0))
    position, velocity = reference.position[0, :end], reference.velocity[0]
    central = (position[2:] - position[:-2]) / (2.0 * DT)
    np.testing.assert_allclose(velocity[1 : end - 1], central, rtol=5e-3, atol=0.03)
    assert not velocity[end:].any()


def test_a_change_that_nobody_would_notice_is_not_made(gaits: list[Gait]) -> None:
    reference = Reference.of([gait.flight for gait in gaits], DT, 2.0)
    before = reference.position.copy()
    reference.stretch(np.arange(2), reference.planned + 1e-5)
    np.testing.assert_array_equal(reference.position, before)


def test_a_change_takes_the_other_part_and_is_stretched_as_it_was_or_as_is_asked(
    gaits: list[Gait],
) -> None:
    one, other = gaits[0].flight, gaits[1].flight
    changed = Reference.of([one, one], DT, 2.0, others=[other])
    changed.stretch(np.arange(2), 1.05 * changed.planned)
    changed.change(np.array([0]), [other], 2.0)
    changed.change(np.array([1]), [other], 2.0, stretched=np.array([0.95]))
    expected = Reference.of([other, other], DT, 2.0, others=[one])
    expected.stretch(np.arange(2), np.array([1.05, 0.95]) * other.duration)
    np.testing.assert_allclose(changed.duration, expected.duration)
    ticks = expected.position.shape[1]
    np.testing.assert_allclose(changed.position[:, :ticks], expected.position)
    np.testing.assert_array_equal(changed.ticks, expected.ticks)


def test_a_flights_duration_follows_the_flights_within_its_limit() -> None:
    timing = FlightTiming(gain=0.5, limit=0.1)
    duration, planned = np.array([0.2, 0.21, 0.2]), np.full(3, 0.2)
    measured = np.array([0.204, 0.26, 0.1])
    np.testing.assert_allclose(timing.next(duration, measured, planned), [0.202, 0.22, 0.18])


@pytest.mark.parametrize("wrong", [{"gain": 1.5}, {"gain": -0.1}, {"limit": 1.0}])
def test_a_timing_that_makes_no_sense_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match=r"timing: .*; give a number from 0"):
        FlightTiming(**wrong)
