"""What the page says is what it shows: menus, plots, timeline, camera, address, and on phones."""

from __future__ import annotations

import base64
import io
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from pronk_pin.viz import LiveServer, Menu, Scene, Track, write_replay
from pronk_pin.viz.scenes import History

if TYPE_CHECKING:
    from conftest import Eye

pytestmark = pytest.mark.browser

BEGAN = 4
"""Stride at which the hopping robot begins to learn."""


@pytest.fixture(scope="module")
def learner(hop: Track) -> Track:
    """The hop as that of a robot that learns from its fourth stride on, of a run of 40."""
    strides = np.arange(40)
    errors = np.where(strides < BEGAN, 0.1, 0.02)
    history = History(strides, 0.4 * strides, {"calf": errors, "thigh": 0.5 * errors}, BEGAN)
    assert hop.torque is not None
    style = {"accent": (0.0, 0.45, 0.7), "feedforward": 0.5 * hop.torque, "history": history}
    return replace(hop, **style)


@pytest.fixture(scope="module")
def menu(scene: Scene, learner: Track) -> Menu:
    """Two worlds, two rivals and one gait; a file holds three of the four combinations."""

    def make(choice: Mapping[str, str]) -> Scene:
        other = replace(learner.moved(y=0.6), name="other", color=(0.9, 0.6, 0.0), forces=None)
        tracks = [learner, scene.tracks[1], *([other] if choice["beside it"] == "other" else [])]
        hill = {"slope": 0.1, "payload": 2.0, "payload_position": (0.0, 0.0, 0.1), "soft": True}
        return replace(scene, tracks=tracks, **(hill if choice["world"] == "hill" else {}))

    options = {"world": ["flat", "hill"], "beside it": ["nothing", "other"], "gait": ["pronk"]}
    first = {"world": "flat", "beside it": "nothing", "gait": "pronk"}
    rounds = [{"world": options["world"]}, {"beside it": options["beside it"]}]
    return Menu(make, options, first, rounds=rounds)


