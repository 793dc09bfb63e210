"""The simulated truth against Pinocchio, and against what weight and gravity ask for."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Experiment, MujocoWorld, Scenario, World, build_model, load_scenario
from pronk_pin.compare.world.mujoco_world import finite, without_warnings
from pronk_pin.control import Gains, load_controller
from pronk_pin.dynamics import mass_matrix, nonlinear_effects
from pronk_pin.errors import InvalidInput
from pronk_pin.kinematics import foot_positions
from pronk_pin.parity import compare_models
from pronk_pin.robot import ROBOTS, Robot, load_robot
from pronk_pin.robot.conventions import to_mujoco

IDEAL = load_scenario("ideal")
LOADED = replace(IDEAL, name="loaded", payload=3.0, payload_position=(0.1, -0.03, 0.08))
HIGH = replace(LOADED, name="high", payload_position=(-0.02, 0.02, 0.5))  # turns the axes over
SHIFTED = replace(LOADED, name="shifted", com_shift=(0.03, 0.01, -0.02))
PLANAR = [0, 2, *range(6, 18)]  # what the locked base leaves free


def loaded_model(robot: Robot, scenario: Scenario) -> pin.Model:
    """Pinocchio's model, trunk shifted, with the payload as a point mass on the trunk."""
    model = robot.model.copy()
    trunk = model.inertias[model.getJointId("root_joint")]
    trunk.lever = trunk.lever + np.array(scenario.com_shift)
    point = pin.Inertia(scenario.payload, np.zeros(3), np.zeros((3, 3)))
    place = pin.SE3(np.eye(3), np.array(scenario.payload_position))
    model.appendBodyToJoint(model.getJointId("root_joint"), point, place)
    return model


def data_at(robot: Robot, model: mujoco.MjModel, q: Array) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[:] = to_mujoco(robot, q).qpos
    mujoco.mj_forward(model, data)
    return data


def stand(robot: Robot, world: World, joints: Array, seconds: float) -> None:
    """Hold a posture by feedback alone."""
    gains = Gains()
    height = np.full((world.n, 1), robot.standing[2])
    world.reset(np.hstack([np.zeros_like(height), height]), joints)
    for _ in range(round(seconds / world.scenario.timestep)):
        feedback = 5.0 * gains.proportional(12) * (joints - world.joints)
        world.step(feedback - gains.derivative(12) * world.joint_rates)


@pytest.mark.parametrize(
    "scenario", [IDEAL, LOADED, HIGH, SHIFTED], ids=lambda scenario: scenario.name
)
def test_mass_and_centre_of_mass_are_the_urdfs_and_the_payloads(
    robot: Robot, scenario: Scenario
) -> None:
    model = build_model(robot, scenario, base="free")
    data = data_at(robot, model, robot.standing)
    own = pin.centerOfMass(robot.model, robot.model.createData(), robot.standing)
    own = own + robot.model.inertias[1].mass / robot.mass * np.array(scenario.com_shift)
    place = robot.standing[:3] + np.array(scenario.payload_position)

    total = robot.mass + scenario.payload
    assert model.body_mass.sum() == pytest.approx(total, rel=1e-9)
    centre = (robot.mass * own + scenario.payload * place) / total
    np.testing.assert_allclose(data.subtree_com[0], centre, atol=1e-9)


