"""Gait optimisation: from a gait problem to its solution, by IPOPT."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from ..._checks import instance_of
from ..._typing import Array
from ..._workers import heeding_signals
from ...errors import GaitNotFound, InvalidInput
from ...kinematics import mirror
from ..checks import TOLERANCE
from ..gait import Gait, GaitPhase, Motion
from ..problem import ContactPhase, GaitProblem, mirrored_phase
from .ballistics import check_ballistics
from .collocation import node_phases, transcribe
from .elastic import find_conflicts, remedies
from .folded_model import FoldedModel
from .guess import vertical_hop
from .transcription import QUIET, Transcription, Violation
from .unfold import (
    advanced,
    fitted,
    fold_problem,
    mirror_image,
    mirror_phase,
    touchdown_impulse,
    unfolded,
)

_COLD = QUIET | {
    "ipopt.max_iter": 300,
    "ipopt.tol": 1e-8,
    "ipopt.constr_viol_tol": 1e-9,
    # Limits are limits: IPOPT would by default relax each by 1e-8 of its size.
    "ipopt.bound_relax_factor": 0.0,
    # The crude guess is far off: a monotone barrier takes twice the iterations.
    "ipopt.mu_strategy": "adaptive",
    "ipopt.adaptive_mu_globalization": "kkt-error",
    "ipopt.mu_init": 0.5,
}
_FREE = {"ipopt.mu_strategy": "monotone", "ipopt.mu_init": 0.1}
"""On a free trunk the monotone barrier takes half the iterations."""

_WARM = _COLD | {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.mu_init": 1e-6,
    "ipopt.warm_start_bound_push": 1e-8,
    "ipopt.warm_start_bound_frac": 1e-8,
    "ipopt.warm_start_slack_bound_push": 1e-8,
    "ipopt.warm_start_slack_bound_frac": 1e-8,
    "ipopt.warm_start_mult_bound_push": 1e-8,
}
_COARSE = 4
"""Mesh intervals of a phase where only the demands matter, not the accuracy."""

_DERIVATIVES = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
"""Option of CasADi's IPOPT that takes a derivative, and the function that is one."""


@dataclass(frozen=True, eq=False)
class SolverState:
    """Final iterate of the solver, for a warm start.

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
        impulses: Touchdown impulses of the feet in the world frame [N s], shape (4, 3), by the
            phase that they begin.
        cost: Value of eq. (6).
        violations: Worst violation of each named constraint.
        iterations: Iterations of the solver.
        solve_time: Time in the solver [s].
        state: Where the solver stopped.
    """

    problem: GaitProblem
    gait: Gait
    motions: Mapping[str, Motion] = field(repr=False)
    impulses: Mapping[str, Array] = field(repr=False)
    cost: float
    violations: Mapping[str, Violation] = field(repr=False)
    iterations: int
    solve_time: float
    state: SolverState = field(repr=False)

    @property
    def values(self) -> dict[str, Array]:
        """The unknowns of the transcription by name, each (nodes, rows)."""
        return _program(self.problem).unpack(self.state.x)

    @property
    def model(self) -> FoldedModel:
        """The folded model it was found with."""
        return fold_problem(self.problem)


def optimize_gait(
    problem: GaitProblem,
    *,
    initial: GaitSolution | SolverState | Mapping[str, Array] | None = None,
    diagnose: bool = True,
) -> GaitSolution:
    """Find the gait of least cost.

    Args:
        problem: What is asked.
        initial: A solution of a like problem (another speed or apex) to start from, or its
            solver's state, or a guess such as `vertical_hop` makes; without it the solver starts
            from that crude hop.
        diagnose: On failure, find out which demands fight; takes some seconds.

    Raises:
        GaitNotFound: The solver failed; the error names what fights and what to try.
        InvalidInput: `initial` was found on another mesh or for another contact sequence.
    """
    instance_of("problem", problem, GaitProblem, "a GaitProblem, as gait_problem() returns it")
    check_ballistics(problem)
    if isinstance(initial, GaitSolution):
        _check_alike(initial.problem, problem)
    run = _solve(problem, initial)
    program, p = _program(problem), _parameters(problem)
    violations = program.violations(run.state.x, p)
    worst = {name: violation.value for name, violation in violations.items()}
    if not run.success or max(worst.values()) > TOLERANCE:
        conflicts = _find_conflicts(problem) if diagnose else None
        raise GaitNotFound(problem.speed, run.status, worst, conflicts, remedies(conflicts))
    return _solution(problem, run.state, run)


