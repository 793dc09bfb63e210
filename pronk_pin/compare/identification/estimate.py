"""Estimation of parameters with intervals from rows `y = A theta`, and their confounding.

Noise in the measured motion is noise in A, and least squares on noisy regressors are biased. So the
normal equations are made of pairs of different strides,

    G = mean over j != k of A_j^T W A_k,    b = mean over j != k of A_j^T W y_k,

whose noise is independent: instrumental variables, with every other stride as the instrument (all
split halves at once). The rows' weights W are robust, so that what no term describes is outvoted.

The delay shifts the commanded torque, and is not linear. The profile of the least squares over
delays a millisecond apart says where to begin; from there each round linearises about the delay of
the last one (Gauss and Newton). In the end the delay stands among the linear parameters with its
own column, so that covariance and intervals are joint ones, and those of the others hold the
uncertainty of the shift.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.optimize
import scipy.stats

from ..._typing import Array, BoolArray, IntArray
from .equations import EVERY, GROUPS, WINDOW, DelayedEquations, Equations
from .model_terms import Term

_ROUNDS = 12
_TUKEY = 4.685  # 95 % efficiency with normal noise
_FLOOR = np.array([0.05, 0.05, 0.005, 0.005, 0.005])
"""Least standard deviation of a row, by group [N, N, N m, N m, N m]: no model is better."""
_OVERLAP = WINDOW / (1.5 * EVERY)
"""Rows that share one error: as long as a window of Hann is at equal height."""
PRIOR = 3.0
"""Standard deviation of what is believed of a parameter beforehand, in its term's scale."""


class Normal(NamedTuple):
    """Normal equations of one speed, from every pair of strides, in the terms' scales."""

    G: Array
    """Shape (k, k, terms, terms)."""
    b: Array
    """Shape (k, k, terms)."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters of the terms.

    Attributes:
        value: The parameters, shape (terms,).
        draws: Deviations of the parameters, their bounds aside, with strides and speeds drawn
            anew, shape (draws, terms).
        model_error: Standard deviation of the parameters by what no model describes, which is the
            same in every stride, shape (terms,).
        information: How much the rows tell of the parameters, in the terms' scales; inverse of
            their covariance if the rows' errors were independent, shape (terms, terms).
        rest: Root mean square of what no term describes of the strides' mean, by group [N, N, N m,
            N m, N m], shape (5,).
        noise: What of it the strides' scatter lets expect, shape (5,).
        size: Root mean square of what the URDF does not describe, shape (5,).
    """

    value: Array
    draws: Array
    model_error: Array
    information: Array
    rest: Array
    noise: Array
    size: Array

    def interval(self, level: float = 0.95) -> tuple[Array, Array]:
        """Ends of the intervals, shape (terms,) each.

        Symmetric, and as if there were no bounds: an estimate on its bound is not sure of it. The
        model's error adds to the scatter, which alone would promise too much where nothing is
        noisy.
        """
        scatter = np.percentile(np.abs(self.draws), 100.0 * level, axis=0)
        model_error = scipy.stats.norm.ppf(0.5 + 0.5 * level) * self.model_error
        reach = np.hypot(scatter, model_error)
        return self.value - reach, self.value + reach


def estimate(
    equations: Mapping[float, DelayedEquations],
    terms: tuple[Term, ...],
    *,
    rng: np.random.Generator,
    draws: int = 300,
    others: bool = True,
) -> Estimate:
    """Fit the terms to the rows of all speeds.

    Args:
        equations: The rows by speed.
        terms: The terms.
        rng: Source of the strides and speeds drawn for the intervals.
        draws: How many.
        others: Take other strides only as instruments. False is plain least squares, for strides
            that do not repeat: biased by noise.
    """
    scale = np.array([term.scale for term in terms])
    weights = {speed: _flight_first(each.group) for speed, each in equations.items()}
    sigma = np.ones(len(GROUPS))
    value = _start(equations, weights, terms, others)
    normal: dict[float, Normal] = {}
    for _ in range(_ROUNDS):
        rows = {speed: each.at(value) for speed, each in equations.items()}
        normal = {
            speed: _normal(each, weights[speed] / sigma[each.group] ** 2, scale)
            for speed, each in rows.items()
        }
        value = _solve(*_sum(normal, others), terms)
        rows = {speed: each.at(value) for speed, each in equations.items()}
        residual = {speed: _mean_residual(each, value) for speed, each in rows.items()}
        sigma = _spread(rows, residual)
        weights = {
            speed: _tukey(residual[speed] / sigma[each.group]) for speed, each in rows.items()
        }
    information, _ = total = _sum(normal, others)
    free = _unbounded(*total) * scale
    drawn = np.array([_unbounded(*_drawn(normal, others, rng)) for _ in range(draws)]) * scale
    at_best = {
        speed: _normal(each, weights[speed] / _FLOOR[each.group] ** 2, scale)
        for speed, each in rows.items()
    }
    root, vectors = _root(_sum(at_best, others)[0])
    model_error = scale * np.sqrt(_OVERLAP * ((vectors / root) ** 2).sum(axis=1))
    return Estimate(value, drawn - free, model_error, information, *_fit(rows, value))


