"""The gait problem as a nonlinear program: separated Hermite-Simpson collocation.

Positions, velocities, accelerations, torques and contact forces are unknowns at every node, the
midpoints of the mesh intervals included; so are the durations of the phases and the touchdown
impulse. Every constraint of section II.B of the paper stands here under its name; bilateral
symmetry is in the folded model.

In stance the feet's height is imposed at touchdown, their velocity by the impact, and their
acceleration at every node: then the equations are independent, and nothing is asked twice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from .._typing import Array
from ..robot import JOINTS
from .folded_model import FoldedModel, fold
from .newton_euler import NB_FOLDED
from .problem import GaitProblem
from .transcription import Constraint, Transcription, Unknown

PHASES = ("stance", "flight")
"""The phases of pronking; touchdown leads from the last one to the first."""

UNITS = {
    "average speed": "m",
    "apex height": "m",
    "dynamics": "N or N m",
    "collocation": "m or rad",
    "contact height": "m",
    "contact acceleration": "m/s^2",
    "touchdown impact": "N s",
    "touchdown contact": "m/s",
    "foot clearance": "m",
    "lift-off continuity": "m or rad",
    "periodicity": "m or rad",
    "stride duration": "s",
    "phase durations": "s",
    "configuration limits": "rad",
    "hip limit": "rad",
    "trunk height": "m",
    "velocity limits": "rad/s",
    "torque limits": "N m",
    "unilateral contact": "N",
    "friction cone": "N",
    "impulse cone": "N s",
}
"""Units of the constraints; where a constraint holds positions and velocities, the former's."""

_TIP = 1e-6
"""Rounding of the friction cone's tip [N], which keeps its derivative finite."""


