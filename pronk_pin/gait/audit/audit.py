"""Audit of gait solutions: each claim checked by other means than the solver's.

The named constraints are evaluated on the collocation's own expressions. Everything else is seen
with Pinocchio's model of the whole robot, which the optimisation never touched, and by solving once
more on a coarser mesh.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from ..._typing import Array
from ...dynamics import planar_rows
from ...errors import GaitNotFound
from ...kinematics import contact_jacobian, foot_positions, mirror
from ...robot import NB
from .. import bezier
from ..checks import Audit, Check
from ..gait import Motion
from ..optimisation import GaitSolution, fit_phase, optimize_gait, resampled
from ..problem import ContactPhase
from ..residual import missing_forces
from .reintegration import drift

ORDERS = range(4, 17)
"""Bezier orders that `bezier_orders` tries."""

_NO_LOAD = 1e-3
"""Force below which a foot counts as unloaded [N]; it uses nothing of its friction cone."""


def audit(solution: GaitSolution, *, refine: bool = True) -> Audit:
    """Check a solution; takes a second or two.

    Args:
        solution: The solution.
        refine: Find the order of convergence too, by solving on a mesh half as fine.
    """
    constraints = tuple(
        Check.of_constraint(name, worst.value, worst.where)
        for name, worst in solution.violations.items()
    )
    stance, flight = _drifts(solution)
    checks = (
        *_residual(solution),
        _symmetry(solution),
        _apex(solution),
        *_contact_drift(solution),
        Check.of("stance drift", stance.joints, stance.joints_where),
        Check.of("stance foot drift", stance.feet, stance.feet_where),
        Check.of("flight drift", flight.joints, flight.joints_where),
        Check.of("flight foot drift", flight.feet, flight.feet_where),
        *([_order(solution, stance.joints)] if refine else []),
        *_bezier(solution),
        *_use(solution),
    )
    return Audit(solution.problem.speed, solution.gait.sha256, constraints, checks)


class BezierLoss(NamedTuple):
    """Errors of Bezier polynomials of one order against the optimised motion of a phase."""

    order: int
    joints: float
    """Largest error of a joint [rad]."""
    feet: float
    """Largest error of a foot's height [m]."""


def bezier_orders(solution: GaitSolution) -> dict[str, tuple[BezierLoss, ...]]:
    """Errors of the Bezier form by order, for each phase; they justify the orders in use.

    The errors are those at the nodes of the mesh, midpoints included.
    """
    robot, losses_by_phase = solution.problem.robot, {}
    for phase, motion in _phases(solution):
        losses, feet = [], foot_positions(robot, motion.q)
        s = motion.t / motion.t[-1]
        for order in ORDERS:
            fitted = fit_phase(solution, dataclasses.replace(phase, order=order))
            q = fitted.motion(robot, s).q
            joints = float(np.max(np.abs(q - motion.q)[:, NB + 1 :]))
            height = foot_positions(robot, q)[..., 2] - feet[..., 2]
            losses.append(BezierLoss(order, joints, float(np.max(np.abs(height)))))
        losses_by_phase[phase.name] = tuple(losses)
    return losses_by_phase


def _phases(solution: GaitSolution) -> Iterator[tuple[ContactPhase, Motion]]:
    for phase in solution.problem.whole_sequence:
        yield phase, solution.motions[phase.name]


def _stances(solution: GaitSolution) -> Iterator[tuple[str, Motion, list[int]]]:
    """Name, motion and standing legs (by index) of the phases with feet on the ground."""
    legs = solution.problem.robot.legs
    for phase, motion in _phases(solution):
        if phase.stands:
            yield phase.name, motion, [legs.index(leg) for leg in solution.problem.feet(phase)]


def _worst(name: str, by_phase: Mapping[str, tuple[Motion, Array]]) -> Check:
    """The worst of values (nodes, ...) over the phases, with its place."""
    candidates = []
    for phase, (motion, values) in by_phase.items():
        by_node = np.abs(values).reshape(len(motion.t), -1).max(axis=1)
        k = int(np.argmax(by_node))
        candidates.append((float(by_node[k]), _place(phase, motion.t[k])))
    value, where = max(candidates)
    return Check.of(name, value, where)


