from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy import signal

from pronk_pin.control import ZeroPhaseFilter, phase_grid
from pronk_pin.control.signals.filters import PAPER_A, PAPER_B, first_order, look_ahead
from pronk_pin.errors import InvalidInput, LeakyFilter

LEARNING = ZeroPhaseFilter.butterworth(3, 0.04)
PAPER = ZeroPhaseFilter(PAPER_B, PAPER_A)
INSIDE = slice(40, -40)


def test_the_learning_filter_damps_a_sine_but_does_not_shift_it() -> None:
    s = phase_grid()
    sine = np.sin(2.0 * np.pi * 4.0 * s)
    nyquist_share = 2.0 * 4.0 / (len(s) - 1)
    response = signal.freqz(LEARNING.b, LEARNING.a, worN=[np.pi * nyquist_share])[1]

    filtered = LEARNING(sine[None])[0]

    expected = abs(response[0]) ** 2 * sine  # forward and backward: the gain twice, no phase
    np.testing.assert_allclose(filtered[INSIDE], expected[INSIDE], atol=0.01)


def test_the_learning_filter_removes_chatter() -> None:
    chatter = (-1.0) ** np.arange(161)
    assert np.abs(LEARNING(chatter[None])[0, INSIDE]).max() < 0.03  # what the ends ring


def test_an_exact_butterworth_leaks_nothing() -> None:
    exact = ZeroPhaseFilter.butterworth(3, 0.1)
    assert exact.dc_gain == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(exact(np.full((1, 161, 2), 7.0)), 7.0, rtol=1e-9)


def test_the_printed_coefficients_leak_36_percent_of_a_constant_torque() -> None:
    assert PAPER.dc_gain == pytest.approx(0.64)
    np.testing.assert_allclose(PAPER(np.full((1, 161, 2), 7.0)), 0.64 * 7.0, rtol=1e-6)


def test_the_printed_coefficients_are_a_butterworth_filter_rounded() -> None:
    b, a = signal.butter(3, 0.1)
    np.testing.assert_allclose(PAPER_B, b, atol=0.5e-3)
    np.testing.assert_allclose(PAPER_A, a, atol=0.5e-2)


def test_an_unstable_filter_is_refused() -> None:
    with pytest.raises(InvalidInput, match="poles must lie inside the unit circle"):
        ZeroPhaseFilter((1.0,), (1.0, -1.01))


def test_look_ahead_reads_a_ramp_earlier_and_holds_its_end() -> None:
    s = phase_grid()
    np.testing.assert_allclose(look_ahead(s[None], 0.053)[0], np.minimum(s + 0.053, 1.0))


def test_no_look_ahead_changes_nothing() -> None:
    values = np.random.default_rng(0).normal(size=(2, 161, 12))
    np.testing.assert_array_equal(look_ahead(values, 0.0), values)


def test_the_speed_filter_answers_a_step_with_its_time_constant() -> None:
    dt, tau = 1e-4, 0.02
    t = dt * np.arange(1, 1001)
    answer = first_order(np.ones((1, 1000)), np.array([-1.0]), time_constant=tau, timestep=dt)
    np.testing.assert_allclose(answer[0], 1.0 - 2.0 * np.exp(-t / tau), atol=5e-3)


def test_the_speed_filter_stays_where_it_starts_without_a_change() -> None:
    held = first_order(np.full((2, 50), 0.3), np.full(2, 0.3), time_constant=0.02, timestep=1e-3)
    np.testing.assert_allclose(held, 0.3)


def test_a_speed_filter_without_time_constant_passes_everything() -> None:
    values = np.random.default_rng(0).normal(size=(2, 20))
    passed = first_order(values, np.zeros(2), time_constant=0.0, timestep=1e-3)
    np.testing.assert_allclose(passed, values)


def test_a_filter_that_leaks_warns_and_says_how_much() -> None:
    with pytest.warns(LeakyFilter, match=r"DC gain of 0\.64 .* loses 36% of a constant torque"):
        PAPER.warn()


def test_a_filter_that_does_not_leak_is_silent() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        LEARNING.warn()


@pytest.mark.parametrize(("order", "cutoff"), [(0, 0.1), (3, 0.0), (3, 1.0)])
def test_a_filter_by_cut_off_that_cannot_be_is_refused(order: int, cutoff: float) -> None:
    with pytest.raises(InvalidInput, match="give an order of 1 or more and a cut-off between"):
        ZeroPhaseFilter.butterworth(order, cutoff)
