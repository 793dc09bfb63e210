"""What no gait can do is refused before the solver is asked, and what gaits do is not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pronk_pin import load_robot
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import build_library, gait_problem, load_library, optimize_gait
from pronk_pin.gait.optimisation.ballistics import check_ballistics, largest_apex, largest_speed
from pronk_pin.robot import Robot


@pytest.mark.parametrize(("robot", "gait"), [("a1", "pronk"), ("a1", "bound"), ("go2", "pronk")])
def test_every_shipped_gait_is_within_what_ballistics_allows(robot: str, gait: str) -> None:
    for shipped in load_library(robot, gait=gait).gaits:
        check_ballistics(
            gait_problem(load_robot(robot), shipped.speed, gait=gait, apex=shipped.apex)
        )


def test_an_apex_beyond_reach_names_the_largest_one(robot: Robot) -> None:
    problem = gait_problem(robot, 0.3, apex=5.0)
    with pytest.raises(
        InvalidInput, match=r"apex 5 m is out of reach of the a1.* allow (0\.\d+) m"
    ):
        optimize_gait(problem)
    # Stretched legs at both ends of the longest flight, by hand: the foot is 0.38 m below.
    flight = 9.81 * 0.35**2 / 8.0
    assert 0.38 + flight == pytest.approx(largest_apex(problem), abs=0.08)
    check_ballistics(dataclasses.replace(problem, apex=largest_apex(problem) - 1e-6))


@pytest.mark.parametrize("speed", [9.0, -9.0])
def test_a_speed_beyond_reach_names_the_largest_one(robot: Robot, speed: float) -> None:
    with pytest.raises(InvalidInput, match=r"speed -?9 m/s is out of reach .* allow 7\.\d+ m/s"):
        build_library(robot, [0.3, speed], progress=False)


def test_slow_joints_make_slow_gaits(robot: Robot) -> None:
    speeds = [
        largest_speed(gait_problem(robot, 0.0, velocity_use=use)) for use in (0.1, 0.2, 1.0, 2.0)
    ]
    assert np.all(np.diff(speeds[:3]) > 0.0)
    assert speeds[3] == speeds[2]  # there the reach of the legs binds


def test_a_longer_flight_allows_a_higher_apex(robot: Robot) -> None:
    problem = gait_problem(robot, 0.0)
    stance, flight = problem.sequence
    longer = dataclasses.replace(
        problem, sequence=(stance, dataclasses.replace(flight, duration=(0.2, 0.45)))
    )
    more = robot.gravity * (0.45**2 - 0.35**2) / 8.0
    assert largest_apex(longer) - largest_apex(problem) == pytest.approx(more)


@pytest.mark.parametrize("base", ["locked", "sagittal"])
def test_limits_of_the_a1_are_those_of_its_legs_by_hand(robot: Robot, base: str) -> None:
    """Thigh joints 0.1805 m before and behind the trunk's middle, two links of 0.2 m that stay bent
    by 0.9163 rad at least, feet of 0.02 m; a trunk that pitches raises its hips and swings them."""
    problem = gait_problem(robot, 0.0, base=base)
    pitch = problem.pitch_limit if base == "sagittal" else 0.0
    leg = 0.2 * np.sqrt(2.0 + 2.0 * np.cos(0.9163))
    longest = 0.35  # s, of a flight; the shortest stance is of 0.1 s
    lowest = 0.2 - 0.02 - pitch * 0.1805  # of a thigh joint above the feet's centres
    sweep = 2.0 * np.sqrt(leg**2 - lowest**2) + 2.0 * pitch * 0.1805 + np.pi * 0.02
    brake = 0.5 * 0.6 * robot.gravity * longest
    assert largest_speed(problem) == pytest.approx(sweep / 0.1 + brake, rel=1e-4)
    highest = leg + 0.02 + pitch * 0.1805 + robot.gravity * longest**2 / 8.0
    # On top of that, legs that go up and down within the trunk move the centre of mass.
    assert 0.0 < largest_apex(problem) - highest < 0.1


def test_a_trunk_that_pitches_reaches_higher_by_what_its_hips_rise(robot: Robot) -> None:
    level, pitching = (
        largest_apex(gait_problem(robot, 0.0, base=base)) for base in ("locked", "sagittal")
    )
    assert pitching - level == pytest.approx(0.2 * 0.1805)
