"""Derivatives of the accelerations and contact forces by configuration, velocity and torques.

A derivative by q is by the small motion d in `pinocchio.integrate(model, q, d)`, so that it has 18
columns: the base's are a translation and a rotation in its own frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from .._typing import Array
from ..kinematics import Contact, contact_radius, jacobian_at
from ..robot import NB, Robot, as_array, as_one, as_state, leg_indices
from .stance import NO_GAINS, contact_response, point_stance, stance_accelerations

_LOCAL, _WORLD = pin.LOCAL, pin.LOCAL_WORLD_ALIGNED


class FlightDerivatives(NamedTuple):
    """Derivatives of the acceleration without contact."""

    da_dq: Array
    """By the configuration, shape (18, 18)."""
    da_dv: Array
    """By the velocity, shape (18, 18)."""
    da_dtau: Array
    """By the motor torques, shape (18, 12)."""


class StanceDerivatives(NamedTuple):
    """Derivatives of the acceleration and of the contact forces in stance."""

    da_dq: Array
    """Of the acceleration by the configuration, shape (18, 18)."""
    da_dv: Array
    """Of the acceleration by the velocity, shape (18, 18)."""
    da_dtau: Array
    """Of the acceleration by the motor torques, shape (18, 12)."""
    dlam_dq: Array
    """Of the contact forces by the configuration, shape (3 feet, 18)."""
    dlam_dv: Array
    """Of the contact forces by the velocity, shape (3 feet, 18)."""
    dlam_dtau: Array
    """Of the contact forces by the motor torques, shape (3 feet, 12)."""
    singular: np.bool_
    """Whether the contacts do not determine the forces; the derivatives are then those of the
    damped least-squares answer with its damping held."""


def flight_derivatives(
    robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike, tau: npt.ArrayLike
) -> FlightDerivatives:
    """Derivatives of `flight_dynamics` by q, v and tau.

    Arguments and errors are those of `stance_derivatives`, as is what a derivative by q means.
    """
    q, v = as_state(robot, q, v)
    as_one("q", q)
    torque = robot.joint_torques(as_array("tau", tau, robot.nu, ()), v[NB:])
    force = np.concatenate([np.zeros(NB), torque])
    da_dq, da_dv, inverse = pin.computeABADerivatives(robot.model, robot.data, q, v, force)
    return FlightDerivatives(da_dq, *_of_motors(robot, v, da_dv, inverse[:, NB:]))


def stance_derivatives(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
) -> StanceDerivatives:
    """Derivatives of `stance_dynamics`' acceleration and contact forces by q, v and tau.

    Pinocchio's own for point contacts; rolling and singular ones from its derivatives of RNEA and
    kinematics.

    A derivative by q is by the small motion d of `pinocchio.integrate(model, q, d)`.

    Args:
        robot: The robot.
        q: Configuration, shape (19,).
        v: Velocity, shape (18,).
        tau: Motor torques [N m], shape (12,).
        feet: Legs in contact, in the order of lam; all if None, none if empty.
        contact: "point" or "rolling", see `contact_jacobian`.

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
        UnknownName: There is no such leg or contact.
    """
    q, v = as_state(robot, q, v)
    as_one("q", q)
    state = (q, v, robot.joint_torques(as_array("tau", tau, robot.nu, ()), v[NB:]))
    legs, radius = leg_indices(robot, feet), contact_radius(robot, contact)
    if legs and radius == 0.0:
        solver = point_stance(robot, legs)
        singular = np.bool_(solver.solve(*state).singular)
        if not singular:
            a_q, a_v, a_force, lam_q, lam_v, lam_force = solver.derivatives()
            a_v, a_tau = _of_motors(robot, v, a_v, a_force)
            lam_v, lam_tau = _of_motors(robot, v, lam_v, lam_force)
            return StanceDerivatives(a_q, a_v, a_tau, lam_q, lam_v, lam_tau, singular)
    return _implicit(robot, state, legs, radius)


def _of_motors(robot: Robot, v: Array, by_v: Array, by_force: Array) -> tuple[Array, Array]:
    """Derivatives by v and motor torques, by chain rule from those by v and joint torques."""
    if robot.parameters.ideal_motors:
        return by_v, by_force
    by_v = by_v.copy()
    by_v[:, NB:] -= by_force * robot.friction_rate(v[NB:])
    return by_v, robot.parameters.torque_constant * by_force


def _implicit(
    robot: Robot, state: tuple[Array, Array, Array], legs: tuple[int, ...], radius: float
) -> StanceDerivatives:
    """Eq. (5) differentiated as a whole, from Pinocchio's RNEA and kinematics derivatives.

    With r(q, v, a, lam) = M a + H v + G - J^T lam and c(q, v, a) the contact points' acceleration,

        M da - J^T dlam = S dtau - r_q dq - r_v dv,    J da = -c_q dq - c_v dv.
    """
    q, v, _ = state
    a, lam, _ = stance_accelerations(robot, state, legs, radius, NO_GAINS)
    nv = robot.nv
    r_q, r_v, c_q, c_v = partials(robot, (q, v, a), lam.reshape(-1, 3), legs, radius)
    motors = robot.parameters.torque_constant * np.eye(nv, robot.nu, k=-NB)
    right = np.hstack([-r_q, -r_v, motors])  # (18, 48)
    free = np.linalg.solve(pin.crba(robot.model, robot.data, q), right)
    jacobian = jacobian_at(robot, q, legs, radius)
    target = np.hstack([-c_q, -c_v, np.zeros((len(lam), robot.nu))]) - jacobian @ free
    response = contact_response(robot, q, jacobian, target)
    parts = [nv, 2 * nv]
    a_q, a_v, a_tau = np.hsplit(free + response.motion, parts)
    lam_q, lam_v, lam_tau = np.hsplit(response.lam, parts)
    return StanceDerivatives(a_q, a_v, a_tau, lam_q, lam_v, lam_tau, response.singular)


def partials(
    robot: Robot,
    motion: tuple[Array, Array, Array],
    forces: Array,
    legs: Sequence[int],
    radius: float,
) -> tuple[Array, Array, Array, Array]:
    """Partial derivatives r_q, r_v (18, 18), c_q, c_v (3 feet, 18) of `_implicit` at (q, v, a)."""
    model, data = robot.model, robot.data
    lever = np.array([0.0, 0.0, -radius])
    pin.computeForwardKinematicsDerivatives(model, data, *motion)
    pin.updateFramePlacements(model, data)
    external = pin.StdVec_Force([pin.Force.Zero() for _ in range(model.njoints)])
    turning = np.zeros((robot.nv, robot.nv))
    c_q, c_v = np.zeros((2, len(legs), 3, robot.nv))
    for row, (leg, force) in enumerate(zip(legs, forces, strict=True)):
        foot = robot.foot_ids[leg]
        rotation = data.oMf[foot].rotation
        v_q, a_q, a_v, jacobian = pin.getFrameAccelerationDerivatives(model, data, foot, _LOCAL)
        velocity = pin.getFrameVelocity(model, data, foot, _LOCAL)
        spatial = pin.getFrameAcceleration(model, data, foot, _LOCAL)
        linear, omega = velocity.linear, velocity.angular
        spin = jacobian[3:]
        # Classical acceleration of the centre, and angular acceleration, both in the foot's axes;
        # these axes turn with the foot.
        centre = spatial.linear + np.cross(omega, linear)
        centre_q = a_q[:3] - _cross(linear, v_q[3:]) + _cross(omega, v_q[:3])
        centre_v = a_v[:3] - _cross(linear, spin) + _cross(omega, jacobian[:3])
        c_q[row] = rotation @ (centre_q - _cross(centre, spin))
        c_v[row] = rotation @ centre_v
        # The lever to where a sphere touches the ground does not turn: + dw/dt x lever.
        c_q[row] -= _cross(lever, rotation @ (a_q[3:] - _cross(spatial.angular, spin)))
        c_v[row] -= _cross(lever, rotation @ a_v[3:])
        # The force is fixed in the world. Pinocchio holds it in the foot's axes, hence the rest.
        local, moment = rotation.T @ force, rotation.T @ np.cross(lever, force)
        frame = model.frames[foot]
        external[frame.parentJoint] += frame.placement.act(pin.Force(local, moment))
        turning += jacobian.T @ np.vstack([_cross(local, spin), _cross(moment, spin)])
    r_q, r_v, _ = pin.computeRNEADerivatives(model, data, *motion, external)
    if not robot.parameters.ideal_motors:
        r_v[NB:, NB:] += np.diag(robot.friction_rate(motion[1][NB:]))
    return r_q - turning, r_v, c_q.reshape(-1, robot.nv), c_v.reshape(-1, robot.nv)


def _cross(vector: Array, columns: Array) -> Array:
    """vector x column, for each column of (3, n)."""
    return np.asarray(pin.skew(vector) @ columns)
