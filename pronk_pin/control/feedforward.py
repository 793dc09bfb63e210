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
    """Stance torques that the model asks for along each gait [N m], shape (n, samples, 12)."""
    return np.stack(
        [
            feedforward(
                robot,
                gait,
                samples=samples,
                friction=friction,
                contact="rolling",
                guide=SAGITTAL_GUIDE,
            ).stance
            for gait in gaits
        ]
    )
