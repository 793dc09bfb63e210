"""The optimiser finds the gait, and says so when it does not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.dynamics import contact_jacobian, planar_rows
from pronk_pin.errors import GaitNotFound, InvalidInput, UnknownName
from pronk_pin.gait import (
    BOUND,
    PRONK,
    GaitLibrary,
    GaitProblem,
    GaitSolution,
    audit,
    gait_problem,
    optimize_gait,
    vertical_hop,
)
from pronk_pin.gait.checks import TOLERANCE
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot, load_robot

COARSE = (4, 6)
"""A mesh that is quick to solve, where accuracy does not matter."""


def test_crude_guess_finds_the_shipped_gait(solution: GaitSolution, library: GaitLibrary) -> None:
    shipped = library.at(0.3)
    for mine, theirs in zip(solution.gait.phases, shipped.phases, strict=True):
        assert mine.duration == pytest.approx(theirs.duration, abs=1e-6)
        np.testing.assert_allclose(mine.joints, theirs.joints, atol=1e-5)


def test_no_constraint_is_violated(solution: GaitSolution) -> None:
    assert max(violation.value for violation in solution.violations.values()) <= TOLERANCE


def test_neighbour_gives_a_quick_start(solution: GaitSolution, library: GaitLibrary) -> None:
    problem = dataclasses.replace(solution.problem, speed=0.4)
    warm = optimize_gait(problem, initial=solution)
    assert warm.iterations < solution.iterations / 2
    np.testing.assert_allclose(warm.gait.stance.joints, library.at(0.4).stance.joints, atol=1e-5)


def test_touchdown_is_the_plastic_impact_of_the_whole_robot(solution: GaitSolution) -> None:
    robot, contact = solution.problem.robot, solution.problem.contact
    before, after = solution.motions["flight"], solution.motions["stance"]
    rows, q, v = planar_rows(robot), after.q[0], before.v[-1]
    mass = pin.crba(robot.model, robot.data, q)[np.ix_(rows, rows)]
    jacobian = contact_jacobian(robot, q, contact=contact)[:, rows]
    kkt = np.block([[mass, -jacobian.T], [jacobian, np.zeros((12, 12))]])
    solved = np.linalg.solve(kkt, np.concatenate([mass @ v[rows], np.zeros(12)]))
    np.testing.assert_allclose(after.v[0, rows], solved[: len(rows)], atol=1e-8)
    np.testing.assert_allclose(solution.impulses["stance"].ravel(), solved[len(rows) :], atol=1e-8)


def test_motors_do_the_work_that_changes_the_energy(solution: GaitSolution) -> None:
    robot = solution.problem.robot
    for name, motion in solution.motions.items():
        energy = [
            pin.computeMechanicalEnergy(robot.model, robot.data, q, v)
            for q, v in ((motion.q[0], motion.v[0]), (motion.q[-1], motion.v[-1]))
        ]
        power = np.sum(motion.tau * motion.v[:, 6:], axis=1)
        work = np.sum(np.diff(motion.t[::2]) / 6 * (power[:-2:2] + 4 * power[1::2] + power[2::2]))
        assert work == pytest.approx(energy[1] - energy[0], abs=1e-3), name


def test_ground_carries_the_weight_over_a_stride(solution: GaitSolution) -> None:
    robot, stance = solution.problem.robot, solution.motions["stance"]
    force = stance.lam.sum(axis=1)  # (nodes, 3)
    impulse = np.sum(
        np.diff(stance.t[::2])[:, None] / 6 * (force[:-2:2] + 4 * force[1::2] + force[2::2]),
        axis=0,
    )
    weight = robot.mass * robot.gravity * solution.gait.duration
    np.testing.assert_allclose(
        impulse + solution.impulses["stance"].sum(axis=0), [0.0, 0.0, weight], atol=1e-3
    )


def test_spherical_feet_roll_and_point_feet_stay(solution: GaitSolution) -> None:
    robot = solution.problem.robot
    point = optimize_gait(GaitProblem(robot, 0.3, contact="point").remeshed(COARSE))

    def travel(found: GaitSolution) -> np.ndarray:
        q = found.motions["stance"].q
        return foot_positions(robot, q[-1]) - foot_positions(robot, q[0])

    q = solution.motions["stance"].q
    turned = (q[-1] - q[0])[7:].reshape(4, 3)[:, 1:].sum(axis=1)  # thigh and calf [rad]
    # The hips turn by less than 0.1 rad, so that the rolling is nearly in the plane.
    np.testing.assert_allclose(travel(solution)[:, 0], robot.foot_radius * turned, rtol=0.02)
    assert np.all(np.abs(travel(solution)[:, 0]) > 1e-3)
    np.testing.assert_allclose(travel(point), 0.0, atol=1e-4)


def test_unlike_legs_get_torques_and_impulses_of_their_own() -> None:
    """The Go1's URDF is not its own mirror image; the motion is, and obeys every row."""
    go1 = load_robot("go1")
    found = optimize_gait(GaitProblem(go1, 0.3).remeshed(COARSE))
    assert audit(found, refine=False)["18-DoF residual"].value < 1e-8
    tau = found.motions["flight"].tau
    assert np.max(np.abs(tau[:, 1:3] - tau[:, 4:6])) > 0.01
    before, after = found.motions["flight"], found.motions["stance"]
    rows, q = planar_rows(go1), after.q[0]
    jump = pin.crba(go1.model, go1.data, q) @ (after.v[0] - before.v[-1])
    push = contact_jacobian(go1, q, contact="rolling").T @ found.impulses["stance"].ravel()
    np.testing.assert_allclose(push[rows], jump[rows], atol=1e-8)


