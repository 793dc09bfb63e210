"""The ground against what a block on a slope does, and where steps are."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import (
    Experiment,
    MujocoWorld,
    Scenario,
    Schedule,
    World,
    build_model,
    load_scenario,
    run_cell,
    steady,
)
from pronk_pin.compare.world.mujoco_world import ground
from pronk_pin.compare.world.mujoco_world.ground import rough_heights, steps
from pronk_pin.control import Gains
from pronk_pin.errors import InvalidInput
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot, load_robot

IDEAL = load_scenario("ideal")


def stiff(robot: Robot, scenario: Scenario, x: Array, seconds: float) -> World:
    """Robots that stand as rigidly as blocks, from x on; the world after so long."""
    world, gains = MujocoWorld(robot, scenario, len(x)), Gains()
    standing = robot.standing[7:]
    start = np.column_stack([x, np.full(len(x), robot.standing[2])])
    world.reset(start, np.tile(standing, (len(x), 1)))
    for _ in range(round(seconds / scenario.timestep)):
        feedback = 5.0 * gains.proportional(12) * (standing - world.joints)
        world.step(feedback - gains.derivative(12) * world.joint_rates)
    return world


def feet(robot: Robot, world: World) -> Array:
    position = np.column_stack([world.base[:, 0], np.zeros(world.n), world.base[:, 1]])
    return foot_positions(robot, robot.q_from_base(position, world.joints))


@pytest.mark.parametrize(("slope", "friction"), [(0.3, 0.1), (-0.3, 0.1), (0.2, 0.05)])
def test_a_robot_slides_down_a_slope_like_a_block(
    robot: Robot, slope: float, friction: float
) -> None:
    scenario = replace(IDEAL, slope=slope, ground_friction=friction)
    early, late = (stiff(robot, scenario, np.zeros(1), t) for t in (0.4, 0.6))
    acceleration = (late.base_rate - early.base_rate)[0, 0] / 0.2
    g = scenario.gravity
    expected = -math.copysign(g * (math.sin(abs(slope)) - friction * math.cos(slope)), slope)
    assert acceleration == pytest.approx(expected, rel=0.02)


def test_a_robot_stays_on_a_slope_that_its_friction_holds(robot: Robot) -> None:
    early, late = (
        stiff(robot, replace(IDEAL, slope=0.3, ground_friction=0.5), np.zeros(1), t)
        for t in (0.5, 0.8)
    )
    assert abs(late.base - early.base).max() < 1e-3


def test_on_a_slope_the_ground_carries_what_leans_on_it(robot: Robot) -> None:
    world = stiff(robot, replace(IDEAL, slope=0.2), np.zeros(1), 1.0)
    x, _, z = world.force[0].sum(axis=0)
    weight = robot.mass * robot.gravity
    assert x == pytest.approx(weight * math.sin(0.2), rel=2e-3)  # against sliding down, uphill
    assert z == pytest.approx(weight * math.cos(0.2), rel=2e-3)


def test_gravity_is_the_scenarios(robot: Robot) -> None:
    world = stiff(robot, replace(IDEAL, gravity=3.7), np.zeros(1), 1.0)
    assert world.force[0, :, 2].sum() == pytest.approx(3.7 * robot.mass, rel=1e-3)


def test_a_foot_stands_on_the_step_below_it_and_a_standing_robot_on_level_ground(
    robot: Robot,
) -> None:
    scenario = replace(IDEAL, step_height=0.02, step_length=0.8)
    centres, heights = steps(scenario)
    chosen = np.argsort(centres)[[3, 10, -4]]
    x = np.array([0.0, *centres[chosen]])
    world = stiff(robot, scenario, x, 1.0)
    expected = np.array([0.0, *heights[chosen]])
    position = feet(robot, world)
    half = 0.5 * scenario.step_length
    for where, height, four in zip(x, expected, position, strict=True):
        assert np.abs(four[:, 0] - where).max() < half  # on one step
        np.testing.assert_allclose(four[:, 2], height + robot.foot_radius, atol=1e-3)


def test_a_force_on_a_step_is_felt_as_on_the_floor(robot: Robot) -> None:
    scenario = replace(IDEAL, step_height=0.02, step_length=0.8)
    world = stiff(robot, scenario, steps(scenario)[0][:2], 1.0)
    weight = robot.mass * robot.gravity
    np.testing.assert_allclose(world.force[..., 2].sum(axis=1), weight, rtol=1e-3)


def test_steps_are_drawn_by_the_seed_and_reach_up_to_their_height() -> None:
    scenario = replace(IDEAL, step_height=0.02)
    _, heights = steps(scenario)
    assert 0.0 <= heights.min() < 0.001
    assert 0.019 < heights.max() <= 0.02
    assert np.any(steps(replace(scenario, seed=1))[1] != heights)
    np.testing.assert_array_equal(steps(scenario)[1], heights)
    assert steps(IDEAL)[0].size == 0


ROUGH = replace(IDEAL, ground_roughness=0.002)


def test_rough_ground_is_as_high_as_it_says_and_level_at_the_start() -> None:
    heights = rough_heights(ROUGH)
    columns = heights.shape[1]
    middle = slice(columns // 2 - 22, columns // 2 + 23)  # 0.44 m to either side
    assert np.abs(heights[:, middle]).max() == 0.0
    away = heights[:, columns // 2 + 100 : columns // 2 + 2100]
    assert away.std() == pytest.approx(0.002, rel=0.05)
    assert abs(away.mean()) < 2e-4
    # Normal, and smooth: neighbours 2 cm apart are nearly as high, those 30 cm apart are not.
    assert np.mean(np.abs(away) < 0.002) == pytest.approx(0.683, abs=0.03)
    assert np.corrcoef(away[:, 1:].ravel(), away[:, :-1].ravel())[0, 1] > 0.9
    assert abs(np.corrcoef(away[:, 15:].ravel(), away[:, :-15].ravel())[0, 1]) < 0.1
    assert not np.array_equal(heights, rough_heights(replace(ROUGH, seed=1)))
    np.testing.assert_array_equal(heights, rough_heights(ROUGH))


def test_feet_stand_on_rough_ground_where_it_is(robot: Robot) -> None:
    """A ray from above, and a foot's sphere at rest, find the height that was drawn."""
    scenario = replace(ROUGH, ground_roughness=0.004)
    heights = rough_heights(scenario)
    model = build_model(robot, scenario)
    data = mujoco.MjData(model)
    data.qpos[model.joint("z").qposadr[0]] = 2.0
    mujoco.mj_forward(model, data)
    groups, geom = np.array([1, 0, 0, 0, 0, 0], dtype=np.uint8), np.zeros(1, dtype=np.int32)
    rows, columns = heights.shape
    for row, column in ((125, 5100), (140, 5200), (100, 4600)):
        place = 0.02 * np.array([column - columns // 2, row - rows // 2])
        from_above, down = np.array([*place, 1.0]), np.array([0.0, 0.0, -1.0])
        distance = mujoco.mj_ray(model, data, from_above, down, groups, 1, -1, geom)
        assert 1.0 - distance == pytest.approx(heights[row, column], abs=1e-6)


def test_level_heights_are_the_plane(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    """Robots that stand on a heightfield of equal heights weigh what they weigh on a plane."""
    monkeypatch.setattr(ground, "rough_heights", lambda _: np.outer([0.0, 1e-9], [0.0, 0.0, 1.0]))
    worlds = [stiff(robot, scenario, np.zeros(1), 0.4) for scenario in (IDEAL, ROUGH)]
    standing = [(world.force[0].copy(), world.base[0].copy()) for world in worlds]
    (force, base), (rough_force, rough_base) = standing
    assert rough_force[:, 2].sum() == pytest.approx(force[:, 2].sum(), rel=1e-3)
    np.testing.assert_allclose(rough_base, base, atol=5e-5)  # feet sink in, by less than that


def test_seeds_are_other_grounds_and_noises_and_one_seed_is_one_run() -> None:
    """Over five seeds the peak errors scatter by some percent; in the nominal scenario by none."""
    experiment = Experiment(
        speeds=(0.3,),
        controllers=("pd",),
        scenarios=("rough", "nominal"),
        seeds=tuple(range(5)),
        schedule=Schedule(startup=0.2, baseline=2.0, learning=0.5),
    )
    peaks: dict[str, list[float]] = {"rough": [], "nominal": []}
    for cell in experiment.cells():
        strides = steady(run_cell(cell))["peak_error"].isel(joint=2)
        peaks[cell.scenario].append(float(strides.mean()))
    spread = {name: np.std(values, ddof=1) / np.mean(values) for name, values in peaks.items()}
    assert 0.003 < spread["rough"] < 0.1
    assert spread["nominal"] < 0.1 * spread["rough"]
    cell = next(cell for cell in experiment.cells() if (cell.scenario, cell.seed) == ("rough", 3))
    again = steady(run_cell(cell))["peak_error"].isel(joint=2)
    assert float(again.mean()) == peaks["rough"][3]


def test_feet_of_another_size_than_those_of_the_urdf_are_refused(robot: Robot) -> None:
    own = load_robot(replace(robot.spec, foot_radius=0.03))
    match = "foot_radius is 0.03 m, and the collision sphere of foot FL_foot has 0.02 m"
    with pytest.raises(InvalidInput, match=match):
        build_model(own, load_scenario("ideal"))
