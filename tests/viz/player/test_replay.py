"""A replay is one file that plays by itself."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.robot import Robot, RobotSpec, load_robot
from pronk_pin.viz import Menu, Scene, Track, write_replay
from pronk_pin.viz.player import replay as module

if TYPE_CHECKING:
    from conftest import Eye


def by_color(scene: Scene) -> Menu:
    """The hop in two colours, of which the file holds both."""

    def make(choice: Mapping[str, str]) -> Scene:
        color = {"plain": None, "red": (0.9, 0.0, 0.0)}[choice["paint"]]
        return replace(scene, tracks=[replace(scene.tracks[0], color=color)])

    options = {"paint": ["plain", "red"], "other": ["one", "two"]}
    filed = {"paint": options["paint"]}
    return Menu(make, options, {"paint": "plain", "other": "one"}, filed)


@pytest.fixture(scope="module")
def replay(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The hop as a file."""
    return write_replay(scene, tmp_path_factory.mktemp("replay") / "new folder" / "hop.html")


@pytest.fixture
def offline(browser: Eye) -> Iterator[Eye]:
    """A browser that is cut off from any network."""
    browser.call("Network.enable")
    conditions = {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
    browser.call("Network.emulateNetworkConditions", offline=True, **conditions)
    yield browser
    browser.call("Network.emulateNetworkConditions", offline=False, **conditions)


def test_two_robots_with_arrows_for_five_seconds_stay_well_below_5_MB(
    robot: Robot, hop: Track, tmp_path: Path
) -> None:
    rng = np.random.default_rng(3)
    noise = [rng.normal(0.0, 0.05, hop.q[:, 7:].shape) for _ in "ab"]
    tracks = [
        replace(hop, name=f"noisy {k}", q=np.c_[hop.q[:, :7], hop.q[:, 7:] + part])
        for k, part in enumerate(noise)
    ]
    path = write_replay(Scene(robot, tracks, friction=0.6), tmp_path / "two.html")
    assert path.stat().st_size < 2e6


def test_the_file_needs_no_other(replay: Path) -> None:
    addresses: list[str | None] = []

    class Collector(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            addresses.extend(value for name, value in attrs if name in ("src", "href"))

    text = replay.read_text(encoding="utf-8")
    Collector().feed(text)
    assert addresses == ["data:,"]
    assert "@import" not in text.split("<script>")[0]


def test_a_path_that_cannot_be_written_is_named(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileProblem, match=r"cannot be written .*; choose another path"):
        write_replay(scene, tmp_path / "file" / "hop.html", fps=5.0)


def test_a_full_disk_leaves_the_replay_that_was_there(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "hop.html"
    path.write_text("before")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileProblem, match=r"No space left on device.*choose another path"):
        write_replay(scene, path, fps=5.0)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_film_needs_frames(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="fps=0; give a number above 0, up to 1000"):
        write_replay(scene, tmp_path / "hop.html", fps=0)


def test_a_file_holds_what_a_programme_wants_filed(scene: Scene, tmp_path: Path) -> None:
    text = write_replay(by_color(scene), tmp_path / "hop.html", fps=5.0).read_text()
    assert 'options: {"paint": ["plain", "red"], "other": ["one"]}' in text


def test_a_file_that_would_grow_too_large_leaves_choices_out(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LARGEST", 100_000)
    text = write_replay(by_color(scene), tmp_path / "hop.html", fps=5.0).read_text()
    assert 'options: {"paint": ["plain"], "other": ["one"]}' in text


def test_no_text_ends_the_script(scene: Scene, tmp_path: Path) -> None:
    menu = Menu(lambda choice: scene, {"</script>": ["a"]}, {"</script>": "a"})
    text = write_replay(menu, tmp_path / "hop.html", fps=5.0).read_text()
    assert len(re.findall("</script>", text)) == 3


@pytest.mark.browser
def test_it_plays_at_once_in_real_time_and_from_the_beginning_again(
    replay: Path, offline: Eye
) -> None:
    browser = offline
    browser.open(replay.as_uri())
    # `last` is when the page drew last, by the browser's clock [ms].
    begin, first = browser.run("[player.last, player.time]")
    browser.wait(f"player.last > {begin} + 1000")
    end, last = browser.run("[player.last, player.time]")
    assert (last - first) % 4.983 == pytest.approx((end - begin) / 1000.0 % 4.983, abs=0.01)
    browser.run("$('rate').value = 2; player.seek(4.5)")
    browser.wait("player.time < 2.0")
    assert browser.run("player.playing")
    assert browser.errors == []


@pytest.mark.browser
def test_robot_ghost_arrows_and_cones_are_seen_to_move(replay: Path, offline: Eye) -> None:
    browser = offline
    browser.open(f"{replay.as_uri()}#t=0.1")
    assert not browser.run("player.playing")
    pushing = browser.scenery()
    browser.run("player.seek(0.3)")
    flying = browser.scenery()
    assert np.sum(np.abs(pushing - flying).max(axis=-1) > 40) > 5_000
    for picture in (pushing, flying):
        r, _, b = np.moveaxis(picture, -1, 0)
        assert np.sum(picture.max(axis=-1) < 60) > 300  # the dark calves
        assert np.sum(b - r > 50) > 500  # the ghost
    orange = [np.sum(p[..., 0] - p[..., 2] > 100) for p in (pushing, flying)]
    assert orange[0] > 100 > 10 > orange[1]
    green = [
        np.sum((p[..., 1] - p[..., 0] > 20) & (p[..., 1] - p[..., 2] > 5))
        for p in (pushing, flying)
    ]
    assert green[0] > 300 > 30 > green[1]
    assert browser.errors == []


@pytest.mark.browser
def test_the_controls_act(replay: Path, browser: Eye) -> None:
    browser.open(f"{replay.as_uri()}#t=1.13")
    assert "stride 2, flight" in browser.run("$('tracks').textContent")
    everything = browser.scenery()
    for layer in ("ghosts", "arrows", "cones", "trails"):
        browser.run("player.seek(0.5)")
        before = browser.scenery()
        browser.run(f"$('{layer}').click()")
        assert np.any(browser.scenery() != before), layer
    browser.run("player.seek(1.13)")
    assert np.any(browser.scenery() != everything)
    browser.run("$('play').click()")
    assert browser.run("player.playing")
    browser.run("$('scrub').value = 3.21; $('scrub').dispatchEvent(new Event('input'))")
    assert browser.run("[player.time, player.playing]") == [3.21, False]
    browser.run("$('stride').selectedIndex = 5; $('stride').dispatchEvent(new Event('change'))")
    assert browser.run("player.time") == pytest.approx(2.0)
    browser.run("document.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight'}))")
    assert browser.run("player.time") == pytest.approx(2.01)
    for by, words in (("error", "0.05 rad"), ("torque", "30 % of the torque limit")):
        before = browser.scenery()
        browser.run(f"$('colour').value = '{by}'; $('colour').dispatchEvent(new Event('change'))")
        assert np.sum(browser.scenery() != before) > 3_000
        assert words in browser.run("$('scale').textContent")
    assert browser.errors == []


@pytest.mark.browser
def test_the_plots_run_with_the_animation(replay: Path, browser: Eye) -> None:
    browser.open(f"{replay.as_uri()}#t=0.0")
    panel = (slice(200, 640), slice(670, 960))
    pictures = []
    for time_ in (1.0, 3.0):
        browser.run(f"player.seek({time_})")
        pictures.append(browser.look()[panel])
    changed = np.abs(pictures[0] - pictures[1]).max(axis=-1) > 60
    columns = np.flatnonzero(changed.any(axis=0))
    # Two thin lines in each plot, 2 of 4.99 s apart.
    assert changed.sum() < 3_000
    assert np.ptp(columns) == pytest.approx(2.0 / 4.99 * 220, abs=12)


@pytest.mark.browser
def test_what_was_chosen_is_shown_and_what_is_missing_is_told(
    scene: Scene, browser: Eye, tmp_path: Path
) -> None:
    path = write_replay(by_color(scene), tmp_path / "hop.html", fps=20.0)
    browser.open(f"{path.as_uri()}#t=0.3")
    plain = browser.scenery()
    browser.run("$('option-paint').value = 'red'")
    browser.run("$('option-paint').dispatchEvent(new Event('change'))")
    browser.wait("player.film.tracks[0].color === '#e60000'")
    red = browser.scenery()
    reddish = [np.sum(p[..., 0] - p[..., 2] > 60) for p in (plain, red)]
    assert reddish[1] > 5_000 > 500 > reddish[0]
    browser.run("player.source.film = () => Promise.reject(new Error('not there')); player.load()")
    browser.wait("$('state').textContent === 'not there'")
    assert browser.errors == []


@pytest.mark.browser
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_the_page_places_the_robot_as_pinocchio_does(
    robot: Robot, browser: Eye, tmp_path: Path, kind: str
) -> None:
    if kind != "revolute":
        thigh = 'name="FL_thigh_joint" type='
        text = robot.urdf.decode().replace(f'{thigh}"revolute"', f'{thigh}"{kind}"')
        (tmp_path / "own.urdf").write_text(text)
        robot = load_robot(RobotSpec("own", str(tmp_path / "own.urdf")))
    rng = np.random.default_rng(8)
    ends = [pin.integrate(robot.model, robot.standing, rng.uniform(-0.6, 0.6, 18)) for _ in "ab"]
    track = Track("robot", np.array([0.0, 1.0]), np.stack(ends))
    path = write_replay(Scene(robot, (track,)), tmp_path / "page.html")
    browser.open(f"{path.as_uri()}#t=0.25")
    q = track.at(np.array([0.25]))["q"][0]
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    browser.run("player.viewer.scene.updateMatrixWorld(true)")
    for index in range(1, robot.model.njoints):
        found = browser.run(
            "player.world.matrixWorld.clone().invert()"
            f".multiply(player.figures[0].nodes[{index}].matrixWorld).elements"
        )
        pose = np.reshape(found, (4, 4)).T
        np.testing.assert_allclose(pose, data.oMi[index].homogeneous, atol=2e-4)
