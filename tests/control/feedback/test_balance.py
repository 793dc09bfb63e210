from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.control import (
    AttitudeRegulator,
    Balance,
    BalanceSpec,
    FootPlacement,
    Gains,
    StrideRecord,
    attitude_angle,
    attitude_error,
    roll_pitch_yaw,
)
from pronk_pin.control.learning.symmetry import symmetric
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library
from pronk_pin.kinematics import foot_positions, inverse_kinematics, mirrored
from pronk_pin.kinematics.contacts import contact_jacobian
from pronk_pin.robot import Robot
from pronk_pin.robot.conventions import rotation_matrix

TICK = 60
ROWS = np.array([0])


def balance(robot: Robot) -> Balance:
    gait = load_library("a1", base="sagittal").at(0.3)
    return Balance(robot, [gait], BalanceSpec(), gains=Gains(), ticks=300, timestep=0.001)


def in_stance(robot: Robot, roll: float, pitch: float, yaw: float) -> np.ndarray:
    """The gait's posture at a tick of stance, with the trunk turned from the gait's attitude."""
    stance = load_library("a1", base="sagittal").at(0.3).stance
    q = stance.motion(robot, np.array([TICK * 0.001 / stance.duration])).q[0]
    turn = pin.rpy.rpyToMatrix(roll, pitch, yaw)
    q[3:7] = pin.Quaternion(turn @ rotation_matrix(q[3:7])).coeffs()
    return q


def test_the_error_of_a_small_turn_is_its_rotation_vector() -> None:
    turn = np.array([0.02, -0.03, 0.01])
    reference = pin.rpy.rpyToMatrix(0.0, -0.2, 0.0)
    rotation = pin.exp3(-turn) @ reference
    np.testing.assert_allclose(attitude_error(rotation, reference), turn, atol=1e-4)
    assert attitude_angle(rotation, reference) == pytest.approx(np.linalg.norm(turn), abs=1e-9)


def test_roll_pitch_and_heading_are_those_the_rotation_was_made_of() -> None:
    angles = np.array([0.3, -0.4, 2.0])
    np.testing.assert_allclose(roll_pitch_yaw(pin.rpy.rpyToMatrix(*angles)), angles, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_torques_put_the_moment_that_was_asked_for_on_the_trunk(
    robot: Robot, axis: int
) -> None:
    """By virtual work: what the joints do comes out as a wrench on the trunk."""
    turn = np.zeros(3)
    turn[axis] = 0.02
    q = in_stance(robot, *turn)
    trunk = (q[None, :7], np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]))
    tau = balance(robot).torque(0, ROWS, TICK, trunk, q[None, 7:], q[None, 7:])[0]
    jacobian = contact_jacobian(robot, q, contact="rolling")
    lam = np.linalg.solve(jacobian[:, 6:].T, -tau)  # massless legs: tau + J^T lam = 0
    moment = rotation_matrix(q[3:7]) @ (jacobian[:, 3:6].T @ lam)
    stance = load_library("a1", base="sagittal").at(0.3).stance
    rate = stance.base_reference(np.array([TICK * 0.001 / stance.duration]))[1][0, 2]
    regulator = AttitudeRegulator()
    expected = np.array([0.0, regulator.damping[1] * rate, 0.0])
    expected[axis] -= regulator.stiffness[axis] * np.sin(turn[axis])
    np.testing.assert_allclose(moment, expected, rtol=1e-2, atol=0.02)
    np.testing.assert_allclose(rotation_matrix(q[3:7]) @ jacobian[:, :3].T @ lam, 0.0, atol=0.05)


def test_feet_are_put_down_as_if_the_trunk_had_the_gaits_attitude(robot: Robot) -> None:
    flight = load_library("a1", base="sagittal").at(0.3).flight
    tick = 180
    q = flight.motion(robot, np.array([tick * 0.001 / flight.duration])).q[0]
    wanted = foot_positions(robot, q) - q[:3]
    turned = q.copy()
    turned[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.1, 0.08, -0.1)).coeffs()
    trunk = (turned[None, :7], np.zeros((1, 6)))
    added = balance(robot).torque(1, ROWS, tick, trunk, q[None, 7:], q[None, 7:])[0]
    turned[7:] += added / Gains().proportional(12)
    np.testing.assert_allclose(foot_positions(robot, turned) - q[:3], wanted, atol=1e-9)


