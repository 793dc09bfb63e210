"""Contact forces within friction cones and torque limits, by ProxQP.

    minimise    |b_joints - lever lam|^2 + weight |lam|^2
    subject to  wrench y = b_base
                |b_joints - lever lam| <= tau_max
                lam_l in the friction cone of each foot l

The cone is replaced by an inner pyramid of eight sides, which reaches the cone along x, y and the
diagonals and stays within it by 8 % elsewhere; it is its own mirror image about x and y.
"""

from __future__ import annotations

import numpy as np
from proxsuite import proxqp

from .._typing import Array, IntArray
from ..robot import NB
from .force_problem import ForceProblem, SaddlePoint

_SIDES = 8
_ACCURACY = 1e-9
"""Violation of cones and limits that passes [N, N m]; what it leaves of the base's equations is
corrected afterwards."""
_SLACK_WEIGHT = 1e3
"""Cost of violated base equations against joint torques, where they cannot be met."""
_ITERATIONS = 100
"""Solvable problems take 1 to 25; ProxQP can spend its default of 10,000 on others."""
_INFEASIBLE = 1e-8
"""ProxQP's default of 1e-4 takes some problems whose forces touch the cone for infeasible."""
_WARM = {"mu_in": 1e-4, "mu_eq": 1e-6, "rho": 1e-8}
"""Proximal parameters close to the exact problem: from the active set of the instant before they
reach the next solution in two iterations; the defaults (0.1, 1e-3, 1e-6), safer from afar, take
eleven."""


def cone_sides(friction: float, feet: int) -> Array:
    """Rows C with C lam <= 0 for forces within the inner pyramids, shape (8 feet, 3 feet)."""
    half = np.pi / _SIDES
    angle = half + 2.0 * half * np.arange(_SIDES)
    height = np.full(_SIDES, -friction * np.cos(half))
    return np.kron(np.eye(feet), np.stack([np.cos(angle), np.sin(angle), height], axis=-1))


def cone_edges(friction: float, feet: int) -> Array:
    """Columns E whose sums with weights of 0 or more are these forces, shape (3 feet, 8 feet)."""
    angle = 2.0 * np.pi / _SIDES * np.arange(_SIDES)
    edges = np.stack([friction * np.cos(angle), friction * np.sin(angle), np.ones(_SIDES)])
    return np.kron(np.eye(feet), edges)


def constrained_forces(
    problem: ForceProblem, conditions: SaddlePoint, rows: IntArray, friction: float, tau_max: Array
) -> Array:
    """Forces y within cones and limits at some instants of a trajectory, in their order.

    Each QP starts from the solution of the one before. Where the base's equations cannot be met
    they are violated least.

    Args:
        problem: The problem of n instants.
        conditions: Its optimality conditions without cones and limits.
        rows: Instants to solve, shape (m,).
        friction: Coefficient of friction.
        tau_max: Torque limits [N m], shape (12,); infinite where there are none.

    Returns:
        Shape (m, 3 feet + constraints).
    """
    chosen = ForceProblem(*(part[rows] for part in problem))
    chain = _Chain(chosen, conditions.matrix[rows], conditions.rhs[rows], friction, tau_max)
    forces = np.empty((len(rows), problem.size))
    met = np.empty(len(rows), dtype=bool)
    for k in range(len(rows)):
        forces[k], met[k] = chain.solve(k)
    residual = np.where(met[:, None], chosen.rest(forces), 0.0)
    return forces + conditions.correction(residual, rows)


class _Chain:
    """The QPs of successive instants, each started from the one before."""

    def __init__(
        self, problem: ForceProblem, matrix: Array, rhs: Array, friction: float, tau_max: Array
    ) -> None:
        size, contacts = problem.size, problem.contacts
        sides = cone_sides(friction, contacts // 3)
        n, motors = problem.b_joints.shape
        self._rows = np.zeros((n, len(sides) + motors, size))
        self._rows[:, : len(sides), :contacts] = sides
        self._rows[:, len(sides) :, :contacts] = problem.lever
        self._upper = np.zeros(self._rows.shape[:2])
        self._upper[:, len(sides) :] = problem.b_joints + tau_max
        self._lower = np.full(self._rows.shape[:2], -np.inf)
        self._lower[:, len(sides) :] = problem.b_joints - tau_max
        self._hessian, self._gradient = matrix[:, :size, :size], -rhs[:, :size]
        self._problem = problem
        self._warm: proxqp.dense.QP | None = None

    def solve(self, k: int) -> tuple[Array, bool]:
        """Solve instant k: its forces, and whether they meet the base's equations."""
        terms = self._terms(k)
        if self._warm is not None:
            self._warm.update(**terms, **_WARM)
            if _solved(self._warm):
                return self._warm.results.x, True
        # A start from far away misleads the solver more than none: a failure begins afresh.
        fresh = _new_qp(terms)
        if _solved(fresh):
            self._warm = fresh
            return fresh.results.x, True
        self._warm = None
        elastic = _new_qp(_with_slack(terms))
        elastic.solve()
        return elastic.results.x[: self._problem.size], False

    def _terms(self, k: int) -> dict[str, Array]:
        """ProxQP's matrices."""
        return {
            "H": self._hessian[k],
            "g": self._gradient[k],
            "A": self._problem.wrench[k],
            "b": self._problem.b_base[k],
            "C": self._rows[k],
            "l": self._lower[k],
            "u": self._upper[k],
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
    qp = proxqp.dense.QP(len(terms["g"]), NB, len(terms["u"]))
    qp.settings.eps_abs = _ACCURACY
    qp.settings.eps_rel = 0.0
    qp.settings.eps_primal_inf = _INFEASIBLE
    qp.settings.max_iter = _ITERATIONS
    qp.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
    qp.init(**terms, compute_preconditioner=False)
    return qp


def _solved(qp: proxqp.dense.QP) -> bool:
    """Solve a QP, and return whether the accuracy is met."""
    qp.solve()
    return bool(qp.results.info.status == proxqp.QPSolverOutput.PROXQP_SOLVED)
