"""Dynamics of a robot whose trunk a planar constraint holds to the sagittal plane, and their
derivatives.

The planar constraint takes the trunk's y, roll and yaw, and, where the base is locked, its pitch.
Left free are x, z, perhaps pitch, and the joints: 14 or 15 coordinates y with the rates y'. On
their rows eq. (5) holds as it stands, and eq. (2) in flight; the planar constraint's forces are in
the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from .._typing import Array, IntArray
from ..kinematics import Contact, contact_bias, contact_jacobian
from ..robot import NB, Base, Robot
from .derivatives import partials


def planar_rows(robot: Robot, base: Base = "locked") -> IntArray:
    """Indices of the velocities that the planar constraint leaves free: x, z, perhaps pitch, and
    the joints.

    No constraint holds a free trunk, and all are left. x and z are those of the trunk,
    which stay in the sagittal plane.
    """
    if base == "free":
        return np.arange(robot.nv, dtype=np.intp)
    free = (0, 2, 4) if base == "sagittal" else (0, 2)
    return np.array([*free, *range(NB, robot.nv)], dtype=np.intp)


def planar_equations(
    robot: Robot,
    q: Array,
    v: Array,
    tau: Array,
    *,
    contact: Contact = "rolling",
    feet: Sequence[str] = (),
    base: Base = "locked",
) -> tuple[Array, Array]:
    """Matrix and right-hand side of eq. (5) on the rows that the planar constraint leaves free, (2)
    in flight.

    Arguments are those of `planar_dynamics`. The unknowns are the accelerations of the free rows,
    and the contact forces of the feet.
    """
    rows = planar_rows(robot, base)
    mass = pin.crba(robot.model, robot.data, q)[np.ix_(rows, rows)]  # (14 or 15, ...)
    force = np.concatenate([np.zeros(NB), robot.joint_torques(tau, v[NB:])])
    force = (force - pin.nonLinearEffects(robot.model, robot.data, q, v))[rows]
    if not feet:
        return mass, force
    jacobian = contact_jacobian(robot, q, feet=feet, contact=contact)[:, rows]
    bias = contact_bias(robot, q, v, feet=feet, contact=contact)
    corner = np.zeros((len(jacobian), len(jacobian)))
    return np.block([[mass, -jacobian.T], [jacobian, corner]]), np.concatenate([force, -bias])


def planar_dynamics(
    robot: Robot,
    q: Array,
    v: Array,
    tau: Array,
    *,
    contact: Contact = "rolling",
    feet: Sequence[str] = (),
    base: Base = "locked",
) -> Array:
    """Acceleration of the planar robot: eq. (5) of the feet that stand, or (2) without any.

    Args:
        robot: The robot.
        q: Configuration, shape (19,).
        v: Velocity, shape (18,).
        tau: Motor torques [N m], shape (12,).
        contact: How feet stand on the ground.
        feet: The legs whose feet stand.
        base: What the planar constraint leaves the trunk.

    Returns:
        Acceleration, shape (18,), zero where the planar constraint holds the trunk.
    """
    rows, a = planar_rows(robot, base), np.zeros(robot.nv)
    kkt, right = planar_equations(robot, q, v, tau, contact=contact, feet=feet, base=base)
    a[rows] = np.linalg.solve(kkt, right)[: len(rows)]
    return a


class Rotors(NamedTuple):
    """Rotor inertia and viscous friction of the joints beyond the URDF, of all or each (12,)."""

    armature: float | Array = 0.0
    """Rotor inertia as the joint feels it [kg m^2]."""
    damping: float | Array = 0.0
    """Viscous friction [N m s/rad]."""


NO_ROTORS = Rotors()
"""The URDF as it stands."""


class PlanarDerivatives(NamedTuple):
    """Derivatives of the planar robot's acceleration at one state."""

    a: Array
    """The acceleration of x, z and the joints, shape (14,)."""
    da_dy: Array
    """By the coordinates, shape (14, 14)."""
    da_dv: Array
    """By their rates, shape (14, 14)."""
    da_dtau: Array
    """By the motor torques, shape (14, 12)."""


