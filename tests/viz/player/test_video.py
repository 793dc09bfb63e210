"""Pictures and films need no display, and say clearly what they need."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from pronk_pin.cli import main
from pronk_pin.errors import FileProblem, InvalidInput, NoBrowser
from pronk_pin.robot import ROBOTS, Robot, RobotSpec, load_robot
from pronk_pin.viz import Film, Scene, Track, write_film, write_png
from pronk_pin.viz.player import video
from pronk_pin.viz.player.browser import VARIABLE
from pronk_pin.viz.player.video import find_encoder

if TYPE_CHECKING:
    from conftest import Eye
"""A large robot."""

PROGRAM = """
import sys, time
from pronk_pin.viz.player.browser import Browser
browser = Browser()
print(browser._process.pid, flush=True)
time.sleep(60)
"""


@pytest.mark.browser
def test_a_picture_shows_the_moment_asked_for(scene: Scene, browser: Eye, tmp_path: Path) -> None:
    film = Film(width=480, height=360)
    pushing = write_png(scene, tmp_path / "new" / "a.png", film)
    flying = write_png(scene, tmp_path / "b.png", Film(width=480, height=360, at=0.3))
    pictures = [
        np.asarray(Image.open(path).convert("RGB")).astype(int) for path in (pushing, flying)
    ]
    assert pictures[0].shape == (360, 480, 3)
    assert np.sum(np.abs(pictures[0] - pictures[1]).max(axis=-1) > 40) > 2_000


def drawn(scene: Scene, path: Path) -> np.ndarray:
    picture = write_png(scene, path, Film(width=480, height=400))
    return np.asarray(Image.open(picture).convert("RGB")).astype(int)


LOOKED_AT = ("a1", "go2", "hyq", "anymal_c")
"""The others take as long again."""


@pytest.mark.browser
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[] if name in ("a1", "go2", "hyq", "anymal_c") else pytest.mark.slow
        )
        for name in ROBOTS
    ],
)
def test_a_robot_is_whole_in_its_picture(name: str, browser: Eye, tmp_path: Path) -> None:
    """None touches the edge, large ones neither, and all have legs down to the ground."""
    robot = load_robot(name)
    q = robot.standing[None]
    stands = drawn(Scene(robot, (Track("robot", np.zeros(1), q),)), tmp_path / "a.png")
    low = q.copy()
    low[0, 2] -= 30.0
    none = drawn(Scene(robot, (Track("robot", np.zeros(1), low),)), tmp_path / "b.png")
    rows, columns = np.nonzero(np.abs(stands - none).max(axis=-1) > 25)
    assert 0.02 < len(rows) / stands[..., 0].size < 0.35
    assert 20 < rows.min() < rows.max() < 395
    assert 5 < columns.min() < columns.max() < 475
    assert np.ptp(rows) > 100


@pytest.mark.browser
def test_capsules_and_cones_are_drawn(robot: Robot, browser: Eye, tmp_path: Path) -> None:
    shapes = ('<capsule radius="0.05" length="0.3"/>', '<cone radius="0.1" length="0.4"/>')
    pictures = []
    for number, shape in enumerate(("", *shapes)):
        visual = f"<visual><geometry>{shape}</geometry></visual>" if shape else ""
        text = re.sub("<visual>.*?</visual>", "", robot.urdf.decode(), flags=re.DOTALL)
        path = tmp_path / f"{number}.urdf"
        path.write_text(text.replace('<link name="trunk">', f'<link name="trunk">{visual}'))
        own = load_robot(RobotSpec("own", str(path)))
        scene = Scene(own, (Track("robot", np.zeros(1), own.standing[None]),))
        pictures.append(drawn(scene, tmp_path / f"{number}.png"))
    counts = [np.sum(np.abs(each - pictures[0]).max(axis=-1) > 25) for each in pictures[1:]]
    assert min(counts) > 1000


@pytest.mark.browser
def test_an_animation_and_a_video_have_the_frames_asked_for(
    scene: Scene, browser: Eye, tmp_path: Path
) -> None:
    film = Film(width=240, height=180, fps=20.0, rate=0.5, seconds=0.2)
    gif = write_film(scene, tmp_path / "hop.gif", film, progress=False)
    with Image.open(gif) as animation:
        assert (animation.n_frames, animation.size) == (8, (240, 180))
        assert animation.info["duration"] == 50
    try:
        program = find_encoder()
    except InvalidInput as error:
        pytest.skip(str(error))
    mp4 = write_film(scene, tmp_path / "hop.mp4", film, progress=False)
    command = [program, "-i", str(mp4), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    frames = subprocess.run(command, capture_output=True, check=True)
    pictures = np.frombuffer(frames.stdout, np.uint8).reshape(-1, 180, 240, 3).astype(int)
    assert len(pictures) == 8
    assert b"20 fps" in frames.stderr
    first = np.asarray(Image.open(write_png(scene, tmp_path / "a.png", film)).convert("RGB"))
    assert np.abs(pictures[0] - first).mean() < 4.0  # what is seen is what was drawn


@pytest.mark.browser
def test_a_killed_program_leaves_no_browser(browser: Eye) -> None:
    process = subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    pid = int(process.stdout.readline())
    os.kill(pid, 0)
    process.send_signal(signal.SIGKILL)
    process.wait()
    for _ in range(100):
        if not alive(pid):
            return
        time.sleep(0.1)
    raise AssertionError("the browser is still there")


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended but was not waited for does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_without_a_browser_it_says_what_to_install(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr("pronk_pin.viz.player.browser._NAMES", ("no-such-browser",))
    with pytest.raises(NoBrowser, match=r"none is installed; install one .*apt install chromium"):
        write_png(scene, tmp_path / "a.png")
    monkeypatch.setenv(VARIABLE, "no-such-browser")
    with pytest.raises(NoBrowser, match="PRONK_PIN_BROWSER=no-such-browser is no program"):
        write_png(scene, tmp_path / "a.png")


def test_a_browser_that_ends_at_once_is_told(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, "false")
    with pytest.raises(NoBrowser, match="false ended"):
        write_png(scene, tmp_path / "a.png")


def test_without_an_encoder_it_says_what_to_install_before_anything_is_drawn(
    scene: Scene,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InvalidInput, match=r"apt install ffmpeg.*pronk-pin\[video\].*a .gif"):
        write_film(scene, tmp_path / "a.mp4")
    # The folder is not even read: that it is none would be told, too.
    assert main(["view", str(tmp_path / "none"), "--mp4", str(tmp_path / "a.mp4")]) == 1
    assert "videos are encoded by ffmpeg" in capsys.readouterr().err


def test_without_a_browser_it_says_so_before_the_page_is_made(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(VARIABLE, "no-such-browser")
    monkeypatch.setattr(video, "write_replay", lambda *_, **__: pytest.fail("drawn for nothing"))
    with pytest.raises(NoBrowser, match="PRONK_PIN_BROWSER=no-such-browser is no program"):
        write_film(scene, tmp_path / "a.gif")


def test_an_installed_ffmpeg_is_used_before_an_extra_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One that fails is quoted, with the way out."""
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\necho Unknown encoder libx264 >&2\nexit 1\n")
    program.chmod(0o755)
    assert find_encoder() == str(program)
    pictures = iter([Image.new("RGB", (240, 180))] * 50)
    with pytest.raises(InvalidInput, match=r"Unknown encoder libx264.*write a .gif"):
        video._write_mp4(tmp_path / "a.mp4", pictures, Film(width=240, height=180))
    assert not (tmp_path / "a.mp4").exists()


def test_a_path_is_looked_at_before_anything_is_drawn(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"as .gif or .mp4, not as 'a.avi'"):
        write_film(scene, tmp_path / "a.avi")
    (tmp_path / "file").write_text("")
    with pytest.raises(FileProblem, match="choose another path"):
        write_png(scene, tmp_path / "file" / "a.png")


def test_slow_motion_and_pieces() -> None:
    assert Film(fps=10.0, rate=0.5, at=1.0, seconds=0.2).times(5.0) == pytest.approx(
        [1.0, 1.05, 1.1, 1.15]
    )
    assert len(Film(fps=10.0).times(5.0)) == 50
    assert Film(at=9.0).times(5.0) == [9.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fps": 0.0}, "fps=0.0; give a number above 0"),
        ({"width": 301}, "even number of pixels"),
        ({"color": "mass"}, "choose error or torque"),
        ({"at": -1.0}, "at=-1.0; give a number from 0 on"),
    ],
)
def test_a_film_refuses_what_cannot_be(change: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        Film(**change)  # type: ignore[arg-type]
