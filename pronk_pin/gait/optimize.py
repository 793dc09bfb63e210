"""From a gait problem to its solution."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from .._typing import Array
from ..errors import GaitNotFound, InvalidInput
from ..robot import NB
from . import bezier
from .collocation import PHASES, node_phases, transcribe
from .folded_model import FoldedModel, fold
from .gait import Gait, GaitPhase, Motion
from .newton_euler import NB_FOLDED
from .problem import GaitProblem
from .transcription import Transcription, Violation

ORDERS = {"stance": 8, "flight": 11}
"""Bezier orders: in flight the first that keeps the joints well within 1e-3 rad of the optimised
motion (order 10 loses 1.2e-3 rad, order 11 4e-4, and beyond it the mesh is the limit); in stance,
where order 6 would do for the joints (4e-4 rad), the first that keeps the feet on the ground
within 0.01 mm."""

TOLERANCE = 1e-8
"""Largest violation of a constraint that passes, in the constraint's unit."""

_COLD: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 200,
    "ipopt.tol": 1e-8,
    "ipopt.constr_viol_tol": 1e-9,
    # Limits are limits: IPOPT would by default relax each by 1e-8 of its size.
    "ipopt.bound_relax_factor": 0.0,
    # The crude guess is far off: a monotone barrier takes twice the iterations.
    "ipopt.mu_strategy": "adaptive",
    "ipopt.mu_init": 0.5,
}
_WARM = _COLD | {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-6,
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_bound_frac": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_frac": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}
_DERIVATIVES = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
"""Option of CasADi's IPOPT that takes a derivative, and the function that is one."""


@dataclass(frozen=True, eq=False)
class SolverState:
    """Where the solver stopped, for a warm start.

    Attributes:
        x: The unknowns of the transcription.
        lam_x, lam_g: Multipliers of the bounds and of the constraints.
    """

    x: Array
    lam_x: Array
    lam_g: Array

    def as_start(self) -> dict[str, Array]:
        """The state as CasADi's solver takes it."""
        return {"x0": self.x, "lam_x0": self.lam_x, "lam_g0": self.lam_g}


@dataclass(frozen=True, eq=False)
class GaitSolution:
    """A solved gait problem.

    Attributes:
        problem: What was asked.
        gait: The gait in its Bezier form.
        motions: The optimised motion of each phase at its nodes, midpoints included.
        impulse: Touchdown impulses of the feet in the world frame [N s], shape (4, 3).
        cost: Value of eq. (6).
        violations: Worst violation of each named constraint.
        iterations: Iterations of the solver.
        solve_time: Time in the solver [s].
        state: Where the solver stopped.
    """

    problem: GaitProblem
    gait: Gait
    motions: Mapping[str, Motion] = field(repr=False)
    impulse: Array = field(repr=False)
    cost: float
    violations: Mapping[str, Violation] = field(repr=False)
    iterations: int
    solve_time: float
    state: SolverState = field(repr=False)

    @property
    def model(self) -> FoldedModel:
        """The folded model it was found with."""
        return fold(self.problem.robot, self.problem.contact)


def optimize_gait(problem: GaitProblem, *, initial: GaitSolution | None = None) -> GaitSolution:
    """Find the gait of least cost.

    Args:
        problem: What is asked.
        initial: A solution of a like problem (another speed or apex) to start from; without it
            the solver starts from a crude vertical hop.

    Raises:
        GaitNotFound: The solver failed; the error names the violated constraints.
        InvalidInput: `initial` was found on another mesh.
    """
    if initial is not None and initial.problem.intervals != problem.intervals:
        raise InvalidInput(
            f"the initial solution has {initial.problem.intervals} mesh intervals, the problem "
            f"{problem.intervals}; give both the same"
        )
    found = _solve(problem, initial)
    program, model = _program(problem), fold(problem.robot, problem.contact)
    violations = program.violations(found.state.x, _parameters(problem))
    worst = {name: violation.value for name, violation in violations.items()}
    if not found.success or max(worst.values()) > TOLERANCE:
        raise GaitNotFound(problem.speed, found.status, worst)
    values = program.unpack(found.state.x)
    motions = {name: _unfolded(model, values, name) for name in PHASES}
    return GaitSolution(
        problem=problem,
        gait=_gait(problem, motions),
        motions=motions,
        impulse=model.unfold_forces(values["impulse"][0]),
        cost=found.cost,
        violations=violations,
        iterations=found.iterations,
        solve_time=found.solve_time,
        state=found.state,
    )


class _Found(NamedTuple):
    """What the solver came back with."""

    state: SolverState
    cost: float
    success: bool
    status: str
    iterations: int
    solve_time: float


def _solve(problem: GaitProblem, initial: GaitSolution | None) -> _Found:
    program = _program(problem)
    if initial is None:
        start = {"x0": program.pack(vertical_hop(problem))}
    else:
        start = initial.state.as_start()
    solver = _solver(_structure(problem), warm=initial is not None)
    clock = time.perf_counter()
    result = solver(**start, **program.bounds, p=_parameters(problem))
    solve_time = time.perf_counter() - clock
    state = SolverState(*(np.array(result[key]).ravel() for key in ("x", "lam_x", "lam_g")))
    stats = solver.stats()
    return _Found(
        state=state,
        cost=float(result["f"]),
        success=bool(stats["success"]),
        status=str(stats["return_status"]),
        iterations=int(stats["iter_count"]),
        solve_time=solve_time,
    )


