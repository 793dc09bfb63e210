"""What any engine has to keep: mechanics as Pinocchio and paper have it, and the promises of
`pronk_pin.compare.world.engine`.

What an engine refuses by name is left out; DART, that of the example, has neither rotors nor a free
base. To try one of your own, add it to the fixture `engine`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import eigh

from pronk_pin._typing import Array
from pronk_pin.compare import Engine, Motion, Scenario, World, load_engine, load_scenario
from pronk_pin.compare.world.engines import ENGINES
from pronk_pin.control import Gains
from pronk_pin.errors import InvalidInput
from pronk_pin.robot import ModelParameters, Robot, load_robot, rotation_matrix

IDEAL = load_scenario("ideal")
NOMINAL = load_scenario("nominal")
DT = IDEAL.timestep
LOADED = replace(
    IDEAL,
    name="loaded",
    armature=(0.01, 0.02, 0.03),
    torque_constant=(1.0, 0.9, 0.8),
    payload=3.0,
    payload_position=(0.1, -0.03, 0.08),
    com_shift=(0.03, 0.01, -0.02),
)
FREE = {"locked": [0, 2, *range(6, 18)], "sagittal": [0, 2, 4, *range(6, 18)], "free": range(18)}
"""Coordinates of v that a base leaves free."""


@pytest.fixture(scope="module", params=["mujoco", "drake", "dart_engine:engine"])
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    needed = {"drake": "pydrake", "dart_engine:engine": "dartpy"}
    if request.param in needed:
        pytest.importorskip(needed[request.param])
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[3] / "examples")
        yield load_engine(request.param)


def asked(engine: Engine, robot: Robot, scenario: Scenario, base: str = "locked") -> Scenario:
    """A scenario that an engine can simulate: without rotors, where it has none.

    The shipped ones have to simulate all of it.
    """
    if engine.name in ENGINES:
        return scenario
    for possible in (scenario, replace(scenario, armature=0.0)):
        try:
            engine.check(robot, possible, base)
        except InvalidInput as error:
            refusal = str(error)
        else:
            return possible
    pytest.skip(refusal)


def in_the_air(
    engine: Engine,
    robot: Robot,
    scenario: Scenario,
    *,
    n: int = 1,
    base: str = "locked",
    height: float = 1.0,
    joint_rates: Array | float = 0.0,
    pitch: float = 0.0,
) -> World:
    world = engine.world(robot, asked(engine, robot, scenario, base), n, base=base)
    place, joints = np.tile([0.0, height], (n, 1)), np.tile(robot.standing[7:], (n, 1))
    world.reset(place, joints, joint_rates=joint_rates, pitch=pitch)
    return world


def on_the_ground(
    engine: Engine, robot: Robot, scenario: Scenario, *, n: int = 1, seconds: float = 0.0
) -> World:
    """Robots that stand up with their trunk level, held by stiff joints."""
    world = in_the_air(engine, robot, scenario, n=n, height=robot.standing[2])
    for _ in range(round(seconds / scenario.timestep)):
        world.step(held(robot, world))
    return world


def held(robot: Robot, world: World) -> Array:
    """Torques that hold the posture of standing [N m], shape (n, 12)."""
    gains = Gains()
    pulled = 5.0 * gains.proportional(12) * (robot.standing[7:] - world.joints)
    return pulled - 2.0 * gains.derivative(12) * world.joint_rates


def play(world: World, control: Array) -> Motion:
    """All robots under controls (n, ticks, 12), to the end."""
    rows = np.arange(world.n)
    with world.running():
        motion = world.play(rows, control)
        world.advance(rows, motion, np.full(world.n, control.shape[1]))
    return motion


def loaded_model(robot: Robot, scenario: Scenario) -> pin.Model:
    """Pinocchio's model with rotors, shifted trunk and payload."""
    model = robot.model.copy()
    model.inertias[1].lever = model.inertias[1].lever + np.array(scenario.com_shift)
    load = pin.Inertia(scenario.payload, np.array(scenario.payload_position), np.zeros((3, 3)))
    model.inertias[1] = model.inertias[1] + load
    model.armature[6:] += scenario.by_joint("armature", robot)
    return model


