"""Falls: what counts as one.

A robot has fallen once its trunk is too low, or tilted too far, or its state is not finite. It is
simulated on, and counts as fallen to the end: `Player.upright`, and the variable `upright` of the
strides. Its strides are not learned from ("fallen" in `SKIPPED` of `control/learning/laws.py`).
What a report says of falls is worded in `compare/report/verdict.py` ("No robot fell.") and
`limitations.py`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._typing import BoolArray, IntArray
from ...control import phase_grid
from ...gait import Gait
from ...robot import rotation_matrix
from ..world import Motion

LEAST_HEIGHT = 0.6
"""Trunk height, over that of the gait's lowest point, below which a robot has fallen."""

LARGEST_TILT = np.radians(45.0)
"""Angle between the trunk's z axis and the vertical beyond which a robot has fallen [rad]."""


class FallDetector:
    """Detects falls of n robots from the motion of their trunks.

    Args:
        gaits: The gait of each robot.

    Attributes:
        floor: Trunk height below which each robot has fallen [m], shape (n,).
    """

    def __init__(self, gaits: Sequence[Gait]) -> None:
        heights = [gait.stance.base_reference(phase_grid())[0][:, 1] for gait in gaits]
        self.floor = LEAST_HEIGHT * np.min(heights, axis=1)
        self._upright = np.cos(LARGEST_TILT)

    def fallen(self, rows: IntArray, motion: Motion) -> BoolArray:
        """Whether trunks are too low or tilted too far, shape (m, ticks)."""
        fallen = motion.base[..., 1] < self.floor[rows, None]
        if motion.pose is not None:
            fallen |= rotation_matrix(motion.pose[..., 3:])[..., 2, 2] < self._upright
        return np.asarray(fallen)
