"""Feet on the ground: Jacobians and bias accelerations of point and rolling contacts.

A point contact holds the foot's centre c: c_dot = 0, eq. (3) of the paper. A rolling contact lets
the foot, a sphere of radius r, roll on the ground without slipping: the lowest point of the sphere
is at rest,

    c_dot + w x d = 0,    c_ddot + dw/dt x d = 0,    d = (0, 0, -r),

with the angular velocity w of the calf; the transposed Jacobian applies the contact force there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from .._checks import known_name
from .._typing import Array
from ..robot import Robot, as_one, as_q, as_state, leg_indices

Contact = Literal["point", "rolling"]
"""Contact model of a foot: "point" or "rolling"."""

CONTACTS: tuple[Contact, ...] = ("point", "rolling")


def contact_jacobian(
    robot: Robot,
    q: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
) -> Array:
    """Contact Jacobian J of eq. (2), the paper's J^T: c_dot = J v in the world's axes.

    Args:
        robot: The robot.
        q: Configuration, shape (19,).
        feet: Legs in contact, in the order of the rows; all if None.
        contact: "point" or "rolling".

    Returns:
        Shape (3 len(feet), 18).

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
        UnknownName: There is no such leg or contact.
    """
    q = as_one("q", as_q(robot, q))
    return jacobian_at(robot, q, leg_indices(robot, feet), contact_radius(robot, contact))


def contact_bias(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
) -> Array:
    """Bias acceleration sigma of eq. (4): c_ddot = J a + sigma in the world's axes [m/s^2].

    Arguments and errors are those of `contact_jacobian`, with the velocity v, shape (18,).

    Returns:
        Shape (3 len(feet),).
    """
    q, v = as_state(robot, q, v)
    as_one("q", q)
    return bias_at(robot, q, v, leg_indices(robot, feet), contact_radius(robot, contact))


def contact_radius(robot: Robot, contact: str) -> float:
    """Distance from the foot's centre down to where the contact acts [m].

    Raises:
        UnknownName: There is no such contact.
    """
    if isinstance(contact, str) and contact == "point":
        return 0.0
    known_name("contact", contact, CONTACTS)
    return robot.foot_radius


def jacobian_at(robot: Robot, q: Array, legs: Sequence[int], radius: float) -> Array:
    """`contact_jacobian` of checked arguments, with the legs by index."""
    model, data, ids = robot.model, robot.data, robot.foot_ids
    pin.computeJointJacobians(model, data, q)
    whole = [pin.getFrameJacobian(model, data, ids[leg], pin.LOCAL_WORLD_ALIGNED) for leg in legs]
    if not whole:
        return np.empty((0, robot.nv))
    jacobian = np.concatenate([foot[:3] for foot in whole])
    if radius:
        # w x (0, 0, -r) = (-r w_y, r w_x, 0)
        jacobian[0::3] -= [radius * foot[4] for foot in whole]
        jacobian[1::3] += [radius * foot[3] for foot in whole]
    return jacobian


def bias_at(robot: Robot, q: Array, v: Array, legs: Sequence[int], radius: float) -> Array:
    """`contact_bias` of checked arguments, with the legs by index."""
    model, data, ids = robot.model, robot.data, robot.foot_ids
    pin.forwardKinematics(model, data, q, v, robot.at_rest)
    whole = [
        pin.getFrameClassicalAcceleration(model, data, ids[leg], pin.LOCAL_WORLD_ALIGNED)
        for leg in legs
    ]
    if not whole:
        return np.empty(0)
    bias = np.concatenate([foot.linear for foot in whole])
    if radius:
        angular = np.array([foot.angular for foot in whole])
        bias[0::3] -= radius * angular[:, 1]
        bias[1::3] += radius * angular[:, 0]
    return bias
