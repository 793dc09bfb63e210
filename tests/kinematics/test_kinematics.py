"""Closed-form legs agree with Pinocchio, forwards and backwards, still and in motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import Robot
from pronk_pin._typing import Array
from pronk_pin.dynamics import contact_jacobian
from pronk_pin.errors import InvalidInput, UnknownName
from pronk_pin.kinematics import (
    foot_positions,
    foot_velocities,
    inverse_kinematics,
    leg_angle,
    leg_inverse_kinematics,
    leg_odometry,
    rotate_leg,
)
from pronk_pin.kinematics.legs import leg_geometry, leg_motion
from pronk_pin.robot.conventions import rotation_matrix

Draw = Callable[..., tuple[Array, Array, Array, Array]]


def feet_in_trunk(robot: Robot, joints: Array) -> Array:
    """Foot centres from the trunk's origin, by Pinocchio, shape (n, 4, 3)."""
    q = robot.q_from_base(np.zeros((*joints.shape[:-1], 3)), joints)
    return foot_positions(robot, q)


def test_feet_are_where_pinocchio_puts_them(any_robot: Robot, any_states: Draw) -> None:
    q, v, _, _ = any_states(4)
    positions = foot_positions(any_robot, q.reshape(2, 2, 19))
    assert positions.shape == (2, 2, 4, 3)
    pin.framesForwardKinematics(any_robot.model, any_robot.data, q[3])
    for leg, foot in enumerate(any_robot.foot_ids):
        np.testing.assert_array_equal(positions[1, 1, leg], any_robot.data.oMf[foot].translation)
    velocity = contact_jacobian(any_robot, q[3]) @ v[3]
    np.testing.assert_allclose(foot_velocities(any_robot, q, v)[3].ravel(), velocity, atol=1e-12)


def test_the_closed_form_agrees_with_pinocchio(any_robot: Robot, any_states: Draw) -> None:
    q, v, _, _ = any_states(50)
    shape = (50, 4, 3)
    legs = leg_motion(leg_geometry(any_robot), q[:, 7:].reshape(shape), v[:, 6:].reshape(shape))
    rotation = rotation_matrix(q[:, 3:7])
    position = q[:, None, :3] + np.einsum("nij,nlj->nli", rotation, legs.position)
    np.testing.assert_allclose(position, foot_positions(any_robot, q), atol=1e-13)
    v[:, :6] = 0.0
    velocity = np.einsum("nij,nlj->nli", rotation, legs.velocity)
    np.testing.assert_allclose(velocity, foot_velocities(any_robot, q, v), atol=1e-12)


@pytest.mark.parametrize("knee", ["backward", "forward"])
@pytest.mark.parametrize("hip", ["above", "below"])
def test_every_branch_reaches_every_foot(
    any_robot: Robot, any_states: Draw, knee: str, hip: str
) -> None:
    joints = any_states(200)[0][:, 7:]
    targets = feet_in_trunk(any_robot, joints)
    solved = np.empty_like(joints)
    for index, leg in enumerate(any_robot.legs):
        solution = leg_inverse_kinematics(any_robot, targets[:, index], leg=leg, knee=knee, hip=hip)
        if hip == "above" or not leg_geometry(any_robot).thigh[index, 2]:
            assert solution.reachable.all()  # thighs below the hip's axis do not reach as far above
        elsewhere = joints[:, 3 * index : 3 * index + 3]
        solution = solution._replace(
            joints=np.where(solution.reachable[:, None], solution.joints, elsewhere)
        )
        solved[:, 3 * index : 3 * index + 3] = solution.joints
    np.testing.assert_allclose(feet_in_trunk(any_robot, solved), targets, atol=1e-10)


def test_the_joints_come_back_over_their_range(any_robot: Robot, any_states: Draw) -> None:
    joints = any_states(300)[0][:, 7:]
    middle = 0.5 * (any_robot.q_min + any_robot.q_max)
    # Solo12's joints may turn more than once, which the foot does not show.
    joints = middle + np.clip(joints - middle, -3.1, 3.1)
    targets = feet_in_trunk(any_robot, joints)
    for index, leg in enumerate(any_robot.legs):
        mine = joints[:, 3 * index : 3 * index + 3]
        found = [
            leg_inverse_kinematics(any_robot, targets[:, index], leg=leg, hip=hip, knee=knee)
            for hip in ("above", "below")
            for knee in ("backward", "forward")
        ]
        errors = np.array([np.abs(item.joints - mine).max(axis=-1) for item in found])
        assert errors.min(axis=0).max() < 1e-7  # the root of round-off, where a knee is stretched
        within = np.array([item.within_limits for item in found])
        assert within[errors.argmin(axis=0), np.arange(len(joints))].all()