def test_a_trunk_that_drifts_to_the_left_puts_its_feet_further_left(robot: Robot) -> None:
    flight = load_library("a1", base="sagittal").at(0.3).flight
    tick, law = 180, balance(robot)
    q = flight.motion(robot, np.array([tick * 0.001 / flight.duration])).q[0]
    law.lift_off(ROWS, np.array([0.3]))
    added = law.torque(1, ROWS, tick, (q[None, :7], np.zeros((1, 6))), q[None, 7:], q[None, 7:])[0]
    moved = q.copy()
    moved[7:] += added / Gains().proportional(12)
    aside = foot_positions(robot, moved) - foot_positions(robot, q)
    np.testing.assert_allclose(
        aside, np.tile([0.0, 0.3 * FootPlacement().gain, 0.0], (4, 1)), atol=1e-9
    )


@pytest.mark.parametrize("learned", [0.0, 0.4, 1.0])
def test_what_a_turned_trunk_does_to_the_legs_is_learned_in_part(
    robot: Robot, learned: float
) -> None:
    """Feet that stand where the gait has them, under a trunk that is turned about its origin."""
    straight, turned = in_stance(robot, 0.0, 0.0, 0.0), in_stance(robot, 0.02, -0.05, 0.03)
    turned = inverse_kinematics(
        robot, turned[:7], foot_positions(robot, straight), initial=straight, tolerance=1e-10
    ).q
    gait = load_library("a1", base="sagittal").at(0.3)
    law = Balance(
        robot, [gait], BalanceSpec(learned=learned), gains=Gains(), ticks=300, timestep=0.001
    )
    ticks = np.ones((1, TICK + 1, 1))
    kept = law.unlearned(ROWS, ticks * turned[:7], ticks * straight[7:])[0, TICK]
    np.testing.assert_allclose(kept, (1.0 - learned) * (straight - turned)[7:], atol=1e-9)


@pytest.mark.parametrize("wrong", [{"learned": 1.1}, {"landing": -0.1}])
def test_a_share_that_is_learned_outside_0_to_1_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(
        InvalidInput, match=r"balance: l(earned|anding)=.*; give a number from 0 to 1"
    ):
        BalanceSpec(**wrong)


def test_nothing_reaches_the_motors_where_the_attitude_is_not_a_number(robot: Robot) -> None:
    q = in_stance(robot, 0.0, 0.0, 0.0)
    trunk = (np.full((1, 7), np.nan), np.zeros((1, 6)))
    for part in (0, 1):
        added = balance(robot).torque(part, ROWS, TICK, trunk, q[None, 7:], q[None, 7:])
        np.testing.assert_array_equal(added, 0.0)


def test_mirroring_twice_changes_nothing_and_swaps_left_and_right(robot: Robot) -> None:
    joints = np.arange(12.0)
    np.testing.assert_array_equal(mirrored(robot, mirrored(robot, joints)), joints)
    np.testing.assert_array_equal(mirrored(robot, joints)[:3], [-3.0, 4.0, 5.0])  # FR on FL


def test_what_is_learned_from_turns_the_trunk_neither_about_x_nor_about_z(robot: Robot) -> None:
    rng = np.random.default_rng(0)
    record = StrideRecord.of(*rng.standard_normal((4, 2, 161, 12)))
    mean = symmetric(robot, record)
    for name in ("error", "error_rate", "feedback"):
        values = getattr(mean, name)
        np.testing.assert_allclose(mirrored(robot, values), values, atol=1e-12)
    np.testing.assert_array_equal(mean.feedforward, record.feedforward)
    again = symmetric(robot, replace(mean))
    np.testing.assert_allclose(again.error, mean.error, atol=1e-12)


@pytest.mark.parametrize(
    "wrong", [{"stiffness": (-1.0, 0.0, 0.0)}, {"damping": (0.0, -1.0, 0.0)}, {"friction": 0.0}]
)
def test_gains_that_make_no_sense_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(
        InvalidInput, match=r"attitude regulation: .*; give a number (from|above) 0"
    ):
        AttitudeRegulator(**wrong)  # type: ignore[arg-type]
