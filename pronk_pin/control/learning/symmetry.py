"""Left-right symmetry of records: all that a law may learn where roll is free."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..._typing import Array
from ...kinematics import leg_geometry
from ...robot import JOINTS, Robot
from ..signals import StrideRecord


def mirrored(robot: Robot, joints: Array) -> Array:
    """Mirror joint quantities (..., 12) about the sagittal plane."""
    legs = joints.reshape(*joints.shape[:-1], -1, len(JOINTS))
    sign = np.array([-1.0, 1.0, 1.0])  # the hips turn about x
    return np.asarray((legs[..., _partners(robot), :] * sign).reshape(joints.shape))


def symmetric(robot: Robot, record: StrideRecord) -> StrideRecord:
    """Average errors and feedback of a record over left and right.

    Learned from it, a feedforward changes neither roll nor heading: their errors stay with the
    attitude's regulation, which would otherwise fight what is learned of them.
    """

    def mean(values: Array) -> Array:
        return 0.5 * (values + mirrored(robot, values))

    return record.changed(mean)


@lru_cache(maxsize=16)
def _partners(robot: Robot) -> tuple[int, ...]:
    """For each leg the index of the one on the other side of the trunk."""
    hips = leg_geometry(robot).hip
    mirrored_hips = hips * np.array([1.0, -1.0, 1.0])
    distance = np.linalg.norm(hips[None] - mirrored_hips[:, None], axis=-1)
    return tuple(int(k) for k in np.argmin(distance, axis=1))
