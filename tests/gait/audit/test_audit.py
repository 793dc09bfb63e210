"""The audit passes what is right and catches what is not."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.dynamics import planar_dynamics
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Audit, GaitSolution, audit, bezier_orders
from pronk_pin.gait.checks import Check, StoredAudit
from pronk_pin.kinematics import foot_positions
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
    order = report["convergence order"]
    assert 3.0 < order.value < 5.5
    assert order.where == "stance drift, from (6, 8) intervals to (12, 16)"


def test_the_bezier_orders_are_the_lowest_that_do(solution: GaitSolution) -> None:
    """Within 1e-3 rad in the joints; in stance the feet within 0.01 mm of the ground too."""
    losses = bezier_orders(solution)
    orders = {phase.name: phase.order for phase in solution.problem.sequence}
    flight = [loss.order for loss in losses["flight"] if loss.joints < 1e-3]
    stance = [loss.order for loss in losses["stance"] if loss.joints < 1e-3 and loss.feet < 5e-6]
    assert (stance[0], flight[0]) == (orders["stance"], orders["flight"])


def doctored(solution: GaitSolution, phase: str, **changed: Array) -> Audit:
    """The audit of a solution of which some of a phase's curves are others."""
    other = dataclasses.replace(solution.motions[phase], **changed)
    motions = {**solution.motions, phase: other}
    return audit(dataclasses.replace(solution, motions=motions), refine=False)


def test_each_foot_is_held_by_the_load_that_it_bears_itself(solution: GaitSolution) -> None:
    """50 N along the ground under a load of 50 N: 1 / 0.6 of the cone, whatever others bear."""
    stance = solution.motions["stance"]
    lam = stance.lam.copy()
    lam[7, 2] = (30.0, 40.0, 50.0)
    report = doctored(solution, "stance", lam=lam)
    found = report["friction use"]
    assert found.value == pytest.approx(1.0 / solution.problem.friction)
    assert found.where == f"stance, t = {stance.t[7]:.3f} s"
    assert found in report.failures
    lam[7, 2, 2] = 0.0  # without load nothing holds
    assert doctored(solution, "stance", lam=lam)["friction use"].value > 1e3
    lam[7, 2] = 0.0  # a foot in the air uses nothing of its cone
    assert doctored(solution, "stance", lam=lam)["friction use"].value < 1.0


def test_the_use_of_a_limit_is_that_of_the_motor_that_comes_nearest(
    solution: GaitSolution,
) -> None:
    robot, flight = solution.problem.robot, solution.motions["flight"]
    tau, v = flight.tau.copy(), flight.v.copy()
    tau[3, 8], v[4, 6 + 10] = -1.25 * robot.tau_max[8], 1.5 * robot.v_max[10]
    report = doctored(solution, "flight", tau=tau, v=v)
    for name, value, node in (("torque use", 1.25, 3), ("velocity use", 1.5, 4)):
        assert report[name].value == pytest.approx(value)
        assert report[name].where == f"flight, t = {flight.t[node]:.3f} s"
        assert not report[name].passed


def test_the_ground_force_is_that_on_all_feet_together(solution: GaitSolution) -> None:
    lam = solution.motions["stance"].lam.copy()
    lam[5, :, 2] = (100.0, 200.0, 300.0, 400.0)
    assert doctored(solution, "stance", lam=lam)["ground force"].value == pytest.approx(1000.0)


def test_a_leg_that_moves_alone_is_no_mirror_symmetry(solution: GaitSolution) -> None:
    """A thigh turned by 10 mrad moves its foot by so much times its distance from the joint."""
    robot, flight = solution.problem.robot, solution.motions["flight"]
    q = flight.q.copy()
    q[6, 7 + 4] += 0.01  # FR_thigh
    before, after = (foot_positions(robot, each[6])[1] for each in (flight.q, q))
    report = doctored(solution, "flight", q=q)
    assert report["mirror symmetry"].value == pytest.approx(np.abs(after - before).max())
    assert not report["mirror symmetry"].passed
    assert report["bezier position"].value == pytest.approx(0.01, abs=1e-3)


def test_a_standing_foot_that_lifts_or_slips_is_seen(solution: GaitSolution) -> None:
    stance = solution.motions["stance"]
    q, v = stance.q.copy(), stance.v.copy()
    q[5, 2] += 1e-3
    v[6, 0] += 0.02  # of the trunk, level: the feet slip as fast
    report = doctored(solution, "stance", q=q, v=v)
    for name, value, node in (("contact height drift", 1e-3, 5), ("contact slip", 0.02, 6)):
        assert report[name].value == pytest.approx(value, rel=1e-2)
        assert report[name].where == f"stance, t = {stance.t[node]:.3f} s"


def test_the_apex_is_the_gaits_greatest_height_between_the_nodes_too(
    solution: GaitSolution,
) -> None:
    higher = dataclasses.replace(solution.problem, apex=solution.problem.apex + 0.005)
    found = audit(dataclasses.replace(solution, problem=higher), refine=False)["apex error"]
    assert found.value == pytest.approx(0.005, abs=1e-4)
    assert found.where == "flight"
