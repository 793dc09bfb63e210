"""A free trunk by x, z, pitch, y, roll and yaw: the planar coordinates first, then the others.

The angles turn about z, y and x in this order, `R = Rz(yaw) Ry(pitch) Rx(roll)`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from .._typing import Array
from ..robot import NB, Robot

COORDINATES = ("x", "z", "pitch", "y", "roll", "yaw")
"""Coordinates of a free trunk."""

MIRRORED = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])
"""Their signs in the mirror image about the sagittal plane."""

_PLACE = [0, 3, 1]
"""Where x, y and z are."""


def free_state(
    robot: Robot,
    position: Sequence[Array],
    velocity: Sequence[Array],
    acceleration: Sequence[Array],
) -> tuple[Array, Array, Array]:
    """Whole-body q (n, 19), v and a (n, 18) of a robot on a free trunk.

    Args:
        robot: The robot.
        position, velocity, acceleration: Each the trunk's coordinates (n, 6), and the joints
            (n, 12), or their derivatives by time.
    """
    base, rates, bends = position[0], velocity[0], acceleration[0]
    turned = Rotation.from_euler("ZYX", base[:, [5, 2, 4]])
    q = np.concatenate([base[:, _PLACE], turned.as_quat(), position[1]], axis=1)
    v, a = np.zeros((2, len(base), robot.nv))
    axes = angle_axes(base)
    spin = rates[:, [5, 2, 4]]  # yaw, pitch, roll
    omega, alpha = np.zeros((2, len(base), 3))
    for i in range(3):
        alpha += axes[:, i] * bends[:, [5, 2, 4]][:, [i]]
        alpha += np.cross(omega, axes[:, i] * spin[:, [i]])
        omega += axes[:, i] * spin[:, [i]]
    back = turned.inv()
    v[:, :3], v[:, 3:NB] = back.apply(rates[:, _PLACE]), back.apply(omega)
    # Body-frame derivative: R^T a_world - omega x v_body.
    a[:, :3] = back.apply(bends[:, _PLACE]) - np.cross(v[:, 3:NB], v[:, :3])
    a[:, 3:NB] = back.apply(alpha)
    v[:, NB:], a[:, NB:] = velocity[1], acceleration[1]
    return q, v, a


def angle_axes(base: Array) -> Array:
    """Axes in the world about which yaw, pitch and roll turn, the rows of (n, 3, 3)."""
    yaw = Rotation.from_euler("Z", base[:, [5]])
    both = Rotation.from_euler("ZY", base[:, [5, 2]])
    up = np.tile([0.0, 0.0, 1.0], (len(base), 1))
    return np.stack([up, yaw.apply([0.0, 1.0, 0.0]), both.apply([1.0, 0.0, 0.0])], axis=1)


def free_coordinates(q: Array) -> Array:
    """The coordinates of the trunk (n, 6) of configurations (n, 19)."""
    yaw, pitch, roll = Rotation.from_quat(q[:, 3 : NB + 1]).as_euler("ZYX").T
    return np.stack([q[:, 0], q[:, 2], pitch, q[:, 1], roll, yaw], axis=1)


def free_rates(base: Array, v: Array) -> Array:
    """Rates of the coordinates (6,) at the coordinates (6,) from a velocity (18,)."""
    turned = Rotation.from_euler("ZYX", base[[5, 2, 4]])
    linear, omega = turned.apply(v[:3]), turned.apply(v[3:NB])
    yaw, pitch, roll = np.linalg.solve(angle_axes(base[None])[0].T, omega)
    return np.array([linear[0], linear[2], pitch, linear[1], roll, yaw])