def test_what_is_out_of_reach_is_told(robot: Robot) -> None:
    targets = np.array([[0.18, 0.13, -0.3], [0.18, 0.13, -0.6], [0.18, 0.05, 0.0]])
    solution = leg_inverse_kinematics(robot, targets, leg="FL")
    np.testing.assert_array_equal(solution.reachable, [True, False, False])
    assert np.isfinite(solution.joints).all()
    assert solution.joints[1, 2] == pytest.approx(0.0)  # stretched towards the target
    assert not solution.within_limits[1]


@pytest.mark.parametrize("contact", ["point", "rolling"])
@pytest.mark.parametrize("standing", [(0, 1, 2, 3), (1, 2)])
def test_odometry_finds_the_velocity_of_a_standing_robot(
    any_robot: Robot, any_crouches: Draw, contact: str, standing: tuple[int, ...]
) -> None:
    """Joint rates that keep the contacts at rest, for a given velocity of the base."""
    q, v, _, _ = any_crouches(20)
    for row in range(len(q)):
        jacobian = contact_jacobian(any_robot, q[row], contact=contact)
        v[row, 6:] = np.linalg.solve(jacobian[:, 6:], -jacobian[:, :6] @ v[row, :6])
    truth = np.einsum("nij,nj->ni", rotation_matrix(q[:, 3:7]), v[:, :3])
    v[:, :3] = 1e6  # the base's linear velocity must not matter
    feet = [any_robot.legs[leg] for leg in standing]
    found = leg_odometry(any_robot, q, v, feet=feet, contact=contact)
    np.testing.assert_allclose(found, truth, atol=1e-11)
    np.testing.assert_allclose(
        leg_odometry(any_robot, q[3], v[3], feet=feet, contact=contact), found[3]
    )


def test_odometry_averages_feet_that_disagree(robot: Robot, random_states: Draw) -> None:
    q, v, _, _ = random_states(10)
    each = [leg_odometry(robot, q, v, feet=(leg,)) for leg in robot.legs]
    np.testing.assert_allclose(leg_odometry(robot, q, v), np.mean(each, axis=0), atol=1e-12)


def test_a_rolling_foot_travels_less_than_a_pivoting_one(robot: Robot) -> None:
    """A leg that pivots over a round foot moves the hip by l + r, seen from the joint by l."""
    v = np.zeros(18)
    v[6:] = np.tile([0.0, 1.0, 0.0], 4)
    height = robot.standing[2] - robot.foot_radius
    pivoting = leg_odometry(robot, robot.standing, v, contact="point")[0]
    rolling = leg_odometry(robot, robot.standing, v, contact="rolling")[0]
    assert pivoting == pytest.approx(height)
    assert rolling == pytest.approx(height + robot.foot_radius)


def test_the_leg_angle_is_that_of_the_line_from_hip_to_foot(
    robot: Robot, random_states: Draw
) -> None:
    joints = random_states(50)[0][:, 7:].copy()
    joints[:, 0::3] = 0.0
    hips = np.stack([robot.model.jointPlacements[2 + 3 * leg].translation for leg in range(4)])
    leg = feet_in_trunk(robot, joints) - hips
    angle = np.arctan2(-leg[..., 0], -leg[..., 2])
    np.testing.assert_allclose(np.cos(angle - leg_angle(robot, joints)), 1.0, atol=1e-12)


def test_turned_legs_are_what_inverse_kinematics_gives(robot: Robot, crouches: Draw) -> None:
    joints, delta = crouches(20)[0][:, 7:], 0.2
    turned = rotate_leg(robot, joints, delta)
    np.testing.assert_allclose(leg_angle(robot, turned) - leg_angle(robot, joints), delta)
    for index, leg in enumerate(robot.legs):
        part = slice(3 * index, 3 * index + 3)
        # Turn the foot about the thigh joint's axis, and ask where the joints must be.
        thigh = 3 + 3 * index
        q = robot.q_from_base(np.zeros((len(joints), 3)), joints)
        targets = np.empty((len(joints), 3))
        for row in range(len(joints)):
            pin.framesForwardKinematics(robot.model, robot.data, q[row])
            joint = robot.data.oMi[thigh]
            axis = robot.data.oMi[thigh - 1].rotation[:, 1]
            foot = robot.data.oMf[robot.foot_ids[index]].translation
            targets[row] = joint.translation + pin.exp3(delta * axis) @ (foot - joint.translation)
        solution = leg_inverse_kinematics(robot, targets, leg=leg)
        np.testing.assert_allclose(turned[:, part], solution.joints, atol=1e-12)


def test_each_leg_can_turn_by_its_own_angle(robot: Robot) -> None:
    delta = np.array([0.1, 0.2, 0.3, 0.4])
    joints = robot.standing[7:]
    np.testing.assert_allclose(
        leg_angle(robot, rotate_leg(robot, joints, delta)) - leg_angle(robot, joints), delta
    )


