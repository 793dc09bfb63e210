from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import SAMPLES, PhaseLog, phase_grid, resample


def test_the_phase_grid_goes_from_0_to_1() -> None:
    s = phase_grid()
    assert (len(s), s[0], s[-1]) == (SAMPLES, 0.0, 1.0)
    np.testing.assert_allclose(np.diff(s), 1.0 / (SAMPLES - 1))


@pytest.mark.parametrize("trailing", [(), (12,), (4, 3)])
def test_resampling_a_straight_line_is_exact(trailing: tuple[int, ...]) -> None:
    slope = np.random.default_rng(0).normal(size=(2, 1, *trailing))
    ticks = np.arange(9.0).reshape(1, 9, *[1] * len(trailing))
    position = np.array([[0.0, 0.25, 3.7, 8.0], [1.0, 7.99, 4.5, 2.0]])
    expected = slope * position.reshape(2, 4, *[1] * len(trailing))
    np.testing.assert_allclose(resample(slope * ticks, position), expected, atol=1e-12)


def test_resampling_holds_the_ends_and_a_single_sample() -> None:
    values = np.array([[2.0, 3.0, 5.0]])
    np.testing.assert_array_equal(resample(values, np.array([[-4.0, 9.0]])), [[2.0, 5.0]])
    np.testing.assert_array_equal(resample(values[:, :1], np.array([[0.0, 0.7]])), [[2.0, 2.0]])


@pytest.fixture
def late() -> PhaseLog:
    """Two robots whose phases were felt to begin at tick 2, for 100 and for 80 ticks."""
    values = np.zeros((2, 120, 12))
    return PhaseLog(values, values, values, values, values, np.array([100, 80]), sensed=2)


def test_phases_are_found_at_their_ticks_and_held_at_the_measured_ends(late: PhaseLog) -> None:
    index = late.index(np.array([0.0, 0.5, 1.0]))
    np.testing.assert_allclose(index, [[2.0, 49.5, 99.0], [2.0, 39.5, 79.0]])


def test_phases_align_on_the_reference_and_not_on_the_length_of_the_stride(late: PhaseLog) -> None:
    index = late.index(np.array([0.25, 0.5, 1.0]), ticks=np.array([90.0, 90.0]))
    np.testing.assert_allclose(index, [[22.5, 45.0, 90.0], [22.5, 45.0, 79.0]])
