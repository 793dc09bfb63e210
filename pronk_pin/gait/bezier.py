"""Bezier polynomials over the phase: `B(s) = sum_i c_i C(n, i) s^i (1 - s)^(n - i)`, eq. (7).

Coefficients stand in the last axis: `(..., order + 1)`. The phase `s` runs from 0 to 1.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import comb

from .._typing import Array


def bernstein(s: Array, order: int) -> Array:
    """Evaluate the Bernstein polynomials of an order at the phases s, (len(s), order + 1)."""
    s = np.atleast_1d(np.asarray(s, dtype=float))
    rising, falling = np.vander(s, order + 1, increasing=True), np.vander(1.0 - s, order + 1)
    return np.asarray(_binomials(order) * rising * falling)


@lru_cache(maxsize=64)
def _binomials(order: int) -> Array:
    """The binomial coefficients C(order, i); they must not be written to."""
    return np.asarray(comb(order, np.arange(order + 1)))


def evaluate(coefficients: Array, s: Array, *, derivative: int = 0) -> Array:
    """Evaluate Bezier polynomials, or their derivatives by s, at the phases s.

    Args:
        coefficients: Bezier coefficients, shape (..., order + 1).
        s: Phases, shape (n,).
        derivative: How often to differentiate by s.

    Returns:
        Shape (n, ...).
    """
    for _ in range(derivative):
        coefficients = differentiate(coefficients)
    basis = bernstein(s, coefficients.shape[-1] - 1)  # (n, order + 1)
    return np.asarray(np.tensordot(basis, coefficients, axes=([1], [coefficients.ndim - 1])))


def differentiate(coefficients: Array) -> Array:
    """Coefficients of the derivative by s, one order lower: `n (c_{i+1} - c_i)`."""
    order = coefficients.shape[-1] - 1
    if order == 0:
        return np.zeros_like(coefficients)
    return np.asarray(order * np.diff(coefficients, axis=-1))


def fit(
    s: Array,
    values: Array,
    order: int,
    *,
    rates: Array | None = None,
    pinned: int = 0,
) -> Array:
    """Fit Bezier coefficients to samples by least squares.

    Args:
        s: Phases of the samples, from 0 to 1, shape (n,).
        values: Samples, shape (n, ...).
        order: Order of the polynomial.
        rates: Derivatives by s at the samples, shape (n, ...); fitted along where given.
        pinned: What both ends meet exactly: 0 nothing, 1 the value, 2 the value and the rate.

    Returns:
        Coefficients, shape (..., order + 1).
    """
    shape = values.shape[1:]
    flat = values.reshape(len(s), -1)
    basis, target = bernstein(s, order), flat
    if rates is not None:
        # d/ds of the basis, written on the same coefficients.
        lower = bernstein(s, order - 1)
        slope = order * (np.pad(lower, ((0, 0), (1, 0))) - np.pad(lower, ((0, 0), (0, 1))))
        flat_rates = rates.reshape(len(s), -1)
        basis, target = np.vstack([basis, slope]), np.vstack([target, flat_rates])
    coefficients = np.zeros((order + 1, flat.shape[1]))
    fixed: list[int] = []
    if pinned >= 1:
        coefficients[0], coefficients[-1] = flat[0], flat[-1]
        fixed += [0, order]
    if pinned >= 2:
        if rates is None:
            raise ValueError("pinned=2 needs the rates")
        coefficients[1] = coefficients[0] + flat_rates[0] / order
        coefficients[-2] = coefficients[-1] - flat_rates[-1] / order
        fixed += [1, order - 1]
    free = [i for i in range(order + 1) if i not in fixed]
    remainder = target - basis @ coefficients
    coefficients[free] = np.linalg.lstsq(basis[:, free], remainder, rcond=None)[0]
    return np.asarray(coefficients.T.reshape(*shape, order + 1))
