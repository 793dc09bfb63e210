"""What is Drake's own: its refusals, its contacts, and that nobody needs it who does not ask."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Scenario, Schedule, Simulation, World, load_scenario
from pronk_pin.compare.simulation import to_dataset
from pronk_pin.compare.world.drake_world import APPROXIMATIONS, DrakeEngine, drake_engine
from pronk_pin.control import Gains, load_controller
from pronk_pin.errors import InvalidInput, MissingExtra, UnknownName
from pronk_pin.gait import Gait, load_library
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import ROBOTS, Robot, load_robot, rotation_matrix

IDEAL = load_scenario("ideal")


@pytest.fixture(autouse=True)
def _drake(request: pytest.FixtureRequest) -> None:
    if "without" not in request.node.name:
        pytest.importorskip("pydrake")


def standing(
    robot: Robot, scenario: Scenario, approximation: str, *, seconds: float = 0.4
) -> World:
    world = DrakeEngine(approximation=approximation).world(robot, scenario, 1, base="locked")
    place = np.array([[0.0, robot.standing[2]]])
    world.reset(place, robot.standing[None, 7:])
    hold(robot, world, seconds)
    return world


def hold(robot: Robot, world: World, seconds: float) -> None:
    gains = Gains()
    for _ in range(round(seconds / IDEAL.timestep)):
        pulled = 5.0 * gains.proportional(12) * (robot.standing[7:] - world.joints)
        world.step(pulled - 2.0 * gains.derivative(12) * world.joint_rates)


def feet(robot: Robot, world: World) -> Array:
    return foot_positions(robot, np.concatenate([world.pose[0], world.joints[0]]))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("ground_roughness", {"ground_roughness": 0.01}),
        ("step_height", {"step_height": 0.02}),
        ("mjcf", {"mjcf": "robot.xml"}),
        ("edit", {"edit": f"{__name__}:standing"}),
    ],
)
def test_what_it_cannot_simulate_is_refused_by_name(
    robot: Robot, name: str, changes: dict[str, Any]
) -> None:
    scenario = replace(IDEAL, name="mine", **changes)
    with pytest.raises(InvalidInput, match=rf"'mine': drake cannot simulate {name}; leave that"):
        DrakeEngine().check(robot, scenario, "locked")
    with pytest.raises(InvalidInput, match=name):
        DrakeEngine().world(robot, scenario, 1, base="locked")


def test_without_drake_the_remedy_is_named(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drake_engine, "find_spec", lambda _: None)
    with pytest.raises(MissingExtra, match=r"drake is not installed; pip install 'pronk-pin\[dr"):
        DrakeEngine().check(robot, IDEAL, "locked")


def test_without_being_asked_for_drake_is_not_imported() -> None:
    code = "import sys, pronk_pin.compare as c; c.load_engine('drake'); assert 'pydrake' not in "
    subprocess.run([sys.executable, "-c", code + "sys.modules"], check=True)


def test_an_unknown_approximation_is_refused() -> None:
    with pytest.raises(UnknownName, match="unknown approximation 'tamsi'; choose one of: lagged"):
        DrakeEngine(approximation="tamsi")


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot_has_a_plant_with_pinocchios_mass_matrix(name: str) -> None:
    from pronk_pin.compare.world.drake_world.plant import build_plant

    robot = load_robot(name)
    whole = build_plant(robot, IDEAL, base="free", approximation="sap")
    plant, (_root, context) = whole.plant, whole.context()
    rng = np.random.default_rng(0)
    quaternion = rng.normal(size=4)
    quaternion /= np.linalg.norm(quaternion)
    q = robot.standing.copy()
    q[3:7], q[7:] = quaternion, q[7:] + 0.3 * rng.normal(size=robot.nu)
    position = np.zeros(robot.nq)
    position[:4], position[4:7] = quaternion[[3, 0, 1, 2]], q[:3]
    position[whole.joints] = q[7:]
    plant.SetPositions(context, position)

    from_ours, turned = np.zeros((robot.nv, robot.nv)), rotation_matrix(quaternion)
    from_ours[:3, 3:6] = from_ours[3:6, :3] = turned
    from_ours[whole.rates, 6 + np.arange(robot.nu)] = 1.0
    mass = from_ours.T @ plant.CalcMassMatrix(context) @ from_ours
    expected = pin.crba(robot.model, robot.model.createData(), q)
    expected = np.triu(expected) + np.triu(expected, 1).T
    np.testing.assert_allclose(mass, expected, atol=1e-12)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_feet_sink_as_deep_as_the_time_constant_of_the_contact_says(
    robot: Robot, approximation: str
) -> None:
    """g T^2 in the mean, as springs k = m / T^2 of the weight on a foot have it."""
    for constant in (0.002, 0.01):
        scenario = replace(IDEAL, ground_time_constant=constant)
        world = standing(robot, scenario, approximation, seconds=0.6)
        depth = robot.foot_radius - feet(robot, world)[:, 2].mean()
        assert depth == pytest.approx(robot.gravity * constant**2, rel=0.01)
        weight = robot.mass * robot.gravity
        assert world.force[0, :, 2].sum() == pytest.approx(weight, rel=1e-3)


def test_springs_and_dampers_of_the_ground_are_critically_damped(robot: Robot) -> None:
    """A robot with rigid legs that is put on the ground at rest settles without overshoot, and as
    fast as a critically damped oscillator of that time constant."""
    constant = 0.01
    scenario = replace(IDEAL, coulomb=50.0, ground_time_constant=constant)
    world = DrakeEngine(approximation="sap").world(robot, scenario, 1, base="locked")
    world.reset(np.array([[0.0, robot.standing[2]]]), robot.standing[None, 7:])
    lowest = (foot_positions(robot, robot.standing)[:, 2] - robot.foot_radius).mean()
    ticks = np.arange(1, 60)
    depth = []
    for _ in ticks:
        world.step(np.zeros((1, 12)))
        depth.append(robot.standing[2] - world.base[0, 1] - lowest)
    t = ticks * IDEAL.timestep / constant
    settling = robot.gravity * constant**2 * (1.0 - (1.0 + t) * np.exp(-t))
    np.testing.assert_allclose(depth, settling, atol=0.06 * settling[-1])


def test_friction_that_knows_the_last_normal_force_lets_feet_slide_and_not_rise(
    robot: Robot,
) -> None:
    """The others lift what slides, as every convex contact does that looks at the step's end."""
    slope = np.arctan(1.2 * 0.3)
    scenario = replace(IDEAL, ground_friction=0.3, slope=slope)
    world = standing(robot, scenario, "lagged")
    before = world.base_rate[0, 0]
    hold(robot, world, 0.2)
    acceleration = (world.base_rate[0, 0] - before) / 0.2
    expected = -robot.gravity * np.cos(slope) * 0.06
    assert acceleration == pytest.approx(expected, rel=1e-3)
    assert feet(robot, world)[:, 2].max() < robot.foot_radius


