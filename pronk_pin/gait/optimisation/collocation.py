"""The gait problem as a nonlinear program: separated Hermite-Simpson collocation.

Positions, velocities, accelerations, torques and contact forces are unknowns at every node, the
midpoints of the mesh intervals included; so are the durations of the phases and the touchdown
impulses. Every constraint of section II.B of the paper stands here under its name; bilateral
symmetry is in the folded model.

In stance the feet's height is imposed at touchdown, their velocity by the impact, and their
acceleration at every node: then the equations are independent, and nothing is asked twice.

Which feet stand in which phase is data, `GaitProblem.sequence`: nothing here knows pronking.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from ..._typing import Array
from ...kinematics import mirror
from ...robot import JOINTS, NB
from ..problem import ContactPhase, GaitProblem
from .folded_model import FoldedModel, fold
from .newton_euler import BASE_COORDINATES
from .transcription import Constraint, Transcription, Unknown

_FREE = BASE_COORDINATES["free"]

_TRUNK_LIMITS = ("pitch limit", "side step", "roll limit", "yaw limit")

_TIP = 1e-6
"""Rounding of the friction cone's tip [N, N s], which keeps its derivative finite."""

_BLUNT_TIPS = (0.1, 0.01)
"""The same on a free trunk, of forces [N] and impulses [N s]. On sharp tips, where forces from the
crude guess begin, the solver spends two thirds of its iterations."""


@dataclass(frozen=True, eq=False)
class _Phase:
    """The unknowns of a phase, one column a node; midpoints are the odd columns.

    Attributes:
        legs: Indices of the folded robot's legs that stand.
    """

    name: str
    legs: tuple[int, ...]
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


