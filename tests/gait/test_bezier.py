"""Bezier polynomials: eq. (7) of the paper."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.gait import bezier

S = np.linspace(0.0, 1.0, 21)


@pytest.mark.parametrize("order", [1, 4, 8, 12])
def test_basis_is_a_partition_of_one(order: int) -> None:
    basis = bezier.bernstein(S, order)
    assert np.all(basis >= 0.0)
    np.testing.assert_allclose(basis.sum(axis=1), 1.0, atol=1e-14)


def test_ends_are_the_first_and_last_coefficient() -> None:
    coefficients = np.random.default_rng(0).normal(size=(3, 2, 7))
    values = bezier.evaluate(coefficients, np.array([0.0, 1.0]))
    np.testing.assert_allclose(values, np.moveaxis(coefficients[..., [0, -1]], -1, 0))


@pytest.mark.parametrize("derivative", [1, 2])
def test_derivatives_equal_finite_differences(derivative: int) -> None:
    coefficients = np.random.default_rng(1).normal(size=(2, 9))
    h, s = 1e-5, S[1:-1]
    lower = derivative - 1
    ahead = bezier.evaluate(coefficients, s + h, derivative=lower)
    behind = bezier.evaluate(coefficients, s - h, derivative=lower)
    exact = bezier.evaluate(coefficients, s, derivative=derivative)
    np.testing.assert_allclose(exact, (ahead - behind) / (2 * h), atol=1e-6)


def test_derivative_of_a_constant_is_zero() -> None:
    assert np.all(bezier.evaluate(np.ones((2, 1)), S, derivative=1) == 0.0)


@pytest.mark.parametrize("pinned", [0, 1, 2])
def test_fit_recovers_a_polynomial_of_its_order(pinned: int) -> None:
    coefficients = np.random.default_rng(2).normal(size=(2, 3, 7))
    values = bezier.evaluate(coefficients, S)
    rates = bezier.evaluate(coefficients, S, derivative=1)
    found = bezier.fit(S, values, 6, rates=rates, pinned=pinned)
    np.testing.assert_allclose(found, coefficients, atol=1e-9)


def test_pinned_fit_meets_both_ends_in_value_and_rate() -> None:
    values, rates = np.exp(3 * S)[:, None], 3 * np.exp(3 * S)[:, None]
    found = bezier.fit(S, values, 4, rates=rates, pinned=2)
    ends = np.array([0.0, 1.0])
    np.testing.assert_allclose(bezier.evaluate(found, ends), values[[0, -1]], atol=1e-12)
    slope = bezier.evaluate(found, ends, derivative=1)
    np.testing.assert_allclose(slope, rates[[0, -1]], atol=1e-11)


def test_higher_order_fits_better() -> None:
    values = np.sin(9 * S)[:, None]

    def error(order: int) -> float:
        found = bezier.evaluate(bezier.fit(S, values, order), S)
        return float(np.max(np.abs(found - values)))

    assert error(10) < 1e-2 * error(6)


def test_rates_cannot_be_pinned_without_rates() -> None:
    with pytest.raises(ValueError, match="needs the rates"):
        bezier.fit(S, S[:, None], 4, pinned=2)
