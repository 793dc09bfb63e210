"""Attitude error on SO(3), and the regulating moment on the trunk.

Attitudes are rotation matrices from the trunk's to the world's axes; the x axis of the world is the
heading that is held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._checks import SHARE, Interval, keep_reals, keep_vectors
from ..._typing import Array


@dataclass(frozen=True)
class AttitudeRegulator:
    """PD regulation of the trunk's attitude through the stance legs: `m = K e_R + D (w_d - w)`.

    e_R is the geometric error of `attitude_error`, w the angular velocity in the world's axes.

    Attributes:
        stiffness: About x, y, z: roll, pitch, heading [N m/rad].
        damping: Likewise [N m s/rad].
        friction: Coefficient of friction that the contact forces keep to; below the ground's.
        until: Phase of stance after which the legs unload and nothing is asked of them.
    """

    stiffness: tuple[float, float, float] = (200.0, 200.0, 100.0)
    damping: tuple[float, float, float] = (10.0, 30.0, 5.0)
    friction: float = 0.6
    until: float = 0.9

    def __post_init__(self) -> None:
        prefix, friction = "attitude regulation: ", Interval(0, 10, above=True)
        stiffness, damping = Interval(0, 1e5, "N m/rad"), Interval(0, 1e4, "N m s/rad")
        keep_vectors(self, {"stiffness": stiffness, "damping": damping}, prefix=prefix)
        keep_reals(self, {"friction": friction, "until": SHARE}, prefix)

    def moment(self, error: Array, rate_error: Array) -> Array:
        """Compute the regulating moment on the trunk [N m], world axes, shape (n, 3).

        Args:
            error: See `attitude_error`, shape (n, 3).
            rate_error: Wanted minus actual angular velocity, world axes [rad/s], shape (n, 3).
        """
        return np.asarray(np.array(self.stiffness) * error + np.array(self.damping) * rate_error)


def attitude_error(rotation: Array, reference: Array) -> Array:
    """Compute the attitude error on SO(3): sin(angle) times the axis to the reference, world axes.

    `e_R = (R_d R^T - R R_d^T)^vee / 2` of attitudes R and references R_d, (..., 3, 3): the
    geometric error of Lee, Leok and McClamroch (2010), shape (..., 3).
    """
    between = reference @ np.swapaxes(rotation, -1, -2)
    skew = 0.5 * (between - np.swapaxes(between, -1, -2))
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


def attitude_angle(rotation: Array, reference: Array) -> Array:
    """Angles between attitudes (..., 3, 3) and references, `acos((tr(R_d^T R) - 1) / 2)` [rad]."""
    cosine = 0.5 * (np.einsum("...ij,...ij->...", reference, rotation) - 1.0)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def roll_pitch_yaw(rotation: Array) -> Array:
    """Roll, pitch and heading [rad] of attitudes Rz(heading) Ry(pitch) Rx(roll), shape (..., 3)."""
    roll = np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2])
    pitch = -np.arcsin(np.clip(rotation[..., 2, 0], -1.0, 1.0))
    yaw = np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0])
    return np.stack([roll, pitch, yaw], axis=-1)


def pitched(angle: Array) -> Array:
    """Rotation matrices Ry(angle) of pitch angles (...) [rad], shape (..., 3, 3)."""
    cos, sin = np.cos(angle), np.sin(angle)
    zero, ones = np.zeros_like(cos), np.ones_like(cos)
    rows = [[cos, zero, sin], [zero, ones, zero], [-sin, zero, cos]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
