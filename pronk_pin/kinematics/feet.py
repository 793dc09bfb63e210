"""Kinematics of the legs: feet from joints, joints from feet, trunk velocity from stance legs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from .._checks import known_name, none_or
from .._typing import Array, BoolArray
from ..errors import InvalidInput
from ..robot import (
    JOINTS,
    NB,
    Robot,
    as_array,
    as_numbers,
    as_q,
    as_robot,
    as_state,
    by_state,
    leg_indices,
    rotation_matrix,
)
from .contacts import Contact, contact_radius
from .legs import Hip, Knee, LegGeometry, leg_angles, leg_geometry, leg_motion

_ROUND_OFF = 1e-9
"""Round-off [rad] by which a joint limit may be exceeded."""


class LegSolution(NamedTuple):
    """Joint angles of one leg from the position of its foot."""

    joints: Array
    """Hip, thigh and calf angle [rad], shape (..., 3); for a target out of reach, those of the
    stretched or folded leg that points at it."""
    reachable: BoolArray
    """Whether the links reach the target, whatever the joint limits, shape (...)."""
    within_limits: BoolArray
    """Whether the angles respect the joint limits, shape (...)."""


def foot_positions(robot: Robot, q: npt.ArrayLike) -> Array:
    """Centres of the feet in the world: g_l(q) of eq. (3); batched.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19).

    Returns:
        Positions [m], shape (..., 4, 3), in the order of `robot.legs`.

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
    """
    q = as_q(robot, q)
    model, data, ids = robot.model, robot.data, robot.foot_ids
    placements = data.oMf

    def feet(row: Array) -> list[Array]:
        pin.framesForwardKinematics(model, data, row)
        return [placements[foot].translation for foot in ids]

    return by_state(feet, (len(ids), 3), q)


def foot_velocities(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """Velocities of the feet's centres in the world: the middle of eq. (3) [m/s]; batched.

    As `foot_positions`, with the velocity v, shape (..., 18).
    """
    q, v = as_state(robot, q, v)
    model, data, ids, world = robot.model, robot.data, robot.foot_ids, pin.LOCAL_WORLD_ALIGNED

    def feet(q_row: Array, v_row: Array) -> list[Array]:
        pin.forwardKinematics(model, data, q_row, v_row)
        return [pin.getFrameVelocity(model, data, foot, world).linear for foot in ids]

    return by_state(feet, (len(ids), 3), q, v)


def leg_inverse_kinematics(
    robot: Robot,
    positions: npt.ArrayLike,
    *,
    leg: str,
    knee: Knee | None = None,
    hip: Hip = "above",
) -> LegSolution:
    """Joint angles that put the centre of one foot at given positions; closed form, batched.

    Args:
        robot: The robot.
        positions: Foot centres from the trunk's origin, in the trunk's frame [m], shape (..., 3).
        leg: Name of the leg, as in `robot.legs`.
        knee: Branch of the knee: "backward" or "forward"; by default as the robot stands.
        hip: Branch of the hip: "above" the foot or "below" it.

    Raises:
        InvalidInput: A wrong shape or NaN, or the robot's legs have no closed form.
        UnknownName: There is no such leg, knee or hip.
    """
    index = leg_indices(robot, [known_name("leg", leg, as_robot(robot).legs)])[0]
    none_or(known_name, "knee", knee, ("backward", "forward"))
    known_name("hip", hip, ("above", "below"))
    offsets = LegGeometry(*(part[index] for part in leg_geometry(robot)))
    positions = as_array("positions", positions, 3, None)
    angles, reachable = leg_angles(offsets, positions, knee=knee, hip=hip)
    limits = slice(len(JOINTS) * index, len(JOINTS) * (index + 1))
    joints, within = _in_range(angles, robot.q_min[limits], robot.q_max[limits])
    return LegSolution(joints, reachable, within)


def leg_odometry(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "rolling",
) -> Array:
    """Trunk velocity from legs that stand without slipping; closed form, batched.

    With the foot's centre at c in the trunk, the trunk turning with w and the calf with w_calf,
    the velocity of the foot's centre is that of a sphere rolling on the ground:

        v_trunk + w x c + c_dot = w_calf x (r z)

    and zero for a point contact. Each leg gives one velocity; the answer is their mean.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19); the position is not used.
        v: Velocity, shape (..., 18); the base's linear velocity is not used.
        feet: Legs in stance; all if None.
        contact: "rolling", on spheres of `robot.foot_radius`, or "point", fixed at the centre.

    Returns:
        Linear velocity of the trunk's origin in the world [m/s], shape (..., 3).

    Raises:
        InvalidInput: A wrong shape, NaN, a quaternion that is not normalised, or no foot at all.
        UnknownName: There is no such leg or contact.
    """
    q, v = as_state(robot, q, v)
    stance = leg_indices(robot, feet)
    if not stance:
        raise InvalidInput("odometry needs at least one leg in stance; feet is empty")
    radius = contact_radius(robot, contact)
    shape = (*q.shape[:-1], len(robot.legs), len(JOINTS))
    legs = leg_motion(leg_geometry(robot), q[..., 7:].reshape(shape), v[..., NB:].reshape(shape))
    rotation = rotation_matrix(q[..., 3:7])
    # All legs see the same trunk and the same ground: the mean of theirs is that of the mean leg.
    position, velocity, calf_rate = (motion[..., stance, :].mean(axis=-2) for motion in legs)
    spin = v[..., 3:NB]
    trunk = -velocity - np.cross(spin, position)  # (..., 3), in the trunk
    if radius:
        trunk += np.cross(spin + calf_rate, radius * rotation[..., 2, :])
    return np.asarray(np.einsum("...ij,...j->...i", rotation, trunk))


def leg_angle(robot: Robot, joints: npt.ArrayLike) -> Array:
    """Leg angles: theta = q_thigh + q_calf / 2, below eq. (11) of the paper; batched.

    The joints' angles count about the trunk's y axis: where a URDF's joint turns against it, its
    angle with the other sign.

    Args:
        robot: The robot, with legs of three joints.
        joints: Joint angles [rad], shape (..., 12).

    Returns:
        Leg angles [rad], shape (..., 4); positive where the foot is behind the hip.

    Raises:
        InvalidInput: A wrong shape or NaN.
    """
    legs = as_array("joints", joints, as_robot(robot).nu, None)
    sense = leg_geometry(robot).sense
    thigh, calf = (sense[:, k] * legs[..., k :: len(JOINTS)] for k in (1, 2))
    return thigh + 0.5 * calf


def rotate_leg(robot: Robot, joints: npt.ArrayLike, delta: npt.ArrayLike) -> Array:
    """Joint angles with the legs turned about the thigh joints at equal length; batched.

    The inverse kinematics behind eq. (12). The thigh joint lies on the axis the leg turns about,
    so its angle takes up the whole turn and hip and calf stay: exactly what
    `leg_inverse_kinematics` gives for the turned foot.

    Args:
        robot: The robot.
        joints: Joint angles [rad], shape (..., 12).
        delta: Turn of the legs [rad], one or of a shape that broadcasts to (..., 4); positive
            moves feet backward.

    Raises:
        InvalidInput: A wrong shape or NaN.
    """
    turned = as_array("joints", joints, as_robot(robot).nu, None).copy()
    thighs = turned[..., 1 :: len(JOINTS)]
    turn = as_numbers("delta", delta)
    if not np.isfinite(turn).all():
        raise InvalidInput("delta holds NaN or infinite values; remove them first")
    try:
        thighs += leg_geometry(robot).sense[:, 1] * turn
    except ValueError as error:
        raise InvalidInput(f"delta does not fit the legs, {thighs.shape}: {error}") from error
    return turned


def _in_range(angles: Array, low: Array, high: Array) -> tuple[Array, BoolArray]:
    """Angles (..., 3) wrapped as near the middle of their range as can be; whether all
    are within it, shape (...)."""
    # The middle counts: the thigh of the A1 goes beyond pi.
    limited = np.isfinite(low) & np.isfinite(high)
    middle = 0.5 * (np.where(limited, low, 0.0) + np.where(limited, high, 0.0))
    joints = (angles - middle + np.pi) % (2.0 * np.pi) - np.pi + middle
    inside = (joints >= low - _ROUND_OFF) & (joints <= high + _ROUND_OFF)
    return joints, np.asarray(inside.all(axis=-1))
