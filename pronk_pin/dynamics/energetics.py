"""Energy, momentum and power of the whole robot.

`q`, `v` and `tau` are in Pinocchio's layout (see `pronk_pin.robot`). Every function takes one state
or a batch, with the batch first.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.integrate import trapezoid

from .._checks import SHARE, real
from .._typing import Array
from ..errors import InvalidInput
from ..robot import NB, Robot, as_array, as_numbers, as_q, as_robot, as_state, by_state


class CentroidalMomentum(NamedTuple):
    """Momentum of the whole robot about its centre of mass, in the world's axes."""

    linear: Array
    """Linear momentum [kg m/s], shape (..., 3)."""
    angular: Array
    """Angular momentum about the centre of mass [kg m^2/s], shape (..., 3)."""


def kinetic_energy(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """Kinetic energy v^T M(q) v / 2 [J]; batched.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19).
        v: Velocity, shape (..., 18).

    Returns:
        Shape (...).

    Raises:
        InvalidInput: A wrong shape, NaN, or a quaternion that is not normalised.
    """
    q, v = as_state(robot, q, v)
    return by_state(partial(pin.computeKineticEnergy, robot.model, robot.data), (), q, v)


def potential_energy(robot: Robot, q: npt.ArrayLike) -> Array:
    """Potential energy in gravity [J], zero with the centre of mass at the height 0; batched.

    Arguments, shape and errors are those of `kinetic_energy`.
    """
    q = as_q(robot, q)
    return by_state(partial(pin.computePotentialEnergy, robot.model, robot.data), (), q)


def centroidal_momentum(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> CentroidalMomentum:
    """Linear and angular momentum about the centre of mass; batched.

    Rotors (armature) are not part of it: what turns inside a link is unknown to the model.
    Arguments and errors are those of `kinetic_energy`.
    """
    q, v = as_state(robot, q, v)

    def about_centre(q_row: Array, v_row: Array) -> Array:
        return np.array(pin.computeCentroidalMomentum(robot.model, robot.data, q_row, v_row).vector)

    momentum = by_state(about_centre, (6,), q, v)
    return CentroidalMomentum(momentum[..., :3], momentum[..., 3:])


def mechanical_power(robot: Robot, v: npt.ArrayLike, tau: npt.ArrayLike) -> Array:
    """Mechanical power of each motor, tau q_dot [W], negative where it brakes; batched.

    Args:
        robot: The robot.
        v: Velocity, shape (..., 18).
        tau: Motor torques [N m], shape (..., 12).

    Returns:
        Shape (..., 12).

    Raises:
        InvalidInput: A wrong shape or NaN.
    """
    v = as_array("v", v, as_robot(robot).nv, None)
    return v[..., NB:] * as_array("tau", tau, robot.nu, v.shape[:-1])


def cost_of_transport(
    robot: Robot,
    t: npt.ArrayLike,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike,
    *,
    regeneration: float = 0.0,
) -> float:
    """Mechanical cost of transport: energy spent by the motors over weight times distance [-].

    The power of each motor is integrated by the trapezoidal rule. The distance is that between
    the trunk's first and last place over the ground.

    Args:
        robot: The robot.
        t: Times of the samples, increasing [s], shape (n,).
        q: Configurations, shape (n, 19).
        v: Velocities, shape (n, 18).
        tau: Motor torques [N m], shape (n, 12).
        regeneration: Share of the braking energy that a motor gives back: 0, nothing, to 1, all.

    Returns:
        The cost of transport; infinite for a motion that spends energy and stays where it is.

    Raises:
        InvalidInput: A wrong shape, NaN, fewer than two samples, times that do not increase, or a
            regeneration outside [0, 1].
    """
    q, v = as_state(robot, q, v)
    t = as_numbers("t", t)
    if q.ndim != 2 or t.shape != q.shape[:1] or len(t) < 2 or not (np.diff(t) > 0.0).all():
        raise InvalidInput(
            f"t has shape {t.shape} and q {q.shape}; give two or more samples, (n,) and "
            f"(n, {robot.nq}), at increasing times"
        )
    regeneration = real("regeneration", regeneration, SHARE)
    power = mechanical_power(robot, v, tau)
    spent = np.where(power > 0.0, power, regeneration * power).sum(axis=-1)
    energy = float(trapezoid(spent, t))
    distance = float(np.linalg.norm(q[-1, :2] - q[0, :2]))
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.divide(energy, robot.mass * robot.gravity * distance))
