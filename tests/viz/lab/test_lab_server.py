"""The page of a live session answers to those who know it, and its controls change the physics."""

from __future__ import annotations

import asyncio
import concurrent.futures
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from pronk_pin.compare import Experiment, Results
from pronk_pin.control import TorqueLibrary
from pronk_pin.errors import InvalidInput
from pronk_pin.storage import temporary_folder
from pronk_pin.viz import LabServer, live_lab
from pronk_pin.viz.lab.lab_messages import LONGEST, Push, SetSpeed, read_message
from pronk_pin.viz.player import Browser

if TYPE_CHECKING:
    from conftest import Eye


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[LabServer]:
    """Two robots at twice the speed of the wall's clock."""
    experiment = Experiment(controllers=("model", "ilc"))
    with live_lab(experiment, rate=2.0, folder=tmp_path / "drive") as server:
        yield server


def wait_for(condition: Callable[[], object], seconds: float = 40.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it never came to that"
        time.sleep(0.02)


def request(lab: LabServer, path: str, *, origin: str = "", token: str = "") -> HTTPRequest:
    """A request for a connection, by default as the page itself makes it."""
    token = token or lab.address.partition("token=")[2]
    url = f"{lab.url.replace('http', 'ws')}{path}?token={token}"
    return HTTPRequest(url, headers={"Origin": origin or lab.url.rstrip("/")})


class Page:
    """A page's connection, without the page."""

    def __init__(self, socket: WebSocketClientConnection) -> None:
        self._socket = socket

    async def hears(self, name: str) -> Any:
        """The next message with a field of this name."""
        while True:
            data = await asyncio.wait_for(self._socket.read_message(), 30.0)
            if data is None:
                raise ConnectionResetError
            message = json.loads(data)
            if name in message:
                return message[name]

    async def asks(self, message: str | bytes | dict[str, Any]) -> None:
        text = json.dumps(message) if isinstance(message, dict) else message
        await self._socket.write_message(text, binary=isinstance(text, bytes))

    def leaves(self) -> None:
        self._socket.close()


async def page(lab: LabServer) -> Page:
    return Page(await websocket_connect(request(lab, "lab")))


def status(url: str, **headers: str) -> int:
    try:
        return int(urllib.request.urlopen(urllib.request.Request(url, headers=headers)).status)
    except urllib.error.HTTPError as error:
        return error.code


def test_only_who_knows_the_token_the_host_and_the_page_is_answered(lab: LabServer) -> None:
    token = lab.address.partition("?")[2]
    assert status(lab.address) == 200
    for path in ("", "film", "skill?robot=0", "stream", "lab", "?token=guessed", "?token=%ff"):
        assert status(f"{lab.url}{path}") == 403, path
    assert status(f"{lab.url}lab?{token}") == 403, "who does not say which page it is of"
    assert status(lab.address, Host="evil.example") == 403
    assert status(lab.address, Origin="http://evil.example") == 403
    assert status(f"{lab.url}skill?robot=0&{token}") == 200
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(lab.url)
    assert token not in caught.value.read().decode(), "a refusal does not tell the token"

    async def connect(**kwargs: Any) -> int:
        try:
            await websocket_connect(request(lab, "lab", **kwargs))
        except HTTPClientError as error:
            return error.code
        return 101

    refused = [{"origin": "http://evil.example"}, {"origin": "null"}, {"token": "guessed"}]
    for kwargs in refused:
        assert asyncio.run(connect(**kwargs)) == 403, kwargs


WRONG = (
    *("", "{", "[]", "7", '"speed"', '{"do": "format"}', '{"speed": 0.1}', '{"do": "speed"}'),
    *('{"do": "speed", "speed": "fast"}', '{"do": "speed", "speed": 0.1, "robot": 1}'),
    *('{"do": "push", "impulse": [1, 2]}', '{"do": "push", "impulse": [1, 2, 3, 4]}'),
    *('{"do": "learning", "on": 1}', '{"do": "world", "values": [1]}', b'{"do": "step"}'),
)


@pytest.mark.parametrize("message", WRONG)
def test_a_message_that_is_none_is_refused(message: str | bytes) -> None:
    with pytest.raises(InvalidInput):
        read_message(message)


def test_a_message_is_read_with_its_types() -> None:
    assert read_message('{"do": "speed", "speed": 0.25}') == SetSpeed(0.25)
    assert read_message('{"do": "push", "impulse": [1, 0, 2.5]}') == Push((1.0, 0.0, 2.5))


def test_a_wrong_message_is_answered_and_one_that_is_too_long_ends_the_connection(
    lab: LabServer,
) -> None:
    async def talk() -> None:
        first = await page(lab)
        for message, reason in (
            ("{", "no message of this page"),
            ({"do": "speed", "speed": 1e9}, "outside"),
            ({"do": "world", "values": {"wind": 1.0}}, "unknown mismatch 'wind'"),
            ({"do": "controller", "robot": 0, "name": "ilc"}, "another robot has"),
            ({"do": "controller", "robot": 0, "name": "library=/etc/hosts"}, "unknown controller"),
            ({"do": "push", "robot": 9, "impulse": [1, 0, 0]}, "robot"),
            ({"do": "record", "on": False}, "nothing is recorded"),
        ):
            await first.asks(message)
            assert reason in await first.hears("refused")
        await first.asks("x" * (LONGEST + 1))
        with pytest.raises(ConnectionResetError):
            await first.hears("never")
        again = await page(lab)
        assert await again.hears("driving"), "who was left is no driver any more"

    asyncio.run(talk())
    assert lab.session.speed == 0.5


def test_one_page_drives_the_other_watches_until_that_one_is_gone(lab: LabServer) -> None:
    async def talk() -> None:
        first, second = await page(lab), await page(lab)
        assert await first.hears("driving") is True
        assert await second.hears("driving") is False
        await second.asks({"do": "speed", "speed": 0.1})
        assert "Another page drives" in await second.hears("refused")
        await first.asks({"do": "speed", "speed": 0.3})
        while (await second.hears("state"))["speed"] != 0.3:
            pass  # who watches is told
        first.leaves()
        assert await second.hears("driving") is True
        await second.asks({"do": "speed", "speed": 0.2})
        while (await second.hears("state"))["speed"] != 0.2:
            pass

    asyncio.run(talk())


def test_who_sends_too_much_is_told_to_wait(lab: LabServer) -> None:
    async def talk() -> None:
        first = await page(lab)
        for _ in range(200):
            await first.asks({"do": "pause", "paused": False})
        assert "messages a second" in await first.hears("refused")

    asyncio.run(talk())


def test_what_is_recorded_on_the_page_is_a_results_folder(lab: LabServer) -> None:
    async def talk() -> str:
        first = await page(lab)
        await first.asks({"do": "record", "on": True})
        assert "drive" in await first.hears("said")
        for _ in range(20):
            await first.hears("strides")
        await first.asks({"do": "record", "on": False})
        return str(await first.hears("said"))

    folder = Path(asyncio.run(talk()).rpartition(" ")[2])
    assert Results.load(folder).experiment.controller_names == ("model", "ilc")


def test_who_waits_for_a_file_at_the_next_touchdown_holds_up_neither_pushes_nor_the_end(
    lab: LabServer,
) -> None:
    wait_for(lambda: lab._strides[0])
    lab.session.clock.rate = 0.02  # the next touchdown comes in 15 s
    token = lab.address.partition("?")[2]
    with concurrent.futures.ThreadPoolExecutor(1) as other:
        file = other.submit(status, f"{lab.url}skill?robot=0&{token}")

        async def talk() -> None:
            first = await page(lab)
            await first.asks({"do": "record", "on": True})
            await first.hears("said")
            await first.asks({"do": "record", "on": False})
            began = time.monotonic()
            await first.asks({"do": "push", "impulse": [1, 0, 0]})
            await first.hears("state")
            while "push" not in [event.get("do") for event in lab._events]:
                await asyncio.sleep(0.01)
            assert time.monotonic() - began < 1.0

        asyncio.run(talk())
        assert not file.done()
        began = time.monotonic()
        lab.close()
        assert time.monotonic() - began < 3.0
        assert concurrent.futures.wait([file], 5.0).done, "its connection has ended, too"


def test_a_page_that_is_told_too_late_is_left_and_the_robots_go_on(lab: LabServer) -> None:
    async def stall() -> None:
        await page(lab)  # which reads nothing from here on
        frames = await websocket_connect(request(lab, "stream"))
        began = lab._strides[0][-1]["time"] if lab._strides[0] else 0.0
        time.sleep(3.0)  # nothing is read meanwhile
        assert lab._strides[0][-1]["time"] - began > 4.0
        frames.close()

    asyncio.run(stall())
    assert lab.session.clock.slipped < 0.5


# --- in the browser -------------------------------------------------------------------------------


def mean(browser: Browser, robot: int, name: str, count: int = 6) -> float:
    """Mean of a quantity of the last strides, as the page has been told."""
    kept = f"lab.strides[{robot}].slice(-{count}).map((s) => s.{name})"
    return float(np.mean(json.loads(browser.run(f"JSON.stringify({kept})"))))


def since(browser: Browser, robot: int, name: str, count: int) -> list[float]:
    """A quantity of the first strides that ended after what was done last."""
    browser.wait(
        f"lab.strides[{robot}].at(-1).time > lab.events.at(-1).time[{robot}] + 0.4 * {count}"
    )
    later = f"lab.strides[{robot}].filter((s) => s.time > lab.events.at(-1).time[{robot}])"
    kept = f"{later}.slice(0, {count}).map((s) => s.{name})"
    return [float(value) for value in json.loads(browser.run(f"JSON.stringify({kept})"))]


def strides_on(browser: Browser, count: int) -> None:
    """Wait for so many more strides."""
    browser.run("var then = lab.strides[1].at(-1)?.number ?? 0")
    browser.wait(f"lab.strides[1].at(-1)?.number >= then + {count}")


def click(browser: Browser, name: str) -> None:
    browser.run(f"document.getElementById('{name}').click()")


def slide(browser: Browser, name: str, value: float) -> None:
    browser.run(
        f"document.getElementById('{name}').value = {value};"
        f"document.getElementById('{name}').dispatchEvent(new Event('input'))"
    )


@pytest.mark.browser
def test_the_controls_of_the_page_change_the_physics(lab: LabServer, browser: Eye) -> None:
    browser.open(lab.address)
    browser.wait("lab.driving && lab.counts.frames > 5")
    strides_on(browser, 8)
    unaided = mean(browser, 1, "calf")
    click(browser, "learn")
    strides_on(browser, 16)
    learned = mean(browser, 1, "calf")
    assert learned < 0.4 * unaided
    assert learned < mean(browser, 0, "calf"), "practice beats the model"
    slide(browser, "knob-payload", 6.0)
    browser.wait("lab.state.world.payload === 6")
    loaded = max(since(browser, 1, "calf", 6))
    assert loaded > 1.8 * learned
    browser.wait("player.figures[1].nodes[1].children.some((part) => part.name === 'payload')")
    strides_on(browser, 20)
    assert mean(browser, 1, "calf") < 0.7 * loaded
    slide(browser, "speed", 0.2)
    strides_on(browser, 12)
    assert mean(browser, 1, "speed") == pytest.approx(0.2, abs=0.07)
    click(browser, "learn")
    browser.wait("!lab.state.robots[1].learning")
    click(browser, "forget")
    browser.wait("lab.events.at(-1).do === 'forget'")
    assert max(since(browser, 1, "calf", 6)) > 2.0 * learned
    assert browser.errors == []


@pytest.mark.browser
def test_a_push_and_a_dragged_trunk_show_an_arrow_and_move_the_robot(
    lab: LabServer, browser: Eye
) -> None:
    browser.open(lab.address)
    browser.wait("lab.driving")
    strides_on(browser, 12)
    slide(browser, "impulse", 25.0)
    steady = mean(browser, 0, "speed")
    click(browser, "push-back")
    browser.wait("lab.counts.arrows > 0")  # frames in which one was drawn
    browser.wait("!lab.pushArrows.get(0).visible")
    assert min(since(browser, 0, "speed", 4)) < steady - 0.05
    strides_on(browser, 10)
    click(browser, "pause")
    browser.wait("lab.state.paused")
    click(browser, "learn")
    browser.wait("lab.state.robots[1].learning")  # what was asked is shown, if it acts later
    # Where the first trunk is on the screen, and a drag from there.
    place = browser.run(
        "(() => { const p = player.figures[0].nodes[1].getWorldPosition(new THREE.Vector3())"
        ".project(player.viewer.camera), box = $('pane').getBoundingClientRect();"
        "return [box.left + (p.x + 1) / 2 * box.width, box.top + (1 - p.y) / 2 * box.height]; })()"
    )
    mouse = {"button": "left", "buttons": 1, "clickCount": 1}
    for kind, x in (("mousePressed", 0), ("mouseMoved", 60), ("mouseMoved", 120)):
        at = {"type": kind, "x": place[0] + x, "y": place[1]}
        browser.call("Input.dispatchMouseEvent", **at, **mouse)
    impulse = browser.run("lab.drag.impulse")
    assert browser.run("lab.drag.robot") == 0
    browser.wait("lab.pushArrows.get(0).visible")
    assert impulse[0] > 1.0
    assert impulse[1] == 0.0
    at = {"type": "mouseReleased", "x": place[0] + 120, "y": place[1]}
    browser.call("Input.dispatchMouseEvent", **at, **mouse)
    browser.wait("lab.events.some((event) => event.do === 'push' && event.robot === 0)")
    assert browser.errors == []


@pytest.mark.browser
def test_a_browser_that_is_killed_and_opened_again_drives_on(lab: LabServer) -> None:
    with Browser(640, 480) as first:
        first.open(lab.address)
        first.wait("lab.driving && lab.strides[0].length > 2")
        first._process.kill()
        first._process.wait()
    with Browser(640, 480) as second:
        second.open(lab.address)
        second.wait("lab.driving && lab.strides[0].length > 3")  # those before it came, too
        click(second, "learn")
        wait_for(lambda: lab.session.robots[1].learning)


@pytest.mark.browser
def test_a_skill_is_saved_and_loaded_as_a_file(lab: LabServer, browser: Eye) -> None:
    browser.open(lab.address)
    browser.wait("lab.driving")
    click(browser, "learn")
    strides_on(browser, 12)
    token = lab.address.partition("?")[2]
    data = urllib.request.urlopen(f"{lab.url}skill?robot=1&{token}").read()
    with temporary_folder() as folder:
        (folder / "skill.npz").write_bytes(data)
        skill = TorqueLibrary.load(folder / "skill.npz")
    assert np.abs(skill.torque).max() > 1.0
    click(browser, "reset")
    browser.wait("lab.strides[1].length < 3")
    sent = browser.run(
        "fetch(lab.url('skill', {robot: 1})).then((a) => a.blob()).then((body) =>"
        "fetch(lab.url('skill', {robot: 1}), {method: 'POST', body})).then((a) => a.status)"
    )
    assert sent == 200
    wrong = browser.run(
        "fetch(lab.url('skill', {robot: 1}), {method: 'POST', body: 'no skill'})"
        ".then((a) => a.text())"
    )
    assert "torque library" in wrong
    assert "/" not in wrong, "no path of this machine"
    post = urllib.request.Request(f"{lab.url}skill?robot=1&{token}", data=data, method="POST")
    with pytest.raises(urllib.error.HTTPError):
        urllib.request.urlopen(post)


def test_ctrl_c_leaves_nothing() -> None:
    code = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"
    code += "from pronk_pin.cli import main; print('code', main(['play', '--no-open']))"
    child = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    line = child.stdout.readline()
    found = re.search(r"http://127\.0\.0\.1:(\d+)/\?token=\S+", line)
    assert found, line
    assert status(found[0]) == 200
    time.sleep(1.0)
    os.kill(child.pid, signal.SIGINT)
    said, trouble = child.communicate(timeout=20)
    assert "code 0" in said
    assert trouble == ""
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(found[0])


def test_a_closed_page_leaves_no_thread(lab: LabServer) -> None:
    def ours() -> list[str]:
        names = (thread.name for thread in threading.enumerate())
        return [name for name in names if name.startswith("pronk_pin")]

    assert len(ours()) >= 4
    assert lab.address in lab._repr_html_()
    lab.close()
    assert ours() == []
    lab.close()
