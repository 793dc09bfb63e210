"""The transcription is the mathematics it claims to be."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from pronk_pin.gait import GaitProblem, GaitSolution, vertical_hop
from pronk_pin.gait.checks import UNITS
from pronk_pin.gait.optimisation.collocation import _apex, node_phases, transcribe
from pronk_pin.robot import Robot

OF_TRUNKS = {"pitch limit", "roll limit", "yaw limit", "side step"}
"""Limits of trunks that are not locked."""


@pytest.mark.parametrize("intervals", [4, 12, 16])
def test_nodes_are_symmetric_with_midpoints_between(intervals: int) -> None:
    s = node_phases(intervals)
    assert s[0] == 0.0
    assert s[intervals] == pytest.approx(0.5)
    np.testing.assert_allclose(s + s[::-1], 1.0, atol=1e-15)
    np.testing.assert_allclose(s[1::2], (s[:-1:2] + s[2::2]) / 2)


@pytest.mark.parametrize("peak", [0.4, 0.5, 0.57])
def test_apex_of_a_parabola_is_exact(peak: float) -> None:
    s = node_phases(16)
    top = _apex(s, ca.SX(0.34 - 1.2 * (s - peak) ** 2))
    assert float(top) == pytest.approx(0.34, abs=1e-14)


def test_every_constraint_has_a_unit(solution: GaitSolution) -> None:
    assert set(solution.violations) == set(UNITS) - OF_TRUNKS  # the trunk is locked


def test_a_violation_is_found_under_its_name(robot: Robot, solution: GaitSolution) -> None:
    problem = GaitProblem(robot, 0.0, apex=1.0)
    program, p = transcribe(problem), np.array([0.3, 0.34])
    values = program.unpack(solution.state.x.copy())  # blocks are views of it
    values["flight.tau"][5, 1] = robot.tau_max[1] + 2.0
    values["stance.q"][0, 1] += 1e-3
    found = program.violations(program.pack(values), p)
    assert found["torque limits"].value == pytest.approx(2.0)
    assert found["torque limits"].where == "flight, node 5"
    assert found["contact height"].value == pytest.approx(1e-3)
    assert found["periodicity"].value == pytest.approx(1e-3)
    assert found["average speed"].value < 1e-9


def test_vertical_hop_respects_the_bounds(robot: Robot) -> None:
    problem = GaitProblem(robot, 0.3)
    program = transcribe(GaitProblem(robot, 0.0, apex=1.0))
    x, bounds = program.pack(vertical_hop(problem)), program.bounds
    assert np.all(bounds["lbx"] <= x)
    assert np.all(x <= bounds["ubx"])
    assert set(program.unpack(x)) == set(vertical_hop(problem))