def states(motion: Motion) -> tuple[Array, Array]:
    """Pinocchio's q and v of the first robot along a motion, each (ticks, ...)."""
    assert motion.pose is not None
    assert motion.twist is not None
    q = np.concatenate([motion.pose[0], motion.joints[0]], axis=-1)
    return q, np.concatenate([motion.twist[0], motion.joint_rates[0]], axis=-1)


def test_a_robot_in_the_air_falls_like_a_stone(engine: Engine, robot: Robot) -> None:
    world, steps = in_the_air(engine, robot, IDEAL, height=2.0), 200
    motion = play(world, np.zeros((1, steps, 12)))
    t = steps * DT
    assert world.base_rate[0, 1] == pytest.approx(-robot.gravity * t, rel=1e-9)
    fallen = 0.5 * robot.gravity * t * (t + DT)  # as semi-implicit Euler sums it
    assert world.base[0, 1] == pytest.approx(2.0 - fallen, rel=1e-9)
    assert not motion.force.any()
    np.testing.assert_allclose(world.joints[0], robot.standing[7:], atol=1e-9)


def test_gravity_leans_with_the_slope(engine: Engine, robot: Robot) -> None:
    world = in_the_air(engine, robot, replace(IDEAL, slope=0.2, gravity=5.0))
    play(world, np.zeros((1, 100, 12)))
    expected = -5.0 * 0.1 * np.array([np.sin(0.2), np.cos(0.2)])
    np.testing.assert_allclose(world.base_rate[0], expected, rtol=1e-9)


def test_legs_on_springs_swing_with_the_period_of_their_mass(engine: Engine, robot: Robot) -> None:
    """In the air, with rotors; the slowest mode and the fastest that the step resolves."""
    stiffness, free = 40.0, FREE["locked"]
    loaded = asked(engine, robot, LOADED)
    model = loaded_model(robot, loaded)
    mass = pin.crba(model, model.createData(), robot.standing)
    mass = (np.triu(mass) + np.triu(mass, 1).T)[np.ix_(free, free)]
    spring = np.diag([0.0, 0.0, *[stiffness] * 12])
    squares, modes = eigh(spring, mass)
    for mode in (2, -1):
        period, shape = 2.0 * np.pi / np.sqrt(squares[mode]), modes[:, mode]
        world = in_the_air(engine, robot, loaded, height=3.0)
        shape *= 0.01 / np.abs(shape[2:]).max()
        world.reset(np.array([[0.0, 3.0]]) + shape[:2], robot.standing[None, 7:] + shape[2:])
        away = []
        for _ in range(int(2.2 * period / DT)):
            offset = world.joints - robot.standing[7:]
            away.append(float(shape @ mass[:, 2:] @ offset[0]))
            world.step(-stiffness * offset / LOADED.by_joint("torque_constant", robot))
        signs = np.flatnonzero(np.diff(np.sign(away)))
        before, after = np.array(away)[signs], np.array(away)[signs + 1]
        crossings = DT * (signs + before / (before - after))
        assert crossings[2] - crossings[0] == pytest.approx(period, rel=0.01)


