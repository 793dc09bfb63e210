"""Conversions lose nothing, and mean to MuJoCo what they mean to Pinocchio."""

from __future__ import annotations

import copy
from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from pronk_pin import Robot
from pronk_pin._typing import Array
from pronk_pin.dynamics import flight_dynamics
from pronk_pin.errors import InvalidInput
from pronk_pin.kinematics import foot_positions, foot_velocities
from pronk_pin.robot.conventions import (
    from_mujoco,
    from_paper,
    joint_order,
    rotation_matrix,
    to_mujoco,
    to_paper,
)

Draw = Callable[..., tuple[Array, Array, Array, Array]]


def test_a_round_trip_gives_the_state_back(any_robot: Robot, any_states: Draw) -> None:
    state = any_states(200)
    back = from_mujoco(any_robot, *to_mujoco(any_robot, *state))
    for name, before, after in zip(back._fields, state, back, strict=True):
        assert after is not None
        scale = np.abs(before).max()
        np.testing.assert_allclose(after, before, rtol=0, atol=1e-14 * scale, err_msg=name)


def test_a_batch_is_converted_like_its_rows(robot: Robot, random_states: Draw) -> None:
    state = random_states(6)
    whole = to_mujoco(robot, *(x.reshape(2, 3, -1) for x in state))
    row = to_mujoco(robot, *(x[4] for x in state))
    for many, one in zip(whole, row, strict=True):
        assert many is not None
        assert one is not None
        np.testing.assert_array_equal(many[1, 1], one)


def test_what_is_not_given_stays_away(robot: Robot) -> None:
    converted = to_mujoco(robot, robot.standing)
    assert converted.qvel is converted.qacc is converted.ctrl is None


def test_mujoco_sees_the_same_feet(
    robot: Robot, random_states: Draw, mujoco_model: mujoco.MjModel
) -> None:
    q, v, _, _ = random_states(20)
    converted = to_mujoco(robot, q, v)
    assert converted.qvel is not None
    data = mujoco.MjData(mujoco_model)
    for row in range(len(q)):
        data.qpos[:], data.qvel[:] = converted.qpos[row], converted.qvel[row]
        mujoco.mj_forward(mujoco_model, data)
        positions, velocities = (
            foot_positions(robot, q[row]),
            foot_velocities(robot, q[row], v[row]),
        )
        for leg, position, velocity in zip(robot.legs, positions, velocities, strict=True):
            calf = mujoco_model.body(f"{leg}_calf").id
            in_calf = [0.0, 0.0, -0.2]
            place = data.xpos[calf] + data.xmat[calf].reshape(3, 3) @ in_calf
            np.testing.assert_allclose(place, position, atol=1e-12)
            jacobian = np.zeros((3, robot.nv))
            mujoco.mj_jac(mujoco_model, data, jacobian, None, place, calf)
            np.testing.assert_allclose(jacobian @ data.qvel, velocity, atol=1e-12)


def test_mujoco_falls_with_the_same_acceleration(
    any_robot: Robot, any_states: Draw, any_mujoco_model: mujoco.MjModel
) -> None:
    q, v, _, tau = any_states(20)
    converted = to_mujoco(any_robot, q, v, tau=tau)
    assert converted.qvel is not None
    assert converted.ctrl is not None
    model = copy.copy(any_mujoco_model)
    model.dof_damping[:] = 0.0  # Go1's URDF has some, which the equations of motion have not
    data = mujoco.MjData(model)
    qacc = np.zeros_like(v)
    for row in range(len(q)):
        data.qpos[:], data.qvel[:] = converted.qpos[row], converted.qvel[row]
        data.qfrc_applied[6:] = converted.ctrl[row]
        mujoco.mj_forward(model, data)
        qacc[row] = data.qacc_smooth
    back = from_mujoco(any_robot, converted.qpos, converted.qvel, qacc)
    assert back.a is not None
    expected = flight_dynamics(any_robot, q, v, tau)
    np.testing.assert_allclose(back.a, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_paper_counts_from_the_front_right(any_robot: Robot) -> None:
    joints, legs = np.arange(12.0), any_robot.legs
    there = ("RF", "LF", "RH", "LH") if legs[0].upper() == "LF" else [*legs[1::-1], *legs[:1:-1]]
    expected = [3 * [leg.upper() for leg in legs].index(leg) + k for leg in there for k in range(3)]
    np.testing.assert_array_equal(to_paper(any_robot, joints), expected)
    np.testing.assert_array_equal(from_paper(any_robot, to_paper(any_robot, joints)), joints)


def test_another_order_of_joints_is_taken_by_name(robot: Robot, random_states: Draw) -> None:
    q, v, a, tau = random_states(3)
    other = robot.joint_names[::-1]
    there = to_mujoco(robot, q, v, a, tau, joints=other)
    np.testing.assert_array_equal(there.ctrl, tau[:, ::-1])
    np.testing.assert_array_equal(there.qpos[:, 7:], q[:, :6:-1])
    back = from_mujoco(robot, *there, joints=other)
    np.testing.assert_array_equal(back.tau, tau)
    with pytest.raises(InvalidInput, match="must name the robot's joints"):
        to_mujoco(robot, q, joints=other[1:])


def test_the_paper_has_no_order_for_a_biped(biped: Robot) -> None:
    with pytest.raises(InvalidInput, match="two front and two rear legs"):
        to_paper(biped, np.zeros(6))


def test_joints_of_another_robot_are_refused() -> None:
    with pytest.raises(InvalidInput, match="must name the robot's joints"):
        joint_order(("a", "b"), ("a", "c"))


def test_rotation_matrices_are_rotations(random_states: Draw) -> None:
    rotation = rotation_matrix(random_states(50)[0][:, 3:7])
    product = rotation @ np.swapaxes(rotation, -1, -2)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0)


@pytest.mark.parametrize("convert", [to_mujoco, from_mujoco])
def test_wrong_states_are_refused_with_a_remedy(
    robot: Robot, convert: Callable[..., object]
) -> None:
    q, v = robot.standing, np.zeros(18)
    with pytest.raises(InvalidInput, match=r"shape \(18,\) where \(\.\.\., 19\)"):
        convert(robot, v)
    with pytest.raises(InvalidInput, match="the batch comes first"):
        convert(robot, q, np.zeros((2, 18)))
    with pytest.raises(InvalidInput, match="NaN"):
        convert(robot, q * np.nan)
    with pytest.raises(InvalidInput, match="normalise it first"):
        convert(robot, 2.0 * q)
    with pytest.raises(InvalidInput, match="give both"):
        convert(robot, q, None, v)
    with pytest.raises(InvalidInput, match="pass floats"):
        convert(robot, ["x"] * 19)
