"""Left-right symmetry of records: all that a law may learn where roll is free."""

from __future__ import annotations

from ..._typing import Array
from ...kinematics import mirrored
from ...robot import Robot
from ..signals import StrideRecord


def symmetric(robot: Robot, record: StrideRecord) -> StrideRecord:
    """Average errors and feedback of a record over left and right.

    Learned from it, a feedforward changes neither roll nor heading: their errors stay with the
    attitude's regulation, which would otherwise fight what is learned of them.
    """

    def mean(values: Array) -> Array:
        return 0.5 * (values + mirrored(robot, values))

    return record.changed(mean)
