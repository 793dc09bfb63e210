from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import Gains, Player, Tape
from pronk_pin.errors import InvalidInput

GAINS = Gains()
LIMIT = np.full(12, 33.5)


def random_tape(n: int, ticks: int, *, begin: int = 0, seed: int = 0) -> Tape:
    feedforward, position, velocity = np.random.default_rng(seed).normal(size=(3, n, ticks, 12))
    return Tape(feedforward, position, velocity, np.full(n, ticks), begin)


def test_the_gains_are_the_papers_for_each_leg_from_hip_to_calf() -> None:
    np.testing.assert_array_equal(GAINS.proportional, [35.0, 60.0, 90.0] * 4)
    np.testing.assert_array_equal(GAINS.derivative, [1.0, 6.0, 2.0] * 4)


def test_the_player_plays_feedforward_plus_feedback_on_each_robots_own_clock() -> None:
    player, tape = Player(3, 10, GAINS, LIMIT), random_tape(3, 10)
    player.load(np.arange(3), tape)
    player.tick[:] = 0, 4, 9
    q, v = np.random.default_rng(1).normal(size=(2, 3, 12))

    torque, feedback, feedforward = player.play(q, v)

    for robot, tick in enumerate((0, 4, 9)):
        error = tape.position[robot, tick] - q[robot]
        rate = tape.velocity[robot, tick] - v[robot]
        expected = np.tile([35.0, 60.0, 90.0], 4) * error + np.tile([1.0, 6.0, 2.0], 4) * rate
        np.testing.assert_allclose(feedback[robot], expected)
        np.testing.assert_array_equal(feedforward[robot], tape.feedforward[robot, tick])
    np.testing.assert_allclose(torque, np.clip(feedforward + feedback, -33.5, 33.5))


def test_the_motors_get_no_more_than_their_limits() -> None:
    player = Player(1, 1, GAINS, LIMIT)
    player.load(np.array([0]), random_tape(1, 1))

    torque, feedback, _ = player.play(np.tile([9.0, -9.0], 6)[None], np.zeros((1, 12)))

    assert np.all(np.abs(feedback) > 33.5)
    np.testing.assert_array_equal(torque[0], np.tile([-33.5, 33.5], 6))


def test_a_tape_is_wound_to_where_it_begins() -> None:
    player = Player(2, 10, GAINS, LIMIT)
    player.load(np.arange(2), random_tape(2, 8, begin=3))
    assert player.tick.tolist() == [3, 3]
    assert player.length.tolist() == [8, 8]


def test_loading_a_tape_for_one_robot_leaves_the_other_alone() -> None:
    player, zeros = Player(2, 10, GAINS, LIMIT), np.zeros((2, 12))
    player.load(np.arange(2), random_tape(2, 10))
    player.tick[:] = 5
    before = player.play(zeros, zeros)[0]

    player.load(np.array([1]), random_tape(1, 6, seed=9))

    after = player.play(zeros, zeros)[0]
    np.testing.assert_array_equal(after[0], before[0])
    assert np.any(after[1] != before[1])
    assert player.tick.tolist() == [5, 0]


def test_negative_gains_are_refused() -> None:
    with pytest.raises(InvalidInput, match="feedback gains must not be negative"):
        Gains(kd=(1.0, -6.0, 2.0))