@dataclass(frozen=True, eq=False)
class _Phase:
    """The unknowns of a phase, one column a node; midpoints are the odd columns."""

    name: str
    q: ca.SX
    v: ca.SX
    a: ca.SX
    tau: ca.SX
    lam: ca.SX
    duration: ca.SX

    @property
    def s(self) -> Array:
        """Phases of the nodes."""
        return node_phases(self.q.shape[1] // 2)


def node_phases(intervals: int) -> Array:
    """Phases of the nodes, midpoints included, shape (2 intervals + 1,).

    The intervals end at Chebyshev's points, close together at both ends of a phase: the legs'
    acceleration lies in the last hundredths of a second before touchdown.
    """
    ends = (1.0 - np.cos(np.linspace(0.0, np.pi, intervals + 1))) / 2.0
    nodes = np.empty(2 * intervals + 1)
    nodes[::2], nodes[1::2] = ends, (ends[1:] + ends[:-1]) / 2.0
    return nodes


@lru_cache(maxsize=8)
def transcribe(problem: GaitProblem) -> Transcription:
    """Write a gait problem as a nonlinear program with the parameters [speed, apex]."""
    model = fold(problem.robot, problem.contact)
    unknowns = _unknowns(problem, model)
    stance, flight = (_phase(unknowns, name) for name in PHASES)
    impulse = unknowns["impulse"].symbol
    speed, apex = ca.SX.sym("speed"), ca.SX.sym("apex")
    constraints = (
        *_motion(model, stance),
        *_motion(model, flight),
        *_standing(problem, model, stance),
        *_flying(problem, model, flight, apex),
        *_stride(problem, stance, flight, speed),
        *_touchdown(problem, model, stance, flight, impulse),
    )
    cost = _cost(problem, stance) + _cost(problem, flight)
    return Transcription.of(unknowns, ca.vertcat(speed, apex), cost, constraints)


def _unknowns(problem: GaitProblem, model: FoldedModel) -> dict[str, Unknown]:
    """All unknowns with their bounds."""
    joints, kept, free = model.joint_rows(), problem.robot, np.inf
    hip = np.tile([joint == "hip" for joint in JOINTS], len(model.legs))
    low, high = kept.q_min[joints], kept.q_max[joints]
    low = np.where(hip, np.maximum(low, -problem.hip_limit), low)
    high = np.where(hip, np.minimum(high, problem.hip_limit), high)
    v_max = np.array([*[free] * NB_FOLDED, *kept.v_max[joints]])
    tau_max = kept.tau_max[joints]
    ground = np.tile([-free, -free, 0.0], len(model.legs))
    unilateral = ("", "", "unilateral contact") * len(model.legs)

    q_limits = ("", "trunk height", *np.where(hip, "hip limit", "configuration limits"))
    q_low, q_high = np.array([-free, problem.trunk_height, *low]), np.array([free, free, *high])
    v_limits = ("",) * NB_FOLDED + ("velocity limits",) * model.nl
    unbounded = np.full(model.nq, free)
    blocks = {
        "q": (q_low, q_high, q_limits),
        "v": (-v_max, v_max, v_limits),
        "a": (-unbounded, unbounded, ("",) * model.nq),
        "tau": (-tau_max, tau_max, ("torque limits",) * model.nl),
        "lam": (ground, np.full(len(ground), free), unilateral),
    }
    unknowns = {}
    for name, intervals in zip(PHASES, problem.intervals, strict=True):
        nodes = 2 * intervals + 1
        for key, (lower, upper, limits) in blocks.items():
            if name == "stance" or key != "lam":
                symbol = ca.SX.sym(f"{name}_{key}", len(lower), nodes)
                unknowns[f"{name}.{key}"] = Unknown(name, symbol, lower, upper, limits)
        shortest, longest = np.array(getattr(problem, name))[:, None]
        symbol = ca.SX.sym(f"{name}_duration")
        unknowns[f"{name}.duration"] = Unknown(
            name, symbol, shortest, longest, ("phase durations",)
        )
    symbol = ca.SX.sym("impulse", len(ground))
    unknowns["impulse"] = Unknown("touchdown", symbol, *blocks["lam"])
    return unknowns


def _phase(unknowns: Mapping[str, Unknown], name: str) -> _Phase:
    symbols = {key: unknowns[f"{name}.{key}"].symbol for key in ("q", "v", "a", "tau", "duration")}
    if name == "stance":
        lam = unknowns["stance.lam"].symbol
    else:
        lam = ca.SX(unknowns["stance.lam"].symbol.shape[0], symbols["q"].shape[1])
    return _Phase(name=name, lam=lam, **symbols)


def _motion(model: FoldedModel, phase: _Phase) -> list[Constraint]:
    """Equations of motion (2) at every node, and Hermite-Simpson between them."""
    constraints = []
    for k in range(len(phase.s)):
        forces = model.dynamics(phase.q[:, k], phase.v[:, k], phase.a[:, k], phase.lam[:, k])
        motors = ca.vertcat(ca.SX(NB_FOLDED, 1), phase.tau[:, k])
        constraints.append(Constraint("dynamics", f"{phase.name}, node {k}", forces - motors))
    for k, length in enumerate(np.diff(phase.s[::2])):
        h, where = phase.duration * length, f"{phase.name}, interval {k}"
        a, m, b = 2 * k, 2 * k + 1, 2 * k + 2
        for x, rate in ((phase.q, phase.v), (phase.v, phase.a)):
            middle = (x[:, a] + x[:, b]) / 2 + h / 8 * (rate[:, a] - rate[:, b])
            end = x[:, a] + h / 6 * (rate[:, a] + 4 * rate[:, m] + rate[:, b])
            constraints.append(Constraint("collocation", where, x[:, m] - middle))
            constraints.append(Constraint("collocation", where, x[:, b] - end))
    return constraints


def _standing(problem: GaitProblem, model: FoldedModel, stance: _Phase) -> list[Constraint]:
    """Holonomic constraints (3) of the standing feet, and the friction cone."""
    height = model.feet(stance.q[:, 0], stance.v[:, 0], stance.a[:, 0])[0][2, :]
    touchdown = height - problem.robot.foot_radius
    constraints = [Constraint("contact height", "stance, node 0", touchdown)]
    for k in range(len(stance.s)):
        where = f"stance, node {k}"
        acceleration = model.feet(stance.q[:, k], stance.v[:, k], stance.a[:, k])[2]
        constraints.append(Constraint("contact acceleration", where, acceleration))
        cone = _cone(stance.lam[:, k], problem.friction)
        constraints.append(Constraint("friction cone", where, cone, upper=np.inf))
    return constraints


def _flying(
    problem: GaitProblem, model: FoldedModel, flight: _Phase, apex: ca.SX
) -> list[Constraint]:
    """Apex of the trunk, and clearance of the feet (unilateral constraints in flight)."""
    constraints = []
    for k, s in enumerate(flight.s[1:-1], start=1):
        # Flat at both ends: a parabola would fight the feet's zero velocity at lift-off.
        profile = problem.clearance * 16 * s**2 * (1 - s) ** 2
        height = model.feet(flight.q[:, k], flight.v[:, k], flight.a[:, k])[0][2, :]
        clear = height - problem.robot.foot_radius - profile
        constraints.append(Constraint("foot clearance", f"flight, node {k}", clear, upper=np.inf))
    top = _apex(flight.s, flight.q[1, :])
    constraints.append(Constraint("apex height", "flight", top - apex))
    return constraints


def _apex(s: Array, z: ca.SX) -> ca.SX:
    """Top of the trunk's path from its heights alone, around the middle of flight.

    A parabola's vertex gives the phase, a quartic the height there. Heights alone, because a
    condition on the velocity or the acceleration of one node makes the legs kink at it.
    """
    middle, apart = len(s) // 2, len(s) // 8
    nodes = [middle + i * apart for i in range(-2, 3)]
    s, h = s[nodes], [z[node] for node in nodes]
    vertex = s[2] + (s[3] - s[2]) * (h[1] - h[3]) / (2 * (h[1] - 2 * h[2] + h[3]))
    top = ca.SX(0)
    for i in range(5):
        top += h[i] * math.prod((vertex - s[j]) / (s[i] - s[j]) for j in range(5) if j != i)
    return top


def _stride(problem: GaitProblem, stance: _Phase, flight: _Phase, speed: ca.SX) -> list[Constraint]:
    """What holds the phases together: continuity, periodicity, speed."""
    total = stance.duration + flight.duration
    first, last = stance.q[:, 0], flight.q[:, -1]
    off, on = "lift-off", "touchdown"
    return [
        Constraint("stride duration", "stride", total, *problem.stride),
        Constraint("lift-off continuity", off, flight.q[:, 0] - stance.q[:, -1]),
        Constraint("lift-off continuity", off, flight.v[:, 0] - stance.v[:, -1]),
        Constraint("periodicity", on, last[1:] - first[1:]),
        Constraint("periodicity", on, first[0]),  # x may begin anywhere; here it begins at 0
        Constraint("average speed", "stride", last[0] - first[0] - speed * total),
    ]


def _touchdown(
    problem: GaitProblem, model: FoldedModel, stance: _Phase, flight: _Phase, impulse: ca.SX
) -> list[Constraint]:
    """Plastic impact: the impulses stop the feet, and lie in the friction cone."""
    q, v = stance.q[:, 0], stance.v[:, 0]
    residual = model.impact(q, v - flight.v[:, -1], impulse)
    velocity = model.feet(q, v, stance.a[:, 0])[1]
    cone = _cone(impulse, problem.friction)
    return [
        Constraint("touchdown impact", "touchdown", residual),
        Constraint("touchdown contact", "touchdown", velocity),
        Constraint("impulse cone", "touchdown", cone, upper=np.inf),
    ]


def _cone(forces: ca.SX, friction: float) -> ca.SX:
    """Friction cone of each foot, mu f_n - |f_t|: not negative where the foot holds."""
    f = ca.reshape(forces, 3, -1)
    return friction * f[2, :] - ca.sqrt(f[0, :] ** 2 + f[1, :] ** 2 + _TIP**2)


def _cost(problem: GaitProblem, phase: _Phase) -> ca.SX:
    """Cost (6) over a phase, by Simpson's rule; the kept legs count twice."""
    rate = 2.0 * (
        problem.torque_weight * ca.sum1(phase.tau**2)
        + problem.velocity_weight * ca.sum1(phase.v[NB_FOLDED:, :] ** 2)
    )  # (1, nodes)
    lengths = np.diff(phase.s[::2])
    weights = np.zeros(len(phase.s))
    weights[:-1:2] += lengths / 6
    weights[1::2] += lengths * 4 / 6
    weights[2::2] += lengths / 6
    return phase.duration * (rate @ ca.DM(weights))
