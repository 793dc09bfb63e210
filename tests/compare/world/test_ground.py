"""The ground against what a block on a slope does, and where steps are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Scenario, World, load_scenario
from pronk_pin.compare.world.ground import steps
from pronk_pin.control import Gains
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot

IDEAL = load_scenario("ideal")


def stiff(robot: Robot, scenario: Scenario, x: Array, seconds: float) -> World:
    """Robots that stand as rigidly as blocks, from x on; the world after so long."""
    world, gains = World(robot, scenario, len(x)), Gains()
    standing = robot.standing[7:]
    start = np.column_stack([x, np.full(len(x), robot.standing[2])])
    world.reset(start, np.tile(standing, (len(x), 1)))
    for _ in range(round(seconds / scenario.timestep)):
        feedback = 5.0 * gains.proportional * (standing - world.joints)
        world.step(feedback - gains.derivative * world.joint_rates)
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
