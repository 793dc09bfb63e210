"""What the standing feet tell of the ground: whether it gives way, and whether it slopes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ...kinematics import foot_positions
from ...robot import Robot
from .recording import PhaseRecording


class Ground(NamedTuple):
    """The ground as the feet found it, mean over speeds."""

    sinking: float
    """By how much the feet sink in after touchdown [m]."""
    slope: float
    """Angle by which it rises forwards [rad]."""


def survey(robot: Robot, stances: Iterable[PhaseRecording]) -> Ground:
    """Look at the feet of recorded stances.

    Args:
        robot: The robot.
        stances: The stance of each speed.
    """
    sinking, slope = [], []
    for phase in stances:
        k, ticks = phase.joints.shape[:2]
        place = np.zeros((k, ticks, 3))
        place[..., [0, 2]] = phase.base
        # The mean of all strides, each from where its feet are in the middle of the stance.
        feet = foot_positions(robot, robot.q_from_base(place, phase.joints))  # (k, ticks, 4, 3)
        height = feet[..., 2].mean(axis=(0, 2))
        sinking.append(height[0] - height.min())
        standing = feet[:, ticks // 3 : 2 * ticks // 3].mean(axis=1)  # (k, 4, 3)
        apart = standing - standing.mean(axis=1, keepdims=True)
        slope.append(np.sum(apart[..., 0] * apart[..., 2]) / np.sum(apart[..., 0] ** 2))
    return Ground(float(np.mean(sinking)), float(np.arctan(np.mean(slope))))
