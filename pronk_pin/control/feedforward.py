"""The model's feedforward: contact inverse dynamics along the gait, on the phase grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Array
from ..gait import Gait
from ..inverse_dynamics import SAGITTAL_GUIDE, feedforward
from ..robot import Robot
from .record import SAMPLES


def model_feedforward(
    robot: Robot, gaits: Sequence[Gait], *, samples: int = SAMPLES, friction: float = 0.6
) -> Array:
    """Torques that the model asks for in stance and flight of each gait [N m].

    Shape (n, 2, samples, 12).
    """
    found = [
        feedforward(
            robot,
            gait,
            samples=samples,
            friction=friction,
            contact="rolling",
            guide=SAGITTAL_GUIDE,
        )
        for gait in gaits
    ]
    return np.stack([[one.stance, one.flight] for one in found])
