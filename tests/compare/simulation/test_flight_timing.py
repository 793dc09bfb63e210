"""Flights last as long as the feet are in the air, which the robots' own heights tell."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import PARTS, load_controller
from pronk_pin.gait import load_library
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot

SPEEDS = (-0.3, 0.0, 0.35, 0.6)


def contact_tick(robot: Robot, base: Array, joints: Array) -> float:
    """When the lowest foot reaches the ground, in ticks: a straight line through its last two
    heights, for a flight of which the base's x and z (n, 2) and the joints (n, 12) are known."""
    place = np.column_stack([base[:, 0], np.zeros(len(base)), base[:, 1]])
    feet = foot_positions(robot, robot.q_from_base(place, joints))
    before, last = feet[-2:, :, 2].min(axis=1) - robot.foot_radius
    assert before > last > 0.0
    return len(joints) - 1 + last / (before - last)


@pytest.mark.parametrize("name", ["ilc-zero", "ilc"])
def test_the_reference_of_a_flight_ends_when_the_feet_touch_down(robot: Robot, name: str) -> None:
    """To half a tick each, as a controller cannot see between two, and without a bias."""
    library = load_library("a1")
    simulation = Simulation(
        robot,
        [library.at(speed) for speed in SPEEDS],
        load_controller(name),
        load_scenario("nominal"),
        schedule=Schedule(startup=0.2, baseline=1.0, learning=6.0),
        rng=np.random.default_rng(0),
    )
    log, timestep = simulation.run(), simulation.world.scenario.timestep
    kept = log.ticks()
    flown, late = kept["tick_joints"][:, :, PARTS.index("flight")], []
    for row, count in enumerate(log.count):
        for k, joints in enumerate(flown[row]):
            ticks = int(np.isfinite(joints[:, 0]).sum())
            base = kept["tick_base"][row, k, PARTS.index("flight"), :ticks]
            planned = log["flight_reference"][row, count - len(flown[row]) + k]
            touchdown = contact_tick(robot, base, joints[:ticks]) * timestep
            late.append((planned - touchdown) / timestep)
    by_robot = np.mean(np.reshape(late, (len(SPEEDS), -1)), axis=1)
    assert np.abs(by_robot).max() < 0.5
    assert abs(by_robot.mean()) < 0.25
