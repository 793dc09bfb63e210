from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import LegAngleRegulator, phase_grid
from pronk_pin.errors import InvalidInput
from pronk_pin.kinematics import foot_positions, rotate_leg
from pronk_pin.robot import Robot


@pytest.mark.parametrize(("error", "direction"), [(0.2, 1.0), (-0.2, -1.0)])
def test_a_robot_that_is_too_fast_puts_its_feet_further_forward(
    robot: Robot, error: float, direction: float
) -> None:
    turn = LegAngleRegulator().turn(np.array([error]))[0]
    q = robot.standing.copy()
    q[7:] = rotate_leg(robot, q[7:], turn)
    moved = foot_positions(robot, q)[:, 0] - foot_positions(robot, robot.standing)[:, 0]
    assert np.all(direction * moved > 0.001)


def test_the_legs_turn_in_proportion_up_to_a_limit() -> None:
    regulator = LegAngleRegulator(gain=-0.1, limit=0.15)
    turn = regulator.turn(np.array([0.0, 0.5, 1.0, 9.0, -9.0]))
    np.testing.assert_allclose(turn, [0.0, -0.05, -0.1, -0.15, 0.15])


def test_the_turn_begins_and_ends_smoothly_and_is_over_before_touchdown() -> None:
    regulator = LegAngleRegulator(settled=0.7)
    share, rate = regulator.profile(np.array([0.0, 0.7, 0.8, 1.0]))
    np.testing.assert_allclose(share, [0.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(rate, 0.0, atol=1e-12)


def test_the_rate_of_the_turn_is_its_derivative() -> None:
    s, h = phase_grid()[1:-1], 1e-6
    regulator = LegAngleRegulator()
    difference = (regulator.profile(s + h)[0] - regulator.profile(s - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(regulator.profile(s)[1], difference, atol=1e-4)


@pytest.mark.parametrize("settings", [{"limit": -0.1}, {"settled": 0.0}, {"settled": 1.2}])
def test_impossible_settings_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(
        InvalidInput, match=r"leg-angle regulation: (limit|settled)=.*; give a number"
    ):
        LegAngleRegulator(**settings)
