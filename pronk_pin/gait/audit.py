"""Is a gait right? Each claim about a solution, checked by other means than the solver's.

The named constraints are evaluated on the collocation's own expressions. Everything else is seen
with Pinocchio's model of the whole robot, which the optimisation never touched.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from .._typing import Array
from ..dynamics import contact_jacobian
from ..kinematics import foot_positions
from ..robot import NB, Robot
from . import bezier
from .collocation import UNITS
from .gait import Motion
from .optimize import TOLERANCE, GaitSolution
from .reintegration import drift, guided_rows

CHECKS: Mapping[str, tuple[str, float | None]] = {
    "18-DoF residual": ("N or N m", 1e-8),
    "mirror symmetry": ("m", 1e-12),
    "apex error": ("m", 1e-4),
    "contact height drift": ("m", 2e-6),
    "contact slip": ("m/s", 1e-4),
    "stance drift": ("rad", 2e-5),
    "stance foot drift": ("m", 2e-6),
    "flight drift": ("rad", 1e-3),
    "flight foot drift": ("m", 1e-4),
    "bezier position": ("rad", 1e-3),
    "bezier velocity": ("rad/s", None),
    "bezier torque": ("N m", None),
    "torque use": ("of limit", 1.0),
    "velocity use": ("of limit", 1.0),
    "friction use": ("of limit", 1.0),
    "ground force": ("N", None),
}
"""Unit of each independent check, and the largest value that passes (None: it only informs)."""

_VIOLATION = "violation: "


@dataclass(frozen=True)
class Check:
    """One checked claim.

    Attributes:
        name: What was checked.
        value: The worst value found.
        unit: Its unit.
        where: Where it was found.
        limit: What passes; None where the value only informs.
    """

    name: str
    value: float
    unit: str
    where: str = ""
    limit: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        return self.limit is None or self.value <= self.limit


@dataclass(frozen=True)
class Audit:
    """What was found about one gait.

    Attributes:
        speed: Speed of the gait [m/s].
        constraints: The named constraints of the problem with their worst violations.
        checks: The independent checks.
    """

    speed: float
    constraints: tuple[Check, ...]
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether everything is within its limit."""
        return not self.failures

    @property
    def worst_violation(self) -> Check:
        """The constraint that is violated most."""
        return max(self.constraints, key=lambda check: check.value)

    @property
    def failures(self) -> tuple[Check, ...]:
        """What is not within its limit."""
        return tuple(check for check in (*self.constraints, *self.checks) if not check.passed)

    def flat(self) -> dict[str, float]:
        """Values by name, as a gait library keeps them; constraints as "violation: name"."""
        entries = {_VIOLATION + check.name: check.value for check in self.constraints}
        return entries | {check.name: check.value for check in self.checks}

    @classmethod
    def from_flat(cls, speed: float, entries: Mapping[str, float]) -> Audit:
        """The audit that a gait library keeps; where a value was found is lost."""
        names = [name.removeprefix(_VIOLATION) for name in entries if name.startswith(_VIOLATION)]
        constraints = (_constraint(name, entries[_VIOLATION + name]) for name in names)
        checks = (_check(name, entries[name]) for name in CHECKS if name in entries)
        return cls(speed, tuple(constraints), tuple(checks))

    def table(self) -> str:
        """Everything that was found, one line a check."""
        lines = [f"{'check':<24}{'worst':>10}  {'unit':<12}{'limit':>8}  where"]
        for check in (*self.constraints, *self.checks):
            limit = "" if check.limit is None else f"{check.limit:.0e}"
            note = check.where if check.passed else f"{check.where}  FAILED"
            lines.append(
                f"{check.name:<24}{check.value:>10.1e}  {check.unit:<12}{limit:>8}  {note}".rstrip()
            )
        return "\n".join(lines)


def audit(solution: GaitSolution) -> Audit:
    """Check a solution; takes about a second."""
    constraints = tuple(
        _constraint(name, worst.value, worst.where) for name, worst in solution.violations.items()
    )
    checks = (
        _residual(solution),
        _symmetry(solution),
        _apex(solution),
        *_contact_drift(solution),
        *_reintegration(solution),
        *_bezier(solution),
        *_use(solution),
    )
    return Audit(solution.problem.speed, constraints, checks)


def _constraint(name: str, value: float, where: str = "") -> Check:
    return Check(name, value, UNITS[name], where, TOLERANCE)


def _check(name: str, value: float, where: str = "") -> Check:
    unit, limit = CHECKS[name]
    return Check(name, value, unit, where, limit)