@pytest.fixture(scope="module")
def page(menu: Menu, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Address of the file."""
    return write_replay(menu, tmp_path_factory.mktemp("page") / "page.html").as_uri()


@pytest.fixture
def sized(browser: Eye) -> Iterator[Eye]:
    """A browser whose window goes back to its size."""
    yield browser
    size(browser, 960, 700)


def size(browser: Eye, width: int, height: int) -> None:
    """Give the window another size."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    browser.call("Emulation.setDeviceMetricsOverride", **metrics)
    time.sleep(0.3)


def choose(browser: Eye, option: str, value: str) -> None:
    """Choose in a menu, as a reader does."""
    select = f"$('option-{option}')"
    browser.run(f"{select}.value = '{value}'; {select}.dispatchEvent(new Event('change'))")
    time.sleep(0.3)


def corners(browser: Eye, id_: str) -> list[float]:
    """Left, top, width and height of an element [px]."""
    box = f"$('{id_}').getBoundingClientRect()"
    return [float(browser.run(f"{box}.{side}")) for side in ("x", "y", "width", "height")]


CHOICE = "[...$('options').querySelectorAll('select')].map((s) => s.value)"


def test_menus_say_what_the_picture_shows(page: str, browser: Eye) -> None:
    """What is not in the file moves the other menus along; after an error they go back."""
    browser.open(f"{page}#t=0.3")
    assert browser.run("$('option-gait').parentElement.hidden")  # one entry is no choice
    assert not browser.run("$('option-world').parentElement.hidden")
    choose(browser, "beside-it", "other")
    assert browser.run("player.film.tracks.length") == 3
    choose(browser, "world", "hill")  # with the other it is not in the file
    assert browser.run(CHOICE) == ["hill", "nothing", "pronk"]
    assert browser.run("[player.film.tracks.length, player.film.slope]") == [2, 0.1]
    browser.run("player.source.film = () => Promise.reject(new Error('gone'))")
    choose(browser, "world", "flat")
    assert browser.run("$('state').textContent") == "gone"
    assert browser.run(CHOICE) == ["hill", "nothing", "pronk"]
    assert browser.errors == []


def test_the_address_keeps_the_whole_choice_and_is_obeyed(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=0.3")
    choose(browser, "world", "hill")
    browser.run("$('rate').value = '0.25'; $('rate').dispatchEvent(new Event('change'))")
    browser.run("player.look('side'); player.seek(1.5)")
    time.sleep(0.6)
    state = "[$('option-world').value, player.time, $('rate').value, player.playing, " + (
        "...player.viewer.camera.position.toArray().map((x) => Math.round(1000 * x))]"
    )
    before, address = browser.run(state), browser.run("location.href")
    assert before[:4] == ["hill", 1.5, "0.25", False]
    browser.call("Page.navigate", url="about:blank")
    browser.open(address)
    assert browser.run(state) == before
    browser.run("location.hash = '#world=flat&stride=3'")
    browser.wait("player.film.slope === 0")
    assert browser.run("player.time") == pytest.approx(1.2, abs=1e-3)
    assert browser.errors == []


def test_slope_payload_and_soft_ground_are_drawn(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=0.3&world=hill")
    assert browser.run("player.earth.rotation.y") == pytest.approx(-0.1)
    cube = "player.figures[0].nodes[1].children.find((child) => child.name === 'payload')"
    side = browser.run(f"{cube}.geometry.parameters.width")
    assert 7850.0 * side**3 == pytest.approx(2.0)
    assert browser.run(f"{cube}.position.z") == pytest.approx(0.1)
    words = browser.run("$('tracks').textContent")
    for told in ("payload, 2 kg", "slopes by 10.0 %", "soft ground"):
        assert told in words
    firm = browser.run("player.ground.material.color.getHex()")
    choose(browser, "world", "flat")
    assert browser.run("player.ground.material.color.getHex()") != firm
    assert "payload" not in browser.run("$('tracks').textContent")


def test_the_moment_of_learning_is_marked_and_errors_run_with_the_strides(
    page: str, browser: Eye
) -> None:
    browser.open(f"{page}#t=0.3")
    assert "stride 0, flight: calf 100, thigh 50 mrad" in browser.run("$('tracks').textContent")
    browser.run("player.seek(1.7)")
    told = "stride 4, stance: calf 20, thigh 10 mrad"
    browser.wait(f"$('tracks').textContent.includes('{told}')")
    share = float(browser.run("$('began').style.left").rstrip("%")) / 100.0
    assert share == pytest.approx(0.4 * BEGAN / browser.run("player.duration"), abs=1e-3)
    pen, x = "player.plots[0].picture.getContext('2d')", "player.plots[0].x(player.began)"
    line = browser.run(f"[...{pen}.getImageData(Math.round({x}) - 1, 10, 3, 1).data]")
    red, green, blue, _ = max(np.reshape(line, (3, 4)).tolist(), key=lambda p: p[0] - p[2])
    assert red > 150 > green > blue  # where learning begins


def test_the_timeline_shows_the_whole_run_and_a_click_jumps(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=0.3")
    box = corners(browser, "timeline")[2:]
    click = "$('timeline').dispatchEvent(new MouseEvent('click', {{clientX: {}, clientY: {}}}))"
    left, top = corners(browser, "timeline")[:2]
    middle = left + box[0] * 7.5 / 40
    browser.run(click.format(middle, top + 5))
    assert browser.run("player.time") == pytest.approx(2.8, abs=1e-3)  # stride 7
    browser.run(click.format(left + box[0] * 30.5 / 40, top + 5))
    browser.wait("$('state').textContent.includes('Stride 30 is not in this file')")
    darkest = (  # the row of the curve in a column, as a share of the height
        "((share) => {{ const c = $('timeline'), x = Math.round(share * c.width), d = "
        "c.getContext('2d').getImageData(x, 2, 1, c.height - 4).data; let at = 0; for (let y = 1; "
        "y < c.height - 4; y++) if ((255 - d[4 * y]) * d[4 * y + 3] > (255 - d[4 * at]) * "
        "d[4 * at + 3]) at = y; return at / c.height; }})({})"
    )
    ink = [browser.run(darkest.format(share)) for share in (0.05, 0.9)]
    assert ink[0] < 0.3 < 0.6 < ink[1]  # the error falls


def test_plots_have_the_reference_the_feedforward_stance_and_hover_values(
    page: str, browser: Eye, learner: Track
) -> None:
    browser.open(f"{page}#t=0.3")
    joint = browser.run("Number($('joint').value)")
    row = learner.at(np.array([1.0]))
    q, error = row["q"][0, 7 + joint], row["error"][0, joint]
    told = {}
    for name in ("angle", "torque"):
        browser.run(f"player.plots.find((plot) => plot.name === '{name}').tell(1.0)")
        told[name] = browser.run(f"$('{name}-value').textContent").removeprefix("1.00 s: ")
    measured, reference = map(float, told["angle"].split(" / "))
    assert (measured, reference) == pytest.approx((q, q + error), abs=0.006)
    torque, feedforward = map(float, told["torque"].split(" / "))
    assert torque == pytest.approx(2.0 * feedforward, rel=0.01)
    shade = [
        browser.run(
            f"[...player.plots[1].picture.getContext('2d').getImageData(Math.round("
            f"player.plots[1].x({t})), 8, 1, 1).data]"
        )[3]
        for t in (0.1, 0.3)
    ]
    assert shade == [255, 0]  # stance, flight


def test_the_camera_stays_above_the_floor_and_comes_back(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=0.3")
    height = "player.viewer.camera.position.y"
    start = browser.run("player.viewer.camera.position.toArray()")
    browser.run("player.viewer.camera.position.set(1, -3, 1); player.viewer.controls.update()")
    assert browser.run(height) > 0.0
    for key, axis in (("s", 2), ("f", 0), ("t", 1)):
        browser.run(f"document.dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}'}}))")
        position = np.abs(browser.run("player.viewer.camera.position.toArray()"))
        assert int(np.argmax(position)) == axis
    browser.run("document.querySelector('[data-view=reset]').click()")
    assert browser.run("player.viewer.camera.position.toArray()") == pytest.approx(start)
    place = "player.world.position.x"
    browser.run("$('follow').click()")
    browser.run("player.seek(0.5)")
    browser.run("player.draw()")
    fixed = browser.run(place)
    browser.run("player.seek(3.0); player.draw()")
    assert browser.run(place) == fixed
    assert browser.run("$('follow').getAttribute('aria-pressed')") == "false"
    browser.run("$('follow').click(); player.draw()")
    assert browser.run(place) < fixed - 1.0


def test_a_picture_of_this_view_is_saved_as_a_file(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=0.3")
    browser.run("HTMLAnchorElement.prototype.click = function () { window.saved = this; }")
    left, top, width, height = corners(browser, "snap")
    point = {"x": left + width / 2, "y": top + height / 2, "button": "left", "clickCount": 1}
    for kind in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=kind, **point)
    browser.wait("window.saved !== undefined")
    assert browser.run("window.saved.download") == "Hop-0.30s.png"
    data = browser.run("window.saved.href").removeprefix("data:image/png;base64,")
    saved = np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")).astype(int)
    pane = corners(browser, "pane")
    assert saved.shape[:2] == (round(pane[3]), round(pane[2]))
    seen = browser.look()[250:500, 100:500]  # where no words are
    assert np.abs(saved[250:500, 100:500] - seen).mean() < 1.0


def test_keys_work_after_a_click_on_a_box_or_the_scrubber(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=1.0")
    for id_, x in (("ghosts", 0.5), ("scrub", 0.2), ("follow", 0.5)):
        left, top, width, height = corners(browser, id_)
        where = {"x": left + x * width, "y": top + height / 2}
        point = {**where, "button": "left", "clickCount": 1}
        for kind in ("mousePressed", "mouseReleased"):
            browser.call("Input.dispatchMouseEvent", type=kind, **point)
        before, playing = browser.run("[player.time, player.playing]")
        for kind in ("keyDown", "keyUp"):
            browser.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key="ArrowRight",
                code="ArrowRight",
                windowsVirtualKeyCode=39,
            )
        assert browser.run("player.time") == pytest.approx(before + 0.01), id_
        for kind in ("keyDown", "keyUp"):
            browser.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=" ",
                code="Space",
                text=" ",
                windowsVirtualKeyCode=32,
            )
        assert browser.run("player.playing") != playing, id_
        browser.run("player.pause()")
    assert not browser.run("player.following || $('ghosts').checked")  # the clicks acted


@pytest.mark.parametrize(("width", "height"), [(390, 844), (600, 1000)])
def test_on_a_phone_the_robot_is_whole_and_the_options_are_in_a_drawer(
    page: str, sized: Eye, width: int, height: int
) -> None:
    browser = sized
    size(browser, width, height)
    browser.open(f"{page}#t=0.3")
    low, high = browser.run(
        "(() => { player.viewer.scene.updateMatrixWorld(true); const all = []; "
        "player.figures.forEach(({parts}) => parts.forEach(({mesh}) => { const p = "
        "mesh.geometry.attributes.position; for (let i = 0; i < p.count; i += 7) { const v = new "
        "THREE.Vector3().fromBufferAttribute(p, i).applyMatrix4(mesh.matrixWorld)"
        ".project(player.viewer.camera); all.push([v.x, v.y]); } })); return "
        "[Math.min(...all.map((v) => v[0])), Math.max(...all.map((v) => v[0]))]; })()"
    )
    assert -1.0 < low < high < 1.0
    assert browser.run("$('side').getClientRects().length") == 0
    browser.run("$('drawer').click()")
    assert browser.run("$('side').getClientRects().length") == 1
    assert browser.run("$('drawer').getAttribute('aria-expanded')") == "true"
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.run("$('clock').getClientRects()[0].height") < 30  # one line


def test_absent_forces_are_said_and_canvases_have_roles_and_labels(page: str, browser: Eye) -> None:
    browser.open(f"{page}#t=0.1&beside it=other")
    browser.wait("player.film.tracks.length === 3")
    assert "no forces and cones for other" in browser.run("$('tracks').textContent")
    canvases = "[...document.querySelectorAll('body canvas')]"
    missing = f"{canvases}.filter((canvas) => !canvas.closest('[aria-label]'))"
    assert browser.run(f"{missing}.length") == 0
    assert browser.run("$('state').getAttribute('role')") == "status"
    color = browser.run("getComputedStyle($('tracks').querySelector('i')).backgroundColor")
    assert color == "rgb(0, 115, 178)"  # the accent, in the legend too


def test_a_page_comes_back_with_its_server_as_it_was(menu: Menu, browser: Eye) -> None:
    with LiveServer(menu) as server:
        port = server.hosts.port
        browser.open(f"{server.url}#world=hill&t=0.7")
        browser.wait("player.film.slope > 0")
    browser.wait("$('state').textContent.includes('has ended')")
    choose(browser, "world", "flat")
    assert browser.run(CHOICE)[0] == "hill"  # what is shown, not what could not be loaded
    time.sleep(2.5)  # longer than one attempt
    browser.run("window.before = true")
    with LiveServer(menu, port=port):
        browser.wait("window.before === undefined && typeof player === 'object' && player.ready")
        assert browser.run("[$('option-world').value, player.time]") == ["hill", 0.7]
    browser.errors.clear()
