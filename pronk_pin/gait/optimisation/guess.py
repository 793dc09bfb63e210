"""Initial guess of the gait optimisation where there is no neighbour."""

from __future__ import annotations

import numpy as np

from ..._checks import instance_of
from ..._typing import Array
from ...robot import NB
from ..problem import GaitProblem
from .collocation import node_phases
from .unfold import fold_problem


def vertical_hop(problem: GaitProblem) -> dict[str, Array]:
    """A crude first guess: the trunk hops on parabolas, the legs keep the standing posture.

    Returns:
        The unknowns of the transcription, each (nodes, rows).
    """
    instance_of("problem", problem, GaitProblem, "a GaitProblem, as gait_problem() returns it")
    robot, model = problem.robot, fold_problem(problem)
    standing = robot.standing[NB + 1 :][model.joint_rows()]
    durations = [
        phase.duration[0] if not phase.stands else 0.5 * sum(phase.duration)
        for phase in problem.sequence
    ]
    flights = [t for phase, t in zip(problem.sequence, durations, strict=True) if not phase.stands]
    flight = float(np.mean(flights)) if flights else 0.0
    rise = robot.gravity * flight**2 / 8
    legs = 1 if problem.base == "free" else 2  # of each that the model keeps
    load = sum(legs * len(p.stands) * t for p, t in zip(problem.sequence, durations, strict=True))
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
