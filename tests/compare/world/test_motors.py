from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pronk_pin.compare import load_scenario
from pronk_pin.compare.world.motors import Motors, push_force

IDEAL = load_scenario("ideal")
TAU_MAX = np.full(12, 30.0)


def test_a_delayed_torque_is_the_command_of_so_many_ticks_before() -> None:
    motors = Motors(replace(IDEAL, delay=0.003), TAU_MAX, 2)
    commands = np.random.default_rng(0).normal(size=(20, 2, 12))
    rows, rates = np.arange(2), np.zeros((2, 12))
    torques = np.array([motors.drive(rows, command, rates) for command in commands])
    np.testing.assert_array_equal(torques[3:], commands[:-3])
    assert not torques[:3].any()


def test_each_robot_has_its_own_clock() -> None:
    motors = Motors(replace(IDEAL, delay=0.002), TAU_MAX, 2)
    commands = np.random.default_rng(0).normal(size=(10, 1, 12))
    rates = np.zeros((1, 12))
    torques = []
    for tick, command in enumerate(commands):
        torques.append(motors.drive(np.array([0]), command, rates))
        if tick % 3 == 0:  # the other one is asked now and then
            motors.drive(np.array([1]), -command, rates)
    np.testing.assert_array_equal(torques[2:], commands[:-2])


def test_what_comes_through_is_known_as_many_ticks_ahead_as_the_motors_are_late() -> None:
    scenario, rows, rates = replace(IDEAL, delay=0.003), np.arange(2), np.zeros((2, 12))
    one, other = Motors(scenario, TAU_MAX, 2), Motors(scenario, TAU_MAX, 2)
    commands = np.random.default_rng(0).normal(size=(2, 12, 12))
    driven = np.stack([one.drive(rows, command, rates) for command in commands.swapaxes(0, 1)], 1)
    done = np.zeros(2, dtype=np.intp)
    for ticks in ([3, 1], [1, 3], [2, 2], [3, 3]):  # each robot on its own clock
        coming = other.coming(rows, 3)
        for k in rows:
            following = driven[k, done[k] : done[k] + ticks[k]]
            np.testing.assert_array_equal(coming[k, : ticks[k]], following)
        given = np.stack([commands[k, done[k] : done[k] + 3] for k in rows])
        other.command(rows, given, np.array(ticks))
        done += ticks


@pytest.mark.parametrize(
    ("speed", "greatest"), [(0.0, 30.0), (10.0, 30.0), (15.0, 15.0), (20.0, 0.0), (25.0, 0.0)]
)
def test_a_motor_gives_less_the_faster_it_turns(speed: float, greatest: float) -> None:
    motors = Motors(replace(IDEAL, full_torque_speed=10.0, no_load_speed=20.0), TAU_MAX, 1)
    for sign in (1.0, -1.0):
        command, rates = np.full((1, 12), 30.0 * sign), np.full((1, 12), speed * sign)
        torque = motors.drive(np.arange(1), command, rates)
        np.testing.assert_allclose(torque, greatest * sign)


def test_a_motor_brakes_with_all_its_torque_at_any_speed() -> None:
    motors = Motors(replace(IDEAL, full_torque_speed=10.0, no_load_speed=20.0), TAU_MAX, 1)
    command, rates = np.full((1, 12), 30.0), np.full((1, 12), -19.0)
    np.testing.assert_array_equal(motors.drive(np.arange(1), command, rates), command)


@pytest.mark.parametrize("duration", [0.0004, 0.05, 0.0501])
def test_a_push_gives_its_impulse_and_the_next_one_turns_around(duration: float) -> None:
    scenario = replace(IDEAL, push_impulse=(3.0, -1.0, 0.5), push_duration=duration)
    time = np.arange(16_000) * scenario.timestep
    force = push_force(scenario, time)
    for number, sign in ((0, 0.0), (1, 1.0), (2, -1.0), (3, 1.0)):
        during = np.floor(time / scenario.push_period) == number
        impulse = force[during].sum(axis=0) * scenario.timestep
        np.testing.assert_allclose(impulse, sign * np.array([3.0, -1.0, 0.5]), atol=1e-9)


def test_nobody_is_pushed_before_the_first_period_is_over() -> None:
    scenario = replace(IDEAL, push_impulse=(3.0, 0.0, 0.0), push_period=2.0)
    assert not push_force(scenario, np.array([0.0, 1.0, 1.999])).any()
    assert push_force(scenario, np.array([2.0])).any()


@pytest.mark.parametrize("delay", [0, 1, 3, 6])
def test_commands_on_their_way_arrive_when_the_delay_changes(delay: int) -> None:
    rows, on_their_way = np.arange(2), np.arange(72.0).reshape(2, 3, 12)
    before, limit = Motors(replace(IDEAL, delay=0.003), np.full(12, 99.0), 2), np.full(12, 99.0)
    before.command(rows, on_their_way, np.array([3, 3]))
    after = Motors(replace(IDEAL, delay=0.001 * delay), limit, 2)
    last = np.full((2, 12), -1.0)
    after.take_over(before, last)
    wanted = np.concatenate([np.repeat(last[:, None], 3, axis=1), on_their_way], axis=1)
    np.testing.assert_array_equal(after.coming(rows, 10), wanted[:, 6 - delay :])