def _place(phase: str, time: float) -> str:
    return f"{phase}, t = {time:.3f} s"


def _residual(solution: GaitSolution) -> tuple[Check, Check]:
    """Residual of eq. (2) of the whole robot: zero on the planar rows, which the planar constraint
    leaves free; on the others the constraint's forces.

    Nothing guides a free trunk: there the guide is what the robot lacks that is not quite the
    mirror image of itself, where half a stride is mirrored."""
    robot, contact = solution.problem.moved, solution.problem.contact
    rows, free, constraint = planar_rows(robot, solution.problem.base), {}, {}
    for name, motion in solution.motions.items():
        missing = missing_forces(robot, motion, contact)
        free[name] = (motion, missing[:, rows])
        constraint[name] = (motion, np.delete(missing, rows, axis=1))
    if solution.problem.base == "free":
        lacks = {
            name: (motion, missing_forces(solution.problem.robot, motion, contact))
            for name, motion in solution.motions.items()
        }
        return _worst("18-DoF residual", free), _worst("guide", lacks)
    return _worst("18-DoF residual", free), _worst("guide", constraint)


def _symmetry(solution: GaitSolution) -> Check:
    """Bilateral symmetry: distance of the right feet from the mirror image of the left ones [m].

    Of half a stride: distance of the feet where it ends from their mirror image where it begins,
    the way gone between. A stride that is neither is asked for none.
    """
    problem, robot = solution.problem, solution.problem.robot
    if problem.base == "free" and not problem.half_stride:
        return Check.of("mirror symmetry", 0.0, "not asked of this gait")
    if problem.half_stride:
        first, last = problem.sequence[0].name, problem.sequence[-1].name
        ends = [solution.motions[first].q[:1], solution.motions[last].q[-1:]]
        begun, ended = (foot_positions(robot, q)[0] for q in ends)
        image = begun[list(mirror(robot).partner)] * np.array([1.0, -1.0, 1.0])
        image[:, 0] += problem.speed * solution.gait.duration / 2.0
        return Check.of("mirror symmetry", float(np.max(np.abs(ended - image))), "half a stride")
    left, right = np.transpose(mirror(robot).pairs)
    by_phase = {}
    for name, motion in solution.motions.items():
        feet = foot_positions(robot, motion.q)  # (nodes, 4, 3)
        apart = feet[:, left] - feet[:, right] * np.array([1.0, -1.0, 1.0])
        by_phase[name] = (motion, apart)
    return _worst("mirror symmetry", by_phase)


