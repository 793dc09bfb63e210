"""Gaits to control, one of the library and one between two, and logs of phases."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import PhaseLog
from pronk_pin.gait import Gait, load_library


@pytest.fixture(scope="session")
def gaits() -> list[Gait]:
    library = load_library("a1")
    return [library.at(-0.2), library.at(0.45)]


@pytest.fixture(scope="session")
def phase_log() -> Callable[..., PhaseLog]:
    """A log of joint angles and rates (n, ticks, 12), in which no torque acted."""

    def build(joints: Array, joint_rates: Array, *, sensed: int = 0) -> PhaseLog:
        n, ticks = joints.shape[:2]
        none = np.zeros((3, *joints.shape))
        return PhaseLog(joints, joint_rates, *none, np.full(n, ticks, np.intp), sensed)

    return build
