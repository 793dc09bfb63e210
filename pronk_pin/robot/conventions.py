"""Conversions between the orders and frames of Pinocchio, MuJoCo and the paper.

The only module that knows more than one convention. Joints are matched by name, never by slice.

=============  ==================  =====================================================
convention     order of the legs   floating base
=============  ==================  =====================================================
Pinocchio      FL, FR, RL, RR      quaternion xyzw; velocity in the body frame
MuJoCo         as in the URDF      quaternion wxyz; linear velocity in the world, angular
                                   velocity in the body frame
paper          FR, FL, RR, RL      (joints only)
=============  ==================  =====================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .._checks import sequence_of, text
from .._typing import Array, IntArray
from ..errors import InvalidInput
from .robot import Robot
from .state import as_array, as_q, as_robot


class MujocoState(NamedTuple):
    """A state in MuJoCo's convention; a field is None where nothing was given."""

    qpos: Array
    """Positions, shape (..., 19): world position, quaternion wxyz, joints."""
    qvel: Array | None
    """Velocities, shape (..., 18): linear in the world, angular in the body, joints."""
    qacc: Array | None
    """Accelerations, shape (..., 18), in the frames of qvel."""
    ctrl: Array | None
    """Motor torques [N m], shape (..., 12)."""


class PinocchioState(NamedTuple):
    """A state in Pinocchio's convention; a field is None where nothing was given."""

    q: Array
    """Configuration, shape (..., 19): world position, quaternion xyzw, joints."""
    v: Array | None
    """Velocity, shape (..., 18): linear and angular in the body frame, joints."""
    a: Array | None
    """Acceleration, shape (..., 18): the time derivative of v."""
    tau: Array | None
    """Motor torques [N m], shape (..., 12)."""


def joint_order(names: tuple[str, ...], wanted: tuple[str, ...]) -> IntArray:
    """Indices that pick `wanted` out of `names`: `x_wanted = x_names[..., indices]`."""
    names = names if isinstance(names, tuple) else sequence_of("names", names, text)
    wanted = wanted if isinstance(wanted, tuple) else sequence_of("wanted", wanted, text)
    if sorted(names) != sorted(wanted):
        raise InvalidInput(
            f"the joints {', '.join(names)} and {', '.join(wanted)} are not the same; "
            "both must name the robot's joints"
        )
    return np.array([names.index(name) for name in wanted], dtype=np.intp)


def to_mujoco(
    robot: Robot,
    q: Array,
    v: Array | None = None,
    a: Array | None = None,
    tau: Array | None = None,
    *,
    joints: Sequence[str] | None = None,
) -> MujocoState:
    """Convert a state of the floating-base robot from Pinocchio to MuJoCo; batched.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19).
        v: Velocity, shape (..., 18); needed where `a` is given.
        a: Acceleration, shape (..., 18).
        tau: Motor torques [N m], shape (..., 12).
        joints: Names of the joints in the order of MuJoCo's model; that of the URDF if None. Of
            a compiled model: `[m.joint(i).name for i in range(1, m.njnt)]`.

    Raises:
        InvalidInput: A shape does not fit, `a` comes without `v`, or `joints` are not the robot's.
    """
    q, v, a, tau = _checked(robot, q, v, a, tau)
    order = joint_order(robot.joint_names, _given_joints(robot, joints))
    rotation = rotation_matrix(q[..., 3:7])
    qpos = np.concatenate([q[..., :3], q[..., [6, 3, 4, 5]], q[..., 7:][..., order]], axis=-1)
    qvel = qacc = None
    if v is not None:
        linear = _rotate(rotation, v[..., :3])
        qvel = np.concatenate([linear, v[..., 3:6], v[..., 6:][..., order]], axis=-1)
    if a is not None and v is not None:
        # The world acceleration is the body acceleration plus the transport term.
        linear = _rotate(rotation, a[..., :3] + np.cross(v[..., 3:6], v[..., :3]))
        qacc = np.concatenate([linear, a[..., 3:6], a[..., 6:][..., order]], axis=-1)
    return MujocoState(qpos, qvel, qacc, None if tau is None else tau[..., order])


