"""Model-based feedforward: contact inverse dynamics along the gait, on the phase grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._checks import known_name
from .._typing import Array
from ..gait import Gait, known_gaits
from ..inverse_dynamics import PLANAR_CONSTRAINT, feedforward
from ..robot import BASES, Robot
from .signals import SAMPLES

CONSTRAINTS: dict[str, tuple[str, ...] | None] = {
    "locked": PLANAR_CONSTRAINT,
    "sagittal": ("y", "roll", "yaw"),
    "free": None,
}
"""Trunk coordinates that the planar constraint holds, by base: all but x and z, or but x, z
and pitch, or none."""


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
    constraint = CONSTRAINTS[known_name("base", base, BASES)]
    solutions = [
        feedforward(
            robot,
            gait,
            samples=samples,
            friction=friction,
            contact="rolling",
            constraint=constraint,
        )
        for gait in gaits
    ]
    return np.stack([[solution.stance, solution.flight] for solution in solutions])
