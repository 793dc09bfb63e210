"""Rigid-body dynamics of the floating-base robot: eq. (2) to (5) of the paper, and impacts.

    M(q) a + H(q, v) v + G(q) = S tau + J^T lam

`q`, `v` and `a` are in Pinocchio's layout (see `pronk_pin.robot`): the base's velocity and
acceleration are in its own frame. Contact forces are in the world's axes, foot by foot. The paper
writes J for our J^T.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from ._contacts import (
    Contact,
    bias_at,
    contact_bias,
    contact_jacobian,
    contact_radius,
    jacobian_at,
)
from ._stance import Baumgarte, contact_response, stance_accelerations
from ._state import as_array, as_one, as_q, as_state, leg_indices
from ._typing import Array, BoolArray
from .errors import InvalidInput
from .robot import NB, Robot

__all__ = [
    "Baumgarte",
    "Contact",
    "Impact",
    "StanceDae",
    "StanceDynamics",
    "contact_bias",
    "contact_jacobian",
    "coriolis_matrix",
    "flight_dynamics",
    "gravity",
    "impact",
    "mass_matrix",
    "nonlinear_effects",
    "selection_matrix",
    "stance_dae",
    "stance_dynamics",
]


class StanceDynamics(NamedTuple):
    """Acceleration and contact forces in stance."""

    a: Array
    """Generalised acceleration, shape (..., 18)."""
    lam: Array
    """Contact forces in the world's axes, foot by foot [N], shape (..., 3 feet)."""
    singular: BoolArray
    """Whether the contacts do not determine the forces (straight legs, redundant feet), so that
    lam is the damped least-squares answer, shape (...). The equations of motion hold even so."""


class StanceDae(NamedTuple):
    """The linear equations of stance, eq. (5): matrix [a, lam] = rhs."""

    matrix: Array
    """[[M, -J^T], [J, 0]], shape (18 + 3 feet, 18 + 3 feet)."""
    rhs: Array
    """[S tau - H v - G, -sigma], shape (18 + 3 feet,)."""


class Impact(NamedTuple):
    """What a collision of feet with the ground does."""

    v: Array
    """Velocity after the impact, shape (18,)."""
    impulse: Array
    """Contact impulses in the world's axes, foot by foot [N s], shape (3 feet,)."""
    singular: bool
    """Whether the contacts do not determine the impulses, see `StanceDynamics.singular`."""


def mass_matrix(robot: Robot, q: npt.ArrayLike) -> Array:
    """Mass matrix M(q) of eq. (2), symmetric.

    Args:
        robot: The robot.
        q: Configuration, shape (19,).

    Returns:
        Shape (18, 18).

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
    """
    return np.array(pin.crba(robot.model, robot.data, as_one("q", as_q(robot, q))))


def coriolis_matrix(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """Coriolis and centrifugal matrix H(q, v) of eq. (2), shape (18, 18).

    Arguments and errors are those of `nonlinear_effects`.
    """
    q, v = as_state(robot, q, v)
    return np.array(pin.computeCoriolisMatrix(robot.model, robot.data, as_one("q", q), v))


def gravity(robot: Robot, q: npt.ArrayLike) -> Array:
    """Gravitational forces G(q) of eq. (2) [N, N m], shape (18,).

    Arguments and errors are those of `mass_matrix`.
    """
    return np.array(
        pin.computeGeneralizedGravity(robot.model, robot.data, as_one("q", as_q(robot, q)))
    )


def nonlinear_effects(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """Bias forces H(q, v) v + G(q) of eq. (2) [N, N m].

    Args:
        robot: The robot.
        q: Configuration, shape (19,).
        v: Velocity, shape (18,).

    Returns:
        Shape (18,).

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
    """
    q, v = as_state(robot, q, v)
    return np.array(pin.nonLinearEffects(robot.model, robot.data, as_one("q", q), v))


def selection_matrix(robot: Robot) -> Array:
    """Selection matrix S of eq. (2), which hands the motor torques to the joints, (18, 12)."""
    return np.eye(robot.nv, robot.nu, k=-NB)


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
    q, v = as_state(robot, q, v)
    tau = as_array("tau", tau, robot.nu, q.shape[:-1])
    force = np.concatenate([np.zeros((*tau.shape[:-1], NB)), tau], axis=-1)
    a = np.empty_like(v)
    rows = (x.reshape(-1, x.shape[-1]) for x in (q, v, force, a))
    for q_row, v_row, force_row, out in zip(*rows, strict=True):
        out[:] = pin.aba(robot.model, robot.data, q_row, v_row, force_row)
    return a


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
    q, v = as_state(robot, q, v)
    tau = as_array("tau", tau, robot.nu, q.shape[:-1])
    legs = tuple(leg_indices(robot, feet))
    radius = contact_radius(robot, contact)
    given = (0.0, 0.0) if baumgarte is None else baumgarte
    gains = Baumgarte(*as_array("baumgarte", given, 2, ()))
    if min(gains) < 0.0:
        raise InvalidInput(f"baumgarte={baumgarte}; both gains must be 0 or positive")
    a, lam = np.empty_like(v), np.empty((*q.shape[:-1], 3 * len(legs)))
    singular = np.zeros(q.shape[:-1], dtype=bool)
    for row in np.ndindex(singular.shape):
        a[row], lam[row], singular[row] = stance_accelerations(
            robot, (q[row], v[row], tau[row]), legs, radius, gains
        )
    return StanceDynamics(a, lam, singular)


def stance_dae(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
) -> StanceDae:
    """The matrix and right-hand side of eq. (5).

    Arguments and errors are those of `stance_dynamics`, for one state.
    """
    q, v = as_state(robot, q, v)
    as_one("q", q)
    tau = as_array("tau", tau, robot.nu, ())
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
    q, v = as_state(robot, q, v)
    as_one("q", q)
    if not 0.0 <= restitution <= 1.0:
        raise InvalidInput(f"restitution={restitution}; choose a number from 0 to 1")
    legs, radius = leg_indices(robot, feet), contact_radius(robot, contact)
    jacobian = jacobian_at(robot, q, legs, radius)
    wanted = -(1.0 + restitution) * (jacobian @ v)
    impulse, change, singular = contact_response(robot, q, jacobian, wanted)
    return Impact(v + change, impulse, singular)
