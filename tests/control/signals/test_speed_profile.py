"""Speed profiles as they are written, and what they command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pronk_pin.control import SpeedProfile
from pronk_pin.errors import FileProblem, InvalidInput


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
    profile = SpeedProfile.parse(words)
    assert str(profile) == str(SpeedProfile(profile.times, profile.speeds)) == words


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


def test_a_sine_is_followed_to_a_hundredth_of_its_swing() -> None:
    profile = SpeedProfile.parse("0.3 2s, 0.3+-0.2/5s 12s")
    time = np.linspace(2.0, 14.0, 500)
    expected = 0.3 + 0.2 * np.sin(2.0 * np.pi * (time - 2.0) / 5.0)
    np.testing.assert_allclose(profile.at(time), expected, atol=0.2 * 0.01)
    assert profile.duration == 14.0
    assert str(profile) == "0.3 2s, 0.3+-0.2/5s 12s"
    again = SpeedProfile.parse(str(SpeedProfile(profile.times, profile.speeds)))
    np.testing.assert_allclose(again.at(time), profile.at(time), atol=1e-5)


def test_a_profile_is_read_from_a_table_of_its_corners(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time,speed\n0,0.1\n2,0.1\n2,0.4\n4,0\n")
    assert str(SpeedProfile.parse(str(path))) == "0.1 2s, 0.4->0 2s"


@pytest.mark.parametrize(
    "text", ["time,speed\n0,fast\n", "time,speed\n1,0\n", "time\n", "0,0,0\n0,0,0\n"]
)
def test_a_table_of_something_else_is_damaged(tmp_path: Path, text: str) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(text)
    with pytest.raises(FileProblem, match="write 'time,speed'"):
        SpeedProfile.parse(str(path))


def test_corners_that_go_back_in_time_are_refused() -> None:
    with pytest.raises(InvalidInput, match="must not decrease"):
        SpeedProfile((0.0, 2.0, 1.0), (0.0, 0.1, 0.2))
    with pytest.raises(InvalidInput, match="as many of both, the first time 0"):
        SpeedProfile((1.0,), (0.0,))
