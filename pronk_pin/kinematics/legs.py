"""Closed-form kinematics of a three-joint leg in the trunk's frame, vectorised over batches.

A leg turns about x at the hip and about y at the thigh and the calf; its foot is at

    p = hip + Rx(s q_hip) [thigh + Ry(s q_thigh) (calf + Ry(s q_calf) foot)]

with the offsets of `LegGeometry` and the senses s of its joints, 1 or -1. Which frames a URDF gives
the joints does not matter: what counts is where their axes are when all angles are zero.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from .._typing import Array, BoolArray
from ..errors import InvalidInput
from ..robot import JOINTS, Robot

Knee = Literal["backward", "forward"]
"""Direction in which a knee points; backward is a negative calf angle, as on the A1."""

Hip = Literal["above", "below"]
"""Whether the hip is above its foot, as in standing and walking, or below it."""

_ROUND_OFF = 1e-9
"""Relative round-off by which the reach of the links may be exceeded."""

_AXES = {"hip": 0, "thigh": 1, "calf": 1}
"""Axis of the trunk that a joint turns about, at zero joint angles."""

_PARALLEL = 1e-9
"""Deviation of an axis from the trunk's that is round-off: URDFs write pi with some digits."""


class LegGeometry(NamedTuple):
    """Offsets of legs [m] in the trunk's axes at zero joint angles, and their joints' senses."""

    hip: Array
    """From the trunk's origin to the hip joint, shape (legs, 3)."""
    thigh: Array
    """From the hip joint to the thigh joint, shape (legs, 3)."""
    calf: Array
    """From the thigh joint to the calf joint, shape (legs, 3)."""
    foot: Array
    """From the calf joint to the centre of the foot, shape (legs, 3)."""
    sense: Array
    """1 where a joint turns about the trunk's axis, -1 where it turns against it, (legs, 3)."""
    knee: Array
    """Where the knees point when the robot stands: -1 backward, 1 forward, shape (legs,)."""


class LegFrames(NamedTuple):
    """Joints of a leg at zero joint angles, from the trunk down, in the trunk's axes."""

    offset: Array
    """From the joint above, the trunk's origin for the first, to each joint [m], shape (3, 3)."""
    rotation: Array
    """Orientation of each joint's frame in the trunk, shape (3, 3, 3)."""
    axis: Array
    """Axes that the joints turn about, shape (3, 3)."""
    foot: Array
    """From the last joint to the centre of the foot [m], shape (3,)."""


class LegMotion(NamedTuple):
    """Feet and calves relative to the trunk, in the trunk's frame."""

    position: Array
    """Foot centres from the trunk's origin [m], shape (..., legs, 3)."""
    velocity: Array
    """Their rates of change as seen from the trunk [m/s], shape (..., legs, 3)."""
    calf_rate: Array
    """Angular velocity of the calves relative to the trunk [rad/s], shape (..., legs, 3)."""


@lru_cache(maxsize=64)
def leg_frames(robot: Robot, leg: str) -> LegFrames:
    """The joints of a leg at zero joint angles, whatever frames the URDF gives them."""
    model, above = robot.model, np.eye(3)
    offsets, rotations, axes = [], [], []
    for name in robot.spec.leg_joints(leg):
        joint = model.getJointId(name)
        placement = model.jointPlacements[joint]
        offsets.append(above @ placement.translation)
        above = above @ placement.rotation
        rotations.append(above)
        axes.append(above @ np.array(model.joints[joint].createData().S).ravel()[3:])
    foot = model.frames[robot.foot_ids[robot.legs.index(leg)]].placement.translation
    return LegFrames(np.array(offsets), np.array(rotations), np.array(axes), above @ foot)


