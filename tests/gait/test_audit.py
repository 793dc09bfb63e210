"""The audit passes what is right and catches what is not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pronk_pin.gait import Audit, GaitProblem, GaitSolution, audit, optimize_gait
from pronk_pin.gait.reintegration import drift, forward_dynamics


@pytest.fixture(scope="module")
def report(solution: GaitSolution) -> Audit:
    return audit(solution)


def test_a_solution_passes(report: Audit) -> None:
    assert report.passed, report.table()


def test_a_wrong_torque_is_caught(solution: GaitSolution) -> None:
    stance = solution.motions["stance"]
    wrong = dataclasses.replace(stance, tau=1.01 * stance.tau)
    doctored = dataclasses.replace(solution, motions={**solution.motions, "stance": wrong})
    failed = {check.name for check in audit(doctored).failures}
    assert {"18-DoF residual", "stance drift"} <= failed


def test_library_keeps_every_value(report: Audit) -> None:
    again = Audit.from_flat(report.speed, report.flat())
    assert again.flat() == report.flat()
    assert again.passed
    assert [c.name for c in again.constraints] == [c.name for c in report.constraints]
    assert "FAILED" not in again.table()


def test_dynamics_give_the_optimised_acceleration(solution: GaitSolution) -> None:
    robot = solution.problem.robot
    for name, contact in (("stance", solution.problem.contact), ("flight", None)):
        motion = solution.motions[name]
        for k in (0, 7, 24):
            a = forward_dynamics(robot, motion.q[k], motion.v[k], motion.tau[k], contact=contact)
            np.testing.assert_allclose(a, motion.a[k], atol=1e-6)


def test_drift_falls_with_the_fourth_power_of_the_mesh(solution: GaitSolution) -> None:
    robot, contact = solution.problem.robot, solution.problem.contact
    coarse = optimize_gait(GaitProblem(robot, 0.3, intervals=(6, 8)))
    drifts = [drift(robot, s.motions["stance"], contact=contact).joints for s in (coarse, solution)]
    order = np.log2(drifts[0] / drifts[1])  # the mesh is twice as fine
    assert 3.0 < order < 5.5
