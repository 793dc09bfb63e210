"""Survey of the ground by feet and IMU: sinking, slope and gravity.

A trunk that is held level climbs a slope; one that is held along it feels gravity lean back.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ...kinematics import foot_positions
from ...robot import Robot
from .recording import PhaseRecording

_SPAN = 0.3
"""Distance from which on a climb shows [m]."""
_UPRIGHT = 0.005
"""Angle up to which an IMU's noise may let gravity lean [rad]."""


class Ground(NamedTuple):
    """Properties of the ground, estimated from the feet, mean over speeds."""

    sinking: float
    """By how much the feet sink in after touchdown [m]."""
    slope: float
    """Angle by which it rises forwards [rad]; NaN where the robot stayed in one place, and gravity
    stands upright on it."""
    gravity: float
    """Gravitational acceleration [m/s^2]."""


def survey(robot: Robot, stances: Iterable[PhaseRecording]) -> Ground:
    """Estimate sinking, slope and gravity from recorded stances.

    Args:
        robot: The robot.
        stances: The stance of each speed.
    """
    sinking, steps, lean = [], [], []
    for phase in stances:
        place = np.zeros((*phase.joints.shape[:2], 3))
        place[..., [0, 2]] = phase.base
        feet = foot_positions(robot, robot.q_from_base(place, phase.joints))  # (k, ticks, 4, 3)
        height = feet[..., 2].mean(axis=(0, 2))
        sinking.append(height[0] - height.min())
        middle = phase.base[:, phase.base.shape[1] // 2]  # (k, 2): it climbs with the ground
        steps.append(middle - middle.mean(axis=0))
        lean.append(phase.lean)
    x, z = np.concatenate(steps).T
    climb = float(np.arctan(x @ z / (x @ x))) if np.ptp(x) > _SPAN else np.nan
    back, up = np.mean(lean, axis=0) - robot.model.gravity.linear[[0, 2]]
    leaning = float(np.arctan2(back, up))
    if np.isnan(climb) and abs(leaning) > _UPRIGHT:
        climb = 0.0
    return Ground(float(np.mean(sinking)), climb + leaning, float(np.hypot(back, up)))