@lru_cache(maxsize=16)
def leg_geometry(robot: Robot) -> LegGeometry:
    """Offsets of the legs and senses of their joints, read from the model's joint placements.

    Raises:
        InvalidInput: The legs have not three joints about x, y, y of the trunk, or there are joints
            besides: the closed form does not hold.
    """
    if len(robot.spec.joints) != len(JOINTS) or robot.joint_names != robot.spec.joint_names:
        others = [name for name in robot.joint_names if name not in robot.spec.joint_names]
        remedy = f"; make those of no leg fixed in the URDF: {', '.join(others)}" if others else ""
        raise InvalidInput(
            f"{robot.name}: closed-form leg kinematics needs legs of three joints and no others, "
            f"not {', '.join(robot.joint_names)}{remedy}"
        )
    legs = [leg_frames(robot, leg) for leg in robot.legs]
    sense = np.empty((len(legs), len(JOINTS)))
    for row, leg, frames in zip(sense, robot.legs, legs, strict=True):
        for k, (joint, name) in enumerate(zip(JOINTS, robot.spec.leg_joints(leg), strict=True)):
            row[k] = np.sign(frames.axis[k, _AXES[joint]])
            if not np.allclose(frames.axis[k], row[k] * np.eye(3)[_AXES[joint]], atol=_PARALLEL):
                raise InvalidInput(
                    f"{robot.name}: joint {name} does not turn about the trunk's "
                    f"{'xyz'[_AXES[joint]]} axis when all angles are zero; closed-form leg "
                    "kinematics needs hips about x, thighs and calves about y"
                )
    offset, foot = np.stack([leg.offset for leg in legs]), np.stack([leg.foot for leg in legs])
    calf = sense[:, 2] * robot.standing[7:].reshape(sense.shape)[:, 2]
    straight = _pitch(foot[:, 0], foot[:, 2]) - _pitch(offset[:, 2, 0], offset[:, 2, 2])
    knee = np.where(calf + straight > 0.0, 1.0, -1.0)
    return LegGeometry(offset[:, 0], offset[:, 1], offset[:, 2], foot, sense, knee)


def leg_motion(geometry: LegGeometry, joints: Array, rates: Array) -> LegMotion:
    """Feet and calves relative to the trunk.

    Args:
        geometry: Offsets of the legs.
        joints: Joint angles [rad], shape (..., legs, 3).
        rates: Joint velocities [rad/s], shape (..., legs, 3).
    """
    hip, thigh, calf = np.moveaxis(geometry.sense * joints, -1, 0).copy()  # (..., legs)
    hip_rate, thigh_rate, bend_rate = np.moveaxis(geometry.sense * rates, -1, 0).copy()
    calf_rate = thigh_rate + bend_rate  # about y, of the calf against the hip link
    upper_z, upper_x = _turned(thigh, geometry.calf[..., 2], geometry.calf[..., 0])
    lower_z, lower_x = _turned(thigh + calf, geometry.foot[..., 2], geometry.foot[..., 0])
    # The foot from the hip joint and its velocity, in the hip link.
    arm_y = geometry.thigh[..., 1] + geometry.calf[..., 1] + geometry.foot[..., 1]
    arm_z = geometry.thigh[..., 2] + upper_z + lower_z
    rate_y = -hip_rate * arm_z
    rate_z = hip_rate * arm_y - thigh_rate * upper_x - calf_rate * lower_x
    cos, sin = np.cos(hip), np.sin(hip)
    position, velocity, spin = np.empty((3, *hip.shape, 3))
    position[..., 0] = geometry.thigh[..., 0] + upper_x + lower_x
    position[..., 1], position[..., 2] = cos * arm_y - sin * arm_z, sin * arm_y + cos * arm_z
    position += geometry.hip
    velocity[..., 0] = thigh_rate * upper_z + calf_rate * lower_z
    velocity[..., 1], velocity[..., 2] = cos * rate_y - sin * rate_z, sin * rate_y + cos * rate_z
    spin[..., 0], spin[..., 1], spin[..., 2] = hip_rate, cos * calf_rate, sin * calf_rate
    return LegMotion(position, velocity, spin)


class ContactPoints(NamedTuple):
    """Contact points of feet with the ground, in the trunk's frame."""

    position: Array
    """From the trunk's origin [m], shape (..., legs, 3)."""
    jacobian: Array
    """Velocities of the feet's material points there for unit joint rates, as seen from the trunk,
    shape (..., legs, 3, 3); the last axis is hip, thigh, calf."""