def test_threads_do_not_disturb_each_other(robot: Robot) -> None:
    world = DrakeEngine().world(robot, load_scenario("nominal"), 4, base="locked")
    height = robot.standing[2] + np.linspace(0.0, 0.02, 4)
    world.reset(np.column_stack([np.zeros(4), height]), np.tile(robot.standing[7:], (4, 1)))
    torque = 4.0 * np.random.default_rng(0).normal(size=(4, 60, 12))
    alone = world.play(np.arange(4), torque)
    rows = [np.array([row]) for row in range(4)]
    with ThreadPoolExecutor(4) as pool:
        motions = list(pool.map(lambda row: world.play(row, torque[row]), rows))
    for row, motion in enumerate(motions):
        np.testing.assert_array_equal(motion.joints[0], alone.joints[row])
        np.testing.assert_array_equal(motion.force[0], alone.force[row])


@pytest.fixture(scope="module")
def gaits() -> list[Gait]:
    library = load_library("a1")
    return [library.at(speed) for speed in (0.0, 0.45)]


def simulation(
    robot: Robot, gaits: list[Gait], scenario: str, *, chunked: bool = True, base: str = "locked"
) -> Simulation:
    return Simulation(
        robot,
        gaits,
        load_controller("pd"),
        load_scenario(scenario),
        schedule=Schedule(startup=0.3, baseline=2.0, learning=0.0),
        rng=np.random.default_rng(0),
        chunked=chunked,
        base=base,
    )


def test_strides_are_the_same_in_one_go_and_tick_by_tick(robot: Robot, gaits: list[Gait]) -> None:
    ends = []
    for chunked in (True, False):
        run = simulation(robot, gaits, "nominal+drake", chunked=chunked)
        run.run()
        ends.append(np.hstack([run.world.base, run.world.joints]))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


@pytest.mark.parametrize("base", ["locked", "free"])
def test_pronking_looks_alike_in_both_engines(robot: Robot, gaits: list[Gait], base: str) -> None:
    """Peaks of the tracking errors under PD, to 5 mrad of 0.1 rad; nobody falls."""
    peaks = []
    for scenario in ("nominal", "nominal+drake"):
        run = simulation(robot, gaits, scenario, base=base)
        strides = to_dataset(run.run(), robot, gaits, attributes={"robot": robot.name})
        assert run.upright.all()
        peaks.append(strides["peak_error"].isel(stride=slice(2, 5)).mean("stride"))
    assert float(peaks[0].max()) > 0.05
    np.testing.assert_allclose(peaks[0], peaks[1], atol=5e-3)
