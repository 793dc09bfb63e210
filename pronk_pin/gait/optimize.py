"""From a gait problem to its solution."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from .._typing import Array
from ..dynamics import contact_jacobian
from ..errors import GaitNotFound, InvalidInput
from ..robot import NB
from . import bezier
from .checks import TOLERANCE, Audit
from .collocation import node_phases, transcribe
from .elastic import fights, remedies
from .folded_model import FoldedModel, fold
from .gait import Gait, GaitPhase, Motion, planar_state
from .problem import PAIRS, ContactPhase, GaitProblem
from .transcription import Transcription, Violation

_COLD: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
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

    def audit(self, *, refine: bool = True) -> Audit:
        """Check the solution by other means than the solver's; takes a second or two.

        Args:
            refine: Find the order of convergence too, by solving on a mesh half as fine.
        """
        from .audit import audit  # which solves problems, and so builds on this module

        return audit(self, refine=refine)

    @property
    def model(self) -> FoldedModel:
        """The folded model it was found with."""
        return _model(self.problem)


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
    if isinstance(initial, GaitSolution):
        _check_alike(initial.problem, problem)
    found = _solve(problem, initial)
    program, p = _program(problem), _parameters(problem)
    violations = program.violations(found.state.x, p)
    worst = {name: violation.value for name, violation in violations.items()}
    if not found.success or max(worst.values()) > TOLERANCE:
        gives = _fights(problem) if diagnose else {}
        raise GaitNotFound(problem.speed, found.status, worst, gives, remedies(gives))
    return _solution(problem, found.state, found)


def _solution(problem: GaitProblem, state: SolverState, found: _Found) -> GaitSolution:
    program, model = _program(problem), _model(problem)
    values = program.unpack(state.x)
    motions = {phase.name: _unfolded(model, values, phase) for phase in problem.sequence}
    impulses = {
        phase.name: _impulse(problem, index, motions, values)
        for index, phase in enumerate(problem.sequence)
        if problem.landing(index)
    }
    phases = [_fitted(problem, phase, motions[phase.name], values) for phase in problem.sequence]
    return GaitSolution(
        problem=problem,
        gait=Gait(problem.robot.name, problem.speed, problem.apex, tuple(phases)),
        motions=motions,
        impulses=impulses,
        cost=found.cost,
        violations=program.violations(state.x, _parameters(problem)),
        iterations=found.iterations,
        solve_time=found.solve_time,
        state=state,
    )


def fit_phase(solution: GaitSolution, phase: ContactPhase) -> GaitPhase:
    """The Bezier form of a phase of a solution, with the order that `phase` asks for."""
    return _fitted(solution.problem, phase, solution.motions[phase.name], solution.values)


def resampled(solution: GaitSolution, intervals: Sequence[int]) -> SolverState:
    """A solution on another mesh, for a warm start there: the unknowns and their bounds'
    multipliers interpolated, the constraints' multipliers left to the solver."""
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


def _fights(problem: GaitProblem) -> dict[str, float]:
    """Which demands have to give way; a coarse mesh is enough to tell."""
    coarse = problem.remeshed([_COARSE] * len(problem.sequence))
    program = _program(coarse)
    return fights(program, program.pack(vertical_hop(coarse)), _parameters(problem))


class _Found(NamedTuple):
    """What the solver came back with."""

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
            raise InvalidInput("the solver's state belongs to another kind of gait problem")
    else:
        guess = vertical_hop(problem) if state is None else state
        start = {"x0": program.pack(guess)}
    solver = _solver(_structure(problem), warm=warm)
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


def _model(problem: GaitProblem) -> FoldedModel:
    return fold(problem.robot, problem.contact, problem.base)


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
    robot, model = problem.robot, _model(problem)
    standing = robot.standing[NB + 1 :][model.joint_rows()]
    durations = [
        phase.duration[0] if not phase.stands else 0.5 * sum(phase.duration)
        for phase in problem.sequence
    ]
    flights = [t for phase, t in zip(problem.sequence, durations, strict=True) if not phase.stands]
    flight = float(np.mean(flights))
    rise = robot.gravity * flight**2 / 8
    load = sum(2 * len(p.stands) * t for p, t in zip(problem.sequence, durations, strict=True))
    push = robot.mass * robot.gravity * sum(durations) / load
    values, start = {}, 0.0
    for index, (phase, duration) in enumerate(zip(problem.sequence, durations, strict=True)):
        name, s = phase.name, node_phases(phase.intervals)
        dip = robot.gravity * flight * duration / 8  # as deep as the speed at take-off asks
        height = -dip if phase.stands else rise
        z = problem.apex - rise + height * 4 * s * (1 - s)
        x = start + problem.speed * duration * s
        pitch = np.zeros((len(s), model.nb - 2))
        q = np.column_stack([x, z, pitch, np.tile(standing, (len(s), 1))])
        v = np.gradient(q, s * duration, axis=0)
        values[f"{name}.q"], values[f"{name}.v"] = q, v
        values[f"{name}.a"] = np.gradient(v, s * duration, axis=0)
        values[f"{name}.tau"] = np.zeros((len(s), model.nl))
        values[f"{name}.duration"] = np.array([duration])
        if phase.stands:
            values[f"{name}.lam"] = np.tile([0.0, 0.0, push], (len(s), len(phase.stands)))
        if problem.landing(index):
            values[f"{name}.impulse"] = np.zeros(3 * len(phase.stands))
        start += problem.speed * duration
    return values