def test_the_whole_body_reaches_a_pose_and_its_feet(any_robot: Robot, any_crouches: Draw) -> None:
    for q in any_crouches(20)[0]:
        feet = foot_positions(any_robot, q)
        moved, pose = np.array([0.5, -0.2, 0.1]), q[:7].copy()
        pose[:3] += moved
        solution = inverse_kinematics(any_robot, pose, feet + moved)
        assert solution.reached
        np.testing.assert_allclose(solution.q[:7], pose, atol=1e-8)
        np.testing.assert_allclose(solution.q[7:], q[7:], atol=1e-6)
        # The same by the closed form.
        for index, leg in enumerate(any_robot.legs):
            knee = "forward" if q[9 + 3 * index] > 0 else "backward"
            exact = leg_inverse_kinematics(any_robot, feet[index] - q[:3], leg=leg, knee=knee)
            mine = solution.q[7 + 3 * index : 10 + 3 * index]
            np.testing.assert_allclose(mine, exact.joints, atol=1e-6)


def test_a_free_trunk_follows_its_feet(robot: Robot) -> None:
    feet = foot_positions(robot, robot.standing) + np.array([0.03, 0.0, 0.0])
    solution = inverse_kinematics(robot, None, feet, initial=robot.standing)
    assert solution.reached
    np.testing.assert_allclose(foot_positions(robot, solution.q), feet, atol=1e-9)
    one = inverse_kinematics(robot, robot.standing[:7], feet[[1]], legs=["FR"])
    assert one.reached
    np.testing.assert_allclose(one.q[7:10], robot.standing[7:10], atol=1e-12)


def test_targets_out_of_reach_are_met_as_nearly_as_can_be(robot: Robot) -> None:
    below = foot_positions(robot, robot.standing) - np.array([0.0, 0.0, 0.5])
    solution = inverse_kinematics(robot, robot.standing[:7], below)
    assert not solution.reached
    assert (solution.q[7:] >= robot.q_min).all()
    assert (solution.q[7:] <= robot.q_max).all()
    apart = below - foot_positions(robot, solution.q)
    np.testing.assert_allclose(solution.foot_errors, apart, atol=1e-12)
    np.testing.assert_allclose(solution.base_error[2], 4 * -apart[0, 2], rtol=1e-6)  # balanced
    firm = inverse_kinematics(robot, robot.standing[:7], below, base_weight=1e4)
    assert np.abs(firm.base_error).max() < 1e-3
    with pytest.raises(InvalidInput, match=r"tolerance=0\.0; give a positive number"):
        inverse_kinematics(robot, None, below, tolerance=0.0)
    with pytest.raises(InvalidInput, match=r"feet has shape \(4, 3\) where \(2, 3\)"):
        inverse_kinematics(robot, None, below, legs=("FL", "FR"))


def test_legs_without_a_closed_form_are_refused(robot: Robot) -> None:
    model = robot.model.copy()
    model.jointPlacements[3] = pin.SE3(pin.exp3(np.array([0.0, 0.0, 0.1])), np.zeros(3))
    with pytest.raises(InvalidInput, match="FL_thigh_joint does not turn about the trunk's y axis"):
        leg_geometry(replace(robot, model=model))


def test_wrong_arguments_are_refused_with_a_remedy(robot: Robot) -> None:
    q, v = robot.standing, np.zeros(18)
    with pytest.raises(InvalidInput, match=r"positions has shape \(2,\) where \(\.\.\., 3\)"):
        leg_inverse_kinematics(robot, np.zeros(2), leg="FL")
    with pytest.raises(UnknownName, match="unknown leg 'left'"):
        leg_inverse_kinematics(robot, np.zeros(3), leg="left")
    with pytest.raises(UnknownName, match="choose one of: backward, forward"):
        leg_inverse_kinematics(robot, np.zeros(3), leg="FL", knee="up")
    with pytest.raises(InvalidInput, match="normalise it first"):
        foot_positions(robot, 0.9 * q)
    with pytest.raises(InvalidInput, match="NaN"):
        foot_velocities(robot, q, v * np.nan)
    with pytest.raises(InvalidInput, match="at least one leg"):
        leg_odometry(robot, q, v, feet=())
    with pytest.raises(InvalidInput, match="does not fit"):
        rotate_leg(robot, q[7:], np.zeros(3))


@pytest.mark.parametrize("contact", ["point", "rolling"])
def test_odometry_holds_for_a_trunk_that_leans_and_turns(
    any_robot: Robot, any_states: Draw, contact: str
) -> None:
    """A leg that stands alone, at any attitude: trunk's axes are not the world's."""
    q, v, _, _ = any_states(30)
    for row, leg in enumerate(np.arange(30) % 4):
        foot, joints = (any_robot.legs[leg],), slice(6 + 3 * leg, 9 + 3 * leg)
        jacobian = contact_jacobian(any_robot, q[row], feet=foot, contact=contact)
        v[row, joints] = np.linalg.solve(jacobian[:, joints], -jacobian[:, :6] @ v[row, :6])
        truth = rotation_matrix(q[row, 3:7]) @ v[row, :3]
        found = leg_odometry(any_robot, q[row], v[row], feet=foot, contact=contact)
        np.testing.assert_allclose(found, truth, atol=1e-8)
