"""The model's feedforward: contact inverse dynamics along the gait, on the phase grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._state import known_name
from .._typing import Array
from ..base import BASES
from ..gait import Gait
from ..inverse_dynamics import SAGITTAL_GUIDE, feedforward
from ..robot import Robot
from .record import SAMPLES

GUIDES: dict[str, tuple[str, ...] | None] = {
    "locked": SAGITTAL_GUIDE,
    "sagittal": ("y", "roll", "yaw"),
    "free": None,
}
"""What a guide holds of the trunk, by how it may move: x and z only, pitch too, or anyhow."""


def model_feedforward(
    robot: Robot,
    gaits: Sequence[Gait],
    *,
    samples: int = SAMPLES,
    friction: float = 0.6,
    base: str = "locked",
) -> Array:
    """Torques that the model asks for in stance and flight of each gait [N m].

    Shape (n, 2, samples, 12). Where the base is free, the legs hold what a guide would.

    Raises:
        UnknownName: There is no such base; see `BASES`.
    """
    guide = GUIDES[known_name("base", base, BASES)]
    found = [
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
    return np.stack([[one.stance, one.flight] for one in found])
