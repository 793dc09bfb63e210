"""The terms of the equations of motion, eq. (2): M(q), H(q, v), G(q) and S.

Pinocchio computes each within 2 to 5 us, which is what checking every number of a state would cost
too. So the arguments get a quick look, the result another, and only where one of them finds
something odd are the arguments checked in earnest.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from .._typing import Array
from ..robot import NB, REFUSALS, Robot, as_one, as_q, as_robot, as_state, sound_base

_COUPLING = 4
"""Flat index, in the matrices, of the base's x against its pitch: every link has a part in it."""


def quick_result(
    algorithm: Callable[..., Any], robot: Robot, probe: int, q: Any, v: Any = None, *others: Any
) -> Array | None:
    """Result of an algorithm of Pinocchio for a state, or None where anything looks odd.

    Args:
        algorithm: Called with model, data, q, v if given, and the others.
        robot: The robot.
        probe: Flat index of an entry of the result that is NaN wherever an argument is, the
            position and attitude of the trunk aside.
        q: Configuration.
        v: Velocity.
        others: Further arguments, checked.
    """
    try:
        if sound_base(q):
            if v is None:
                result = algorithm(robot.model, robot.data, q)
            elif v.ndim == 1:  # Pinocchio takes a column, too
                result = algorithm(robot.model, robot.data, q, v, *others)
            else:
                return None
            if isfinite(result.item(probe)):
                return result  # type: ignore[no-any-return]
    except REFUSALS:
        pass
    return None


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
    mass = quick_result(pin.crba, robot, _COUPLING, q)
    if mass is None:
        q = as_one("q", as_q(robot, q))
        mass = pin.crba(robot.model, robot.data, q)
    return mass


def coriolis_matrix(robot: Robot, q: npt.ArrayLike, v: npt.ArrayLike) -> Array:
    """Coriolis and centrifugal matrix H(q, v) of eq. (2), shape (18, 18).

    Arguments and errors are those of `nonlinear_effects`.
    """
    matrix = quick_result(pin.computeCoriolisMatrix, robot, _COUPLING, q, v)
    if matrix is None:
        q, v = as_state(robot, q, v)
        matrix = pin.computeCoriolisMatrix(robot.model, robot.data, as_one("q", q), v)
    return matrix


def gravity(robot: Robot, q: npt.ArrayLike) -> Array:
    """Gravitational forces G(q) of eq. (2) [N, N m], shape (18,).

    Arguments and errors are those of `mass_matrix`.
    """
    forces = quick_result(pin.computeGeneralizedGravity, robot, 0, q)
    if forces is None:
        q = as_one("q", as_q(robot, q))
        forces = pin.computeGeneralizedGravity(robot.model, robot.data, q)
    return forces


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
    forces = quick_result(pin.nonLinearEffects, robot, 0, q, v)
    if forces is None:
        q, v = as_state(robot, q, v)
        forces = pin.nonLinearEffects(robot.model, robot.data, as_one("q", q), v)
    return forces


def selection_matrix(robot: Robot) -> Array:
    """Selection matrix S of eq. (2), which hands the motor torques to the joints, (18, 12)."""
    as_robot(robot)
    return np.eye(robot.nv, robot.nu, k=-NB)
