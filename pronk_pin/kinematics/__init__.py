"""Kinematics: feet from joints, joints from feet, trunk velocity from stance legs, whole body."""

from .feet import (
    LegSolution,
    foot_positions,
    foot_velocities,
    leg_angle,
    leg_inverse_kinematics,
    leg_odometry,
    rotate_leg,
)
from .whole_body import WholeBodySolution, inverse_kinematics

__all__ = [
    "LegSolution",
    "WholeBodySolution",
    "foot_positions",
    "foot_velocities",
    "inverse_kinematics",
    "leg_angle",
    "leg_inverse_kinematics",
    "leg_odometry",
    "rotate_leg",
]
