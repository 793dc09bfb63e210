"""Recursive Newton-Euler in CasADi, over the trunk and its left legs, in world axes.

Links, joint axes and inertias are Pinocchio's, turned into the trunk's axes at zero joint angles.
The tree is short and every leg is alike, so that world axes, with classical accelerations, keep it
plain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np

from ..._typing import Array
from ...kinematics import leg_frames, mirror
from ...robot import JOINTS, Base, Robot

BASE_COORDINATES: Mapping[Base, int] = {"locked": 2, "sagittal": 3, "free": 6}
"""Coordinates of the trunk: x and z, pitch where it is free, then y, roll and yaw."""


Half = Literal["mean", "difference", "own"]
"""Part of a pair of legs: their mean, half their difference, left less right, or each its own."""


class FrameMotion(NamedTuple):
    """Motion of a frame, in world axes; three rows each."""

    position: ca.SX
    velocity: ca.SX
    acceleration: ca.SX
    """Classical acceleration of the origin."""
    omega: ca.SX
    alpha: ca.SX


class _Inertia(NamedTuple):
    """Inertia of a body about the origin of its frame: what forces are linear in."""

    mass: float
    """[kg]"""
    first: Array
    """Mass times centre of mass [kg m], shape (3,)."""
    second: Array
    """Rotational inertia about the origin [kg m^2], shape (3, 3)."""

    def paired(self, other: _Inertia, sign: float) -> _Inertia:
        """Mean with another inertia; with a sign of -1, half the difference."""
        return _Inertia(
            0.5 * (self.mass + sign * other.mass),
            0.5 * (self.first + sign * other.first),
            0.5 * (self.second + sign * other.second),
        )

    def turned(self, rotation: Array) -> _Inertia:
        """The same inertia in turned axes."""
        second = rotation @ self.second @ rotation.T
        return _Inertia(self.mass, rotation @ self.first, second)

    def mirrored(self) -> _Inertia:
        """Mirror image about the plane y = 0."""
        flip = np.array([1.0, -1.0, 1.0])
        return _Inertia(self.mass, flip * self.first, np.outer(flip, flip) * self.second)


@dataclass(frozen=True)
class _Link:
    """A link with the joint that carries it, in the trunk's axes at zero joint angles.

    Attributes:
        translation: From the joint above to this one [m], shape (3,).
        axis: Joint axis, shape (3,).
        body: Inertia about the joint.
        armature: Inertia of the rotor as the joint feels it [kg m^2].
    """

    translation: Array
    axis: Array
    body: _Inertia
    armature: float


def newton_euler(
    robot: Robot,
    legs: tuple[str, ...],
    state: tuple[ca.SX, ca.SX, ca.SX],
    lam: ca.SX,
    gravity: Array,
    lever: Array,
    base: Base,
    half: Half = "mean",
) -> tuple[ca.SX, list[FrameMotion]]:
    """Inverse dynamics of the folded robot, by recursive Newton-Euler.

    Args:
        robot: The robot.
        legs: The legs that are kept; each counts twice on the trunk, once on a free one, which
            keeps them all.
        state: q, v and a of the folded robot, (8,) each, or (9,) with pitch, (18,) if free.
        lam: Contact forces of the kept feet in the world frame [N], (3, feet).
        gravity: Gravitational acceleration in the world [m/s^2], shape (3,).
        lever: From a foot's centre to where `lam` acts, in the world [m], shape (3,).
        base: How the trunk may move.
        half: With which inertias of the legs. Where left and right differ, the mean of a leg and
            its mirror image gives what the pair needs on average, and the trunk exactly; half
            their difference, with no trunk and no forces, what the left leg needs beyond that, and
            the right one less.

    Returns:
        The forces that must act along each coordinate (8, 9 or 18), and the motion of the feet.
    """
    q, v, a = state
    nb = BASE_COORDINATES[base]
    trunk, rotation, turns = _trunk(q[:nb], v[:nb], a[:nb])
    count = 1.0 if base == "free" else 2.0  # a leg, or the leg and its mirror image
    on_trunk, moment = _wrench(_inertia(robot, 1), rotation, trunk, gravity)
    pairs = {leg: _links(robot, leg, half) for leg in legs}
    torques, feet = [], []
    for i, leg in enumerate(legs):
        rows = slice(nb + i * len(JOINTS), nb + (i + 1) * len(JOINTS))
        joints = (q[rows], v[rows], a[rows])
        carried, torque, foot = _leg(
            robot, leg, pairs[leg], (trunk, rotation), joints, lam[:, i], gravity, lever
        )
        on_trunk = on_trunk + count * carried[0]
        moment = moment + count * carried[1]
        torques.append(torque)
        feet.append(foot)
    along = [on_trunk[0], on_trunk[2], ca.dot(turns[0], moment) if turns else moment[1]]
    if turns:
        along += [on_trunk[1], *(ca.dot(axis, moment) for axis in turns[1:])]
    along = along[:nb]
    return ca.vertcat(*along, *torques), feet


def _trunk(q: ca.SX, v: ca.SX, a: ca.SX) -> tuple[FrameMotion, ca.SX, list[ca.SX]]:
    """Motion and rotation of the trunk, and, where it is free, its axes of pitch, roll and yaw.

    The angles are those of `Rz(yaw) Ry(pitch) Rx(roll)`.
    """
    if q.numel() <= BASE_COORDINATES["sagittal"]:
        return *_planar(q, v, a), []
    position, velocity, acceleration = (ca.vertcat(x[0], x[3], x[1]) for x in (q, v, a))
    x, y, z = np.eye(3)
    turned = _rotation(z, q[5])
    pitching = turned @ ca.DM(y)
    turned = turned @ _rotation(y, q[2])
    rolling, yawing = turned @ ca.DM(x), ca.SX(ca.DM(z))
    omega, alpha = yawing * v[5], yawing * a[5]
    for axis, row in ((pitching, 2), (rolling, 4)):
        alpha = alpha + axis * a[row] + ca.cross(omega, axis * v[row])
        omega = omega + axis * v[row]
    motion = FrameMotion(position, velocity, acceleration, omega, alpha)
    return motion, turned @ _rotation(x, q[4]), [pitching, rolling, yawing]


def _planar(q: ca.SX, v: ca.SX, a: ca.SX) -> tuple[FrameMotion, ca.SX]:
    """Motion and rotation of the trunk, held to the sagittal plane."""
    position, velocity, acceleration = (ca.vertcat(x[0], 0.0, x[1]) for x in (q, v, a))
    if q.numel() == 2:
        still = ca.SX(3, 1)
        return FrameMotion(position, velocity, acceleration, still, still), ca.SX.eye(3)
    omega, alpha = (ca.vertcat(0.0, x[2], 0.0) for x in (v, a))
    rotation = _rotation(np.array([0.0, 1.0, 0.0]), q[2])
    return FrameMotion(position, velocity, acceleration, omega, alpha), rotation


def _leg(
    robot: Robot,
    leg: str,
    links: list[_Link],
    trunk: tuple[FrameMotion, ca.SX],
    joints: tuple[ca.SX, ca.SX, ca.SX],
    lam: ca.SX,
    gravity: Array,
    lever: Array,
) -> tuple[tuple[ca.SX, ca.SX], ca.SX, FrameMotion]:
    """One leg: the force on it from the trunk and its moment about the trunk's origin (3 each),
    its motor torques (3), its foot's motion."""
    motion, rotation = trunk
    motions, axes, wrenches, rotors = [], [], [], []
    for link, q, v, a in zip(links, *map(ca.vertsplit, joints), strict=True):
        motion = _moved(motion, rotation @ ca.DM(link.translation))
        rotation = rotation @ _rotation(link.axis, q)
        axis = rotation @ ca.sparsify(ca.DM(link.axis))
        motion = motion._replace(
            omega=motion.omega + axis * v,
            alpha=motion.alpha + axis * a + ca.cross(motion.omega, axis * v),
        )
        motions.append(motion)
        axes.append(axis)
        wrenches.append(_wrench(link.body, rotation, motion, gravity))
        rotors.append(link.armature * a)

    foot = _moved(motion, rotation @ ca.DM(leg_frames(robot, leg).foot))
    force, point = -lam, foot.position + lever
    moment = ca.SX.zeros(3)
    torques = []
    # From the foot up: what the joint above must carry, about its own origin.
    for joint, axis, wrench in zip(motions[::-1], axes[::-1], wrenches[::-1], strict=True):
        moment = moment + ca.cross(point - joint.position, force) + wrench[1]
        force, point = force + wrench[0], joint.position
        torques.append(ca.dot(axis, moment))
    moment = moment + ca.cross(point - trunk[0].position, force)
    return (force, moment), ca.vertcat(*torques[::-1]) + ca.vertcat(*rotors), foot


