"""Left and right: which legs are each other's mirror images about the trunk's sagittal plane."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .._typing import Array
from ..errors import InvalidInput
from ..robot import Robot
from .legs import leg_geometry

_APART = 0.2
"""Distance of a hip from the mirror image of its partner's, over its distance from the plane, up to
which the two are a pair."""

_FLIP = np.array([1.0, -1.0, 1.0])
"""Mirror of a place about the plane y = 0."""

_TURNED = np.array([-1.0, 1.0, 1.0])
"""Mirror of turns about x, y, y: of a hip, a thigh and a calf."""


class Mirror(NamedTuple):
    """The mirror of a robot with legs left and right, read from where its hips are."""

    pairs: tuple[tuple[int, int], ...]
    """Left and right leg of each pair, as indices into `robot.legs`, from the front to the rear."""
    partner: tuple[int, ...]
    """For each leg that on the other side."""
    sign: Array
    """Joint angles of a leg over those of its partner when the two are mirror images, (legs, 3)."""


@lru_cache(maxsize=16)
def mirror(robot: Robot) -> Mirror:
    """The mirror of a robot about the plane y = 0 of its trunk.

    Raises:
        InvalidInput: A leg has no partner there, or legs have no closed form.
    """
    geometry = leg_geometry(robot)
    hips = geometry.hip + geometry.thigh
    distance = np.linalg.norm(hips[None] - (hips * _FLIP)[:, None], axis=-1)
    partner = np.argmin(distance, axis=1)
    for k, other in enumerate(partner):
        if not (distance[k, other] < _APART * abs(hips[k, 1]) and partner[other] == k):
            raise InvalidInput(
                f"{robot.name}: no leg is the mirror image of {robot.legs[k]} about the trunk's "
                "sagittal plane; gaits need legs in pairs, left and right"
            )
    left = [k for k in np.argsort(-hips[:, 0], kind="stable") if hips[k, 1] > 0.0]
    return Mirror(
        tuple((int(k), int(partner[k])) for k in left),
        tuple(map(int, partner)),
        _TURNED * geometry.sense * geometry.sense[partner],
    )


def mirrored(robot: Robot, joints: Array) -> Array:
    """Mirror joint quantities (..., 12) about the sagittal plane."""
    _, partner, sign = mirror(robot)
    legs = joints.reshape(*joints.shape[:-1], *sign.shape)
    return np.asarray((legs[..., partner, :] * sign).reshape(joints.shape))