def from_mujoco(
    robot: Robot,
    qpos: Array,
    qvel: Array | None = None,
    qacc: Array | None = None,
    ctrl: Array | None = None,
    *,
    joints: Sequence[str] | None = None,
) -> PinocchioState:
    """Convert a state of the floating-base robot from MuJoCo to Pinocchio; batched.

    The inverse of `to_mujoco`; arguments and errors are those of its result.
    """
    qpos, qvel, qacc, ctrl = _checked(robot, qpos, qvel, qacc, ctrl)
    order = joint_order(_given_joints(robot, joints), robot.joint_names)
    q = np.concatenate([qpos[..., :3], qpos[..., [4, 5, 6, 3]], qpos[..., 7:][..., order]], axis=-1)
    inverse = np.swapaxes(rotation_matrix(q[..., 3:7]), -1, -2)
    v = a = None
    if qvel is not None:
        linear = _rotate(inverse, qvel[..., :3])
        v = np.concatenate([linear, qvel[..., 3:6], qvel[..., 6:][..., order]], axis=-1)
    if qacc is not None and v is not None:
        linear = _rotate(inverse, qacc[..., :3]) - np.cross(v[..., 3:6], v[..., :3])
        a = np.concatenate([linear, qacc[..., 3:6], qacc[..., 6:][..., order]], axis=-1)
    return PinocchioState(q, v, a, None if ctrl is None else ctrl[..., order])


def to_paper(robot: Robot, joints: Array) -> Array:
    """Joint quantities (..., 12) in the paper's order of legs.

    Raises:
        InvalidInput: A wrong shape, NaN, or a robot that has not two front and two rear legs.
    """
    return as_array("joints", joints, as_robot(robot).nu, None)[
        ..., joint_order(robot.joint_names, _paper_names(robot))
    ]


def from_paper(robot: Robot, joints: Array) -> Array:
    """Joint quantities (..., 12) from the paper's order of legs to Pinocchio's.

    Errors are those of `to_paper`.
    """
    return as_array("joints", joints, as_robot(robot).nu, None)[
        ..., joint_order(_paper_names(robot), robot.joint_names)
    ]


def rotation_matrix(quaternion: Array) -> Array:
    """Rotation matrices (..., 3, 3) of unit quaternions xyzw (..., 4)."""
    x, y, z, w = np.moveaxis(quaternion, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _given_joints(robot: Robot, joints: Sequence[str] | None) -> tuple[str, ...]:
    return robot.urdf_joint_names if joints is None else sequence_of("joints", joints, text)


def _paper_names(robot: Robot) -> tuple[str, ...]:
    """The joints in the paper's order of legs: front right, front left, rear right, rear left.

    Which leg is where is read from the model, so that HR of Solo12 takes the place of RR.
    """
    hips = (robot.model.getJointId(robot.spec.leg_joints(leg)[0]) for leg in robot.legs)
    places = (robot.model.jointPlacements[hip].translation for hip in hips)
    by_place = {
        (bool(x < 0.0), bool(y > 0.0)): robot.spec.leg_joints(leg)
        for leg, (x, y, _) in zip(robot.legs, places, strict=True)
    }
    names = tuple(name for place in sorted(by_place) for name in by_place[place])
    if len(by_place) != 4 or len(names) != robot.nu:
        raise InvalidInput(
            f"{robot.name}: the paper's order is that of two front and two rear legs and no other "
            "joints; this robot has no such order"
        )
    return names


def _rotate(rotation: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("...ij,...j->...i", rotation, vector))


def _checked(
    robot: Robot, q: Array, v: Array | None, a: Array | None, tau: Array | None
) -> tuple[Array, Array | None, Array | None, Array | None]:
    """Arrays of the right sizes and one batch shape, with a unit quaternion.

    Only the norm of the quaternion matters here, and both orders of its components share it.
    """
    q = as_q(robot, q)
    batch = q.shape[:-1]
    if a is not None and v is None:
        raise InvalidInput("an acceleration changes frames only with its velocity; give both")
    return (
        q,
        None if v is None else as_array("the velocity", v, robot.nv, batch),
        None if a is None else as_array("the acceleration", a, robot.nv, batch),
        None if tau is None else as_array("the torques", tau, robot.nu, batch),
    )