def _moved(motion: FrameMotion, arm: ca.SX) -> FrameMotion:
    """Motion of a point that is fixed to a moving body, at `arm` from its origin."""
    omega, alpha = motion.omega, motion.alpha
    swing = ca.cross(omega, arm)
    return FrameMotion(
        motion.position + arm,
        motion.velocity + swing,
        motion.acceleration + ca.cross(alpha, arm) + ca.cross(omega, swing),
        omega,
        alpha,
    )


def _wrench(
    body: _Inertia, rotation: ca.SX, motion: FrameMotion, gravity: Array
) -> tuple[ca.SX, ca.SX]:
    """Force and moment about its frame's origin that a body's own motion needs, in world axes."""
    first = rotation @ ca.DM(body.first)
    second = rotation @ ca.DM(body.second) @ rotation.T
    fall, omega, alpha = motion.acceleration - gravity, motion.omega, motion.alpha
    force = body.mass * fall + ca.cross(alpha, first) + ca.cross(omega, ca.cross(omega, first))
    moment = ca.cross(first, fall) + second @ alpha + ca.cross(omega, second @ omega)
    return force, moment


def _rotation(axis: Array, angle: ca.SX) -> ca.SX:
    """Rotation matrix about an axis a, `1 + sin(angle) a^ + (1 - cos(angle)) a^ a^` (Rodrigues)."""
    skew = ca.sparsify(ca.DM(np.cross(np.eye(3), axis)))
    return ca.SX.eye(3) + ca.sin(angle) * skew + (1.0 - ca.cos(angle)) * (skew @ skew)


