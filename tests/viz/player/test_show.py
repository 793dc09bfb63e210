"""Three lines show a motion of one's own."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library
from pronk_pin.robot import Robot, load_robot
from pronk_pin.viz import play, show
from pronk_pin.viz.player.show import track_of

QUIET = {"open_browser": False}


def test_a_posture_is_shown_and_moved() -> None:
    robot = load_robot("solo12")
    with show(robot, robot.standing, **QUIET) as page:
        page.display(robot.standing)
        assert page.url.startswith("http://127.0.0.1:")
        assert f'src="{page.url}"' in page._repr_html_()


def test_a_motion_is_played_beside_its_reference_and_another(robot: Robot) -> None:
    t = np.linspace(0.0, 1.0, 11)
    q = np.tile(robot.standing, (11, 1))
    page = play(robot, (t, q), (t, q), beside={"t": t, "q": q}, block=False, **QUIET)
    assert page is not None
    with page:
        names = [(track.name, track.ghost) for track in page.scene.tracks]
        assert names == [("robot", False), ("reference", True), ("beside", False)]
        assert page.scene.duration == pytest.approx(1.0)


def test_it_waits_in_a_script(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    motion = (np.zeros(1), robot.standing[None])
    assert play(robot, motion, duration=0.1, title="Mine", **QUIET) is None
    assert "Mine is at http://127.0.0.1:" in capsys.readouterr().out


def test_a_gaits_motion_brings_forces_and_torques(robot: Robot) -> None:
    motion = load_library("a1").at(0.5).stance.motion(robot, np.linspace(0.0, 1.0, 21))
    track = track_of(robot, motion, "gait")
    assert track.forces is not None
    np.testing.assert_array_equal(track.forces, motion.lam)
    np.testing.assert_array_equal(track.torque, motion.tau)


@pytest.mark.parametrize(
    ("trajectory", "message"),
    [
        ("motion", r"a str is no trajectory; give \(t, q\)"),
        ((np.zeros(2), np.zeros((3, 18))), "q has shape"),
        ((np.zeros(2), np.tile([0, 0, 0, 0, 0, 0, 1] + [0] * 12, (3, 1))), r"t has shape \(2,\)"),
    ],
)
def test_what_is_no_trajectory_is_refused(robot: Robot, trajectory: object, message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        track_of(robot, trajectory, "mine")


def test_one_posture_at_a_time_is_shown(robot: Robot) -> None:
    with pytest.raises(InvalidInput, match="show one posture"):
        show(robot, robot.standing[None], **QUIET)
