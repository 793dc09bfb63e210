"""Whatever goes wrong in a stride, learning pauses or forgets, and never blows up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pronk_pin._typing import Array, IntArray
from pronk_pin.compare import Scenario, Schedule, Simulation, load_scenario
from pronk_pin.control import SKIPPED, load_controller
from pronk_pin.gait import Gait
from pronk_pin.robot import Robot

NOMINAL = load_scenario("nominal")
LATE = replace(NOMINAL, full_torque_speed=500.0, no_load_speed=1000.0)
"""The nominal scenario, played tick by tick, so that sensors can be made to fail."""

Build = Callable[..., Simulation]
BASELINE, LEARNING = 2.0, 8.0


@pytest.fixture(scope="module")
def build(robot: Robot, gaits: list[Gait]) -> Build:
    def simulation(scenario: Scenario, *, robot: Robot = robot) -> Simulation:
        return Simulation(
            robot,
            gaits,
            load_controller("ilc"),
            scenario,
            schedule=Schedule(startup=0.2, baseline=BASELINE, learning=LEARNING),
            rng=np.random.default_rng(0),
        )

    return simulation


@pytest.fixture(scope="module")
def undisturbed(build: Build) -> Simulation:
    """A learning run in which nothing goes wrong."""
    simulation = build(NOMINAL)
    simulation.run()
    return simulation


def calf_peak(simulation: Simulation, robot: int, *, last: int = 4) -> float:
    """Mean peak error of the calves over the last strides [rad]."""
    strides = simulation.strides
    end = int(strides.count[robot])
    return float(strides["peak_error"][robot, end - last : end, 2::3].mean())


def reasons(simulation: Simulation, robot: int) -> list[str]:
    """Why strides were skipped, one by one."""
    strides = simulation.strides
    numbers = strides["skipped"][robot, : strides.count[robot]]
    return [SKIPPED[int(number)] for number in numbers]


def watch_learning(simulation: Simulation) -> list[Array]:
    """The first robot's feedforward after each touchdown."""
    seen: list[Array] = []
    touchdown = simulation.controller.touchdown

    def spy(rows, learning=None):  # type: ignore[no-untyped-def]
        tape = touchdown(rows, learning)
        if 0 in rows:
            seen.append(simulation.controller.feedforward[0].copy())
        return tape

    simulation.controller.touchdown = spy  # type: ignore[method-assign]
    return seen


def test_a_push_is_forgotten(build: Build, undisturbed: Simulation) -> None:
    """Pushed once, hard, after 5.2 s."""
    pushed = replace(NOMINAL, push_impulse=(5.0, 0.0, 0.0), push_period=5.2, push_duration=0.05)
    simulation = build(pushed)
    learned = watch_learning(simulation)
    simulation.run()
    assert simulation.upright.all()
    limit = 2.0 * np.abs(undisturbed.controller.feedforward[0]).max()
    assert max(np.abs(feedforward).max() for feedforward in learned) < limit
    worst = float(np.nanmax(simulation.strides["peak_error"][0, 15:, 2::3]))
    assert worst > 0.02  # it was felt
    assert calf_peak(simulation, 0) < 1.5 * calf_peak(undisturbed, 0)


def blind(simulation: Simulation, first: int, last: int, *, robot: int = 0) -> None:
    """Let the first robot's feet feel nothing between two ticks of its clock."""
    feet = simulation.player.sensors.feet

    def fail(rows: IntArray, force: Array) -> Array:
        felt = feet(rows, force).copy()
        clock = np.round(simulation.world.state[rows, 0] * 1000)
        felt[(rows == robot) & (clock >= first) & (clock < last)] = 0.0
        return felt

    simulation.player.sensors.feet = fail  # type: ignore[method-assign]