def _unfolded(model: FoldedModel, values: dict[str, Array], phase: ContactPhase) -> Motion:
    """The whole robot's motion at the nodes of a phase."""
    name, robot = phase.name, model.robot
    curves = []
    for key in "qva":
        folded = values[f"{name}.{key}"]
        base = np.zeros((len(folded), 3))
        base[:, : model.nb] = folded[:, : model.nb]
        curves.append((base, model.unfold_joints(folded[:, model.nb :])))
    q, v, a = planar_state(robot, *curves)
    lam = values.get(f"{name}.lam", np.zeros((len(q), 0)))
    kept = [values[f"{name}.{key}"].T for key in "qva"]
    apart = np.array(model.asymmetry.map(len(q))(*kept)).T  # (n, 6)
    return Motion(
        t=float(values[f"{name}.duration"][0, 0]) * node_phases(phase.intervals),
        q=q,
        v=v,
        a=a,
        tau=model.unfold_torques(values[f"{name}.tau"], apart),
        lam=_forces(model, phase, lam),
    )


def _impulse(
    problem: GaitProblem, index: int, motions: Mapping[str, Motion], values: dict[str, Array]
) -> Array:
    """Touchdown impulses on all feet at the beginning of a phase [N s], shape (4, 3).

    The motors give none, so that the feet of unlike legs bear unlike impulses.
    """
    robot, model, phase = problem.robot, _model(problem), problem.sequence[index]
    q, v = (values[f"{phase.name}.{key}"][0] for key in "qv")
    jump = np.array(model.jump_asymmetry(q, v - values[f"{problem.before(index).name}.v"][-1]))
    impulse: Array = _forces(model, phase, values[f"{phase.name}.impulse"])[0]
    apart = model.unfold_torques(np.zeros(model.nl), jump.ravel())
    for leg in problem.feet(phase):
        i = robot.legs.index(leg)
        joints = slice(3 * i, 3 * i + 3)
        whole = motions[phase.name].q[0]
        jacobian = contact_jacobian(robot, whole, feet=[leg], contact=problem.contact)
        impulse[i] += np.linalg.solve(jacobian[:, NB:][:, joints].T, apart[joints])
    return impulse


def _forces(model: FoldedModel, phase: ContactPhase, standing: Array) -> Array:
    """Forces on all feet (n, 4, 3) from those of the standing, kept ones (n, 3 feet)."""
    folded = np.zeros((len(standing), len(model.legs), 3))
    legs = [PAIRS.index(pair) for pair in phase.stands]
    folded[:, legs] = standing.reshape(len(standing), len(legs), 3)
    return model.unfold_forces(folded.reshape(len(standing), -1))


def _fitted(
    problem: GaitProblem, phase: ContactPhase, motion: Motion, values: Mapping[str, Array]
) -> GaitPhase:
    """Bezier form of a phase; the motion's ends are met exactly, in value and rate."""
    duration, order, nb = float(motion.t[-1]), phase.order, _model(problem).nb
    s = motion.t / duration
    base, rates = np.zeros((2, len(s), 3))
    base[:, :nb] = values[f"{phase.name}.q"][:, :nb]
    rates[:, :nb] = values[f"{phase.name}.v"][:, :nb]
    joints, joint_rates = motion.q[:, NB + 1 :], motion.v[:, NB:]
    return GaitPhase(
        name=phase.name,
        feet=problem.feet(phase),
        duration=duration,
        joints=bezier.fit(s, joints, order, rates=joint_rates * duration, pinned=2),
        base=bezier.fit(s, base, order, rates=rates * duration, pinned=2),
        tau=bezier.fit(s, motion.tau, order),
        lam=bezier.fit(s, motion.lam, order),
    )
