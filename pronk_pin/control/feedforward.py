"""Model-based feedforward: contact inverse dynamics along the gait, on the phase grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._checks import instance_of, known_name, sequence_of
from .._state import as_robot
from .._typing import Array
from ..base import BASES
from ..errors import InvalidInput
from ..gait import Gait
from ..inverse_dynamics import SAGITTAL_GUIDE, feedforward
from ..robot import Robot
from .record import SAMPLES

GUIDES: dict[str, tuple[str, ...] | None] = {
    "locked": SAGITTAL_GUIDE,
    "sagittal": ("y", "roll", "yaw"),
    "free": None,
}
"""Trunk coordinates that the planar constraint holds, by base: all but x and z, or but x, z
and pitch, or none."""


def known_gaits(robot: Robot, gaits: Sequence[Gait]) -> tuple[Gait, ...]:
    """Gaits of a robot, one or more.

    Raises:
        InvalidInput: There is none, or one is no gait, or of another robot.
    """
    as_robot(robot)
    if isinstance(gaits, Gait):
        raise InvalidInput("gaits is one Gait; give a list, with a gait for each robot")
    found = sequence_of(
        "gaits", gaits, lambda name, gait: instance_of(name, gait, Gait), wanted="gaits"
    )
    if not found:
        raise InvalidInput("gaits is empty; give one for each robot")
    for gait in found:
        if gait.robot != robot.name:
            raise InvalidInput(
                f"a gait of the {gait.robot} cannot be played by the {robot.name}; take it from "
                f"load_library('{robot.name}')"
            )
    return found


def model_feedforward(
    robot: Robot,
    gaits: Sequence[Gait],
    *,
    samples: int = SAMPLES,
    friction: float = 0.6,
    base: str = "locked",
) -> Array:
    """Compute the inverse-dynamics torques in stance and flight of each gait: eq. (2) [N m].

    Shape (n, 2, samples, 12). Where the base is free, the legs hold what the constraint would.

    Raises:
        UnknownName: There is no such base; see `BASES`.
    """
    gaits = known_gaits(robot, gaits)
    guide = GUIDES[known_name("base", base, BASES)]
    solutions = [
        feedforward(
            robot,
            gait,
            samples=samples,
            friction=friction,
            contact="rolling",
            guide=guide,
        )
        for gait in gaits
    ]
    return np.stack([[solution.stance, solution.flight] for solution in solutions])
