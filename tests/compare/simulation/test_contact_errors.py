"""Errors from the true contact on, of stances whose joints are known by hand."""

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare.simulation.contact_errors import ContactErrors
from pronk_pin.gait import Gait

DT = 1e-3
TICKS = 300
ROW = np.array([0])


def reference(gait: Gait, ticks: Array) -> Array:
    """The stance of the gait at ticks after its beginning [rad], shape (ticks, 12)."""
    s = np.clip(ticks * DT / gait.stance.duration, 0.0, 1.0)
    return gait.stance.joint_reference(s)[0]


def forces(contact: int) -> Array:
    """A foot bears load from a tick on, shape (1, TICKS, 4, 3)."""
    force = np.zeros((1, TICKS, 4, 3))
    force[0, contact:, 2, 2] = 1.0
    return force


@pytest.mark.parametrize("late", [0, 1, 3, 7])
def test_a_stance_that_is_felt_late_is_judged_from_the_ground_on(
    gaits: list[Gait], late: int
) -> None:
    """The contact comes `late` ticks before the controller's first: joints that follow the gait
    from the true contact on have no error, however late it is felt."""
    errors, flight, stance = ContactErrors(gaits[:1], DT), 200, 150
    joints = np.full((1, TICKS, 12), 9.0)
    before = np.arange(TICKS) - (flight - late)
    joints[0, before >= 0] = reference(gaits[0], before[before >= 0])
    # The load is there one tick after the last state in the air.
    errors.flight(ROW, joints, forces(flight - late + 1), np.array([flight]))
    joints[0] = reference(gaits[0], np.arange(TICKS) + late)
    peak, rms = errors.stance(ROW, joints, forces(max(1 - late, 0)), np.array([stance]))
    np.testing.assert_allclose(peak, 0.0, atol=1e-12)
    np.testing.assert_allclose(rms, 0.0, atol=1e-12)


def test_the_error_before_it_is_felt_counts(gaits: list[Gait]) -> None:
    """One joint is 0.2 rad off in the two ticks between contact and detection, and never again."""
    errors = ContactErrors(gaits[:1], DT)
    joints = reference(gaits[0], np.arange(TICKS))[None]
    joints[0, :2, 5] += 0.2
    peak, rms = errors.stance(ROW, joints, forces(1), np.array([150]))
    assert peak[0, 5] == pytest.approx(0.2)
    assert rms[0, 5] == pytest.approx(0.2 * np.sqrt(2 / 150))
    assert np.delete(peak[0], 5).max() < 1e-12


def test_a_touchdown_that_was_none_waits_for_the_ground(gaits: list[Gait]) -> None:
    """Felt 20 ticks too early: what the legs do in the air is no error of the stance."""
    errors = ContactErrors(gaits[:1], DT)
    joints = np.full((1, TICKS, 12), 9.0)
    joints[0, 20:] = reference(gaits[0], np.arange(TICKS - 20))
    peak, _ = errors.stance(ROW, joints, forces(21), np.array([150]))
    np.testing.assert_allclose(peak, 0.0, atol=1e-12)


def test_the_load_of_the_lift_off_is_no_touchdown(gaits: list[Gait]) -> None:
    """A flight of 50 ticks whose feet leave the ground after five."""
    errors = ContactErrors(gaits[:1], DT)
    force = np.zeros((1, TICKS, 4, 3))
    force[0, :5, :, 2] = 30.0
    errors.flight(ROW, np.full((1, TICKS, 12), 9.0), force, np.array([50]))
    joints = reference(gaits[0], np.arange(TICKS))[None]
    peak, _ = errors.stance(ROW, joints, forces(1), np.array([150]))
    np.testing.assert_allclose(peak, 0.0, atol=1e-12)
