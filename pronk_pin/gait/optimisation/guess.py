"""Initial guess of the gait optimisation where there is no neighbour."""

from __future__ import annotations

import numpy as np

from ..._checks import instance_of
from ..._typing import Array
from ...kinematics import leg_geometry
from ...robot import NB
from ..problem import GaitProblem
from .collocation import node_phases
from .unfold import fold_problem


def vertical_hop(problem: GaitProblem) -> dict[str, Array]:
    """A crude first guess: the trunk hops on parabolas, the legs keep the standing posture.

    Without a flight they swing to and fro, as far as the trunk goes while they stand.

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
    count = 1 if problem.base == "free" else 2  # of each leg that the model keeps
    load = sum(count * len(p.stands) * t for p, t in zip(problem.sequence, durations, strict=True))
    push = robot.mass * robot.gravity * sum(durations) / load
    values, start = {}, 0.0
    for index, (phase, duration) in enumerate(zip(problem.sequence, durations, strict=True)):
        name, s = phase.name, node_phases(phase.intervals)
        dip = robot.gravity * flight * duration / 8  # as deep as the speed at take-off asks
        height = -dip if phase.stands else rise
        z = problem.apex - rise + height * 4 * s * (1 - s)
        x = start + problem.speed * duration * s
        pitch = np.zeros((len(s), model.nb - 2))
        legs = np.tile(standing, (len(s), 1))
        if not flights:  # a trot is found from legs that keep still, and not from these
            legs[:, 1::3] += _sweep(problem, durations, index, s)
        q = np.column_stack([x, z, pitch, legs])
        v = np.gradient(q, s * duration, axis=0)
        values[f"{name}.q"], values[f"{name}.v"] = q, v
        values[f"{name}.a"] = np.gradient(v, s * duration, axis=0)
        values[f"{name}.tau"] = np.zeros((len(s), model.nl))
        values[f"{name}.duration"] = np.array([duration])
        if phase.stands:
            values[f"{name}.lam"] = np.tile([0.0, 0.0, push], (len(s), len(phase.stands)))
        if problem.impacts(index):
            values[f"{name}.impulse"] = np.zeros(3 * len(phase.stands))
        start += problem.speed * duration
    return values


def _sweep(problem: GaitProblem, durations: list[float], index: int, s: Array) -> Array:
    """What the thighs turn beside the standing posture at phases s of a phase, (nodes, legs).

    A foot that stands goes back under its hip with the speed of the gait, then forth again.
    """
    robot, n = problem.robot, len(durations)
    turns = np.zeros((len(s), len(robot.legs)))
    sense = leg_geometry(robot).sense[:, 1]
    for leg in range(len(robot.legs)):
        stands = [leg in problem.standing(phase.stands) for phase in problem.sequence]
        total = sum(t for t, down in zip(durations, stands, strict=True) if down == stands[index])
        standing = sum(t for t, down in zip(durations, stands, strict=True) if down)
        first = index
        while stands[first - 1] == stands[index] and (first - 1) % n != index:
            first = (first - 1) % n
        passed = sum(durations[(first + i) % n] for i in range((index - first) % n))
        share = (passed + durations[index] * s) / total
        ahead = problem.speed * standing * ((0.5 - share) if stands[index] else (share - 0.5))
        turns[:, leg] = -sense[leg] * ahead / robot.standing[2]
    return turns
