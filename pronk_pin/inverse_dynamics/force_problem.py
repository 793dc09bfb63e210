"""Contact forces of a motion: the equations, and their cheapest solution in closed form.

The unknowns y stack the contact forces lam, foot by foot, and the planar constraint's forces w.
They must meet the base's equations, and the motors give the joints' remaining torques:

    minimise    |b_joints - lever lam|^2 + weight |lam|^2
    subject to  wrench y = b_base

Leading dimensions are a batch.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from .._typing import Array, IntArray
from ..kinematics import jacobian_at
from ..robot import NB, Robot, rotation_matrix

FORCE_WEIGHT = 1e-6
"""Cost of contact forces against joint torques [m^2]: small enough not to show, and it decides
where straight legs leave the torques undecided."""

_PROXIMAL = 1e-8
"""Damping of the base's equations, which repeated steps take away wherever they can be met."""
_STEPS = 1


class ForceProblem(NamedTuple):
    """The equations of one instant, or of a batch of them."""

    lever: Array
    """Torques that hold the contact forces [m], shape (..., 12, 3 feet)."""
    b_joints: Array
    """Torques needed without contact, against friction too [N m], shape (..., 12)."""
    wrench: Array
    """Wrench of unit forces on the trunk, in its axes, shape (..., 6, 3 feet + constraints)."""
    b_base: Array
    """Wrench the trunk needs [N, N m], shape (..., 6)."""

    @property
    def contacts(self) -> int:
        """Number of contact forces, 3 feet."""
        return int(self.lever.shape[-1])

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.wrench.shape[-1])

    def torques(self, y: Array) -> Array:
        """Torques that motors of torque constant 1 give with forces y [N m], shape (..., 12)."""
        return self.b_joints - apply(self.lever, y[..., : self.contacts])

    def rest(self, y: Array) -> Array:
        """Residual `b_base - wrench y` of the base's equations [N, N m], shape (..., 6)."""
        return self.b_base - apply(self.wrench, y)


class SaddlePoint(NamedTuple):
    """The optimality conditions of a `ForceProblem`, K [y, mu] = rhs, and their damped inverse."""

    matrix: Array
    """K with the damping of the base's equations, shape (..., size + 6, size + 6)."""
    inverse: Array
    """Its inverse."""
    rhs: Array
    """Shape (..., size + 6)."""

    def correction(self, residual: Array, rows: IntArray) -> Array:
        """Cheapest change of y that removes a residual (m, 6) of the base's equations, at
        some of n instants, shape (m, size)."""
        return apply(self.inverse[rows, :-NB, -NB:], residual)

    def solve(self) -> Array:
        """Solve for y; where the base's equations cannot be met, violate them least."""
        z = apply(self.inverse, self.rhs)
        for _ in range(_STEPS):
            # Refined towards the undamped equations; multipliers of those that cannot be met grow.
            residual = self.rhs - apply(self.matrix, z)
            residual[..., -NB:] -= _PROXIMAL * z[..., -NB:]
            z = z + apply(self.inverse, residual)
        return z[..., :-NB]


def force_problem(
    robot: Robot,
    motion: tuple[Array, Array, Array],
    legs: Sequence[int],
    radius: float,
    axes: Sequence[int],
) -> ForceProblem:
    """The equations at one instant or at n instants of a checked motion (q, v, a).

    Args:
        robot: The robot.
        motion: q, v and a, with at most one leading dimension.
        legs: Legs in contact, by index.
        radius: Distance from the foot's centre to the contact point [m].
        axes: Base coordinates that the planar constraint holds, by index.
    """
    q, v, a = motion
    if q.ndim == 1:
        needed = pin.rnea(robot.model, robot.data, q, v, a)
        jacobian = jacobian_at(robot, q, legs, radius)
    else:
        needed, jacobian = np.empty_like(v), np.empty((len(q), 3 * len(legs), robot.nv))
        rnea, model, data = pin.rnea, robot.model, robot.data
        for q_row, v_row, a_row, out, rows in zip(q, v, a, needed, jacobian, strict=True):
            out[:] = rnea(model, data, q_row, v_row, a_row)
            rows[:] = jacobian_at(robot, q_row, legs, radius)
    if not robot.parameters.ideal_motors:
        needed[..., NB:] += robot.friction(v[..., NB:])
    transposed = np.swapaxes(jacobian, -1, -2)  # (..., 18, 3 feet)
    wrench = transposed[..., :NB, :]
    if axes:
        # World forces at the trunk's origin, in the trunk's axes as the base's equations are.
        constraint = np.zeros((*q.shape[:-1], NB, NB))
        into_trunk = np.swapaxes(rotation_matrix(q[..., 3:7]), -1, -2)
        constraint[..., :3, :3] = constraint[..., 3:, 3:] = into_trunk
        wrench = np.concatenate([wrench, constraint[..., list(axes)]], axis=-1)
    return ForceProblem(transposed[..., NB:, :], needed[..., NB:], wrench, needed[..., :NB])


def saddle_point(problem: ForceProblem) -> SaddlePoint:
    """The optimality conditions of a problem, inverted.

    K = [[H, wrench^T], [wrench, -damping]], with H = lever^T lever + weight on the contact forces
    and zero on the planar constraint's.
    """
    contacts, size = problem.contacts, problem.size
    holding = np.swapaxes(problem.lever, -1, -2)  # (..., 3 feet, 12)
    batch = problem.b_base.shape[:-1]
    matrix, rhs = np.zeros((*batch, size + NB, size + NB)), np.zeros((*batch, size + NB))
    matrix[..., :contacts, :contacts] = holding @ problem.lever
    matrix[..., :size, size:] = np.swapaxes(problem.wrench, -1, -2)
    matrix[..., size:, :size] = problem.wrench
    diagonal = matrix.reshape(*batch, (size + NB) ** 2)[..., :: size + NB + 1]  # a view
    diagonal[..., :contacts] += FORCE_WEIGHT
    diagonal[..., size:] = -_PROXIMAL
    rhs[..., :contacts] = apply(holding, problem.b_joints)
    rhs[..., size:] = problem.b_base
    return SaddlePoint(matrix, np.linalg.inv(matrix), rhs)


def apply(matrices: Array, vectors: Array) -> Array:
    """Matrices (..., i, j) times vectors (..., j)."""
    if vectors.ndim == 1:
        return np.asarray(matrices @ vectors)
    return np.asarray((matrices @ vectors[..., None])[..., 0])
