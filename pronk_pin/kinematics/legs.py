"""Closed-form kinematics of a three-joint leg in the trunk's frame, vectorised over batches.

A leg turns about x at the hip and about y at the thigh and the calf; its foot is at

    p = hip + Rx(q_hip) [thigh + Ry(q_thigh) (calf + Ry(q_calf) foot)]

with the offsets of `LegGeometry`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .._typing import Array
from ..errors import InvalidInput
from ..robot import JOINTS, Robot

_AXES = {"hip": "RX", "thigh": "RY", "calf": "RY"}


class LegGeometry(NamedTuple):
    """Offsets of the legs [m] in the trunk's axes at zero joint angles."""

    hip: Array
    """From the trunk's origin to the hip joint, shape (legs, 3)."""
    thigh: Array
    """From the hip joint to the thigh joint, shape (legs, 3)."""
    calf: Array
    """From the thigh joint to the calf joint, shape (legs, 3)."""
    foot: Array
    """From the calf joint to the centre of the foot, shape (legs, 3)."""


class LegMotion(NamedTuple):
    """Feet and calves relative to the trunk, in the trunk's frame."""

    position: Array
    """Foot centres from the trunk's origin [m], shape (..., legs, 3)."""
    velocity: Array
    """Their rates of change as seen from the trunk [m/s], shape (..., legs, 3)."""
    calf_rate: Array
    """Angular velocity of the calves relative to the trunk [rad/s], shape (..., legs, 3)."""


@lru_cache(maxsize=16)
def leg_geometry(robot: Robot) -> LegGeometry:
    """Offsets of the legs, read from the model's joint placements.

    Raises:
        InvalidInput: The legs have not three joints about x, y, y in parallel frames, or there are
            joints besides: the closed form does not hold.
    """
    model = robot.model
    if len(robot.spec.joints) != len(JOINTS) or robot.joint_names != robot.spec.joint_names:
        raise InvalidInput(
            f"{robot.name}: closed-form leg kinematics needs legs of three joints and no others, "
            f"not {', '.join(robot.joint_names)}"
        )
    offsets: dict[str, list[Array]] = {part: [] for part in (*JOINTS, "foot")}
    for leg, foot_id in zip(robot.legs, robot.foot_ids, strict=True):
        for joint, name in zip(JOINTS, robot.spec.leg_joints(leg), strict=True):
            joint_id = model.getJointId(name)
            placement = model.jointPlacements[joint_id]
            kind = model.joints[joint_id].shortname().removeprefix("JointModel")
            if kind != _AXES[joint] or not np.allclose(placement.rotation, np.eye(3), atol=1e-9):
                raise InvalidInput(
                    f"{robot.name}: joint {name} is not a {_AXES[joint]} joint parallel to the "
                    "trunk; closed-form leg kinematics needs hips about x, thighs and calves "
                    "about y"
                )
            offsets[joint].append(np.array(placement.translation))
        offsets["foot"].append(np.array(model.frames[foot_id].placement.translation))
    return LegGeometry(*(np.stack(offsets[part]) for part in (*JOINTS, "foot")))


def leg_motion(geometry: LegGeometry, joints: Array, rates: Array) -> LegMotion:
    """Feet and calves relative to the trunk.

    Args:
        geometry: Offsets of the legs.
        joints: Joint angles [rad], shape (..., legs, 3).
        rates: Joint velocities [rad/s], shape (..., legs, 3).
    """
    hip_rate, thigh_rate = rates[..., 0], rates[..., 1]
    calf_rate = thigh_rate + rates[..., 2]  # about y, of the calf against the hip link
    upper = turn_y(joints[..., 1], geometry.calf)  # (..., legs, 3)
    lower = turn_y(joints[..., 1] + joints[..., 2], geometry.foot)
    arm = geometry.thigh + upper + lower
    velocity = np.stack(
        [
            thigh_rate * upper[..., 2] + calf_rate * lower[..., 2],
            -hip_rate * arm[..., 2],
            hip_rate * arm[..., 1] - thigh_rate * upper[..., 0] - calf_rate * lower[..., 0],
        ],
        axis=-1,
    )
    spin = np.stack([hip_rate, calf_rate, np.zeros_like(hip_rate)], axis=-1)
    hip = joints[..., 0]
    return LegMotion(
        position=geometry.hip + turn_x(hip, arm),
        velocity=turn_x(hip, velocity),
        calf_rate=turn_x(hip, spin),
    )


def turn_x(angle: Array, vector: Array) -> Array:
    """Vectors (..., 3) turned about x by angles (...)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vector, -1, 0)
    return np.stack([np.broadcast_to(x, cos.shape), cos * y - sin * z, sin * y + cos * z], axis=-1)


def turn_y(angle: Array, vector: Array) -> Array:
    """Vectors (..., 3) turned about y by angles (...)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(vector, -1, 0)
    return np.stack([cos * x + sin * z, np.broadcast_to(y, cos.shape), cos * z - sin * x], axis=-1)