def _worst(name: str, by_phase: Mapping[str, tuple[Motion, Array]]) -> Check:
    """The worst of values (nodes, ...) over the phases, with its place."""
    found = []
    for phase, (motion, values) in by_phase.items():
        by_node = np.abs(values).reshape(len(motion.t), -1).max(axis=1)
        k = int(np.argmax(by_node))
        found.append((float(by_node[k]), f"{phase}, t = {motion.t[k]:.3f} s"))
    value, where = max(found)
    return _check(name, value, where)


def _residual(solution: GaitSolution) -> Check:
    """Equations of motion (2) of the whole robot in the rows that the guide leaves free."""
    robot, contact = solution.problem.robot, solution.problem.contact
    rows, by_phase = guided_rows(robot), {}
    for name, motion in solution.motions.items():
        residuals = []
        for q, v, a, tau, lam in zip(
            motion.q, motion.v, motion.a, motion.tau, motion.lam, strict=True
        ):
            force = pin.rnea(robot.model, robot.data, q, v, a).copy()
            force -= contact_jacobian(robot, q, contact=contact).T @ lam.ravel()
            force[NB:] -= tau
            residuals.append(force[rows])
        by_phase[name] = (motion, np.array(residuals))
    return _worst("18-DoF residual", by_phase)


def _symmetry(solution: GaitSolution) -> Check:
    """Bilateral symmetry, seen where it matters: the feet stand mirrored in the world."""
    robot = solution.problem.robot
    left = [i for i, leg in enumerate(robot.legs) if leg.endswith("L")]
    right = [i for i, leg in enumerate(robot.legs) if leg.endswith("R")]
    by_phase = {}
    for name, motion in solution.motions.items():
        feet = _feet(robot, motion)  # (nodes, 4, 3)
        mirror = feet[:, left] - feet[:, right] * np.array([1.0, -1.0, 1.0])
        by_phase[name] = (motion, mirror)
    return _worst("mirror symmetry", by_phase)


def _apex(solution: GaitSolution) -> Check:
    """The trunk's greatest height between the nodes, too."""
    base, _ = solution.gait.flight.base_reference(np.linspace(0.0, 1.0, 1001))
    error = abs(float(np.max(base[:, 1])) - solution.problem.apex)
    return _check("apex error", error, "flight")


def _contact_drift(solution: GaitSolution) -> tuple[Check, Check]:
    """Height and slip of the standing feet, which are imposed at touchdown only."""
    robot, motion = solution.problem.robot, solution.motions["stance"]
    height = _feet(robot, motion)[..., 2] - robot.foot_radius
    slip = [
        contact_jacobian(robot, q, contact=solution.problem.contact) @ v
        for q, v in zip(motion.q, motion.v, strict=True)
    ]
    return (
        _worst("contact height drift", {"stance": (motion, height)}),
        _worst("contact slip", {"stance": (motion, np.array(slip))}),
    )


def _reintegration(solution: GaitSolution) -> tuple[Check, ...]:
    """Stance and flight under the optimised torques, by an adaptive integrator."""
    robot, contact = solution.problem.robot, solution.problem.contact
    stance = drift(robot, solution.motions["stance"], contact=contact)
    flight = drift(robot, solution.motions["flight"], contact=None)
    return (
        _check("stance drift", stance.joints, "stance"),
        _check("stance foot drift", stance.feet, "stance"),
        _check("flight drift", flight.joints, "flight"),
        _check("flight foot drift", flight.feet, "flight"),
    )


def _bezier(solution: GaitSolution) -> tuple[Check, ...]:
    """What the Bezier form loses against the optimised motion."""
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
    """How much of each limit the gait uses, and the forces and torques themselves."""
    robot, motions = solution.problem.robot, solution.motions
    stance = motions["stance"]
    tangential = np.linalg.norm(stance.lam[..., :2], axis=-1)
    # A foot without load uses nothing.
    normal = np.maximum(stance.lam[..., 2], np.finfo(float).tiny)
    cone = tangential / (solution.problem.friction * normal)
    torque = {name: (m, m.tau / robot.tau_max) for name, m in motions.items()}
    velocity = {name: (m, m.v[:, NB:] / robot.v_max) for name, m in motions.items()}
    total = stance.lam[..., 2].sum(axis=1)
    return (
        _worst("torque use", torque),
        _worst("velocity use", velocity),
        _worst("friction use", {"stance": (stance, cone)}),
        _worst("ground force", {"stance": (stance, total)}),
    )


def _feet(robot: Robot, motion: Motion) -> Array:
    """Centres of the feet at the nodes [m], shape (nodes, 4, 3)."""
    return np.array([foot_positions(robot, q) for q in motion.q])
