from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.errors import InvalidInput
from pronk_pin.inverse_dynamics import distribute_wrench, wrench_matrix
from pronk_pin.kinematics.contacts import contact_jacobian
from pronk_pin.kinematics.legs import contact_points, leg_angles, leg_geometry, leg_motion
from pronk_pin.robot import Robot
from pronk_pin.robot.conventions import rotation_matrix

FRICTION = 0.6
ARMS = np.array(
    [[0.18, 0.13, -0.3], [0.18, -0.13, -0.3], [-0.18, 0.13, -0.3], [-0.18, -0.13, -0.3]]
)
NOMINAL = np.tile([0.0, 0.0, 80.0], (4, 1))


def total(arms: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Force and moment, by cross products."""
    return np.concatenate([forces.sum(axis=-2), np.cross(arms, forces).sum(axis=-2)], axis=-1)


def test_the_wrench_matrix_is_the_sum_of_forces_and_of_their_moments() -> None:
    rng = np.random.default_rng(0)
    arms, forces = rng.standard_normal((2, 5, 4, 3))
    wrench = np.einsum("nij,nj->ni", wrench_matrix(arms), forces.reshape(5, 12))
    np.testing.assert_allclose(wrench, total(arms, forces), atol=1e-12)


def test_within_the_cones_the_forces_give_the_wrench_that_was_asked_for() -> None:
    rng = np.random.default_rng(1)
    wrench = rng.uniform(-1.0, 1.0, (20, 6)) * np.array([20.0, 20.0, 20.0, 5.0, 5.0, 5.0])
    arms, nominal = np.tile(ARMS, (20, 1, 1)), np.tile(NOMINAL, (20, 1, 1))
    forces = distribute_wrench(arms, wrench, nominal, friction=FRICTION)
    change = total(arms, forces) - total(arms, nominal)
    np.testing.assert_allclose(change, wrench, rtol=1e-2, atol=5e-2)


def test_whatever_is_asked_the_forces_keep_to_their_cones() -> None:
    rng = np.random.default_rng(2)
    wrench = rng.uniform(-1.0, 1.0, (60, 6)) * np.array([400.0, 400.0, 400.0, 90.0, 90.0, 90.0])
    arms, nominal = np.tile(ARMS, (60, 1, 1)), np.tile(NOMINAL, (60, 1, 1))
    forces = distribute_wrench(arms, wrench, nominal, friction=FRICTION)
    side = np.hypot(forces[..., 0], forces[..., 1])
    assert np.all(side <= FRICTION * forces[..., 2] + 1e-4)
    asked = np.linalg.norm(wrench, axis=1)
    missed = np.linalg.norm(wrench - total(arms, forces) + total(arms, nominal), axis=1)
    assert np.all(missed < asked)  # better than to do nothing
    assert np.any(missed > 1.0)  # and some of it cannot be had


def test_the_ground_does_not_pull() -> None:
    """A roll moment beyond what the weight can give lifts one side off, and no more."""
    wrench = np.array([[0.0, 0.0, 0.0, 100.0, 0.0, 0.0]])
    forces = distribute_wrench(ARMS[None], wrench, NOMINAL[None], friction=FRICTION)[0]
    np.testing.assert_allclose(forces[[1, 3]], 0.0, atol=1e-3)
    assert np.all(forces[[0, 2], 2] > 80.0)


def test_a_coefficient_of_friction_of_zero_is_refused() -> None:
    with pytest.raises(InvalidInput, match="positive"):
        distribute_wrench(ARMS[None], np.zeros((1, 6)), NOMINAL[None], friction=0.0)


def test_contact_points_and_their_jacobians_are_pinocchios(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    q = robot.standing.copy()
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.2, -0.3, 0.4)).coeffs()
    q[7:] += 0.3 * rng.standard_normal(12)
    rotation = rotation_matrix(q[3:7])
    down = -robot.foot_radius * rotation[2]
    points = contact_points(leg_geometry(robot), q[7:].reshape(4, 3), down)
    whole = contact_jacobian(robot, q, contact="rolling")
    for leg in range(4):
        rows = whole[3 * leg : 3 * leg + 3, 6 + 3 * leg : 9 + 3 * leg]
        np.testing.assert_allclose(rotation @ points.jacobian[leg], rows, atol=1e-12)
        # Moments of the contact force about the trunk's origin, as the base's rows have them.
        arm = np.cross(np.eye(3), rotation @ points.position[leg])
        moment = rotation @ whole[3 * leg : 3 * leg + 3, 3:6].T
        np.testing.assert_allclose(moment, -arm.T, atol=1e-12)


def test_all_legs_at_once_find_the_angles_that_their_feet_came_from(robot: Robot) -> None:
    rng = np.random.default_rng(4)
    joints = robot.standing[7:].reshape(4, 3) + 0.2 * rng.standard_normal((7, 4, 3))
    geometry = leg_geometry(robot)
    feet = leg_motion(geometry, joints, np.zeros_like(joints)).position
    angles, reachable = leg_angles(geometry, feet)
    assert reachable.all()
    np.testing.assert_allclose(np.sin(angles), np.sin(joints), atol=1e-9)
    np.testing.assert_allclose(np.cos(angles), np.cos(joints), atol=1e-9)
