"""The audit passes what is right and catches what is not."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from pronk_pin.dynamics import planar_dynamics
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Audit, GaitSolution, audit, bezier_orders
from pronk_pin.gait.checks import Check, StoredAudit
from pronk_pin.storage import as_type


@pytest.fixture(scope="module")
def report(solution: GaitSolution) -> Audit:
    return audit(solution)


def test_a_solution_passes(report: Audit) -> None:
    assert report.passed, report.table()


def test_a_wrong_torque_is_caught(solution: GaitSolution) -> None:
    stance = solution.motions["stance"]
    wrong = dataclasses.replace(stance, tau=1.01 * stance.tau)
    doctored = dataclasses.replace(solution, motions={**solution.motions, "stance": wrong})
    failed = {check.name for check in audit(doctored, refine=False).failures}
    assert {"18-DoF residual", "stance drift"} <= failed


def test_library_keeps_every_value(report: Audit) -> None:
    document = json.loads(json.dumps(report.as_json()))
    again = Audit.from_stored(report.speed, as_type(document, StoredAudit, "x", "again"))
    assert again == report
    assert "FAILED" not in again.table()


def test_every_check_says_where_it_is_worst(report: Audit) -> None:
    for check in report.checks:
        assert "stance" in check.where or "flight" in check.where, check.name


def test_an_audit_without_a_check_is_damage(report: Audit) -> None:
    checks = report.as_json()["checks"]
    less = {name: found for name, found in checks.items() if name != "stance drift"}
    with pytest.raises(InvalidInput, match="audit without stance drift"):
        Audit.from_stored(0.3, StoredAudit(report.motion, less))
    for stranger in ("beauty", "violation: beauty"):
        more = {**checks, stranger: (1.0, "")}
        with pytest.raises(InvalidInput, match=f"'{stranger}' that is not known"):
            Audit.from_stored(0.3, StoredAudit(report.motion, more))


def test_an_audit_says_which_motion_it_is_of(solution: GaitSolution, report: Audit) -> None:
    assert report.motion == solution.gait.sha256


def test_a_limit_may_be_used_in_full_but_not_exceeded() -> None:
    assert Check.of("torque use", 1.0).passed
    assert not Check.of("torque use", 1.0 + 1e-6).passed
    assert not Check.of("torque use", float("nan")).passed
    assert not Check.of("convergence order", 2.0).passed


def test_dynamics_give_the_optimised_acceleration(solution: GaitSolution) -> None:
    robot = solution.problem.robot
    for name, feet in (("stance", robot.legs), ("flight", ())):
        motion = solution.motions[name]
        for k in (0, 7, 24):
            a = planar_dynamics(robot, motion.q[k], motion.v[k], motion.tau[k], feet=feet)
            np.testing.assert_allclose(a, motion.a[k], atol=1e-6)


def test_drift_falls_with_the_fourth_power_of_the_mesh(report: Audit) -> None:
    assert 3.0 < report["convergence order"].value < 5.5


def test_the_bezier_orders_are_the_lowest_that_do(solution: GaitSolution) -> None:
    """Within 1e-3 rad in the joints; in stance the feet within 0.01 mm of the ground too."""
    losses = bezier_orders(solution)
    orders = {phase.name: phase.order for phase in solution.problem.sequence}
    flight = [loss.order for loss in losses["flight"] if loss.joints < 1e-3]
    stance = [loss.order for loss in losses["stance"] if loss.joints < 1e-3 and loss.feet < 5e-6]
    assert (stance[0], flight[0]) == (orders["stance"], orders["flight"])
