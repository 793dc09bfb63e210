"""One fresh solve, and the shipped library, for all tests of the gaits."""

from __future__ import annotations

import pytest

from pronk_pin.gait import GaitLibrary, GaitProblem, GaitSolution, load_library, optimize_gait
from pronk_pin.robot import Robot


@pytest.fixture(scope="session")
def library() -> GaitLibrary:
    """The 14 gaits of the paper's apex."""
    return load_library("a1").at_apex(0.34)


@pytest.fixture(scope="session")
def solution(robot: Robot) -> GaitSolution:
    """From the crude guess, at 0.3 m/s."""
    return optimize_gait(GaitProblem(robot, 0.3))
