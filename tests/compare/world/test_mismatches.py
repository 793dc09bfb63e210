"""Learning in worlds that differ from the model in one thing each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Experiment, Scenario, Schedule, Simulation, load_scenario
from pronk_pin.compare.world.mismatch import MISMATCHES
from pronk_pin.control import ControllerSpec, load_controller
from pronk_pin.gait import load_library
from pronk_pin.robot import Robot

LAST = 5


def simulate_learning(
    robot: Robot,
    controller: str | ControllerSpec,
    scenario: str | Scenario,
    speeds: Sequence[float],
    learning: float = 12.0,
) -> Simulation:
    """A learning run that has been run."""
    world = load_scenario(scenario) if isinstance(scenario, str) else scenario
    spec = load_controller(controller) if isinstance(controller, str) else controller
    simulation = Simulation(
        robot,
        [load_library("a1").at(speed) for speed in speeds],
        spec,
        world,
        schedule=Schedule(0.3, 5.0, learning),
        rng=np.random.default_rng(0),
    )
    simulation.run()
    return simulation


def peaks(simulation: Simulation, metric: str = "felt_peak_error") -> tuple[Array, Array]:
    """Mean peaks of thigh and calf [rad] before learning and at the end, shape (2,) each.

    From when the controller felt the contact; `peak_error` counts from the contact on.
    """
    strides, before, after = simulation.strides, [], []
    for robot, end in enumerate(strides.count):
        first = int(np.argmax(strides["learning"][robot, :end] == 1.0))
        for found, last in ((before, first), (after, int(end))):
            found.append(strides[metric][robot, last - LAST : last].mean(axis=0))
    means = (np.mean(found, axis=0).reshape(4, 3).mean(axis=0)[1:] for found in (before, after))
    return tuple(means)  # type: ignore[return-value]


@pytest.mark.parametrize("scenario", ["delay", "soft-ground"])
def test_the_hard_worlds_are_learned_at_one_speed(robot: Robot, scenario: str) -> None:
    simulation = simulate_learning(robot, "ilc", scenario, (0.0,))
    before, after = peaks(simulation)
    assert np.all(after < 0.25 * before)
    before, after = peaks(simulation, "peak_error")
    assert np.all(after < 0.45 * before)


def test_with_a_delay_it_is_the_flights_timing_that_helps(robot: Robot) -> None:
    """Motors that act 4 ms late push 4 ms longer, and the flight ends later than planned."""
    practised = simulate_learning(robot, "ilc", "delay", (0.0,))
    flight = practised.strides["duration"] - practised.strides["stance"]
    planned = load_library("a1").at(0.0).flight.duration
    last = int(practised.strides.count[0]) - 1
    assert 1.05 < flight[0, last] / planned < 1.15


@pytest.mark.slow
@pytest.mark.parametrize("scenario", MISMATCHES)
def test_practice_takes_away_three_quarters_of_the_error_in_every_world(
    robot: Robot, scenario: str
) -> None:
    simulation = simulate_learning(robot, "ilc", scenario, Experiment().speeds)
    before, after = peaks(simulation)
    assert np.all(after < 0.25 * before)
    # From the contact on: on soft ground the feet sink in faster than the motors can follow.
    left = 0.45 if scenario == "soft-ground" else 0.35
    before, after = peaks(simulation, "peak_error")
    assert np.all(after < left * before)
    assert simulation.upright.all()


@pytest.mark.slow
def test_an_imu_and_odometry_do_nearly_as_well_as_true_states(robot: Robot) -> None:
    """All of the noise but the encoders' zeros, which no robot can tell from its posture."""
    noise = load_scenario("noise")
    noise = replace(noise, sensors=replace(noise.sensors, encoder_bias=0.0))
    speeds = load_library("a1").speeds
    left = [
        peaks(simulate_learning(robot, controller, scenario, speeds, learning=20.0))[1]
        for controller, scenario in (("ilc-imu", noise), ("ilc", "nominal"))
    ]
    assert np.all(left[0] < 1.2 * left[1])