@pytest.mark.parametrize("base", ["locked", "sagittal", "free"])
def test_each_motor_accelerates_the_robot_as_pinocchio_says(
    engine: Engine, robot: Robot, base: str
) -> None:
    """A robot a motor; in the air, legs in motion, with rotors, payload and weak motors."""
    rates = np.random.default_rng(1).normal(size=12)
    pitch = 0.0 if base == "locked" else 0.3
    loaded = asked(engine, robot, LOADED, base)
    world = in_the_air(
        engine, robot, loaded, n=12, base=base, joint_rates=np.tile(rates, (12, 1)), pitch=pitch
    )
    rotation = rotation_matrix(world.pose[0, 3:])
    q = np.concatenate([world.pose[0], world.joints[0]])
    v = np.concatenate([world.twist[0], rates])
    world.step(4.0 * np.eye(12))

    # From the turned trunk's axes into those at the beginning, in which Pinocchio's answer is.
    turned = rotation.T @ rotation_matrix(world.pose[:, 3:])  # (12, 3, 3)
    twist = np.einsum("nij,nkj->nki", turned, world.twist.reshape(12, 2, 3)).reshape(12, 6)
    measured = (np.hstack([twist, world.joint_rates]) - v) / DT
    model = loaded_model(robot, loaded)
    data, free = model.createData(), list(FREE[base])
    axes = np.eye(18)
    if base != "free":  # guides are the world's, and so are their rates
        axes[:3, :3] = rotation.T
    mass = pin.crba(model, data, q)
    mass = axes.T @ (np.triu(mass) + np.triu(mass, 1).T) @ axes
    force = np.tile(-axes.T @ pin.nonLinearEffects(model, data, q, v), (12, 1))
    force[:, 6:] += 4.0 * np.diag(LOADED.by_joint("torque_constant", robot))
    expected = np.zeros((12, 18))
    expected[:, free] = np.linalg.solve(mass[np.ix_(free, free)], force[:, free].T).T
    np.testing.assert_allclose(measured, expected @ axes.T, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", ["a1", "hyq"])
def test_viscous_friction_comes_on_top_and_acts_at_the_end_of_the_step(
    engine: Engine, name: str
) -> None:
    """Linearly implicit Euler, with which stiff dampers are stable; the HyQ has some of its own."""
    robot, rates = load_robot(name), 3.0 * np.random.default_rng(1).normal(size=(1, 12))
    world = in_the_air(engine, robot, replace(IDEAL, damping=0.5), joint_rates=rates)
    world.step(np.zeros((1, 12)))
    free, v = FREE["locked"], np.concatenate([np.zeros(6), rates[0]])
    friction = np.diag([0.0, 0.0, *(0.5 + robot.model.damping[6:])])
    data = robot.model.createData()
    mass = pin.crba(robot.model, data, robot.standing)
    mass = (np.triu(mass) + np.triu(mass, 1).T)[np.ix_(free, free)]
    force = -pin.nonLinearEffects(robot.model, data, robot.standing, v)[free] - friction @ v[free]
    expected = np.linalg.solve(mass + DT * friction, force)
    after = np.hstack([world.base_rate, world.joint_rates])[0]
    np.testing.assert_allclose((after - v[free]) / DT, expected, rtol=1e-6, atol=1e-6)


def test_what_the_model_is_told_beyond_its_urdf_is_not_the_worlds(
    engine: Engine, robot: Robot
) -> None:
    """Rotors, friction and load of a model are beliefs; what is true the scenario says."""
    told = ModelParameters(
        armature=(0.1, 0.1, 0.1), damping=(1.0, 1.0, 1.0), coulomb=(1.0, 1.0, 1.0), payload=5.0
    )
    worlds = [on_the_ground(engine, each, IDEAL) for each in (robot, robot.with_parameters(told))]
    motions = [play(world, np.full((1, 50, 12), 1.0)) for world in worlds]
    np.testing.assert_array_equal(motions[0].joints, motions[1].joints)
    np.testing.assert_array_equal(motions[0].force, motions[1].force)
    assert motions[0].force.any()


def test_feet_without_friction_are_not_held(engine: Engine, robot: Robot) -> None:
    world = on_the_ground(engine, robot, replace(IDEAL, ground_friction=1e-6, slope=0.1))
    for _ in range(200):
        force = world.step(held(robot, world)).force
    np.testing.assert_allclose(force[..., :2], 0.0, atol=1e-3)
    sliding = -robot.gravity * np.sin(0.1) * 200 * DT
    assert world.base_rate[0, 0] == pytest.approx(sliding, rel=0.02)


def test_dry_friction_takes_its_torque_from_a_moving_joint(engine: Engine, robot: Robot) -> None:
    """Calves driven against it, in the air: as if the motors had so much less."""
    driven = np.zeros((1, 12))
    driven[0, 2::3] = 3.0
    rates = []
    for coulomb, torque in ((0.6, driven), (0.0, driven - 0.6 * (driven > 0.0))):
        world = in_the_air(
            engine, robot, replace(IDEAL, coulomb=coulomb), joint_rates=2.0 * (driven > 0.0)
        )
        for _ in range(20):
            others = 400.0 * (robot.standing[7:] - world.joints) - 4.0 * world.joint_rates
            world.step(np.where(driven > 0.0, torque, others))
        rates.append(world.joint_rates[0, 2::3])
    np.testing.assert_allclose(rates[0], rates[1], rtol=0.01)
    assert rates[0].min() > 5.0


def test_dry_friction_holds_a_joint_until_it_is_overcome(engine: Engine, robot: Robot) -> None:
    moved = []
    for coulomb, torque in ((0.0, 0.1), (0.2, 0.1), (0.2, 0.3)):
        world = in_the_air(engine, robot, replace(IDEAL, coulomb=coulomb))
        play(world, np.full((1, 100, 12), torque))
        moved.append(np.abs(world.joints[0] - robot.standing[7:]).max())
    assert moved[0] > 0.05
    assert moved[1] < 0.02 * moved[0]
    assert moved[2] > 0.5 * moved[0]


def test_momentum_is_kept_in_flight(engine: Engine, robot: Robot) -> None:
    """Legs thrash; the horizontal and the angular momentum stay, as far as steps are small."""
    errors = []
    for timestep in (1e-3, 2.5e-4):
        scenario = replace(IDEAL, timestep=timestep)
        world = in_the_air(engine, robot, scenario, base="free", height=3.0)
        time = timestep * np.arange(round(0.1 / timestep))
        phase = np.random.default_rng(5).uniform(0.0, 2.0 * np.pi, 12)
        motion = play(world, 4.0 * np.sin(60.0 * time[:, None] + phase)[None])
        q, v = states(motion)
        data = robot.model.createData()
        momentum = np.array(
            [
                pin.computeCentroidalMomentum(robot.model, data, *at).vector
                for at in zip(q, v, strict=True)
            ]
        )
        momentum[:, 2] += robot.mass * robot.gravity * time
        errors.append(np.abs(momentum).max(axis=0))
        pin.computeAllTerms(robot.model, data, q[-1], v[-1])
        legs = [
            data.oMi[i].act(robot.model.inertias[i] * data.v[i]).vector
            for i in range(2, robot.model.njoints)
        ]
        thrashing = np.abs(legs).sum(axis=0)
        assert np.abs(q[-1, 7:] - q[0, 7:]).max() > 0.05
        assert (errors[-1][:3] < 0.02 * thrashing[:3].max()).all()
        assert (errors[-1][3:] < 0.02 * thrashing[3:].max()).all()
    assert errors[1].max() < 0.4 * errors[0].max()  # of first order in the step


def test_pose_and_twist_are_of_one_motion_in_the_trunks_axes(engine: Engine, robot: Robot) -> None:
    """A trunk that turns about all of its axes: differences of poses are the twist."""
    world = in_the_air(engine, robot, IDEAL, base="free", height=3.0, pitch=0.4)
    torque = np.tile(8.0 * np.random.default_rng(2).normal(size=12), (1, 120, 1))
    torque[:, 40:] *= -0.5
    motion = play(world, torque)
    q, v = states(motion)
    assert (np.abs(v[:, 3:6]).max(axis=0) > 0.2).all()
    for before, after, rate in zip(q[:-1], q[1:], v[1:], strict=True):
        moved = pin.difference(robot.model, before, after)[:6] / DT
        np.testing.assert_allclose(moved[3:], rate[3:6], atol=2e-3 * np.abs(rate[3:6]).max() + 1e-9)
        way = (after[:3] - before[:3]) / DT
        velocity = rotation_matrix(after[3:7]) @ rate[:3]
        np.testing.assert_allclose(way, velocity, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(q[:, 3:7], axis=1), 1.0, atol=1e-9)
    np.testing.assert_array_equal(world.pose[0, [0, 2]], world.base[0])


def test_a_push_gives_its_impulse_to_the_trunks_centre_of_mass(
    engine: Engine, robot: Robot
) -> None:
    scenario = replace(
        LOADED, push_impulse=(3.0, -2.0, 1.0), push_period=0.06, push_duration=0.02, gravity=1e-9
    )
    world = in_the_air(engine, robot, scenario, base="free")
    motion = play(world, np.zeros((1, 82, 12)))
    q, v = states(motion)
    model = loaded_model(robot, scenario)
    data = model.createData()
    momentum = [
        pin.computeCentroidalMomentum(model, data, *at).vector for at in zip(q, v, strict=True)
    ]
    np.testing.assert_allclose(momentum[60], 0.0, atol=1e-6)
    np.testing.assert_allclose(momentum[81][:3], scenario.push_impulse, rtol=0.01, atol=0.01)
    # About the robot's centre of mass, as the trunk's is a little off it.
    pin.centerOfMass(model, data, q[60])
    trunk = q[60, :3] + model.inertias[1].lever
    moment = np.cross(trunk - data.com[0], scenario.push_impulse)
    np.testing.assert_allclose(momentum[81][3:], moment, atol=0.05 * np.abs(moment).max())


def test_a_push_that_is_asked_for_is_the_same_as_one_that_is_planned(
    engine: Engine, robot: Robot
) -> None:
    pushed = replace(IDEAL, push_impulse=(3.0, 0.0, 1.0), push_period=0.06, push_duration=0.02)
    zero, row = np.zeros((1, 60, 12)), np.zeros(1, dtype=np.intp)
    usual = in_the_air(engine, robot, IDEAL)
    if engine.name not in ENGINES:
        with pytest.raises(InvalidInput, match="cannot push"):
            usual.push(row, np.array([-3.0, 0.0, -1.0]), 0.02)
        return
    planned = play(in_the_air(engine, robot, pushed), np.zeros((1, 100, 12)))
    usual.advance(row, usual.play(row, zero), np.array([60]))
    usual.push(row, np.array([3.0, 0.0, 1.0]), 0.02)
    for ticks in (15, 25):  # the second piece begins while the push acts, and outlasts it
        usual.play(row, zero)  # which uses nothing up
        motion = usual.play(row, zero[:, :ticks])
        usual.advance(row, motion, np.array([ticks]))
    last = planned.base_rate[:, -1], planned.joints[:, -1]
    for got, wanted in zip((motion.base_rate[:, -1], motion.joints[:, -1]), last, strict=True):
        np.testing.assert_allclose(got, wanted, rtol=1e-9, atol=1e-12)
    still = in_the_air(engine, robot, IDEAL)
    assert (
        motion.base_rate[0, -1, 0] > 0.1 + play(still, np.zeros((1, 100, 12))).base_rate[0, -1, 0]
    )


def test_the_ground_carries_the_weight_of_a_standing_robot(engine: Engine, robot: Robot) -> None:
    world = on_the_ground(engine, robot, replace(NOMINAL, payload=2.0), seconds=1.0)
    weight = (robot.mass + 2.0) * robot.gravity
    assert world.force[0, :, 2].sum() == pytest.approx(weight, rel=1e-3)
    assert np.all(world.force[0, :, 2] > 0.1 * weight)
    assert np.abs(world.force[0, :, :2]).max() < 0.2 * weight


@pytest.mark.parametrize("leg", range(4))
def test_a_foot_that_is_lifted_carries_nothing(engine: Engine, robot: Robot, leg: int) -> None:
    joints = robot.standing[7:].copy()
    joints[3 * leg + 1 : 3 * leg + 3] += 0.3, -0.6
    world = engine.world(robot, IDEAL, 1, base="locked")
    world.reset(np.array([[0.0, robot.standing[2]]]), joints[None])
    for _ in range(200):
        world.step(500.0 * (joints - world.joints) - 5.0 * world.joint_rates)
    assert ((world.force[0, :, 2] > 0.0) == (np.arange(4) != leg)).all()


def test_feet_hold_within_their_friction_cones_and_slide_as_they_should_beyond(
    engine: Engine, robot: Robot
) -> None:
    """Below the friction angle and above it: the acceleration is g cos(slope) (tan(slope) - mu)."""
    if engine.name == "dart":
        pytest.skip("DART has another law of friction, see test_dart_engine.py")
    friction, ticks = 0.3, 300
    for share in (0.8, 1.2):
        slope = np.arctan(share * friction)
        scenario = replace(IDEAL, ground_friction=friction, slope=slope)
        world = on_the_ground(engine, robot, scenario, seconds=0.3)
        before = world.base_rate[0, 0]
        for _ in range(ticks):
            force = world.step(held(robot, world)).force[0, 0]
            pulled = np.linalg.norm(force[:, :2], axis=-1)
            assert (pulled <= friction * force[:, 2] * (1.0 + 1e-3) + 1e-6).all()
        if share < 1.0:
            assert abs(world.base_rate[0, 0]) < 1e-3
        else:
            sliding = -robot.gravity * np.cos(slope) * friction * (share - 1.0)
            acceleration = (world.base_rate[0, 0] - before) / (ticks * DT)
            assert acceleration == pytest.approx(sliding, rel=0.1)


def test_a_force_acts_in_the_step_after_the_state_it_stands_beside(
    engine: Engine, robot: Robot
) -> None:
    """Momentum of the whole robot, tick by tick, from before the touchdown on."""
    world = in_the_air(engine, robot, IDEAL, height=robot.standing[2] + 0.02)
    rows, all_ticks = np.arange(1), 200
    first = None
    for tick in range(all_ticks):
        q = np.concatenate([world.pose[0], world.joints[0]])
        v = np.concatenate([world.twist[0], world.joint_rates[0]])
        motion = world.step(held(robot, world))
        dv = (np.concatenate([world.twist[0], world.joint_rates[0]]) - v) / DT
        data = robot.model.createData()
        mass = pin.crba(robot.model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        needed = mass @ dv + pin.nonLinearEffects(robot.model, data, q, v)
        force = motion.force[0, 0].sum(axis=0)
        np.testing.assert_allclose(
            force[[0, 2]], needed[[0, 2]], atol=1e-6 * robot.mass * 9.81 + 1e-4 * abs(force[2])
        )
        np.testing.assert_array_equal(world.force[rows], motion.force[:, 0])
        if first is None and force.any():
            first = tick
    assert first is not None
    assert 40 < first < 80  # 20 mm in 64 ms


def test_what_is_played_and_thrown_away_has_not_happened(engine: Engine, robot: Robot) -> None:
    world = on_the_ground(engine, robot, NOMINAL, n=2, seconds=0.05)
    torque = 5.0 * np.random.default_rng(0).normal(size=(2, 60, 12))
    rows = np.arange(2)
    before = [world.base.copy(), world.joints.copy(), world.joint_rates.copy(), world.force.copy()]
    thrown = world.play(rows, -torque)
    for old, new in zip(
        before, (world.base, world.joints, world.joint_rates, world.force), strict=True
    ):
        np.testing.assert_array_equal(old, new)
    first, again = world.play(rows, torque), world.play(rows, torque)
    np.testing.assert_array_equal(first.joints, again.joints)
    np.testing.assert_array_equal(first.force, again.force)
    assert np.abs(first.joints - thrown.joints).max() > 0.01

    # Advanced by some of it, each robot by its own share, and gone on: the same as in one go.
    share = np.array([20, 35])
    world.advance(rows, first, share)
    np.testing.assert_array_equal(world.joints, first.joints[rows, share])
    np.testing.assert_array_equal(world.force, first.force[rows, share - 1])
    for row, ticks in zip(rows, share, strict=True):
        rest = world.play(rows[[row]], torque[[row], ticks:])
        np.testing.assert_allclose(rest.joints[0], first.joints[row, ticks:], atol=1e-9)
        np.testing.assert_allclose(rest.force[0], first.force[row, ticks:], atol=1e-4)


def test_robots_move_to_the_bit_as_each_alone_and_as_before(engine: Engine, robot: Robot) -> None:
    rng = np.random.default_rng(0)
    joints = robot.standing[7:] + 0.1 * rng.normal(size=(3, 12))
    torque = 8.0 * rng.normal(size=(3, 150, 12))

    def played(rows: list[int]) -> tuple[Array, ...]:
        scenario = asked(engine, robot, NOMINAL)
        world = engine.world(robot, scenario, len(rows), base="locked")
        world.reset(np.tile([0.0, robot.standing[2]], (len(rows), 1)), joints[rows])
        motion = play(world, torque[rows])
        return motion.base, motion.joints, motion.joint_rates, motion.force

    together = played([0, 1, 2])
    assert together[3][..., 2].any(axis=(1, 2)).all()  # each has met the ground
    for both, again in zip(together, played([0, 1, 2]), strict=True):
        np.testing.assert_array_equal(both, again)
    for row in range(3):
        for both, alone in zip(together, played([row]), strict=True):
            np.testing.assert_array_equal(both[row], alone[0])


@pytest.mark.parametrize("constant", [1.0, 0.8])
def test_servos_do_at_every_tick_what_feedback_would(
    engine: Engine, robot: Robot, constant: float
) -> None:
    scenario = asked(engine, robot, replace(NOMINAL, torque_constant=constant))
    gains, ticks = Gains(), 100
    place, joints = np.array([[0.0, robot.standing[2] + 0.01]]), robot.standing[None, 7:]
    # Off by so much that motors reach their limits at first.
    target = joints + 0.8 * np.sin(np.arange(12.0))
    setpoint = np.tile(gains.proportional(12) * target, (1, ticks, 1))
    servos = engine.world(robot, scenario, 1, base="locked", servo=gains)
    servos.reset(place, joints)
    motion = play(servos, setpoint)
    motors = engine.world(robot, scenario, 1, base="locked")
    motors.reset(place, joints)
    limited = False
    for tick in range(ticks):
        np.testing.assert_allclose(motion.joints[0, tick], motors.joints[0], atol=1e-6)
        wanted = gains.proportional(12) * (target - motors.joints)
        wanted -= gains.derivative(12) * motors.joint_rates
        torque = np.clip(wanted, -robot.tau_max, robot.tau_max)
        limited |= bool((torque != wanted).any())
        motors.step(torque)
    assert limited
    assert motion.force.any()


@pytest.mark.parametrize("base", ["locked", "sagittal", "free"])
def test_a_robot_that_breaks_is_told_and_put_back_and_harms_no_other(
    engine: Engine, robot: Robot, base: str
) -> None:
    world, alone = (in_the_air(engine, robot, IDEAL, n=n, base=base) for n in (2, 1))
    joints = np.tile(robot.standing[7:], (2, 1))
    joints[1, 4] = np.nan
    world.reset(np.tile([0.0, 1.0], (2, 1)), joints)
    motion = play(world, np.zeros((2, 9, 12)))  # it raises nothing
    assert motion.finite.tolist() == [[True] * 9, [False] * 9]

    world.restart(np.array([1]))

    play(alone, np.zeros((1, 9, 12)))
    np.testing.assert_array_equal(world.joints[1], robot.standing[7:])
    np.testing.assert_allclose(world.pose[1], robot.standing[:7], atol=1e-12)
    np.testing.assert_array_equal(world.joint_rates[1], 0.0)
    np.testing.assert_array_equal(world.base[0], alone.base[0])
    assert play(world, np.zeros((2, 3, 12))).finite.all()
