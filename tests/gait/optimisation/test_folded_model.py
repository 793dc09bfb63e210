"""The folded model is Pinocchio's model, restricted to mirror-symmetric states."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.gait.gait import planar_state
from pronk_pin.gait.optimisation.folded_model import FoldedModel, fold
from pronk_pin.robot import Robot


@pytest.fixture(params=["rolling", "point", "rolling with rotors", "pitching"], scope="module")
def folded(robot: Robot, request: pytest.FixtureRequest) -> FoldedModel:
    if request.param == "pitching":
        return fold(robot, "rolling", "sagittal")
    if request.param != "rolling with rotors":
        return fold(robot, request.param)
    model = robot.model.copy()
    model.armature[6:] = np.tile([0.01, 0.02, 0.03], 4)
    return fold(dataclasses.replace(robot, model=model), "rolling")


def states(folded: FoldedModel, q, v, a):
    """Whole-robot q, v and a of folded ones, and the matrix from folded to whole velocities."""

    def parts(x):
        base = np.zeros((1, 3))
        base[0, : folded.nb] = x[: folded.nb]
        return base, folded.unfold_joints(x[folded.nb :])[None]

    whole = [x[0] for x in planar_state(folded.robot, parts(q), parts(v), parts(a))]
    grow = [
        planar_state(folded.robot, parts(q), parts(unit), parts(np.zeros(folded.nq)))[1][0]
        for unit in np.eye(folded.nq)
    ]
    return *whole, np.stack(grow, axis=1)  # (18, nq)


def kept(folded: FoldedModel, grow: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """What forces of the whole robot do along the folded coordinates, of the kept legs alone."""
    share = np.ones(folded.nq)
    share[folded.nb :] = 0.5  # a folded joint moves two of the robot's
    return share.reshape(-1, *[1] * (forces.ndim - 1)) * (grow.T @ forces)


def lowest_points(folded: FoldedModel, q, v, a):
    """Motion of the material points at the feet's lowest points, by Pinocchio; (4, 3) each."""
    robot, frame = folded.robot, pin.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(robot.model, robot.data, q, v, a)
    pin.updateFramePlacements(robot.model, robot.data)
    arm = np.array([0, 0, -robot.foot_radius if folded.contact == "rolling" else 0.0])
    position, velocity, acceleration, jacobian = [], [], [], []
    for foot in robot.foot_ids:
        twist = pin.getFrameVelocity(robot.model, robot.data, foot, frame)
        rate = pin.getFrameClassicalAcceleration(robot.model, robot.data, foot, frame)
        full = pin.computeFrameJacobian(robot.model, robot.data, q, foot, frame)
        position.append(robot.data.oMf[foot].translation.copy())
        velocity.append(twist.linear + np.cross(twist.angular, arm))
        acceleration.append(rate.linear + np.cross(rate.angular, arm))
        jacobian.append(full[:3] - pin.skew(arm) @ full[3:])
    return map(np.array, (position, velocity, acceleration, jacobian))


@pytest.mark.parametrize("seed", range(5))
def test_dynamics_equal_pinocchio_at_symmetric_states(folded: FoldedModel, seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = folded.robot
    q, v, a = rng.normal(size=(3, folded.nq)) * [[1.0], [10.0], [100.0]]
    lam = rng.normal(size=6) * 100.0
    *whole, grow = states(folded, q, v, a)
    tau = pin.rnea(robot.model, robot.model.createData(), *whole)
    *_, jacobian = lowest_points(folded, *whole)
    tau -= np.einsum("fcj,fc->j", jacobian, folded.unfold_forces(lam))
    mine = np.array(folded.dynamics(q, v, a, lam)).ravel()
    np.testing.assert_allclose(mine, kept(folded, grow, tau), rtol=1e-11, atol=1e-10)


def test_mass_matrix_and_bias_equal_pinocchio(folded: FoldedModel) -> None:
    rng = np.random.default_rng(7)
    robot, data, zero = folded.robot, folded.robot.model.createData(), np.zeros(folded.nq)
    q, v = rng.normal(size=(2, folded.nq))
    whole, rate, bias_only, grow = states(folded, q, v, zero)
    mass = np.stack(
        [np.array(folded.impact(q, column, np.zeros(6))).ravel() for column in np.eye(folded.nq)],
        axis=1,
    )
    expected = kept(folded, grow, pin.crba(robot.model, data, whole) @ grow)
    np.testing.assert_allclose(mass, expected, atol=1e-13)
    bias = np.array(folded.dynamics(q, v, zero, np.zeros(6))).ravel()
    expected = kept(folded, grow, pin.rnea(robot.model, data, whole, rate, bias_only))
    np.testing.assert_allclose(bias, expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_feet_equal_pinocchio(folded: FoldedModel, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, v, a = rng.normal(size=(3, folded.nq))
    *whole, _ = states(folded, q, v, a)
    *expected, _ = lowest_points(folded, *whole)
    for mine, pinocchio in zip(folded.feet(q, v, a), expected, strict=True):
        np.testing.assert_allclose(np.array(mine).T, pinocchio[[0, 2]], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_contact_acceleration_is_the_derivative_of_contact_velocity(
    folded: FoldedModel, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    q, v, a = rng.normal(size=(3, folded.nq))
    h = 1e-6

    def velocity(t: float) -> np.ndarray:
        return np.array(folded.feet(q + v * t + 0.5 * a * t**2, v + a * t, a)[1])

    rate = (velocity(h) - velocity(-h)) / (2 * h)
    np.testing.assert_allclose(np.array(folded.feet(q, v, a)[2]), rate, atol=1e-7)


def test_unfolded_right_side_mirrors_the_left_side(folded: FoldedModel) -> None:
    joints = folded.unfold_joints(np.arange(1.0, 7.0))
    np.testing.assert_array_equal(joints, [1, 2, 3, -1, 2, 3, 4, 5, 6, -4, 5, 6])
    forces = folded.unfold_forces(np.arange(1.0, 7.0))
    np.testing.assert_array_equal(forces, [[1, 2, 3], [1, -2, 3], [4, 5, 6], [4, -5, 6]])
