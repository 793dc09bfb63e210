"""From the unknowns of the folded robot to the motion of the whole one, and its Bezier form."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from ..._typing import Array
from ...kinematics import MIRRORED, contact_jacobian, mirror, mirrored
from ...robot import JOINTS, NB
from .. import bezier
from ..gait import GaitPhase, Motion, whole_state
from ..problem import ContactPhase, GaitProblem
from .collocation import node_phases
from .folded_model import FoldedModel, fold


def fold_problem(problem: GaitProblem) -> FoldedModel:
    """The folded model of a problem."""
    return fold(problem.moved, problem.contact, problem.base)


def unfolded(problem: GaitProblem, values: dict[str, Array], phase: ContactPhase) -> Motion:
    """The whole robot's motion at the nodes of a phase."""
    name, robot, model = phase.name, problem.robot, fold_problem(problem)
    curves = []
    for key in "qva":
        folded = values[f"{name}.{key}"]
        base = np.zeros((len(folded), max(3, model.nb)))
        base[:, : model.nb] = folded[:, : model.nb]
        curves.append((base, model.unfold_joints(folded[:, model.nb :])))
    q, v, a = whole_state(robot, *curves)
    lam = values.get(f"{name}.lam", np.zeros((len(q), 0)))
    kept = [values[f"{name}.{key}"].T for key in "qva"]
    apart = np.array(model.asymmetry.map(len(q))(*kept)).T  # (n, 6), (n, 12) on a free trunk
    return Motion(
        t=float(values[f"{name}.duration"][0, 0]) * node_phases(phase.intervals),
        q=q,
        v=v,
        a=a,
        tau=model.unfold_torques(values[f"{name}.tau"], apart),
        lam=foot_forces(model, problem.standing(phase.stands), lam),
    )


def touchdown_impulse(
    problem: GaitProblem, index: int, motions: Mapping[str, Motion], values: dict[str, Array]
) -> Array:
    """Touchdown impulses on all feet at the beginning of a phase [N s], shape (4, 3).

    The motors give none, so that the feet of unlike legs bear unlike impulses.
    """
    robot, model, phase = problem.robot, fold_problem(problem), problem.sequence[index]
    impulse: Array = foot_forces(
        model, problem.standing(phase.stands), values[f"{phase.name}.impulse"]
    )[0]
    if problem.base == "free":
        return impulse
    q, v = (values[f"{phase.name}.{key}"][0] for key in "qv")
    jump = np.array(model.jump_asymmetry(q, v - values[f"{problem.before(index).name}.v"][-1]))
    apart = model.unfold_torques(np.zeros(model.nl), jump.ravel())
    for leg in problem.feet(phase):
        i = robot.legs.index(leg)
        joints = slice(len(JOINTS) * i, len(JOINTS) * (i + 1))
        whole = motions[phase.name].q[0]
        jacobian = contact_jacobian(robot, whole, feet=[leg], contact=problem.contact)
        impulse[i] += np.linalg.solve(jacobian[:, NB:][:, joints].T, apart[joints])
    return impulse


def foot_forces(model: FoldedModel, legs: Sequence[int], standing: Array) -> Array:
    """Forces on all feet (n, 4, 3) from those of the standing, kept `legs` (n, 3 feet)."""
    folded = np.zeros((len(standing), len(model.legs), 3))
    folded[:, list(legs)] = standing.reshape(len(standing), len(legs), 3)
    return model.unfold_forces(folded.reshape(len(standing), -1))


def fitted(
    problem: GaitProblem, phase: ContactPhase, motion: Motion, values: Mapping[str, Array]
) -> GaitPhase:
    """Bezier form of a phase; the motion's ends are met exactly, in value and rate."""
    duration, order, nb = float(motion.t[-1]), phase.order, fold_problem(problem).nb
    s = motion.t / duration
    base, rates = np.zeros((2, len(s), max(3, nb)))
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


def mirror_image(problem: GaitProblem, motion: Motion) -> Motion:
    """Motion of the other half of a stride: the mirror image of one of this half, farther on."""
    robot = problem.robot
    partner = list(mirror(robot).partner)
    flip = np.array([1.0, -1.0, 1.0])
    q, v, a = motion.q.copy(), motion.v.copy(), motion.a.copy()
    q[:, :3] *= flip
    q[:, 3 : NB + 1] *= [-1.0, 1.0, -1.0, 1.0]
    for rates in (v, a):
        rates[:, :3] *= flip
        rates[:, 3:NB] *= -flip
        rates[:, NB:] = mirrored(robot, rates[:, NB:])
    q[:, NB + 1 :] = mirrored(robot, q[:, NB + 1 :])
    return Motion(motion.t, q, v, a, mirrored(robot, motion.tau), motion.lam[:, partner] * flip)


def advanced(motion: Motion, distance: float) -> Motion:
    """The same motion farther on along x [m]."""
    q = motion.q.copy()
    q[:, 0] += distance
    return dataclasses.replace(motion, q=q)


def mirror_phase(
    problem: GaitProblem, own: GaitPhase, image: ContactPhase, half: float
) -> GaitPhase:
    """Bezier form of a phase of the other half of a stride, half a stride [m] farther on."""
    robot, base = problem.robot, own.base * MIRRORED[:, None]
    base[0] += half

    def turned(joints: Array) -> Array:
        return mirrored(robot, joints.T).T

    lam = own.lam[list(mirror(robot).partner)] * np.array([1.0, -1.0, 1.0])[:, None]
    return GaitPhase(
        name=image.name,
        feet=problem.feet(image),
        duration=own.duration,
        joints=turned(own.joints),
        base=base,
        tau=turned(own.tau),
        lam=lam,
    )
