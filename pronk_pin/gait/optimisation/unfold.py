"""From the unknowns of the folded robot to the motion of the whole one, and its Bezier form."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..._typing import Array
from ...kinematics import contact_jacobian
from ...robot import JOINTS, NB
from .. import bezier
from ..gait import GaitPhase, Motion, planar_state
from ..problem import PAIRS, ContactPhase, GaitProblem
from .collocation import node_phases
from .folded_model import FoldedModel, fold


def fold_problem(problem: GaitProblem) -> FoldedModel:
    """The folded model of a problem."""
    return fold(problem.robot, problem.contact, problem.base)


def unfolded(model: FoldedModel, values: dict[str, Array], phase: ContactPhase) -> Motion:
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
        lam=foot_forces(model, phase, lam),
    )


def touchdown_impulse(
    problem: GaitProblem, index: int, motions: Mapping[str, Motion], values: dict[str, Array]
) -> Array:
    """Touchdown impulses on all feet at the beginning of a phase [N s], shape (4, 3).

    The motors give none, so that the feet of unlike legs bear unlike impulses.
    """
    robot, model, phase = problem.robot, fold_problem(problem), problem.sequence[index]
    q, v = (values[f"{phase.name}.{key}"][0] for key in "qv")
    jump = np.array(model.jump_asymmetry(q, v - values[f"{problem.before(index).name}.v"][-1]))
    impulse: Array = foot_forces(model, phase, values[f"{phase.name}.impulse"])[0]
    apart = model.unfold_torques(np.zeros(model.nl), jump.ravel())
    for leg in problem.feet(phase):
        i = robot.legs.index(leg)
        joints = slice(len(JOINTS) * i, len(JOINTS) * (i + 1))
        whole = motions[phase.name].q[0]
        jacobian = contact_jacobian(robot, whole, feet=[leg], contact=problem.contact)
        impulse[i] += np.linalg.solve(jacobian[:, NB:][:, joints].T, apart[joints])
    return impulse


def foot_forces(model: FoldedModel, phase: ContactPhase, standing: Array) -> Array:
    """Forces on all feet (n, 4, 3) from those of the standing, kept ones (n, 3 feet)."""
    folded = np.zeros((len(standing), len(model.legs), 3))
    legs = [PAIRS.index(pair) for pair in phase.stands]
    folded[:, legs] = standing.reshape(len(standing), len(legs), 3)
    return model.unfold_forces(folded.reshape(len(standing), -1))


def fitted(
    problem: GaitProblem, phase: ContactPhase, motion: Motion, values: Mapping[str, Array]
) -> GaitPhase:
    """Bezier form of a phase; the motion's ends are met exactly, in value and rate."""
    duration, order, nb = float(motion.t[-1]), phase.order, fold_problem(problem).nb
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