def _apex(solution: GaitSolution) -> Check:
    """Error of the apex [m]: the trunk's greatest height in flight, between the nodes too, or, with
    several flights or none, its height in the middle of each or of the first phase."""
    topped, errors = [phase.name for phase in solution.problem.topped], []
    for phase in (phase for phase in solution.gait.phases if phase.name in topped):
        height = phase.base_reference(np.linspace(0.0, 1.0, 1001))[0][:, 1]
        single = len(topped) == 1 and solution.problem.base != "free"
        top = float(np.max(height) if single else height[len(height) // 2])
        errors.append((abs(top - solution.problem.apex), phase.name))
    return Check.of("apex error", *max(errors))


def _contact_drift(solution: GaitSolution) -> tuple[Check, Check]:
    """Height and slip of the standing feet, which are imposed at touchdown only."""
    robot, contact = solution.problem.robot, solution.problem.contact
    height, slip = {}, {}
    for name, motion, legs in _stances(solution):
        height[name] = (motion, foot_positions(robot, motion.q)[:, legs, 2] - robot.foot_radius)
        feet = [robot.legs[leg] for leg in legs]
        velocity = [
            contact_jacobian(robot, q, feet=feet, contact=contact) @ v
            for q, v in zip(motion.q, motion.v, strict=True)
        ]
        slip[name] = (motion, np.array(velocity))
    return _worst("contact height drift", height), _worst("contact slip", slip)


class _PhaseDrift(NamedTuple):
    """The worst drifts of some phases, and where."""

    joints: float
    joints_where: str
    feet: float
    feet_where: str


def _drifts(solution: GaitSolution) -> tuple[_PhaseDrift, _PhaseDrift]:
    """Stance and flight under the optimised torques, by an adaptive integrator."""
    problem = solution.problem
    drifts = {
        phase: drift(
            problem.moved,
            motion,
            contact=problem.contact,
            feet=problem.feet(phase),
            base=problem.base,
        )
        for phase, motion in _phases(solution)
    }

    def worst(standing: bool) -> _PhaseDrift:
        group = {phase.name: d for phase, d in drifts.items() if bool(phase.stands) == standing}
        if not group:
            return _PhaseDrift(0.0, "no flight", 0.0, "no flight")
        joints = max((d.joints.value, _place(name, d.joints.time)) for name, d in group.items())
        feet = max((d.feet.value, _place(name, d.feet.time)) for name, d in group.items())
        return _PhaseDrift(*joints, *feet)

    return worst(True), worst(False)


def _order(solution: GaitSolution, fine: float) -> Check:
    """Order of convergence: how the drift of the stances falls as the mesh gets finer.

    The coarser mesh has half the intervals, or two thirds where the solver finds no gait on half.
    """
    name, intervals = "convergence order", solution.problem.intervals
    for share in (1 / 2, 2 / 3):
        coarse = tuple(max(4, 2 * round(n * share / 2)) for n in intervals)
        ratio = sum(intervals) / sum(coarse)
        if ratio == 1.0:
            break
        try:
            coarse_solution = optimize_gait(
                solution.problem.remeshed(coarse),
                initial=resampled(solution, coarse),
                diagnose=False,
            )
        except GaitNotFound:
            continue
        order = float(np.log(_drifts(coarse_solution)[0].joints / fine) / np.log(ratio))
        return Check.of(name, order, f"stance drift, from {coarse} intervals to {intervals}")
    return Check.of(name, 0.0, "no gait on a coarser mesh to compare with")


def _bezier(solution: GaitSolution) -> tuple[Check, ...]:
    """Errors of the Bezier form against the optimised motion."""
    position, velocity, torque = {}, {}, {}
    for phase in solution.gait.phases:
        motion = solution.motions[phase.name]
        s = motion.t / phase.duration
        q, v = phase.joint_reference(s)
        position[phase.name] = (motion, q - motion.q[:, NB + 1 :])
        velocity[phase.name] = (motion, v - motion.v[:, NB:])
        torque[phase.name] = (motion, bezier.evaluate(phase.tau, s) - motion.tau)
    return (
        _worst("bezier position", position),
        _worst("bezier velocity", velocity),
        _worst("bezier torque", torque),
    )


def _use(solution: GaitSolution) -> tuple[Check, ...]:
    """Share of each limit that the gait uses, and the total ground force [N]."""
    robot, motions = solution.problem.robot, solution.motions
    cone, total = {}, {}
    for name, motion, legs in _stances(solution):
        lam = motion.lam[:, legs]
        tangential = np.linalg.norm(lam[..., :2], axis=-1)
        # A foot without load uses nothing.
        normal = np.maximum(lam[..., 2], _NO_LOAD)
        cone[name] = (motion, tangential / (solution.problem.friction * normal))
        total[name] = (motion, lam[..., 2].sum(axis=1))
    torque = {name: (m, m.tau / robot.tau_max) for name, m in motions.items()}
    velocity = {name: (m, m.v[:, NB:] / robot.v_max) for name, m in motions.items()}
    return (
        _worst("torque use", torque),
        _worst("velocity use", velocity),
        _worst("friction use", cone),
        _worst("ground force", total),
    )