def _solution(problem: GaitProblem, state: SolverState, run: _Found) -> GaitSolution:
    program = _program(problem)
    values = program.unpack(state.x)
    motions = {phase.name: unfolded(problem, values, phase) for phase in problem.sequence}
    impulses = {
        phase.name: touchdown_impulse(problem, index, motions, values)
        for index, phase in enumerate(problem.sequence)
        if problem.impacts(index)
    }
    phases = [fitted(problem, phase, motions[phase.name], values) for phase in problem.sequence]
    if problem.half_stride:
        half = problem.speed * sum(phase.duration for phase in phases)
        for phase in problem.sequence:
            image = mirrored_phase(phase).name
            motions[image] = advanced(mirror_image(problem, motions[phase.name]), half)
        for index, phase in enumerate(problem.sequence):
            if problem.impacts(index):
                image = mirrored_phase(phase).name
                partner = list(mirror(problem.robot).partner)
                impulses[image] = impulses[phase.name][partner] * np.array([1.0, -1.0, 1.0])
        images = problem.whole_sequence[len(phases) :]
        phases += [
            mirror_phase(problem, own, image, half)
            for own, image in zip(phases, images, strict=True)
        ]
    return GaitSolution(
        problem=problem,
        gait=Gait(problem.robot.name, problem.speed, problem.apex, tuple(phases)),
        motions=motions,
        impulses=impulses,
        cost=run.cost,
        violations=program.violations(state.x, _parameters(problem)),
        iterations=run.iterations,
        solve_time=run.solve_time,
        state=state,
    )


def fit_phase(solution: GaitSolution, phase: ContactPhase) -> GaitPhase:
    """The Bezier form of a phase of a solution, with the order that `phase` asks for."""
    problem, values = solution.problem, solution.values
    names = [own.name for own in problem.sequence]
    if phase.name in names:
        return fitted(problem, phase, solution.motions[phase.name], values)
    own = mirrored_phase(phase)
    fit = fitted(problem, own, solution.motions[own.name], values)
    half = problem.speed * solution.gait.duration / 2.0
    return mirror_phase(problem, fit, phase, half)


def resampled(solution: GaitSolution, intervals: Sequence[int]) -> SolverState:
    """Interpolate a solution to another mesh, for a warm start there.

    The unknowns and their bounds' multipliers are interpolated, the constraints' are zero.
    """
    problem, before = solution.problem, _program(solution.problem)
    program = _program(problem.remeshed(intervals))

    def moved(vector: Array) -> Array:
        values = before.unpack(vector)
        for phase, n in zip(problem.sequence, intervals, strict=True):
            old, new = node_phases(phase.intervals), node_phases(n)
            for key in ("q", "v", "a", "tau", "lam"):
                name = f"{phase.name}.{key}"
                if name in values:
                    values[name] = np.asarray(CubicSpline(old, values[name])(new))
        return program.pack(values)

    return SolverState(moved(solution.state.x), moved(solution.state.lam_x), np.zeros(program.size))


def _check_alike(initial: GaitProblem, problem: GaitProblem) -> None:
    if initial.intervals != problem.intervals:
        raise InvalidInput(
            f"the initial solution has {initial.intervals} mesh intervals, the problem "
            f"{problem.intervals}; give both the same"
        )
    phases = [[(p.name, p.stands) for p in each.sequence] for each in (initial, problem)]
    if phases[0] != phases[1] or initial.base != problem.base:
        raise InvalidInput(
            "the initial solution has another contact sequence or base mode than the problem; "
            "give both the same"
        )


def _find_conflicts(problem: GaitProblem) -> dict[str, float] | None:
    """Find the conflicting demands, on a coarse mesh, which is enough to tell."""
    coarse = problem.remeshed([_COARSE] * len(problem.sequence))
    program = _program(coarse)
    return find_conflicts(program, program.pack(vertical_hop(coarse)), _parameters(problem))


class _Found(NamedTuple):
    """Result of one run of the solver."""

    state: SolverState
    cost: float
    success: bool
    status: str
    iterations: int
    solve_time: float


def _solve(
    problem: GaitProblem, initial: GaitSolution | SolverState | Mapping[str, Array] | None
) -> _Found:
    program = _program(problem)
    state = initial.state if isinstance(initial, GaitSolution) else initial
    warm = isinstance(state, SolverState)
    if isinstance(state, SolverState):
        start = state.as_start()
        if len(state.x) != len(program.bounds["lbx"]) or len(state.lam_g) != program.size:
            raise InvalidInput(
                "the solver's state belongs to another kind of gait problem; take the state of a "
                "solution with the same sequence, base and mesh"
            )
    else:
        guess = vertical_hop(problem) if state is None else state
        start = {"x0": program.pack(guess)}
    solver = _solver(_structure(problem), warm=warm)
    clock = time.perf_counter()
    with heeding_signals():
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
    options = _COLD | (_FREE if structure.base == "free" else {})
    if not warm:
        return ca.nlpsol("solver", "ipopt", nlp, options)
    # The derivatives take ten times as long to write down as all the rest.
    cold = _solver(structure, warm=False)
    derivatives = {option: cold.get_function(name) for option, name in _DERIVATIVES.items()}
    return ca.nlpsol("solver", "ipopt", nlp, _WARM | derivatives)