def test_a_missed_touchdown_is_no_fall_and_teaches_nothing(build: Build) -> None:
    simulation = build(LATE)
    blind(simulation, 5000, 5400)  # more than a stride
    learned = watch_learning(simulation)
    simulation.run()
    assert simulation.upright.all()
    found = reasons(simulation, 0)
    assert "too long" in found
    assert reasons(simulation, 1)[1:] == [""] * (len(reasons(simulation, 1)) - 1)
    skipped = [number for number, reason in enumerate(found) if reason]
    for number in skipped:  # the feedforward of the next stride is that of this one
        np.testing.assert_array_equal(learned[number + 1], learned[number])
    assert calf_peak(simulation, 0) < 0.03


def test_a_touchdown_that_is_none_teaches_nothing(build: Build) -> None:
    """The feet feel one blow in the middle of a flight, and the ground after it."""
    simulation = build(LATE)
    feet, ends = simulation.player.sensors.feet, simulation.player._ends
    middle = 0.55 * simulation._gaits[0].flight.duration / 0.001
    state = {"flown": False, "struck": False}

    def strike(rows: IntArray, force: Array) -> Array:
        felt = feet(rows, force).copy()
        if state["flown"] and not state["struck"] and rows[0] == 0:
            felt[0] = 60.0
            state["struck"] = True
        return felt

    def note(rows, motion, tick, length, airborne):  # type: ignore[no-untyped-def]
        late = simulation.world.state[0, 0] > 5.0
        state["flown"] = bool(airborne and late and tick > middle)
        return ends(rows, motion, tick, length, airborne)

    simulation.player.sensors.feet, simulation.player._ends = strike, note  # type: ignore[method-assign]
    learned = watch_learning(simulation)
    simulation.run()
    assert state["struck"]
    assert simulation.upright.all()
    found = reasons(simulation, 0)
    assert "false touchdown" in found
    number = found.index("false touchdown")
    np.testing.assert_array_equal(learned[number + 1], learned[number])
    assert calf_peak(simulation, 0) < 0.03


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_sensor_that_fails_for_a_while_stops_learning_for_so_long(
    build: Build, value: float
) -> None:
    simulation = build(LATE)
    encoders = simulation.player.sensors.encoders

    def fail(rows: IntArray, joints: Array, rates: Array) -> tuple[Array, Array]:
        angle, rate = (part.copy() for part in encoders(rows, joints, rates))
        clock = np.round(simulation.world.state[rows, 0] * 1000)
        failing = (rows == 0) & (clock >= 5000) & (clock < 5020)
        angle[failing, 4] = value
        return angle, rate

    simulation.player.sensors.encoders = fail  # type: ignore[method-assign]
    learned = watch_learning(simulation)
    simulation.run()
    assert simulation.upright.all()
    found = reasons(simulation, 0)
    assert "not finite" in found
    number = found.index("not finite")
    np.testing.assert_array_equal(learned[number + 1], learned[number])
    assert np.isfinite(simulation.controller.feedforward).all()
    assert np.isfinite(simulation.strides["peak_error"][0, : simulation.strides.count[0]]).all()
    assert calf_peak(simulation, 0) < 0.03


def test_a_motor_at_its_limit_does_not_wind_up(build: Build, robot: Robot) -> None:
    """The thighs and calves may give less than the gait needs."""
    model = robot.model.copy()
    limit = 7.0
    model.effortLimit = np.minimum(model.effortLimit, limit)
    weak = replace(robot, model=model)
    simulation = build(replace(NOMINAL, payload=2.0), robot=weak)
    learned = watch_learning(simulation)
    simulation.run()
    missing = np.abs(simulation.player.log.missing).max()
    assert missing > 0.0  # it is at its limit even in the end
    sizes = [np.abs(feedforward).max() for feedforward in learned]
    assert max(sizes) <= limit
    assert np.isfinite(simulation.controller.feedforward).all()
    peaks = simulation.strides["peak_error"][0, : simulation.strides.count[0]].max(axis=-1)
    began = int(np.argmax(simulation.strides["learning"][0] == 1.0))
    assert peaks[-5:].max() < peaks[began - 3 : began].min()  # and still better than without