def test_a_pitching_trunk_has_no_moment_about_its_pitch_axis(robot: Robot) -> None:
    problem = gait_problem(robot, 0.0, gait="bound").remeshed((6, 6, 6, 6))
    found = optimize_gait(problem)
    report = audit(found, refine=False)
    assert report["18-DoF residual"].value < 1e-8
    # All that the planar constraint still takes is what the trunk's centre of mass lies off the
    # mirror plane.
    assert report["guide"].value < 1.0
    pitch = [2 * np.arcsin(motion.q[:, 4]) for motion in found.motions.values()]
    assert 0.1 < np.max(np.abs(np.concatenate(pitch))) <= problem.pitch_limit + 1e-8


def test_an_impossible_gait_names_what_fights(robot: Robot) -> None:
    problem = GaitProblem(robot, 0.3, torque_use=0.1).remeshed((4, 4))
    with pytest.raises(GaitNotFound, match="these demands fight") as caught:
        optimize_gait(problem)
    assert max(caught.value.violations.values()) > TOLERANCE
    # The torque limits are 3.35 N m; a gait of this cost uses about 4 N m.
    assert caught.value.conflicts is not None
    assert list(caught.value.conflicts) == ["torque limits"]
    assert "raise torque_use" in str(caught.value)
    enough = problem.torque_use * robot.tau_max[0] + caught.value.conflicts["torque limits"]
    optimize_gait(dataclasses.replace(problem, torque_use=1.02 * enough / robot.tau_max[0]))


def test_an_initial_solution_must_have_the_same_mesh(solution: GaitSolution) -> None:
    finer = solution.problem.remeshed((14, 16))
    with pytest.raises(InvalidInput, match="mesh intervals"):
        optimize_gait(finer, initial=solution)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"stride": (0.3, 0.1)}, "the shorter one first"),
        ({"base": "free"}, "choose gait 'trot', or base 'locked' or 'sagittal'"),
        ({"sequence": PRONK[:1]}, "no flight"),
        ({"sequence": BOUND[:2]}, "the rear legs never stand"),
        ({"sequence": (*PRONK, dataclasses.replace(PRONK[1], name="more"))}, "same feet; merge"),
        ({"friction": 0.0}, r"friction=0\.0; give a number above 0, up to 10"),
        ({"apex": 0.1}, "is not above the least trunk height"),
    ],
)
def test_a_senseless_problem_is_refused(robot: Robot, change: dict, text: str) -> None:
    with pytest.raises((InvalidInput, UnknownName), match=text):
        GaitProblem(robot, 0.3, **change)


def test_a_senseless_mesh_or_order_is_refused(robot: Robot) -> None:
    with pytest.raises(InvalidInput, match="an even number, 4 or more"):
        GaitProblem(robot, 0.3).remeshed((12, 15))
    with pytest.raises(InvalidInput, match="3 or more"):
        dataclasses.replace(PRONK[0], order=2)


def test_a_guess_of_another_problem_is_refused(robot: Robot, solution: GaitSolution) -> None:
    guess = vertical_hop(solution.problem.remeshed(COARSE))
    with pytest.raises(InvalidInput, match=r"guess for stance.q is not \d+ numbers"):
        optimize_gait(solution.problem, initial=guess)
    other = dataclasses.replace(solution.problem, base="sagittal")
    with pytest.raises(InvalidInput, match="another contact sequence or base"):
        optimize_gait(other, initial=solution)
