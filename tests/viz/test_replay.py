"""A replay is one file that plays by itself."""

from __future__ import annotations

import base64
import json
import re
import time
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import umsgpack

from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.viz import Scene, Track, write_replay

if TYPE_CHECKING:
    from conftest import Browser


@pytest.fixture(scope="module")
def replay(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The hop as a file."""
    return write_replay(scene, tmp_path_factory.mktemp("replay") / "new folder" / "hop.html")


def animation(replay: Path) -> dict[str, dict[str, np.ndarray]]:
    """The key frames in a file: for each path the times and the values of each track."""
    found = re.search(r"of (\[\".*?\"\])\)", replay.read_text(encoding="utf-8"))
    assert found is not None
    messages = [umsgpack.unpackb(base64.b64decode(text)) for text in json.loads(found.group(1))]
    clips = {entry["path"]: entry["clip"]["tracks"] for entry in messages[-1]["animations"]}
    return {
        path: {
            name: np.frombuffer(key[part].data, "<f4")
            for key in tracks
            for name, part in ((key["name"], "values"), ("times", "times"))
        }
        for path, tracks in clips.items()
    }


def test_two_robots_for_five_seconds_stay_well_below_5_MB(replay: Path) -> None:
    assert replay.stat().st_size < 4e6


def test_the_file_needs_no_other(replay: Path) -> None:
    addresses: list[str | None] = []

    class Collector(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            addresses.extend(value for name, value in attrs if name in ("src", "href"))

    text = replay.read_text(encoding="utf-8")
    Collector().feed(text)
    assert addresses == ["data:,"]
    assert "@import" not in text.split("<script>")[0]


def test_words_are_shown_as_they_are(replay: Path) -> None:
    text = replay.read_text(encoding="utf-8")
    assert "0.5 m/s &lt;made by hand&gt;" in text
    assert "<h1>Hop</h1>" in text
    assert "robot: hops" in text


def test_the_key_frames_are_the_scene(replay: Path, scene: Scene) -> None:
    frames = animation(replay)
    expected = dict(scene.transforms(float(scene.times(60.0)[100])))
    assert set(frames) == {f"/meshcat/{path}" for path in expected}
    for path, pose in expected.items():
        position = frames[f"/meshcat/{path}"][".position"].reshape(-1, 3)[100]
        np.testing.assert_allclose(position, pose[:3, 3], atol=1e-6)
    length = frames["/meshcat/robot/force FL"][".scale"].reshape(-1, 3)[100, 2]
    assert length == pytest.approx(np.linalg.norm(expected["robot/force FL"][:3, 2]), abs=1e-6)


def test_a_recording_that_begins_late_plays_at_once(scene: Scene, tmp_path: Path) -> None:
    track = scene.tracks[0]
    late = Scene(scene.robot, (Track("late", track.t + 7.0, track.q),))
    times = animation(write_replay(late, tmp_path / "late.html", fps=10.0))["/meshcat/ground"]
    assert times["times"][0] == 0.0
    assert times["times"][-1] == pytest.approx(4.99, abs=0.1)


def test_a_path_that_cannot_be_written_is_named(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileProblem, match=r"cannot be written .*; choose another path"):
        write_replay(scene, tmp_path / "file" / "hop.html", fps=5.0)


def test_a_film_needs_frames(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="fps must be positive, not 0"):
        write_replay(scene, tmp_path / "hop.html", fps=0)


@pytest.mark.browser
def test_it_plays_at_once_and_from_the_beginning_again(replay: Path, browser: Browser) -> None:
    browser.open(replay.as_uri())
    assert browser.run("viewer.animator.playing")
    assert browser.run("viewer.animator.duration") == pytest.approx(4.99, abs=0.01)
    browser.run("viewer.animator.mixer.timeScale = 100")
    time.sleep(1.0)
    assert browser.run("viewer.animator.playing")
    assert browser.errors == []


@pytest.mark.browser
def test_robot_ghost_and_forces_are_seen_to_move(replay: Path, browser: Browser) -> None:
    browser.open(f"{replay.as_uri()}#t=0.1")
    pushing = browser.look()
    browser.open(f"{replay.as_uri()}#t=0.3")
    flying = browser.look()
    assert np.sum(np.abs(pushing - flying).max(axis=-1) > 40) > 5_000
    for picture in (pushing, flying):
        scenery = picture[250:]  # below the legend
        r, _, b = np.moveaxis(scenery, -1, 0)
        assert np.sum(scenery.max(axis=-1) < 60) > 500  # the dark calves
        assert np.sum(b - r > 50) > 500  # the ghost
    orange = [np.sum(p[250:, :, 0] - p[250:, :, 2] > 100) for p in (pushing, flying)]
    assert orange[0] > 100 > 10 > orange[1]
    assert browser.errors == []