@pytest.mark.parametrize(
    "scenario", [IDEAL, LOADED, HIGH, SHIFTED], ids=lambda scenario: scenario.name
)
def test_the_mass_matrix_is_pinocchios_with_the_payload(robot: Robot, scenario: Scenario) -> None:
    model, reference = build_model(robot, scenario, base="free"), loaded_model(robot, scenario)
    rng = np.random.default_rng(3)
    q = robot.standing.copy()
    q[3:7] = rng.normal(size=4)
    q[3:7] /= np.linalg.norm(q[3:7])
    q[7:] += 0.3 * rng.normal(size=12)
    mass = np.zeros((18, 18))
    mujoco.mj_fullM(model, data_at(robot, model, q), mass)

    expected = pin.crba(reference, reference.createData(), q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    velocities = to_mujoco(robot, np.tile(q, (18, 1)), np.eye(18)).qvel
    assert velocities is not None
    np.testing.assert_allclose(velocities @ mass @ velocities.T, expected, atol=1e-9)


def test_the_rotors_stand_on_the_diagonal_of_the_mass_matrix(robot: Robot) -> None:
    masses = np.zeros((2, 18, 18))
    for mass, armature in zip(masses, (0.0, 0.02), strict=True):
        model = build_model(robot, replace(IDEAL, armature=armature), base="free")
        mujoco.mj_fullM(model, data_at(robot, model, robot.standing), mass)
    np.testing.assert_allclose(masses[1] - masses[0], np.diag([0.0] * 6 + [0.02] * 12), atol=1e-12)


def test_the_feet_are_where_pinocchio_has_them(robot: Robot) -> None:
    joints = robot.standing[7:] + 0.3 * np.random.default_rng(0).normal(size=12)
    world = MujocoWorld(robot, IDEAL, 1)
    world.reset(np.array([[0.2, 0.5]]), joints[None])
    q = robot.q_from_base(np.array([0.2, 0.0, 0.5]), joints)

    data = mujoco.MjData(world.model)
    mujoco.mj_setState(world.model, data, world.state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
    mujoco.mj_kinematics(world.model, data)

    feet = [data.geom(name).xpos for name in robot.foot_names]
    np.testing.assert_allclose(feet, foot_positions(robot, q), atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot_has_a_world_with_its_dynamics_and_its_feet(name: str) -> None:
    """Feet of meshes become spheres of the robot's foot radius, and weigh nothing."""
    robot = load_robot(name)
    model = build_model(robot, LOADED, base="free")
    parity = compare_models(replace(robot, model=loaded_model(robot, LOADED)), model, states=20)
    assert parity.mass_matrix is not None
    assert parity.bias is not None
    assert max(parity.mass_matrix, parity.bias) < 1e-12
    data = data_at(robot, model, robot.standing)
    feet = [data.geom(foot).xpos for foot in robot.foot_names]
    np.testing.assert_allclose(feet, foot_positions(robot, robot.standing), atol=1e-9)
    radii = [model.geom(foot).size[0] for foot in robot.foot_names]
    np.testing.assert_allclose(radii, robot.foot_radius)


@pytest.mark.parametrize("torque_constant", [1.0, 0.85])
def test_each_motor_accelerates_the_guided_robot_as_pinocchio_says(
    robot: Robot, torque_constant: float
) -> None:
    """One robot a motor; in the air, and from rest."""
    world = MujocoWorld(robot, replace(IDEAL, torque_constant=torque_constant), 12)
    world.reset(np.tile([0.0, 1.0], (12, 1)), np.tile(robot.standing[7:], (12, 1)))
    world.step(4.0 * np.eye(12))

    force = -np.tile(nonlinear_effects(robot, robot.standing, np.zeros(18)), (12, 1))
    force[:, 6:] += torque_constant * 4.0 * np.eye(12)
    mass = mass_matrix(robot, robot.standing)[np.ix_(PLANAR, PLANAR)]
    expected = np.linalg.solve(mass, force[:, PLANAR].T).T
    measured = np.hstack([world.base_rate, world.joint_rates]) / IDEAL.timestep
    np.testing.assert_allclose(measured, expected, rtol=1e-6, atol=1e-6)


def test_a_robot_in_the_air_falls_like_a_stone(robot: Robot) -> None:
    world, steps = MujocoWorld(robot, IDEAL, 1), 200
    world.reset(np.array([[0.0, 2.0]]), robot.standing[None, 7:])
    for _ in range(steps):
        world.step(np.zeros((1, 12)))
    t = steps * IDEAL.timestep
    assert world.base_rate[0, 1] == pytest.approx(-robot.gravity * t, rel=1e-9)
    fallen = 0.5 * robot.gravity * t * (t + IDEAL.timestep)  # as semi-implicit Euler sums it
    assert world.base[0, 1] == pytest.approx(2.0 - fallen, rel=1e-9)
    assert not world.force.any()
    np.testing.assert_allclose(world.joints[0], robot.standing[7:], atol=1e-9)


def test_the_ground_carries_the_weight_of_a_standing_robot(robot: Robot) -> None:
    world = MujocoWorld(robot, replace(load_scenario("nominal"), payload=2.0), 1)
    stand(robot, world, robot.standing[None, 7:], 1.5)
    weight = (robot.mass + 2.0) * robot.gravity
    assert world.force[0, :, 2].sum() == pytest.approx(weight, rel=1e-3)
    assert np.all(world.force[0, :, 2] > 0.1 * weight)


@pytest.mark.parametrize("leg", range(4))
def test_a_foot_that_is_lifted_carries_nothing(robot: Robot, leg: int) -> None:
    joints = robot.standing[7:].copy()
    joints[3 * leg + 1 : 3 * leg + 3] += 0.3, -0.6
    world = MujocoWorld(robot, IDEAL, 1)
    stand(robot, world, joints[None], 0.4)
    assert ((world.force[0, :, 2] > 0.0) == (np.arange(4) != leg)).all()


def test_a_softer_ground_gives_way_more(robot: Robot) -> None:
    heights = []
    for softness in (0.002, 0.01):
        world = MujocoWorld(robot, replace(IDEAL, ground_time_constant=softness), 1)
        stand(robot, world, robot.standing[None, 7:], 1.0)
        q = robot.q_from_base(np.insert(world.base[0], 1, 0.0), world.joints[0])
        heights.append(foot_positions(robot, q)[:, 2].mean())
    assert heights[1] < heights[0] - 1e-4
    assert heights[0] == pytest.approx(robot.foot_radius, abs=1e-3)


def test_joints_stand_in_the_order_of_the_urdf_document_and_motors_in_ours(
    any_robot: Robot,
) -> None:
    document = ElementTree.parse(any_robot.urdf_path).getroot()
    order = [
        joint.get("name") for joint in document.findall("joint") if joint.get("type") != "fixed"
    ]
    model = build_model(any_robot, load_scenario("nominal"), base="free")
    hinges = [i for i in range(model.njnt) if model.jnt_type[i] == mujoco.mjtJoint.mjJNT_HINGE]
    assert [model.joint(i).name for i in hinges] == order
    assert list(any_robot.urdf_joint_names) == order
    driven = [model.joint(model.actuator_trnid[k, 0]).name for k in range(model.nu)]
    assert driven == list(any_robot.joint_names)
    assert list(model.jnt_qposadr[hinges]) == list(range(7, 7 + len(order)))


@pytest.mark.parametrize("name", ROBOTS)
def test_rotor_and_friction_come_on_top_of_the_robots_own(name: str) -> None:
    robot = load_robot(name)
    added = replace(IDEAL, armature=0.02, damping=0.3, coulomb=0.4)
    model = build_model(robot, added, base="free")
    dofs = [model.joint(joint).dofadr[0] for joint in robot.joint_names]
    own = robot.model
    np.testing.assert_allclose(model.dof_armature[dofs], own.armature[6:] + 0.02)
    np.testing.assert_allclose(model.dof_damping[dofs], own.damping[6:] + 0.3)
    np.testing.assert_allclose(model.dof_frictionloss[dofs], own.friction[6:] + 0.4)


BY_KIND = {
    "armature": (0.01, 0.02, 0.03),
    "damping": (0.1, 0.2, 0.3),
    "coulomb": (0.3, 0.2, 0.1),
    "torque_constant": (1.0, 0.9, 0.8),
}


@pytest.mark.parametrize("servo", [None, Gains()], ids=["motors", "servos"])
@pytest.mark.parametrize("by_joint", [False, True])
def test_joints_may_differ_by_kind_or_each(
    robot: Robot, by_joint: bool, servo: Gains | None
) -> None:
    tiled = {name: np.tile(values, 4) for name, values in BY_KIND.items()}
    if by_joint:
        tiled = {name: values * np.linspace(1.0, 2.0, 12) for name, values in tiled.items()}
    scenario = replace(IDEAL, name="mine", **(tiled if by_joint else BY_KIND))  # type: ignore[arg-type]
    model = build_model(robot, scenario, servo=servo)
    dofs = [model.joint(joint).dofadr[0] for joint in robot.joint_names]
    motors = [model.actuator(joint).id for joint in robot.joint_names]
    found = {
        "armature": model.dof_armature[dofs] - robot.model.armature[6:],
        "damping": model.dof_damping[dofs] - robot.model.damping[6:],
        "coulomb": model.dof_frictionloss[dofs] - robot.model.friction[6:],
        "torque_constant": model.actuator_gainprm[motors, 0],
    }
    for name, values in found.items():
        np.testing.assert_allclose(values, tiled[name], atol=1e-15)
        np.testing.assert_array_equal(scenario.by_joint(name, robot), tiled[name])
    if servo is not None:
        limit = robot.tau_max * tiled["torque_constant"]
        np.testing.assert_allclose(model.actuator_forcerange[motors, 1], limit)
        stiffness = servo.proportional(12) * tiled["torque_constant"]
        np.testing.assert_allclose(model.actuator_biasprm[motors, 1], -stiffness)


@pytest.mark.parametrize("count", [0, 1, 2, 4, 13])
def test_values_of_another_number_of_joints_are_refused_with_the_remedy(
    robot: Robot, count: int
) -> None:
    scenario = replace(IDEAL, name="mine", coulomb=(0.1,) * count)
    words = (
        rf"'mine': coulomb has {count} values; for the a1 give one number, 3 \(hip, thigh, calf\)"
    )
    with pytest.raises(InvalidInput, match=words):
        build_model(robot, scenario)
    with pytest.raises(InvalidInput, match=words + ", or 12, one for each joint"):
        Experiment(scenarios=(scenario,))


def test_viscous_friction_slows_the_joints_as_pinocchio_says(robot: Robot) -> None:
    """In the air; MuJoCo's Euler takes the damping at the end of the step."""
    damping, dt = 0.5, IDEAL.timestep
    world = MujocoWorld(robot, replace(IDEAL, damping=damping), 1)
    rates = 3.0 * np.random.default_rng(1).normal(size=(1, 12))
    world.reset(np.array([[0.0, 1.0]]), robot.standing[None, 7:], joint_rates=rates)
    before = np.hstack([world.base_rate, world.joint_rates])[0]
    world.step(np.zeros((1, 12)))

    v = np.zeros(18)
    v[PLANAR] = before
    friction = np.diag([0.0, 0.0, *[damping] * 12])
    force = -nonlinear_effects(robot, robot.standing, v)[PLANAR] - friction @ before
    mass = mass_matrix(robot, robot.standing)[np.ix_(PLANAR, PLANAR)]
    expected = np.linalg.solve(mass + dt * friction, force)
    measured = (np.hstack([world.base_rate, world.joint_rates])[0] - before) / dt
    np.testing.assert_allclose(measured, expected, rtol=1e-6, atol=1e-6)


def test_coulomb_friction_takes_its_torque_from_a_moving_joint(robot: Robot) -> None:
    """Each calf alone is driven against it; in the air, in motion."""
    coulomb, torque = 0.6, 3.0
    worlds = [MujocoWorld(robot, replace(IDEAL, coulomb=value), 1) for value in (coulomb, 0.0)]
    tau = np.zeros((1, 12))
    tau[0, 2::3] = torque
    for world, driven in zip(worlds, (tau, tau - coulomb * (tau > 0.0)), strict=True):
        rates = np.where(tau > 0.0, 2.0, 0.0)
        world.reset(np.array([[0.0, 1.0]]), robot.standing[None, 7:], joint_rates=rates)
        for _ in range(20):
            others = 400.0 * (robot.standing[7:] - world.joints) - 4.0 * world.joint_rates
            world.step(np.where(tau > 0.0, driven, others))
    with_friction, without = (world.joint_rates[0, 2::3] for world in worlds)
    np.testing.assert_allclose(with_friction, without, rtol=0.01)
    assert with_friction.min() > 5.0


def test_coulomb_friction_holds_a_joint_that_would_move_without_it(robot: Robot) -> None:
    moved = []
    for coulomb in (0.0, 0.2):
        world = MujocoWorld(robot, replace(IDEAL, coulomb=coulomb), 1)
        world.reset(np.array([[0.0, 2.0]]), robot.standing[None, 7:])
        for _ in range(100):
            world.step(np.full((1, 12), 0.1))
        moved.append(np.abs(world.joints[0] - robot.standing[7:]).max())
    assert moved[0] > 0.05
    assert moved[1] < 0.02 * moved[0]


def test_robots_in_a_batch_move_exactly_as_each_alone(robot: Robot) -> None:
    rng = np.random.default_rng(0)
    joints = robot.standing[7:] + 0.1 * rng.normal(size=(3, 12))
    base = np.tile([0.0, robot.standing[2]], (3, 1))
    torques = 8.0 * rng.normal(size=(150, 3, 12))

    def end(rows: list[int]) -> tuple[Array, ...]:
        world = MujocoWorld(robot, load_scenario("nominal"), len(rows))
        world.reset(base[rows], joints[rows])
        force = np.zeros((len(rows), 4, 3))
        for tau in torques:
            world.step(tau[rows])
            force += world.force
        return world.base, world.joints, world.joint_rates, force

    together = end([0, 1, 2])
    assert together[3][..., 2].any(axis=1).all()  # each has met the ground
    for row in range(3):
        for both, alone in zip(together, end([row]), strict=True):
            np.testing.assert_array_equal(both[row], alone[0])


def test_a_robot_that_is_not_finite_is_seen_and_put_back_to_rest(robot: Robot) -> None:
    world = MujocoWorld(robot, IDEAL, 2)
    world.reset(np.tile([0.0, 1.0], (2, 1)), np.tile(robot.standing[7:], (2, 1)))
    world._state[1, 5] = np.nan
    assert finite(world.state).tolist() == [True, False]
    with without_warnings():  # MuJoCo would leave a log file
        world.step(np.zeros((2, 12)))
    assert finite(world.state).tolist() == [True, False]

    world.restart(np.array([1]))

    assert finite(world.state).all()
    np.testing.assert_array_equal(world.joints[1], robot.standing[7:])
    assert world.base[0, 1] == pytest.approx(1.0, abs=1e-4)


def test_a_touchdown_is_felt_within_the_ticks_that_the_controller_reckons_with(
    robot: Robot,
) -> None:
    """From the instant at which the feet reach the ground, between two ticks."""
    world, standing = MujocoWorld(robot, load_scenario("nominal"), 8), robot.standing[7:]
    heights = robot.standing[2] + np.linspace(0.05, 0.06, world.n)  # contacts at all fractions
    world.reset(np.column_stack([np.zeros(world.n), heights]), np.tile(standing, (world.n, 1)))
    clearance, load = [], []
    for _ in range(150):
        position = np.column_stack([world.base[:, 0], np.zeros(world.n), world.base[:, 1]])
        feet = foot_positions(robot, robot.q_from_base(position, world.joints))
        clearance.append(feet[..., 2].min(axis=1) - robot.foot_radius)
        load.append(world.force[..., 2].sum(axis=1))
        world.step(Gains().proportional(12) * (standing - world.joints))
    threshold = load_controller("pd").contact.touchdown * robot.mass * robot.gravity
    felt = np.argmax(np.array(load) > threshold, axis=0)
    for height, tick in zip(np.array(clearance).T, felt, strict=True):
        below = int(np.argmax(height < 0.0))
        contact = below - height[below] / (height[below] - height[below - 1])
        assert 1.0 <= tick - contact <= load_controller("pd").touchdown_ticks
