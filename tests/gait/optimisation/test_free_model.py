"""The robot on a free trunk, in CasADi, is Pinocchio's; half a stride mirrored is data."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.errors import UnknownName
from pronk_pin.gait import GaitProblem, gait_problem, load_library, optimize_gait
from pronk_pin.gait.optimisation.folded_model import fold
from pronk_pin.gait.problem import WALK, FreeTrunk
from pronk_pin.kinematics import (
    contact_jacobian,
    foot_positions,
    free_coordinates,
    free_rates,
    free_state,
    mirror,
)
from pronk_pin.kinematics.trunk import angle_axes
from pronk_pin.robot import Robot


def test_equations_of_motion_are_those_of_pinocchio(robot: Robot) -> None:
    model, rng = fold(robot, "rolling", "free"), np.random.default_rng(3)
    q, v, a = rng.normal(scale=0.5, size=(3, 18))
    lam = rng.normal(scale=30.0, size=12)
    curves = [(x[None, :6], x[None, 6:]) for x in (q, v, a)]
    whole = [x[0] for x in free_state(robot, *curves)]
    wanted = pin.rnea(robot.model, robot.data, *whole)
    wanted = wanted - contact_jacobian(robot, whole[0], contact="rolling").T @ lam
    turned = pin.Quaternion(whole[0][3:7]).matrix()
    found = np.array(model.dynamics(q, v, a, lam)).ravel()
    np.testing.assert_allclose(found[6:], wanted[6:], atol=1e-12)
    np.testing.assert_allclose(found[[0, 3, 1]], turned @ wanted[:3], atol=1e-12)
    moments = angle_axes(q[None, :6])[0] @ turned @ wanted[3:6]
    np.testing.assert_allclose(found[[5, 2, 4]], moments, atol=1e-12)


def test_coordinates_and_rates_come_back_from_the_state(robot: Robot) -> None:
    rng = np.random.default_rng(4)
    q, v, a = rng.normal(scale=0.5, size=(3, 18))
    whole_q, whole_v, _ = free_state(robot, *[(x[None, :6], x[None, 6:]) for x in (q, v, a)])
    np.testing.assert_allclose(free_coordinates(whole_q)[0], q[:6], atol=1e-12)
    np.testing.assert_allclose(free_rates(q[:6], whole_v[0]), v[:6], atol=1e-12)


def test_the_mirror_puts_each_foot_where_its_partner_is(robot: Robot) -> None:
    model, rng = fold(robot, "rolling", "free"), np.random.default_rng(5)
    q = rng.normal(scale=0.3, size=18)
    image = np.array(model.mirrored(q)).ravel()
    still = np.zeros((1, 6)), np.zeros((1, 12))
    feet, images = (
        foot_positions(robot, free_state(robot, (x[None, :6], x[None, 6:]), still, still)[0])[0]
        for x in (q, image)
    )
    partners = feet[list(mirror(robot).partner)] * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(images, partners, atol=1e-12)


def test_the_other_half_of_a_trot_is_on_the_other_diagonal(robot: Robot) -> None:
    problem = gait_problem(robot, 0.5, gait="trot")
    feet = {phase.name: problem.feet(phase) for phase in problem.whole_sequence}
    assert feet == {
        "left stance": ("FL", "RR"),
        "left flight": (),
        "right stance": ("FR", "RL"),
        "right flight": (),
    }


def test_trot_of_the_robot_as_it_is_needs_no_guide_and_keeps_off_its_limits(robot: Robot) -> None:
    """Residual of all 18 rows with Pinocchio's model, whose trunk is not its own mirror image."""
    library = load_library("a1", gait="trot")
    for gait, audit in zip(library.gaits, library.audit, strict=True):
        assert audit.passed
        assert audit["guide"].value < 1e-8
        assert audit["velocity use"].value < 0.5
        assert audit["torque use"].value < 0.5
        base = np.concatenate([p.base_reference(np.linspace(0, 1, 51))[0] for p in gait.phases])
        assert np.max(np.abs(base[:, [2, 4, 5]])) < 0.06  # pitch, roll, yaw


def test_trots_of_all_speeds_are_one_family(robot: Robot) -> None:
    """Between two gaits, the mean of both almost obeys the equations of motion."""
    library = load_library("a1", gait="trot")
    for speed in (library.speeds[:-1] + library.speeds[1:]) / 2.0:
        residual = library.residual(float(speed), robot=robot)
        assert residual.force < 0.01 * robot.mass * robot.gravity
        assert residual.height < 1e-4


@pytest.mark.slow
def test_a_walk_without_a_flight_lands_each_foot_at_rest_beside_those_that_stand(
    robot: Robot,
) -> None:
    """Three legs stand, one swings, each in its turn: no impact, no jump of the velocity."""
    sequence = tuple(dataclasses.replace(phase, intervals=4) for phase in WALK)
    problem = GaitProblem(
        robot, 0.2, apex=0.29, base="free", sequence=sequence, stride=(0.48, 0.8),
        trunk=FreeTrunk(), hip_limit=0.15, velocity_weight=0.3, clearance=0.02,
    )  # fmt: skip
    assert not any(problem.impacts(index) for index in range(len(sequence)))
    walk = optimize_gait(problem, diagnose=False)
    motions = [walk.motions[phase.name] for phase in sequence]
    assert walk.impulses == {}
    assert motions[0].q[len(motions[0].t) // 2, 2] == pytest.approx(0.29)
    for before, after in zip([motions[-1], *motions[:-1]], motions, strict=True):
        np.testing.assert_allclose(before.v[-1], after.v[0], atol=1e-8)
    for phase, motion in zip(sequence, motions, strict=True):
        legs = [robot.legs.index(foot) for foot in problem.feet(phase)]
        assert len(legs) == 3
        for q, v in zip(motion.q, motion.v, strict=True):
            jacobian = contact_jacobian(
                robot, q, feet=[robot.legs[leg] for leg in legs], contact="rolling"
            )
            np.testing.assert_allclose(jacobian @ v, 0.0, atol=5e-3)  # a coarse mesh
        weight = motion.lam[:, legs, 2]
        assert np.min(weight) >= 0.0
    lasting = [motion.t[-1] for motion in motions]
    lift = [np.trapezoid(m.lam[..., 2].sum(axis=1), m.t) for m in motions]
    assert sum(lift) == pytest.approx(robot.mass * robot.gravity * sum(lasting), rel=0.01)


def test_pronking_on_a_free_trunk_is_refused(robot: Robot) -> None:
    with pytest.raises(UnknownName, match="choose one of: locked, sagittal"):
        gait_problem(robot, 0.5, base="free")


def test_shipped_trot_keeps_its_standing_feet_on_the_ground(robot: Robot) -> None:
    for gait in load_library("a1", gait="trot").gaits:
        for phase in gait.phases:
            q = phase.motion(robot, np.linspace(0.0, 1.0, 101)).q
            height = foot_positions(robot, q)[..., 2] - robot.foot_radius
            standing = [robot.legs.index(foot) for foot in phase.feet]
            np.testing.assert_allclose(height[:, standing], 0.0, atol=1e-5)
            assert np.min(height) > -1e-5
