"""Contact forces within friction cones and torque limits, by ProxQP.

The unknowns y stack the contact forces lam, foot by foot, and the guide's forces w:

    minimise    |b_joints - lever lam|^2 + weight |lam|^2
    subject to  wrench y = b_base
                |b_joints - lever lam| <= tau_max
                lam_l in the friction cone of each foot l

The cone is replaced by an inner pyramid of eight sides, which reaches the cone along x, y and the
diagonals and stays within it by 8 % elsewhere; it is its own mirror image about x and y.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from proxsuite import proxqp

from ._typing import Array

FORCE_WEIGHT = 1e-6
"""Cost of contact forces against joint torques [m^2]: small enough not to show, and it decides
where straight legs leave the torques undecided."""

_SIDES = 8
_ACCURACY = 1e-10
_SLACK_WEIGHT = 1e3
"""Cost of violated base equations against joint torques, where they cannot be met."""
_ITERATIONS = 100
"""Solvable problems take 1 to 25; ProxQP can spend its default of 10,000 on others."""
_INFEASIBLE = 1e-8
"""ProxQP's default of 1e-4 takes some problems whose forces touch the cone for infeasible."""


class ForceProblem(NamedTuple):
    """What changes from one instant to the next; see the module's equations."""

    lever: Array
    """Torques that hold the contact forces [m], shape (12, 3 feet)."""
    b_joints: Array
    """Torques needed without contact [N m], shape (12,)."""
    wrench: Array
    """Wrench of unit forces on the trunk, shape (6, 3 feet + guides)."""
    b_base: Array
    """Wrench the trunk needs [N, N m], shape (6,)."""


def cone_sides(friction: float, feet: int) -> Array:
    """Rows C with C lam <= 0 for forces within the inner pyramids, shape (8 feet, 3 feet)."""
    half = np.pi / _SIDES
    angle = half + 2.0 * half * np.arange(_SIDES)
    height = np.full(_SIDES, -friction * np.cos(half))
    return np.kron(np.eye(feet), np.stack([np.cos(angle), np.sin(angle), height], axis=-1))


class ForceQP:
    """Solves one `ForceProblem` after another, each started from the one before.

    Args:
        feet: Number of feet in contact.
        guides: Number of coordinates held by a guide.
        friction: Coefficient of friction.
        tau_max: Torque limits [N m], shape (12,); infinite where there are none.
    """

    def __init__(self, feet: int, guides: int, friction: float, tau_max: Array) -> None:
        self._forces, self._size = 3 * feet, 3 * feet + guides
        self._tau_max = tau_max
        self._cone = np.pad(cone_sides(friction, feet), ((0, 0), (0, guides)))
        self._warm: proxqp.dense.QP | None = None

    def solve(self, problem: ForceProblem) -> Array:
        """The forces y; where the base equations cannot be met, those that violate them least."""
        terms = self._terms(problem)
        if self._warm is not None:
            self._warm.update(**terms)
            if _solved(self._warm):
                return np.array(self._warm.results.x)
        # A start from far away misleads the solver more than none: a failure begins afresh.
        fresh = _new_qp(terms)
        if _solved(fresh):
            self._warm = fresh
            return np.array(fresh.results.x)
        self._warm = None
        elastic = _new_qp(_with_slack(terms))
        elastic.solve()
        return np.array(elastic.results.x[: self._size])

    def _terms(self, problem: ForceProblem) -> dict[str, Array]:
        """ProxQP's matrices."""
        lever = np.pad(problem.lever, ((0, 0), (0, self._size - self._forces)))
        hessian = lever.T @ lever
        hessian[range(self._forces), range(self._forces)] += FORCE_WEIGHT
        sides = len(self._cone)
        return {
            "H": hessian,
            "g": -lever.T @ problem.b_joints,
            "A": problem.wrench,
            "b": problem.b_base,
            "C": np.vstack([self._cone, lever]),
            "l": np.concatenate([np.full(sides, -np.inf), problem.b_joints - self._tau_max]),
            "u": np.concatenate([np.zeros(sides), problem.b_joints + self._tau_max]),
        }


def _with_slack(terms: dict[str, Array]) -> dict[str, Array]:
    """The same problem with its equations relaxed at a price, which always has a solution."""
    equations, size = terms["A"].shape
    wide = ((0, 0), (0, equations))
    hessian = np.pad(terms["H"], ((0, equations), (0, equations)))
    hessian[size:, size:] = _SLACK_WEIGHT * np.eye(equations)
    return terms | {
        "H": hessian,
        "g": np.pad(terms["g"], (0, equations)),
        "A": np.hstack([terms["A"], np.eye(equations)]),
        "C": np.pad(terms["C"], wide),
    }


def _new_qp(terms: dict[str, Array]) -> proxqp.dense.QP:
    qp = proxqp.dense.QP(len(terms["g"]), len(terms["b"]), len(terms["u"]))
    qp.settings.eps_abs = _ACCURACY
    qp.settings.eps_rel = 0.0
    qp.settings.eps_primal_inf = _INFEASIBLE
    qp.settings.max_iter = _ITERATIONS
    qp.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
    qp.init(**terms)
    return qp


def _solved(qp: proxqp.dense.QP) -> bool:
    """Solve; whether the accuracy is met."""
    qp.solve()
    return bool(qp.results.info.status == proxqp.QPSolverOutput.PROXQP_SOLVED)