def _start(
    equations: Mapping[float, DelayedEquations],
    weights: Mapping[float, Array],
    terms: tuple[Term, ...],
    others: bool,
) -> Array:
    """The parameters to begin with: the best of the delays on a grid, with the others' estimates
    given it."""
    delay = next((k for k, term in enumerate(terms) if term.column is None), None)
    if delay is None:
        return np.zeros(len(terms))
    linear = (*terms[:delay], *terms[delay + 1 :])
    scale = np.array([term.scale for term in linear])
    best, least = np.zeros(len(terms)), np.inf
    for shift in next(iter(equations.values())).torque.x:
        if not terms[delay].lower <= shift <= terms[delay].upper:
            continue
        rows = {speed: each.given_delay(shift) for speed, each in equations.items()}
        normal = {speed: _normal(each, weights[speed], scale) for speed, each in rows.items()}
        value = _solve(*_sum(normal, others), linear)
        squares = sum(
            float(weights[speed] @ _mean_residual(each, value) ** 2) for speed, each in rows.items()
        )
        if squares < least:
            best, least = np.insert(value, delay, shift), squares
    return best


def _mean_residual(rows: Equations, value: Array) -> Array:
    """What parameters leave of the strides' mean, shape (m,)."""
    return np.asarray(rows.y.mean(axis=0) - rows.A.mean(axis=0) @ value)


def _fit(rows: Mapping[float, Equations], value: Array) -> tuple[Array, Array, Array]:
    """Root mean squares by group: the rest, its expected noise, and the rows' left-hand side."""
    group = np.concatenate([equations.group for equations in rows.values()])
    squares = []
    for equations in rows.values():
        residual = equations.y - equations.A @ value  # (k, m)
        scatter = residual.var(axis=0, ddof=1) / len(residual)
        squares.append([residual.mean(axis=0) ** 2, scatter, equations.y.mean(axis=0) ** 2])
    joined = np.concatenate([np.array(each) for each in squares], axis=1)  # (3, rows)
    rms = [
        np.sqrt(joined[:, group == k].mean(axis=1)) if np.any(group == k) else np.full(3, np.nan)
        for k in range(len(GROUPS))
    ]
    residual, noise, size = np.array(rms).T
    return residual, noise, size


def _flight_first(group: IntArray) -> Array:
    """Weights to begin with: flight, where no contact can mislead, if it was recorded."""
    flying = group >= 2
    return np.where(flying, 1.0, 0.0) if flying.any() else np.ones(len(flying))


def _spread(rows: Mapping[float, Equations], residual: Mapping[float, Array]) -> Array:
    """Robust standard deviation of each group's residuals."""
    sigma = _FLOOR.copy()
    group = np.concatenate([equations.group for equations in rows.values()])
    all_of_them = np.concatenate(list(residual.values()))
    for k in range(len(GROUPS)):
        if np.any(group == k):
            sigma[k] = max(sigma[k], 1.4826 * float(np.median(np.abs(all_of_them[group == k]))))
    return sigma


def _tukey(z: Array) -> Array:
    """Tukey's biweight."""
    return np.asarray(np.where(np.abs(z) < _TUKEY, (1.0 - (z / _TUKEY) ** 2) ** 2, 0.0))


def _normal(rows: Equations, weight: Array, scale: Array) -> Normal:
    A = rows.A * scale  # (k, m, p)
    weighted = np.swapaxes(A * weight[:, None], 1, 2)  # (k, p, m)
    G = np.einsum("jpm,kmq->jkpq", weighted, A, optimize=True)
    b = np.einsum("jpm,km->jkp", weighted, rows.y, optimize=True)
    return Normal(G, b)


def _sum(normal: Mapping[float, Normal], others: bool) -> tuple[Array, Array]:
    """G and b over all pairs of strides of all speeds."""
    pairs = [_pairs(each, np.ones(len(each.G)), others) for each in normal.values()]
    return sum(G for G, _ in pairs), sum(b for _, b in pairs)  # type: ignore[return-value]