@lru_cache(maxsize=16)
def transcribe(problem: GaitProblem) -> Transcription:
    """Write a gait problem as a nonlinear program with the parameters [speed, apex]."""
    model = fold(problem.moved, problem.contact, problem.base)
    unknowns = _unknowns(problem, model)
    phases = [_phase(problem, unknowns, model, phase) for phase in problem.sequence]
    speed, apex = ca.SX.sym("speed"), ca.SX.sym("apex")
    constraints: list[Constraint] = []
    for phase in phases:
        constraints += _motion(model, phase)
    for phase in phases:
        constraints += _standing(problem, model, phase)
    cycle = _cycle(problem, phases)
    for leg in range(len(model.legs)):
        constraints += _swinging(problem, model, cycle, len(phases), leg)
    topped = [phase.name for phase in problem.topped]
    for phase in (phase for phase in phases if phase.name in topped):
        # With several flights the trunk pitches through them and may have no top in any.
        middle = phase.q[1, len(phase.s) // 2]
        top = _apex(phase.s, phase.q[1, :]) if len(topped) == 1 and model.nb < _FREE else middle
        constraints.append(Constraint("apex height", phase.name, top - apex))
    constraints += _stride(problem, phases, speed)
    for index in range(len(phases)):
        constraints += _transition(problem, model, unknowns, phases, index)
    cost = sum((_cost(problem, model, phase) for phase in phases), ca.SX(0))
    if problem.trunk is not None:
        count = 2.0 if problem.half_stride else 1.0
        for name, unknown in unknowns.items():
            if name.endswith(".impulse"):
                cost += count * problem.trunk.impact_weight * ca.sumsqr(unknown.symbol)
    return Transcription.of(unknowns, ca.vertcat(speed, apex), cost, tuple(constraints))


def _unknowns(problem: GaitProblem, model: FoldedModel) -> dict[str, Unknown]:
    """All unknowns with their bounds."""
    joints, kept, free = model.joint_rows(), problem.robot, np.inf
    hip = np.tile([joint == "hip" for joint in JOINTS], len(model.legs))
    low, high = kept.q_min[joints], kept.q_max[joints]
    low = np.where(hip, np.maximum(low, -problem.hip_limit), low)
    high = np.where(hip, np.minimum(high, problem.hip_limit), high)
    v_max = np.array([*[free] * model.nb, *problem.velocity_use * kept.v_max[joints]])
    tau_max = problem.torque_use * kept.tau_max[joints]

    pitch, top = [problem.pitch_limit] * (min(model.nb, 3) - 2), free
    if problem.trunk is not None:
        top = problem.trunk.height
        pitch += [problem.trunk.side, problem.trunk.roll, problem.trunk.yaw]
    base_limits = ("", "trunk height", *_TRUNK_LIMITS)[: model.nb]
    q_limits = (*base_limits, *np.where(hip, "hip limit", "configuration limits"))
    q_low = np.array([-free, problem.trunk_height, *np.negative(pitch), *low])
    q_high = np.array([free, top, *pitch, *high])
    v_limits = ("",) * model.nb + ("velocity limits",) * model.nl
    unbounded = np.full(model.nq, free)
    blocks = {
        "q": (q_low, q_high, q_limits),
        "v": (-v_max, v_max, v_limits),
        "a": (-unbounded, unbounded, ("",) * model.nq),
        "tau": (-tau_max, tau_max, ("torque limits",) * model.nl),
    }
    unknowns, impulses = {}, {}
    for index, phase in enumerate(problem.sequence):
        name, nodes, feet = phase.name, 2 * phase.intervals + 1, len(phase.stands)
        ground = np.tile([-free, -free, 0.0], feet)
        forces = (ground, np.full(len(ground), free), ("", "", "unilateral contact") * feet)
        for key, (lower, upper, limits) in (blocks | ({"lam": forces} if feet else {})).items():
            symbol = ca.SX.sym(f"{name}_{key}", len(lower), nodes)
            unknowns[f"{name}.{key}"] = Unknown(name, symbol, lower, upper, limits)
        shortest, longest = np.array(phase.duration)[:, None]
        symbol = ca.SX.sym(f"{name}_duration")
        unknowns[f"{name}.duration"] = Unknown(
            name, symbol, shortest, longest, ("phase durations",)
        )
        if problem.impacts(index):
            symbol = ca.SX.sym(f"{name}_impulse", len(ground))
            impulses[f"{name}.impulse"] = Unknown(f"touchdown of {name}", symbol, *forces)
    return unknowns | impulses


def _phase(
    problem: GaitProblem,
    unknowns: Mapping[str, Unknown],
    model: FoldedModel,
    phase: ContactPhase,
) -> _Phase:
    name, legs = phase.name, problem.standing(phase.stands)
    symbols = {key: unknowns[f"{name}.{key}"].symbol for key in ("q", "v", "a", "tau", "duration")}
    lam = ca.SX(3 * len(model.legs), symbols["q"].shape[1])
    for i, leg in enumerate(legs):
        lam[3 * leg : 3 * leg + 3, :] = unknowns[f"{name}.lam"].symbol[3 * i : 3 * i + 3, :]
    return _Phase(name=name, legs=legs, lam=lam, **symbols)


def _motion(model: FoldedModel, phase: _Phase) -> list[Constraint]:
    """Equations of motion (2) at every node, and Hermite-Simpson between them."""
    constraints = []
    for k in range(len(phase.s)):
        forces = model.dynamics(phase.q[:, k], phase.v[:, k], phase.a[:, k], phase.lam[:, k])
        motors = ca.vertcat(ca.SX(model.nb, 1), phase.tau[:, k])
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


def _feet(
    model: FoldedModel, phase: _Phase, k: int, legs: Sequence[int]
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Height, contact velocity and contact acceleration of some feet at a node."""
    position, velocity, acceleration = model.feet(phase.q[:, k], phase.v[:, k], phase.a[:, k])
    columns = list(legs)
    return position[2, columns], velocity[:, columns], acceleration[:, columns]


def _standing(problem: GaitProblem, model: FoldedModel, phase: _Phase) -> list[Constraint]:
    """Holonomic constraints (3) of the standing feet, `J a + sigma = 0`, and the friction cone."""
    constraints, tip = [], _BLUNT_TIPS[0] if model.nb == _FREE else _TIP
    for k in range(len(phase.s) if phase.legs else 0):
        where = f"{phase.name}, node {k}"
        acceleration = _feet(model, phase, k, phase.legs)[2]
        constraints.append(Constraint("contact acceleration", where, acceleration))
        cone = _cone(phase.lam[:, k], phase.legs, problem.friction, tip)
        constraints.append(Constraint("friction cone", where, cone, upper=np.inf))
    return constraints


class _Part(NamedTuple):
    """A phase of a whole stride: one of the program's, or the mirror image of one."""

    phase: _Phase
    source: tuple[int, ...]
    """For each leg that whose unknowns move it: itself, or its partner in the mirror image."""

    def stands(self, leg: int) -> bool:
        """Whether a leg stands."""
        return self.source[leg] in self.phase.legs


def _cycle(problem: GaitProblem, phases: Sequence[_Phase]) -> list[_Part]:
    """The phases of a whole stride."""
    own = tuple(range(len(problem.robot.legs)))
    cycle = [_Part(phase, own) for phase in phases]
    if problem.half_stride:
        cycle += [_Part(phase, mirror(problem.robot).partner) for phase in phases]
    return cycle


def _swinging(
    problem: GaitProblem, model: FoldedModel, cycle: Sequence[_Part], starts: int, leg: int
) -> list[Constraint]:
    """Clearance of a foot over its swings: `z >= 16 h s^2 (1 - s)^2` at the phase s of the swing.

    A swing goes from lift-off to touchdown, through as many phases as it takes. Of half a stride
    those count that begin in it: the others are their mirror images.
    """
    n, constraints = len(cycle), []
    for first in range(starts):
        if cycle[first].stands(leg) or not cycle[first - 1].stands(leg):
            continue
        length = next(i for i in range(1, n + 1) if cycle[(first + i) % n].stands(leg))
        swing = [cycle[(first + i) % n] for i in range(length)]
        total = sum((part.phase.duration for part in swing), ca.SX(0))
        passed = ca.SX(0)
        for i, (phase, source) in enumerate(swing):
            last = len(phase.s) - 1 if i == length - 1 else len(phase.s)
            for k in range(1, last):
                alone = length == 1
                s = phase.s[k] if alone else (passed + phase.duration * phase.s[k]) / total
                # Flat at both ends: a parabola would fight the feet's zero velocity at lift-off.
                profile = problem.clearance * 16 * s**2 * (1 - s) ** 2
                height = _feet(model, phase, k, [source[leg]])[0] - problem.robot.foot_radius
                where = f"{phase.name}, node {k}"
                constraints.append(
                    Constraint("foot clearance", where, height - profile, upper=np.inf)
                )
            passed = passed + phase.duration
    return constraints


def _apex(s: Array, z: ca.SX) -> ca.SX:
    """Greatest height of the trunk, by interpolation of its heights in mid-flight.

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


def _stride(problem: GaitProblem, phases: Sequence[_Phase], speed: ca.SX) -> list[Constraint]:
    """Constraints on the whole stride: duration, start at x = 0, `x_N - x_0 = v T`."""
    total = sum((phase.duration for phase in phases), ca.SX(0))
    parts = 2.0 if problem.half_stride else 1.0
    first, last = phases[0].q[0, 0], phases[-1].q[0, -1]
    # Whole strides on a free trunk may begin anywhere beside the way, too; half a stride may not.
    whole = problem.trunk is not None and not problem.half_stride
    beside = [Constraint("periodicity", "stride", phases[0].q[3, 0])] if whole else []
    return [
        *beside,
        Constraint("stride duration", "stride", parts * total, *problem.stride),
        Constraint("periodicity", "stride", first),  # x may begin anywhere; here it begins at 0
        Constraint("average speed", "stride", last - first - speed * total),
    ]


def _transition(
    problem: GaitProblem,
    model: FoldedModel,
    unknowns: Mapping[str, Unknown],
    phases: Sequence[_Phase],
    index: int,
) -> list[Constraint]:
    """Transition into a phase: continuity, with feet that come to rest on the ground where others
    stand already, or the plastic impact of the feet that land.

    `M (v+ - v-) = J^T impulse` with `J v+ = 0` for all standing feet, and impulses within the
    friction cone.
    """
    phase, before = phases[index], phases[index - 1]
    name, rows = ("phase continuity", slice(0, None)) if index else ("periodicity", slice(1, None))
    where = f"{before.name} to {phase.name}"
    q, v = phase.q[:, 0], phase.v[:, 0]
    last_q, last_v = before.q[:, -1], before.v[:, -1]
    if problem.half_stride and not index:
        last_q, last_v = model.mirrored(last_q), model.mirrored(last_v)
    constraints = [Constraint(name, where, last_q[rows] - q[rows])]
    landing = problem.standing(problem.landing(index))
    if not landing:
        return [*constraints, Constraint(name, where, last_v - v)]
    if not problem.impacts(index):
        height, velocity, _ = _feet(model, phase, 0, landing)
        return [
            *constraints,
            Constraint(name, where, last_v - v),
            Constraint(
                "contact height", f"{phase.name}, node 0", height - problem.robot.foot_radius
            ),
            Constraint("touchdown contact", f"touchdown of {phase.name}", velocity),
        ]
    impulse = ca.SX(3 * len(model.legs), 1)
    for i, leg in enumerate(phase.legs):
        symbol = unknowns[f"{phase.name}.impulse"].symbol
        impulse[3 * leg : 3 * leg + 3] = symbol[3 * i : 3 * i + 3]
    where = f"touchdown of {phase.name}"
    height = _feet(model, phase, 0, landing)[0] - problem.robot.foot_radius
    velocity = _feet(model, phase, 0, phase.legs)[1]
    residual = model.impact(q, v - last_v, impulse)
    tip = _BLUNT_TIPS[1] if model.nb == _FREE else _TIP
    cone = _cone(impulse, phase.legs, problem.friction, tip)
    return [
        *constraints,
        Constraint("contact height", f"{phase.name}, node 0", height),
        Constraint("touchdown impact", where, residual),
        Constraint("touchdown contact", where, velocity),
        Constraint("impulse cone", where, cone, upper=np.inf),
    ]


def _cone(forces: ca.SX, legs: Sequence[int], friction: float, tip: float) -> ca.SX:
    """Friction cone of each standing foot, mu f_n - |f_t|: not negative where the foot holds."""
    f = ca.reshape(forces, 3, -1)[:, list(legs)]
    return friction * f[2, :] - ca.sqrt(f[0, :] ** 2 + f[1, :] ** 2 + tip**2)


def _cost(problem: GaitProblem, model: FoldedModel, phase: _Phase) -> ca.SX:
    """Cost (6) over a phase, `int W_tau |tau|^2 + W_q |q'|^2 dt`, by Simpson's rule.

    The kept legs count twice, and so does half a stride. On a free trunk its turns and tilts, its
    motion beside the way, and joints far from the standing posture cost something too.
    """
    count = 1.0 if problem.base == "free" and not problem.half_stride else 2.0
    rate = count * (
        problem.torque_weight * ca.sum1(phase.tau**2)
        + problem.velocity_weight * ca.sum1(phase.v[model.nb :, :] ** 2)
    )  # (1, nodes)
    if problem.trunk is not None:
        turns, strays = phase.v[[2, 4, 5], :], phase.v[[1, 3], :]
        rate += count * problem.trunk.turn_weight * ca.sum1(turns**2)
        rate += count * problem.trunk.drift_weight * ca.sum1(strays**2)
        rate += count * problem.trunk.tilt_weight * ca.sum1(phase.q[[2, 4, 5], :] ** 2)
        standing = problem.robot.standing[NB + 1 :][model.joint_rows()]
        bent = phase.q[model.nb :, :] - ca.repmat(ca.DM(standing), 1, len(phase.s))
        rate += count * problem.trunk.posture_weight * ca.sum1(bent**2)
    lengths = np.diff(phase.s[::2])
    weights = np.zeros(len(phase.s))
    weights[:-1:2] += lengths / 6
    weights[1::2] += lengths * 4 / 6
    weights[2::2] += lengths / 6
    return phase.duration * (rate @ ca.DM(weights))