def planar_derivatives(
    robot: Robot,
    q: Array,
    v: Array,
    tau: Array,
    *,
    contact: Contact | None = None,
    rotors: Rotors = NO_ROTORS,
) -> PlanarDerivatives:
    """Solve eq. (5), or (2) in flight, on the planar rows, and differentiate it as a whole.

    With r(q, v, a, lam) = M a + H v + G - J^T lam and c(q, v, a) the contact points' acceleration,
    on the rows and columns that the planar constraint leaves free,

        M da - J^T dlam = S dtau - r_q dq - r_v dv,    J da = -c_q dq - c_v dv.

    Args:
        robot: The robot.
        q: Configuration with a level trunk, shape (19,).
        v: Velocity, shape (18,), zero where the constraint holds the trunk.
        tau: Motor torques [N m], shape (12,).
        contact: Contact model of the feet, which all stand; None in flight.
        rotors: Rotor inertia and friction of the joints beyond the URDF.
    """
    rows = planar_rows(robot)
    free = len(rows)
    motors = robot.parameters.torque_constant * np.eye(robot.nv, robot.nu, k=-NB)[rows]  # (14, 12)
    kkt, right = _equations(robot, q, v, tau, contact, rotors)
    solution = np.linalg.solve(kkt, right)
    a = np.zeros(robot.nv)
    a[rows] = solution[:free]
    legs = tuple(range(len(robot.legs))) if contact is not None else ()
    radius = robot.foot_radius if contact == "rolling" else 0.0
    parts = partials(
        robot, (q, v, a), np.asarray(solution[free:].reshape(-1, 3), dtype=float), legs, radius
    )
    r_q, r_v, c_q, c_v = (part[:, rows] for part in parts)
    r_v = r_v[rows] + np.diag(_at_joints(robot, rotors.damping))
    sides = np.block([[-r_q[rows], -r_v, motors], [-c_q, -c_v, np.zeros((len(c_q), robot.nu))]])
    da_dy, da_dv, da_dtau = np.hsplit(np.linalg.solve(kkt, sides)[:free], [free, 2 * free])
    return PlanarDerivatives(a[rows], da_dy, da_dv, da_dtau)


def planar_acceleration(
    robot: Robot,
    q: Array,
    v: Array,
    tau: Array,
    *,
    contact: Contact | None = None,
    rotors: Rotors = NO_ROTORS,
) -> tuple[Array, float]:
    """Acceleration of the planar coordinates, shape (14,), and vertical force on all feet [N].

    Arguments of `planar_derivatives`.
    """
    kkt, right = _equations(robot, q, v, tau, contact, rotors)
    a, lam = np.split(np.linalg.solve(kkt, right), [len(planar_rows(robot))])
    return a, float(lam[2::3].sum())


def planar_impact(
    robot: Robot, q: Array, v: Array, *, contact: Contact, rotors: Rotors = NO_ROTORS
) -> Array:
    """Rates (m, 14) after a plastic impact of all feet, from rates (m, 14) before it.

    `v+ = v - M^-1 J^T (J M^-1 J^T)^-1 J v` on the planar rows, so that `J v+ = 0`.
    """
    rows = planar_rows(robot)
    mass = _mass(robot, q, rotors)
    jacobian = contact_jacobian(robot, q, contact=contact)[:, rows]
    answer = np.linalg.solve(mass, jacobian.T)
    impulse = np.linalg.solve(jacobian @ answer, jacobian @ v.T)
    return np.asarray(v - (answer @ impulse).T)


def _equations(
    robot: Robot, q: Array, v: Array, tau: Array, contact: Contact | None, rotors: Rotors
) -> tuple[Array, Array]:
    """Matrix and right-hand side of eq. (5) on the free rows, with what the joints add."""
    feet = () if contact is None else robot.legs
    kkt, right = planar_equations(robot, q, v, tau, contact=contact or "rolling", feet=feet)
    rows = planar_rows(robot)
    free = np.arange(len(rows))
    kkt[free, free] += _at_joints(robot, rotors.armature)
    right[free] -= _at_joints(robot, rotors.damping) * v[rows]
    return kkt, right


def _mass(robot: Robot, q: Array, rotors: Rotors) -> Array:
    rows = planar_rows(robot)
    mass = pin.crba(robot.model, robot.data, q)[np.ix_(rows, rows)]
    return np.asarray(mass + np.diag(_at_joints(robot, rotors.armature)))


def _at_joints(robot: Robot, value: float | Array) -> Array:
    """A value at each joint, and 0 for x and z, shape (14,)."""
    return np.concatenate([np.zeros(2), np.broadcast_to(value, robot.nu)])