def contact_points(geometry: LegGeometry, joints: Array, down: Array) -> ContactPoints:
    """Contact points of the feet at `down` from their centres, and the Jacobians of their legs.

    Args:
        geometry: Offsets of the legs.
        joints: Joint angles [rad], shape (..., legs, 3).
        down: From the centres to the contacts, in the trunk's frame [m], shape (..., 3).
    """
    shape = (*joints.shape[:-2], 3, *joints.shape[-2:])  # an axis for the joint that moves
    rates = np.broadcast_to(np.eye(3)[:, None], shape)
    motion = leg_motion(geometry, np.broadcast_to(joints[..., None, :, :], shape), rates)
    columns = motion.velocity + np.cross(motion.calf_rate, down[..., None, None, :])
    position = motion.position[..., 0, :, :] + down[..., None, :]
    return ContactPoints(position, np.moveaxis(columns, -3, -1))


def leg_angles(
    geometry: LegGeometry, positions: Array, *, knee: Knee | None = None, hip: Hip = "above"
) -> tuple[Array, BoolArray]:
    """Closed-form joint angles for positions of the feet's centres, and whether they are in reach.

    Args:
        geometry: Offsets of the legs, or of one leg.
        positions: Foot centres from the trunk's origin, in the trunk's frame [m], shape
            (..., legs, 3), or (..., 3) for one leg.
        knee: Branch of the knee; None for that of the standing posture.
        hip: Branch of the hip: above the foot or below it.

    Returns:
        Hip, thigh and calf angle [rad], up to whole turns, shape (..., 3), those of the stretched
        or folded leg where the target is out of reach; shape (...).
    """
    # The hip angle turns the plane y = side of the leg about x, until it holds the target.
    target = positions - geometry.hip
    side = geometry.thigh[..., 1] + geometry.calf[..., 1] + geometry.foot[..., 1]
    square = target[..., 1] ** 2 + target[..., 2] ** 2 - side**2
    height = np.sqrt(np.maximum(square, 0.0)) * (-1.0 if hip == "above" else 1.0)
    hip_angle = np.arctan2(target[..., 2], target[..., 1]) - np.arctan2(height, side)
    x, z = target[..., 0] - geometry.thigh[..., 0], height - geometry.thigh[..., 2]
    side_of_knee = geometry.knee if knee is None else -1.0 if knee == "backward" else 1.0
    thigh_angle, calf_angle, in_plane = _two_links(geometry, x, z, side_of_knee)
    reachable = np.asarray(in_plane & (square >= -_ROUND_OFF))
    angles = np.stack([hip_angle, thigh_angle, calf_angle], axis=-1)
    return geometry.sense * angles, reachable


def _two_links(
    offsets: LegGeometry, x: Array, z: Array, knee: Array | float
) -> tuple[Array, Array, BoolArray]:
    """Thigh and calf angle that put the foot at (x, z) from the thigh joint; whether in reach."""
    calf, foot = offsets.calf, offsets.foot
    upper, lower = np.hypot(calf[..., 0], calf[..., 2]), np.hypot(foot[..., 0], foot[..., 2])
    cosine = (x**2 + z**2 - upper**2 - lower**2) / (2.0 * upper * lower)
    bend = np.arccos(np.clip(cosine, -1.0, 1.0)) * knee
    calf_angle = bend + _pitch(calf[..., 0], calf[..., 2]) - _pitch(foot[..., 0], foot[..., 2])
    # From the thigh joint to the foot at zero thigh angle.
    leg_z, leg_x = _turned(calf_angle, foot[..., 2], foot[..., 0])
    thigh_angle = _pitch(x, z) - _pitch(calf[..., 0] + leg_x, calf[..., 2] + leg_z)
    return thigh_angle, calf_angle, np.asarray(np.abs(cosine) <= 1.0 + _ROUND_OFF)


def _pitch(x: Array, z: Array) -> Array:
    """Angle about y that turns a vector pointing down into the direction of (x, z)."""
    return np.arctan2(-x, -z)


def _turned(angle: Array, first: Array, second: Array) -> tuple[Array, Array]:
    """Components along two axes turned by angles (...) from the first towards the second."""
    cos, sin = np.cos(angle), np.sin(angle)
    return cos * first - sin * second, sin * first + cos * second
