"""Foot placement: the feet land as if the trunk had the gait's attitude, and a little aside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._checks import Interval, keep_reals
from ..._typing import Array
from ...kinematics import LegGeometry, leg_angles, leg_motion


@dataclass(frozen=True)
class FootPlacement:
    """Foot placement in flight: feet in the world's axes, and aside of a drifting trunk.

    `p <- p + share(s) (R^T R_d p + R^T e_y clip(gain v_y) - p)` for a foot p in the trunk's frame,
    with the attitude R, the gait's R_d and the speed sideways v_y.

    The joints' references in stance then pull the trunk to the gait's attitude; a foot put down in
    the direction of the drift brakes it. Forward that is eq. (12), see `LegAngleRegulator`.

    Attributes:
        gain: Sideways displacement for each speed sideways [s].
        limit: Largest sideways displacement [m].
        settled: Phase of flight at which the feet have reached their places.
    """

    gain: float = 0.05
    limit: float = 0.05
    settled: float = 0.7

    def __post_init__(self) -> None:
        checks = {
            "gain": Interval(-10, 10, "s"),
            "limit": Interval(0, 1, "m"),
            "settled": Interval(0, 1, above=True),
        }
        keep_reals(self, checks, "foot placement: ")

    def aside(self, speed: Array) -> Array:
        """Sideways displacement of the feet [m] for a speed sideways [m/s], shape (n,)."""
        return np.clip(self.gain * speed, -self.limit, self.limit)

    def share(self, s: Array) -> Array:
        """Share of their displacement that the feet have reached at the phase s of flight."""
        x = np.clip(s / self.settled, 0.0, 1.0)
        return np.asarray(x * x * (3.0 - 2.0 * x))


def placed(geometry: LegGeometry, joints: Array, turn: Array, offset: Array, share: Array) -> Array:
    """Compute joint angles with the feet turned about the trunk's origin and displaced.

    Args:
        geometry: Offsets of the legs.
        joints: Joint angles that put the feet where the gait has them [rad], shape (n, legs, 3).
        turn: From the gait's attitude of the trunk to the actual axes, shape (n, 3, 3).
        offset: Displacement in the trunk's actual axes [m], shape (n, 3).
        share: Share of the displacement, 0 to 1, shape (n,).

    Returns:
        Shape (n, legs, 3); the given angles where the feet would be out of reach.
    """
    feet = leg_motion(geometry, joints, np.zeros_like(joints)).position  # (n, legs, 3)
    target = np.einsum("nij,nlj->nli", turn, feet) + offset[:, None]
    moved, reachable = leg_angles(geometry, feet + share[:, None, None] * (target - feet))
    nearest = joints + (moved - joints + np.pi) % (2.0 * np.pi) - np.pi  # without whole turns
    return np.where(reachable[..., None] & np.isfinite(nearest), nearest, joints)
