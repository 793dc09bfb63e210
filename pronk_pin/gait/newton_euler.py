"""Recursive Newton-Euler in CasADi, over the trunk and its left legs, in world axes.

Links, joint axes and inertias are Pinocchio's. The tree is short and every leg is alike, so that
world axes, with classical accelerations, keep it plain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from .._typing import Array
from ..robot import JOINTS, Robot

NB_FOLDED = 2
"""Coordinates of the trunk: x and z."""


class FrameMotion(NamedTuple):
    """Motion of a frame, in world axes; three rows each."""

    position: ca.SX
    velocity: ca.SX
    acceleration: ca.SX
    """Classical acceleration of the origin."""
    omega: ca.SX
    alpha: ca.SX


@dataclass(frozen=True)
class _Link:
    """A link as Pinocchio has it, with the joint that carries it.

    Attributes:
        rotation, translation: Placement of the joint in its parent, shapes (3, 3) and (3,).
        axis: Joint axis in the joint's frame, shape (3,).
        mass: Mass [kg].
        com: Centre of mass in the joint's frame [m], shape (3,).
        inertia: Rotational inertia about the centre of mass [kg m^2], shape (3, 3).
        armature: Inertia of the rotor as the joint feels it [kg m^2].
    """

    rotation: Array
    translation: Array
    axis: Array
    mass: float
    com: Array
    inertia: Array
    armature: float


def newton_euler(
    robot: Robot,
    legs: tuple[str, ...],
    state: tuple[ca.SX, ca.SX, ca.SX],
    lam: ca.SX,
    gravity: Array,
    lever: Array,
) -> tuple[ca.SX, list[FrameMotion]]:
    """What forces a motion of the folded robot needs.

    Args:
        robot: The robot.
        legs: The legs that are kept; each counts twice on the trunk.
        state: q, v and a of the folded robot, (8,) each.
        lam: Contact forces of the kept feet in the world frame [N], (3, feet).
        gravity: Gravitational acceleration in the world [m/s^2], shape (3,).
        lever: From a foot's centre to where `lam` acts, in the world [m], shape (3,).

    Returns:
        The forces that must act along each coordinate (8), and the motion of the feet.
    """
    q, v, a = state
    trunk = _planar(q[:NB_FOLDED], v[:NB_FOLDED], a[:NB_FOLDED])
    on_trunk = robot.model.inertias[1].mass * (trunk.acceleration - gravity)
    torques, feet = [], []
    for i, leg in enumerate(legs):
        rows = slice(NB_FOLDED + i * len(JOINTS), NB_FOLDED + (i + 1) * len(JOINTS))
        joints = (q[rows], v[rows], a[rows])
        force, torque, foot = _leg(robot, leg, trunk, joints, lam[:, i], gravity, lever)
        on_trunk = on_trunk + 2.0 * force  # the leg and its mirror image
        torques.append(torque)
        feet.append(foot)
    return ca.vertcat(on_trunk[0], on_trunk[2], *torques), feet


def _planar(q: ca.SX, v: ca.SX, a: ca.SX) -> FrameMotion:
    """Motion of the trunk, held to the sagittal plane without rotation."""
    position, velocity, acceleration = (ca.vertcat(x[0], 0.0, x[1]) for x in (q, v, a))
    return FrameMotion(position, velocity, acceleration, ca.SX(3, 1), ca.SX(3, 1))


def _leg(
    robot: Robot,
    leg: str,
    trunk: FrameMotion,
    joints: tuple[ca.SX, ca.SX, ca.SX],
    lam: ca.SX,
    gravity: Array,
    lever: Array,
) -> tuple[ca.SX, ca.SX, FrameMotion]:
    """One leg: the force on it from the trunk (3), its motor torques (3), its foot's motion."""
    links = _links(robot, leg)
    motion, rotation = trunk, ca.SX.eye(3)
    motions, axes, wrenches, rotors = [], [], [], []
    for link, q, v, a in zip(links, *map(ca.vertsplit, joints), strict=True):
        motion = _moved(motion, rotation @ ca.DM(link.translation))
        rotation = rotation @ ca.sparsify(ca.DM(link.rotation)) @ _rotation(link.axis, q)
        axis = rotation @ ca.sparsify(ca.DM(link.axis))
        motion = motion._replace(
            omega=motion.omega + axis * v,
            alpha=motion.alpha + axis * a + ca.cross(motion.omega, axis * v),
        )
        motions.append(motion)
        axes.append(axis)
        wrenches.append(_wrench(link, rotation, motion, gravity))
        rotors.append(link.armature * a)

    frame = robot.model.frames[robot.foot_ids[robot.legs.index(leg)]]
    foot = _moved(motion, rotation @ ca.DM(frame.placement.translation))
    force, point = -lam, foot.position + lever
    moment = ca.SX.zeros(3)
    torques = []
    # From the foot up: what the joint above must carry, about its own origin.
    for joint, axis, wrench in zip(motions[::-1], axes[::-1], wrenches[::-1], strict=True):
        moment = moment + ca.cross(point - joint.position, force) + wrench[1]
        force, point = force + wrench[0], joint.position
        torques.append(ca.dot(axis, moment))
    return force, ca.vertcat(*torques[::-1]) + ca.vertcat(*rotors), foot


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
    link: _Link, rotation: ca.SX, motion: FrameMotion, gravity: Array
) -> tuple[ca.SX, ca.SX]:
    """Force and moment about the joint's origin that a link's own motion needs, in world axes."""
    arm = rotation @ ca.DM(link.com)
    force = link.mass * (_moved(motion, arm).acceleration - gravity)
    inertia = rotation @ ca.DM(link.inertia) @ rotation.T
    spin = inertia @ motion.alpha + ca.cross(motion.omega, inertia @ motion.omega)
    return force, spin + ca.cross(arm, force)


def _rotation(axis: Array, angle: ca.SX) -> ca.SX:
    """Rodrigues' formula."""
    skew = ca.sparsify(ca.DM(np.cross(np.eye(3), axis)))
    return ca.SX.eye(3) + ca.sin(angle) * skew + (1.0 - ca.cos(angle)) * (skew @ skew)


def _links(robot: Robot, leg: str) -> list[_Link]:
    """The links of a leg from the trunk down."""
    links = []
    for name in robot.spec.leg_joints(leg):
        i = robot.model.getJointId(name)
        placement, inertia = robot.model.jointPlacements[i], robot.model.inertias[i]
        links.append(
            _Link(
                rotation=np.array(placement.rotation),
                translation=np.array(placement.translation),
                axis=np.array(robot.model.joints[i].createData().S).ravel()[3:],
                mass=float(inertia.mass),
                com=np.array(inertia.lever),
                inertia=np.array(inertia.inertia),
                armature=float(robot.model.armature[robot.model.joints[i].idx_v]),
            )
        )
    return links
