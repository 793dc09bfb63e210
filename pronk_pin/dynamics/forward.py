"""Forward dynamics: accelerations in flight and in stance, eq. (5), and impacts."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from .._checks import SHARE, real
from .._typing import Array
from ..kinematics import Contact, bias_at, contact_radius, jacobian_at
from ..robot import NB, Robot, as_array, as_one, as_robot, as_state, by_state, leg_indices
from .stance import (
    NO_GAINS,
    Impact,
    StanceDynamics,
    baumgarte_gains,
    contact_response,
    point_stance,
    stance_accelerations,
)
from .terms import mass_matrix, nonlinear_effects, quick_result, selection_matrix


class StanceDae(NamedTuple):
    """Linear equations of stance, eq. (5): matrix [a, lam] = rhs."""

    matrix: Array
    """[[M, -J^T], [J, 0]], shape (18 + 3 feet, 18 + 3 feet)."""
    rhs: Array
    """[S tau - H v - G, -sigma], shape (18 + 3 feet,)."""


def flight_dynamics(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike, tau: npt.ArrayLike) -> Array:
    """Acceleration without contact: eq. (2) with lam = 0; batched.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19).
        v: Velocity, shape (..., 18).
        tau: Motor torques [N m], shape (..., 12).

    Returns:
        Generalised acceleration, shape (..., 18).

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
    """
    if np.ndim(tau) == 1 and as_robot(robot).parameters.ideal_motors:
        force = np.zeros(robot.nv)
        force[NB:] = as_array("tau", tau, robot.nu, ())
        quick = quick_result(pin.aba, robot, 0, q, v, force)
        if quick is not None:
            return quick
    q, v = as_state(robot, q, v)
    tau = robot.joint_torques(as_array("tau", tau, robot.nu, q.shape[:-1]), v[..., NB:])
    force = np.concatenate([np.zeros((*tau.shape[:-1], NB)), tau], axis=-1)
    return by_state(partial(pin.aba, robot.model, robot.data), (robot.nv,), q, v, force)


def stance_dynamics(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    baumgarte: tuple[float, float] | None = None,
    contact: Contact = "point",
) -> StanceDynamics:
    """Acceleration and contact forces with feet on the ground: eq. (5) solved; batched.

    Contacts neither slip nor open, so forces may pull.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19).
        v: Velocity, shape (..., 18).
        tau: Motor torques [N m], shape (..., 12).
        feet: Legs in contact, in the order of lam; all if None, none if empty.
        baumgarte: Gains (kp [1/s^2], kd [1/s]) that pull drifting feet back to rest at the height
            of standing, see `Baumgarte`; None for eq. (4) as it stands.
        contact: "point" or "rolling", see `contact_jacobian`.

    Raises:
        InvalidInput: A wrong shape, NaN, a quaternion that is not normalised, negative gains.
        UnknownName: There is no such leg or contact.
    """
    legs, radius = leg_indices(robot, feet), contact_radius(robot, contact)
    gains = baumgarte_gains(baumgarte)
    simple = bool(legs) and radius == 0.0 and gains == NO_GAINS
    if simple and np.ndim(tau) == 1 and robot.parameters.ideal_motors:
        torque = as_array("tau", tau, robot.nu, ())
        quick = point_stance(robot, legs).quick(q, v, torque)
        if quick is not None:
            return quick
    q, v = as_state(robot, q, v)
    batch = q.shape[:-1]
    tau = robot.joint_torques(as_array("tau", tau, robot.nu, batch), v[..., NB:])
    if not batch:
        return stance_accelerations(robot, (q, v, tau), legs, radius, gains)
    states = (q.reshape(-1, robot.nq), v.reshape(-1, robot.nv), tau.reshape(-1, robot.nu))
    n = len(states[0])
    a, lam = np.empty((n, robot.nv)), np.empty((n, 3 * len(legs)))
    singular = np.ones(n, dtype=bool)
    if simple:
        singular = point_stance(robot, legs).solve_all(*states, out=(a, lam))
    for row in np.flatnonzero(singular):
        solution = stance_accelerations(
            robot, (states[0][row], states[1][row], states[2][row]), legs, radius, gains
        )
        a[row], lam[row], singular[row] = solution
    return StanceDynamics(
        a.reshape(v.shape), lam.reshape(*batch, 3 * len(legs)), singular.reshape(batch)
    )


def stance_dae(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
) -> StanceDae:
    """Assemble the matrix and right-hand side of eq. (5).

    Arguments and errors are those of `stance_dynamics`, for one state.
    """
    q, v = as_state(robot, q, v)
    as_one("q", q)
    tau = robot.joint_torques(as_array("tau", tau, robot.nu, ()), v[NB:])
    legs, radius = leg_indices(robot, feet), contact_radius(robot, contact)
    mass, bias = mass_matrix(robot, q), nonlinear_effects(robot, q, v)
    jacobian = jacobian_at(robot, q, legs, radius)
    corner = np.zeros((len(jacobian), len(jacobian)))
    return StanceDae(
        matrix=np.block([[mass, -jacobian.T], [jacobian, corner]]),
        rhs=np.concatenate(
            [selection_matrix(robot) @ tau - bias, -bias_at(robot, q, v, legs, radius)]
        ),
    )


def impact(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    restitution: float = 0.0,
    contact: Contact = "point",
) -> Impact:
    """Velocity after feet hit the ground: M (v+ - v) = J^T impulse, J v+ = -restitution J v.

    Restitution acts on all three components of the contact points' velocities: reflecting the
    normal one alone while the tangential ones stop could create energy.

    Args:
        robot: The robot.
        q: Configuration, shape (19,).
        v: Velocity before the impact, shape (18,).
        feet: Legs that hit the ground, in the order of the impulses; all if None.
        restitution: From 0, plastic, to 1, elastic.
        contact: "point" or "rolling", see `contact_jacobian`.

    Raises:
        InvalidInput: A wrong shape, NaN, a quaternion that is not normalised, or a restitution
            outside [0, 1].
        UnknownName: There is no such leg or contact.
    """
    restitution = real("restitution", restitution, SHARE)
    legs, radius = leg_indices(robot, feet), contact_radius(robot, contact)
    if legs and radius == 0.0:
        quick = point_stance(robot, legs).quick_impact(q, v, restitution)
        if quick is not None:
            return quick
    q, v = as_state(robot, q, v)
    as_one("q", q)
    jacobian = jacobian_at(robot, q, legs, radius)
    target = -(1.0 + restitution) * (jacobian @ v)
    impulse, change, singular = contact_response(robot, q, jacobian, target)
    return Impact(v + change, impulse, singular)
