"""Falls, of trunks that are put where they count as one, and where they do not yet."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare.simulation.fall import LARGEST_TILT, LEAST_HEIGHT, FallDetector
from pronk_pin.compare.world import Motion
from pronk_pin.control import phase_grid
from pronk_pin.gait import Gait

ROW = np.array([1])


def motion(height: Array, roll: float | None = None) -> Motion:
    """One robot at these heights [m], with its trunk rolled [rad], or one that cannot turn."""
    ticks = len(height)
    joints, pose = np.zeros((1, ticks, 12)), None
    if roll is not None:
        pose = np.zeros((1, ticks, 7))
        pose[..., 3], pose[..., 6] = np.sin(roll / 2.0), np.cos(roll / 2.0)
    base = np.stack([np.zeros(ticks), height], axis=-1)[None]
    force, finite = np.zeros((1, ticks, 4, 3)), np.ones((1, ticks), dtype=bool)
    return Motion(base, 0.0 * base, joints, joints, force, finite, None, pose, pose)


def test_a_trunk_far_below_the_gaits_lowest_point_has_fallen(gaits: list[Gait]) -> None:
    lowest = gaits[1].stance.base_reference(phase_grid())[0][:, 1].min()
    heights = LEAST_HEIGHT * lowest + np.array([0.01, 0.001, -0.001])
    fallen = FallDetector(gaits).fallen(ROW, motion(heights))
    assert fallen.tolist() == [[False, False, True]]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_trunk_that_is_tilted_too_far_has_fallen(gaits: list[Gait], side: float) -> None:
    falls, high = FallDetector(gaits), np.ones(2)
    for degrees, fallen in ((-1.0, False), (1.0, True)):
        roll = side * (LARGEST_TILT + np.radians(degrees))
        assert falls.fallen(ROW, motion(high, roll)).tolist() == [[fallen, fallen]]
