"""Gaits optimised again for a robot with other parameters: its rotors, or what was identified."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import GaitNotFound
from ..robot import Base, Robot
from .gait import Gait
from .optimisation import GaitSolution, optimize_gait
from .style import gait_problem


def replan(robot: Robot, gaits: Sequence[Gait], *, base: Base = "locked") -> list[Gait]:
    """Optimise gaits of the same speeds and heights again, for a robot with its parameters.

    With rotors the legs bring other momentum to the ground and land otherwise: what was a gait of
    the URDF's robot is none of theirs. Each starts from its neighbour's solution, the slowest from
    a crude guess; half a second a gait.

    Args:
        robot: The robot with its parameters.
        gaits: Pronking gaits of the URDF's robot.
        base: How the trunk may move in them: "locked" or "sagittal".

    Raises:
        GaitNotFound: The robot cannot do one of them, for a load that is too heavy, say.
    """
    solved: dict[int, GaitSolution] = {}
    for k in sorted(range(len(gaits)), key=lambda k: abs(gaits[k].speed)):
        problem = gait_problem(robot, gaits[k].speed, apex=gaits[k].apex, base=base)
        nearest = min(solved, key=lambda i: abs(gaits[i].speed - gaits[k].speed), default=None)
        try:
            start = None if nearest is None else solved[nearest]
            solved[k] = optimize_gait(problem, initial=start, diagnose=nearest is None)
        except GaitNotFound:
            if nearest is None:
                raise
            solved[k] = optimize_gait(problem)
    return [solved[k].gait for k in range(len(gaits))]
