"""Speed profiles as they are written, and what they command."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import SpeedProfile
from pronk_pin.errors import InvalidInput


def test_a_profile_is_read_piece_by_piece() -> None:
    profile = SpeedProfile.parse("0 4s, 0->0.8 2s, 0.8 4s, 0.8->-.3 1.5s")
    assert profile.duration == 11.5
    np.testing.assert_allclose(
        profile.at([-1.0, 0.0, 4.0, 5.0, 6.0, 9.9, 10.75, 11.5, 99.0]),
        [0.0, 0.0, 0.0, 0.4, 0.8, 0.8, 0.25, -0.3, -0.3],
    )


def test_a_step_commands_the_new_speed_from_its_time_on() -> None:
    profile = SpeedProfile.parse("0.1 2s, 0.4 2s")
    np.testing.assert_allclose(profile.at(np.array([1.999, 2.0, 2.001])), [0.1, 0.4, 0.4])


@pytest.mark.parametrize(
    "words", ["0 4s, 0->0.8 2s, 0.8 4s", "0.1 2s, 0.4 2s", "-0.3->0.3 5s", "0.25 1.5s"]
)
def test_a_profile_is_written_as_it_is_read(words: str) -> None:
    assert str(SpeedProfile.parse(words)) == words


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("fast", "'fast' is no piece of a speed profile; write '0.4 3s'"),
        ("0 4s, 0->0.8", "'0->0.8' is no piece"),
        ("", "'' is no piece"),
        ("200 3s", r"speeds of a speed profile\[0\]=200"),
    ],
)
def test_what_is_no_profile_is_answered_with_one(words: str, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        SpeedProfile.parse(words)


def test_corners_that_go_back_in_time_are_refused() -> None:
    with pytest.raises(InvalidInput, match="must not decrease"):
        SpeedProfile((0.0, 2.0, 1.0), (0.0, 0.1, 0.2))
    with pytest.raises(InvalidInput, match="as many of both, the first time 0"):
        SpeedProfile((1.0,), (0.0,))
