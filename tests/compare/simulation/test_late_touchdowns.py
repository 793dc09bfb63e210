"""Touchdowns that the contact sensor tells late: when they are felt, and what is made of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from pronk_pin._typing import Array, IntArray
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import Tape, load_controller
from pronk_pin.gait import Gait, load_library
from pronk_pin.robot import Robot

BASELINE = Schedule(startup=0.2, baseline=2.0, learning=0.0)


def simulation(
    robot: Robot,
    gaits: Sequence[Gait],
    scenario: str,
    *,
    encoders: bool = True,
    controller: str = "pd",
    schedule: Schedule = BASELINE,
    chunked: bool = True,
) -> Simulation:
    """A simulation of touchdowns that are detected by the load, and by the encoders or not."""
    spec = load_controller(controller)
    if not encoders:
        spec = replace(spec, contact=replace(spec.contact, impact=None))
    return Simulation(
        robot,
        gaits,
        spec,
        load_scenario(scenario),
        schedule=schedule,
        rng=np.random.default_rng(0),
        chunked=chunked,
    )


def touchdowns(simulation: Simulation) -> tuple[IntArray, IntArray]:
    """By how many ticks touchdowns were felt late, truly and as the robots believe, (strides,).

    Counted from the last tick without contact.
    """
    player, found = simulation.player, []
    play = player.play

    def spy(rows: IntArray, tape: Tape, *, part: int | None) -> IntArray:
        played = play(rows, tape, part=part)
        if part == 1:
            for row, ticks in zip(rows, played, strict=True):
                loaded = (player.log.force[row, :ticks, :, 2] > 0.0).any(axis=1)
                loaded[: ticks // 2] = False  # those of the lift-off
                found.append((ticks - (np.argmax(loaded) - 1), player.late[row]))
        return played

    player.play = spy  # type: ignore[method-assign]
    simulation.run()
    late, believed = np.array(found).T
    return late, believed


def test_the_contact_sensor_alone_is_late_by_what_the_scenario_says(
    robot: Robot, gaits: list[Gait]
) -> None:
    for scenario, more in (("nominal", 0), ("late-touchdown", 3)):
        late, believed = touchdowns(simulation(robot, gaits, scenario, encoders=False))
        assert set(late) == {2 + more}
        assert set(believed) == {2}
    late, _ = touchdowns(simulation(robot, gaits, "touchdown-jitter", encoders=False))
    assert set(late) <= set(range(2, 7))
    assert len(set(late)) >= 3


@pytest.mark.parametrize(
    ("scenario", "ticks"), [("nominal", {2}), ("late-touchdown", {3}), ("touchdown-jitter", {2, 3})]
)
def test_with_encoders_a_touchdown_is_a_tick_later_at_most_and_the_robot_knows_it(
    robot: Robot, gaits: list[Gait], scenario: str, ticks: set[int]
) -> None:
    late, believed = touchdowns(simulation(robot, gaits, scenario))
    assert len(late) >= 8
    assert set(late) == ticks
    np.testing.assert_array_equal(late, believed)


def test_the_end_of_a_reference_is_no_impact_where_motors_are_late(
    robot: Robot, gaits: list[Gait]
) -> None:
    both, load = (
        simulation(robot, gaits, "delay", encoders=encoders).run() for encoders in (True, False)
    )
    np.testing.assert_array_equal(both["duration"], load["duration"])


@pytest.mark.parametrize("scenario", ["touchdown-jitter", "delay+touchdown-jitter"])
def test_jittering_touchdowns_are_the_same_however_many_ticks_are_played_at_once(
    robot: Robot, gaits: list[Gait], scenario: str
) -> None:
    many, one = (
        simulation(robot, gaits, scenario, chunked=chunked).run() for chunked in (True, False)
    )
    np.testing.assert_array_equal(many["duration"], one["duration"])
    np.testing.assert_allclose(many["peak_error"], one["peak_error"], atol=1e-6)


def felt_peaks(simulation: Simulation) -> Array:
    """Mean peak in calf over the last 30 strides of each robot [rad], shape (n,)."""
    log = simulation.run()
    assert simulation.upright.all()
    return np.array(
        [
            log["felt_peak_error"][row, count - 30 : count, 2::3].mean()
            for row, count in enumerate(log.count)
        ]
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "most"),
    [
        ("late-touchdown", 0.010),
        ("touchdown-jitter", 0.010),
        ("noise+late-touchdown", 0.012),
        ("noise+touchdown-jitter", 0.012),
    ],
)
def test_late_touchdowns_are_learned_with_at_all_speeds(
    robot: Robot, scenario: str, most: float
) -> None:
    library, schedule = load_library("a1"), Schedule(baseline=2.0, learning=20.0)
    gaits = [library.at(float(speed)) for speed in library.speeds]
    learning = simulation(robot, gaits, scenario, controller="ilc", schedule=schedule)
    assert felt_peaks(learning).max() <= most