def _pairs(normal: Normal, times: Array, others: bool) -> tuple[Array, Array]:
    """Mean over pairs of different strides, or of each with itself, counted so many times."""
    weight = np.outer(times, times) if others else np.diag(times)
    if others:
        np.fill_diagonal(weight, 0.0)
    weight /= weight.sum()
    G = np.einsum("jk,jkpq->pq", weight, normal.G)
    return 0.5 * (G + G.T), np.einsum("jk,jkp->p", weight, normal.b)


def _drawn(
    normal: Mapping[float, Normal], others: bool, rng: np.random.Generator
) -> tuple[Array, Array]:
    """G and b of speeds and strides drawn anew, with replacement."""
    speeds = list(normal)
    count = next(iter(normal.values())).G.shape[-1]
    G, b = np.zeros((count, count)), np.zeros(count)
    for index in rng.integers(len(speeds), size=len(speeds)):
        each = normal[speeds[index]]
        k = len(each.G)
        times = np.bincount(rng.integers(k, size=k), minlength=k).astype(float)
        while np.count_nonzero(times) < 2:  # a pair needs two
            times = np.bincount(rng.integers(k, size=k), minlength=k).astype(float)
        pairs = _pairs(each, times, others)
        G, b = G + pairs[0], b + pairs[1]
    return G, b


def _root(G: Array) -> tuple[Array, Array]:
    """Eigenvalues' roots and vectors of G and the prior."""
    values, vectors = np.linalg.eigh(G)
    # Noise can make the mean over pairs indefinite: such a direction is known no better than that.
    return np.sqrt(np.abs(values) + PRIOR**-2), vectors


def _unbounded(G: Array, b: Array) -> Array:
    """The minimum of theta^T (G + prior) theta / 2 - b^T theta, in the terms' scales."""
    root, vectors = _root(G)
    return np.asarray(vectors @ ((vectors.T @ b) / root**2))


def _solve(G: Array, b: Array, terms: tuple[Term, ...]) -> Array:
    """The same within the bounds, in the terms' units."""
    scale = np.array([term.scale for term in terms])
    lower = np.array([term.lower for term in terms]) / scale
    upper = np.array([term.upper for term in terms]) / scale
    root, vectors = _root(G)
    target = (vectors.T @ b) / root
    solution = scipy.optimize.lsq_linear(root[:, None] * vectors.T, target, (lower, upper))
    return np.asarray(solution.x * scale)


def repetition(rows: Equations, terms: tuple[Term, ...]) -> float:
    """Repetition of strides: median over the terms of `mean_{j != k} A_j^T A_k / mean_j A_j^T A_j`.

    1 if they repeat, lower by noise, and near 0 where the robot stumbles.
    """
    scale = np.array([term.scale for term in terms])
    normal = _normal(rows, np.ones(len(rows.group)), scale)
    own = np.einsum("jjpp->p", normal.G)
    other = (np.einsum("jkpp->p", normal.G) - own) / (len(normal.G) - 1)
    seen = own > _UNSEEN * own.max()
    return float(np.median(other[seen] / own[seen]))


class Confounding(NamedTuple):
    """Terms that the recorded motion does not tell apart."""

    correlation: Array
    """Between the errors of the parameters, shape (terms, terms)."""
    condition: float
    """Condition number of the rows, in the terms' scales, of the terms that can be seen."""
    seen: BoolArray
    """Whether the rows tell anything of a term, shape (terms,)."""
    pairs: tuple[tuple[int, int, float], ...]
    """Pairs of terms with their correlation where it is strong."""


STRONG = 0.9
"""Correlation from which on two terms are named as hard to tell apart."""
_UNSEEN = 1e-6


def confounding(estimate_: Estimate) -> Confounding:
    """Find the terms that the rows do not tell apart."""
    G = estimate_.information
    diagonal = np.diag(G)
    seen = diagonal > np.maximum(_UNSEEN * diagonal.max(), PRIOR**-2)
    count = len(G)
    correlation = np.eye(count)
    index = np.flatnonzero(seen)
    values = np.linalg.eigvalsh(G[np.ix_(index, index)])
    floor = PRIOR**-2
    covariance = np.linalg.inv(G[np.ix_(index, index)] + floor * np.eye(len(index)))
    deviation = np.sqrt(np.diag(covariance))
    correlation[np.ix_(index, index)] = covariance / np.outer(deviation, deviation)
    condition = float(np.sqrt(values[-1] / max(values[0], floor)))
    pairs = tuple(
        (int(i), int(j), float(correlation[i, j]))
        for n, i in enumerate(index)
        for j in index[n + 1 :]
        if abs(correlation[i, j]) > STRONG
    )
    return Confounding(correlation, condition, np.asarray(seen), pairs)