def _structure(problem: GaitProblem) -> GaitProblem:
    """The problem without what its program takes as parameters."""
    return replace(problem, speed=0.0, apex=1.0)


def _parameters(problem: GaitProblem) -> Array:
    """The parameters of the program."""
    return np.array([problem.speed, problem.apex])


def _program(problem: GaitProblem) -> Transcription:
    """The program of all problems of this structure."""
    return transcribe(_structure(problem))


@lru_cache(maxsize=8)
def _solver(structure: GaitProblem, *, warm: bool) -> ca.Function:
    """IPOPT on the exact derivatives of a transcription."""
    nlp = transcribe(structure).nlp
    if not warm:
        return ca.nlpsol("solver", "ipopt", nlp, _COLD)
    # The derivatives take ten times as long to write down as all the rest.
    cold = _solver(structure, warm=False)
    derivatives = {option: cold.get_function(name) for option, name in _DERIVATIVES.items()}
    return ca.nlpsol("solver", "ipopt", nlp, _WARM | derivatives)


def vertical_hop(problem: GaitProblem) -> dict[str, Array]:
    """A crude first guess: the trunk hops on parabolas, the legs keep the standing posture.

    Returns:
        The unknowns of the transcription, each (nodes, rows).
    """
    robot, model = problem.robot, fold(problem.robot, problem.contact)
    legs, standing = len(model.legs), robot.standing[NB + 1 :][model.joint_rows()]
    stance, flight = 0.5 * sum(problem.stance), problem.flight[0]
    rise = robot.gravity * flight**2 / 8
    dip = robot.gravity * flight * stance / 8  # as deep as the speed at take-off asks
    values, start = {}, 0.0
    for name, duration, n in zip(PHASES, (stance, flight), problem.intervals, strict=True):
        s = node_phases(n)
        height = rise if name == "flight" else -dip
        z = problem.apex - rise + height * 4 * s * (1 - s)
        x = start + problem.speed * duration * s
        q = np.column_stack([x, z, np.tile(standing, (len(s), 1))])
        v = np.gradient(q, s * duration, axis=0)
        values[f"{name}.q"], values[f"{name}.v"] = q, v
        values[f"{name}.a"] = np.gradient(v, s * duration, axis=0)
        values[f"{name}.tau"] = np.zeros((len(s), q.shape[1] - NB_FOLDED))
        values[f"{name}.duration"] = np.array([duration])
        start += problem.speed * duration
    push = robot.mass * robot.gravity * (stance + flight) / stance / len(robot.legs)
    values["stance.lam"] = np.tile([0.0, 0.0, push], (2 * problem.intervals[0] + 1, legs))
    values["impulse"] = np.zeros(3 * legs)
    return values


def _unfolded(model: FoldedModel, values: dict[str, Array], name: str) -> Motion:
    """The whole robot's motion at the nodes of a phase."""
    q, v, a, tau = (values[f"{name}.{key}"] for key in ("q", "v", "a", "tau"))
    n, robot = len(q), model.robot
    lam = values.get(f"{name}.lam", np.zeros((n, 3 * len(model.legs))))

    def rates(folded: Array) -> Array:
        whole = np.zeros((n, robot.nv))
        whole[:, [0, 2]] = folded[:, :NB_FOLDED]
        whole[:, robot.nv - robot.nu :] = model.unfold_joints(folded[:, NB_FOLDED:])
        return whole

    position = np.stack([q[:, 0], np.zeros(n), q[:, 1]], axis=-1)
    return Motion(
        t=float(values[f"{name}.duration"][0, 0]) * node_phases(n // 2),
        q=robot.q_from_base(position, model.unfold_joints(q[:, NB_FOLDED:])),
        v=rates(v),
        a=rates(a),
        tau=model.unfold_joints(tau),
        lam=model.unfold_forces(lam),
    )


def _gait(problem: GaitProblem, motions: Mapping[str, Motion]) -> Gait:
    """The Bezier form of all phases."""
    feet = {"stance": problem.robot.legs, "flight": ()}
    phases = [_fitted(name, feet[name], motions[name], ORDERS[name]) for name in PHASES]
    return Gait(problem.robot.name, problem.speed, problem.apex, tuple(phases))


def _fitted(name: str, feet: tuple[str, ...], motion: Motion, order: int) -> GaitPhase:
    """Bezier form of a phase; the motion's ends are met exactly, in value and rate."""
    duration = float(motion.t[-1])
    s, n = motion.t / duration, len(motion.t)
    base = np.column_stack([motion.q[:, 0], motion.q[:, 2], np.zeros(n)])
    base_rates = np.column_stack([motion.v[:, 0], motion.v[:, 2], np.zeros(n)])
    return GaitPhase(
        name=name,
        feet=feet,
        duration=duration,
        joints=bezier.fit(s, motion.q[:, 7:], order, rates=motion.v[:, 6:] * duration, pinned=2),
        base=bezier.fit(s, base, order, rates=base_rates * duration, pinned=2),
        tau=bezier.fit(s, motion.tau, order),
        lam=bezier.fit(s, motion.lam, order),
    )
