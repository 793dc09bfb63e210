"""Kinematics: feet from joints, joints from feet, trunk velocity from stance legs, whole body.

Comes in: a `Robot`, configurations and velocities, batch first.
Goes out: positions and velocities of feet, joint angles, contact Jacobians and their biases.
"""

from .contacts import (
    CONTACTS,
    Contact,
    bias_at,
    contact_bias,
    contact_jacobian,
    contact_radius,
    jacobian_at,
)
from .feet import (
    LegSolution,
    foot_positions,
    foot_velocities,
    leg_angle,
    leg_inverse_kinematics,
    leg_odometry,
    rotate_leg,
)
from .legs import (
    LegFrames,
    LegGeometry,
    contact_points,
    leg_angles,
    leg_frames,
    leg_geometry,
    leg_motion,
)
from .mirror import Mirror, mirror, mirrored
from .symmetric import mirror_symmetric
from .trunk import COORDINATES, MIRRORED, free_coordinates, free_rates, free_state
from .whole_body import WholeBodySolution, inverse_kinematics

__all__ = [
    "CONTACTS",
    "COORDINATES",
    "MIRRORED",
    "Contact",
    "LegFrames",
    "LegGeometry",
    "LegSolution",
    "Mirror",
    "WholeBodySolution",
    "bias_at",
    "contact_bias",
    "contact_jacobian",
    "contact_points",
    "contact_radius",
    "foot_positions",
    "foot_velocities",
    "free_coordinates",
    "free_rates",
    "free_state",
    "inverse_kinematics",
    "jacobian_at",
    "leg_angle",
    "leg_angles",
    "leg_frames",
    "leg_geometry",
    "leg_inverse_kinematics",
    "leg_motion",
    "leg_odometry",
    "mirror",
    "mirror_symmetric",
    "mirrored",
    "rotate_leg",
]
