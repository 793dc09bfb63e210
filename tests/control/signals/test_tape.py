from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import Gains, Tape, clip_torque
from pronk_pin.errors import InvalidInput

GAINS = Gains()
LIMIT = np.full(12, 33.5)


def random_tape(n: int, ticks: int) -> Tape:
    feedforward, position, velocity = np.random.default_rng(0).normal(size=(3, n, ticks, 12))
    return Tape(feedforward, position, velocity, np.full(n, ticks))


def test_the_gains_are_the_papers_for_each_leg_from_hip_to_calf() -> None:
    np.testing.assert_array_equal(GAINS.proportional(12), [35.0, 60.0, 90.0] * 4)
    np.testing.assert_array_equal(GAINS.derivative(12), [1.0, 6.0, 2.0] * 4)


def test_the_feedback_is_that_of_eq_9_and_nothing_where_a_sensor_failed() -> None:
    error, rate = np.random.default_rng(1).normal(size=(2, 3, 12))
    expected = np.tile([35.0, 60.0, 90.0], 4) * error + np.tile([1.0, 6.0, 2.0], 4) * rate
    np.testing.assert_allclose(GAINS.feedback(error, rate), expected)
    error[1, 2], rate[2, 5] = np.nan, np.inf
    feedback = GAINS.feedback(error, rate)
    assert feedback[1, 2] == feedback[2, 5] == 0.0
    assert np.count_nonzero(feedback) == 34


def test_servos_that_are_told_the_set_points_give_feedforward_plus_feedback() -> None:
    tape = random_tape(3, 10)
    q, v = np.random.default_rng(1).normal(size=(2, 3, 10, 12))
    servo = tape.setpoint(GAINS) - GAINS.proportional(12) * q - GAINS.derivative(12) * v
    expected = tape.feedforward + GAINS.feedback(tape.position - q, tape.velocity - v)
    np.testing.assert_allclose(servo, expected)


def test_the_motors_get_no_more_than_their_limits() -> None:
    feedback = np.tile([40.0, -20.0], 6)
    torque = clip_torque(feedback, np.tile([5.0, -20.0], 6), LIMIT)
    np.testing.assert_array_equal(torque, np.tile([33.5, -33.5], 6))


def test_negative_gains_are_refused() -> None:
    with pytest.raises(InvalidInput, match=r"gains: kd\[1\]=-6\.0; give a number from 0 to"):
        Gains(kd=(1.0, -6.0, 2.0))


def test_beyond_its_end_a_tape_is_held() -> None:
    tape = random_tape(2, 5)
    longer = tape.held(8)
    assert tape.held(3) is tape
    assert longer.ticks == 8
    np.testing.assert_array_equal(longer.setpoint(GAINS)[:, :5], tape.setpoint(GAINS))
    for name in ("feedforward", "position", "velocity"):
        values, held = getattr(tape, name), getattr(longer, name)
        np.testing.assert_array_equal(held[:, 5:], np.repeat(values[:, -1:], 3, axis=1))


def test_a_reference_ends_after_the_last_tick_at_which_any_joint_moves() -> None:
    velocity = np.zeros((3, 10, 12))
    velocity[0, :4, 2] = 1.0  # one joint stops earlier than the other
    velocity[0, :6, 7] = -1.0
    velocity[1, 9, 0] = 0.5  # to the end of the tape
    velocity[2, 0, 11] = 0.5
    tape = Tape(0.0 * velocity, 0.0 * velocity, velocity, np.full(3, 10))
    assert tape.ticks == 10
    assert tape.reference_end.tolist() == [6, 10, 1]
