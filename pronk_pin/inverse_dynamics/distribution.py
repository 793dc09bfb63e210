"""Contact forces that put a wanted wrench on the trunk, within their friction cones.

With the lever arms r_l of the feet about the trunk's origin and the nominal forces lam_0,

    minimise    |S (W (lam - lam_0) - w)|^2 + weight |lam - lam_0|^2
    subject to  lam_l in the friction cone of each foot l

for W lam = (sum lam_l, sum r_l x lam_l). Where the cones do not bind it is solved in closed form
for the whole batch; the others are one small QP each, solved as non-negative least squares (Lawson
and Hanson 1974). There is always a solution: what the ground cannot give is left out, the least
that can be.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from .._checks import POSITIVE, real
from .._typing import Array
from ..robot import NB
from .qp import cone_edges

_ARM = 0.2
"""Length at which a moment counts like a force [m]: about half of the feet's distances."""

_WEIGHT = 1e-4
"""Cost of changed forces against a missed wrench: it decides what the wrench leaves open."""

_SCALE = np.repeat([1.0, 1.0 / _ARM], 3)


def wrench_matrix(arms: Array) -> Array:
    """Force and moment about the origin of unit forces at arms (..., feet, 3): (..., 6, 3 feet)."""
    x, y, z = np.moveaxis(arms, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    moment = np.stack([np.stack(row, axis=-1) for row in rows], axis=-3)  # (..., 3, feet, 3)
    force = np.broadcast_to(np.eye(3)[:, None], moment.shape)
    stacked = np.concatenate([force, moment], axis=-3)
    return np.asarray(stacked.reshape(*arms.shape[:-2], NB, -1))


def distribute_wrench(arms: Array, wrench: Array, nominal: Array, *, friction: float) -> Array:
    """Contact forces that change the wrench on the trunk by a wanted one [N].

    Args:
        arms: Contacts from the point about which moments count, in the world's axes [m], shape
            (n, feet, 3).
        wrench: Wanted change of force and moment on the trunk, world axes [N, N m], shape (n, 6).
        nominal: Forces to change, world axes [N], shape (n, feet, 3).
        friction: Coefficient of friction.

    Returns:
        The forces, all within their cones, shape (n, feet, 3).

    Raises:
        InvalidInput: The coefficient of friction is not positive.
    """
    friction = real("friction", friction, POSITIVE)
    matrix = wrench_matrix(arms)  # (n, 6, 3 feet)
    transposed = np.swapaxes(matrix, -1, -2)
    damped = matrix @ transposed + _WEIGHT * np.diag(_SCALE**-2)
    change = transposed @ np.linalg.solve(damped, wrench[..., None])
    forces = nominal + change.reshape(nominal.shape)
    side = np.hypot(forces[..., 0], forces[..., 1])
    for k in np.flatnonzero((side > friction * forces[..., 2]).any(axis=-1)):
        scaled = _SCALE[:, None] * matrix[k]
        forces[k] = _within_cones(scaled, _SCALE * wrench[k], nominal[k], friction)
    return forces


def _within_cones(matrix: Array, wrench: Array, nominal: Array, friction: float) -> Array:
    """Solve the QP of one instant, with cones replaced by their inner pyramids.

    Forces are sums of a pyramid's edges E with weights of 0 or more. The active-set method gives
    the same bits each time, where an interior one rounds by where its memory lies.
    """
    edges, weight = cone_edges(friction, len(nominal)), np.sqrt(_WEIGHT)
    left = np.vstack([matrix, weight * np.eye(nominal.size)])  # (6 + 3 feet, 3 feet)
    right = left @ nominal.ravel()
    right[: len(wrench)] += wrench
    weights, _ = nnls(left @ edges, right)
    return np.asarray(edges @ weights).reshape(nominal.shape)