def _links(robot: Robot, leg: str, half: Half) -> list[_Link]:
    """The links of a leg from the trunk down, with their share of the pair's inertias."""
    links, sign = [], 1.0 if half == "mean" else -1.0
    other = robot.legs[mirror(robot).partner[robot.legs.index(leg)]]
    frames, images = leg_frames(robot, leg), leg_frames(robot, other)
    names = zip(robot.spec.leg_joints(leg), robot.spec.leg_joints(other), strict=True)
    for k, joints in enumerate(names):
        i, j = (robot.model.getJointId(name) for name in joints)
        own = _inertia(robot, i).turned(frames.rotation[k])
        rotor = float(robot.model.armature[robot.model.joints[i].idx_v])
        if half != "own":
            image = _inertia(robot, j).turned(images.rotation[k]).mirrored()
            other_rotor = float(robot.model.armature[robot.model.joints[j].idx_v])
            own, rotor = own.paired(image, sign), 0.5 * (rotor + sign * other_rotor)
        links.append(
            _Link(
                translation=frames.offset[k],
                axis=np.round(frames.axis[k]),  # the trunk's, as `leg_geometry` has made sure
                body=own,
                armature=rotor,
            )
        )
    return links


def _inertia(robot: Robot, joint: int) -> _Inertia:
    """Inertia of the body that a joint of Pinocchio's model carries."""
    body = robot.model.inertias[joint]
    mass, com = float(body.mass), np.array(body.lever)
    steiner = mass * (com @ com * np.eye(3) - np.outer(com, com))
    return _Inertia(mass, mass * com, np.array(body.inertia) + steiner)
