"""The live page is served to this machine, in real time, and leaves nothing behind."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import urlparse

import numpy as np
import pytest
import umsgpack
from tornado.websocket import websocket_connect

from pronk_pin.errors import InvalidInput, PortUnavailable, PronkError
from pronk_pin.viz import Scene, drawing, live, serve
from pronk_pin.viz.live import LiveServer

if TYPE_CHECKING:
    from conftest import Browser

PROGRAM = """
import signal, numpy as np
from pronk_pin import load_robot
from pronk_pin.viz import Scene, Track, serve
signal.signal(signal.SIGINT, signal.default_int_handler)
robot = load_robot()
track = Track("robot", np.zeros(1), robot.standing[None])
serve(Scene(robot, (track,)), open_browser=False)
print("ended")
"""


def port_of(url: str) -> int:
    port = urlparse(url).port
    assert port is not None
    return port


def listens(host: str, port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex((host, port)) == 0


def listen(url: str, seconds: float) -> list[dict[str, Any]]:
    """What a page receives in that time [s]."""

    async def receive() -> list[dict[str, Any]]:
        page = await websocket_connect(f"{url.replace('http', 'ws')}stream")
        received, end = [], time.monotonic() + seconds
        while time.monotonic() < end:
            message = await page.read_message()
            if not isinstance(message, bytes):
                break
            received.append(message)
        page.close()
        return [umsgpack.unpackb(message) for message in received]

    return asyncio.run(receive())


def playing(server: LiveServer, duration: float) -> threading.Thread:
    thread = threading.Thread(target=server.play, args=(duration,))
    thread.start()
    return thread


def test_a_page_gets_the_robots_and_then_their_motion(scene: Scene) -> None:
    with LiveServer(scene) as server:
        thread = playing(server, 1.0)
        received = listen(server.url, 0.8)
        thread.join()
    sent = [message["path"] for message in received if message["type"] == "set_object"]
    paths = [path for path, _ in scene.transforms(0.0)]
    assert set(sent) == {f"/meshcat/{path}" for path in paths} | {"/meshcat/sun"}
    frames = sum(
        message["type"] == "set_transform" and message["path"] == "/meshcat/robot/trunk_0"
        for message in received
    )
    assert frames > 20


def test_the_page_and_the_viewer_come_from_the_server(scene: Scene) -> None:
    with LiveServer(scene) as server:
        page = urllib.request.urlopen(server.url, timeout=10).read().decode()
        viewer = urllib.request.urlopen(f"{server.url}viewer.js", timeout=10).read().decode()
    assert "<h1>Hop</h1>" in page
    assert "MeshCat" in viewer


def test_only_this_machine_can_reach_it(scene: Scene) -> None:
    with LiveServer(scene) as server:
        assert listens("127.0.0.1", port_of(server.url))
        # A server on all interfaces would answer on the whole of 127.0.0.0/8.
        assert not listens("127.0.0.2", port_of(server.url))


def test_a_port_in_use_is_refused_with_a_remedy(scene: Scene) -> None:
    with LiveServer(scene) as first:
        port = port_of(first.url)
        with pytest.raises(PortUnavailable, match=f"port {port} .*--port") as caught:
            serve(scene, port=port, open_browser=False, duration=0.1)
        assert isinstance(caught.value, PronkError)
        with LiveServer(scene) as second:
            assert port_of(second.url) != port


def test_a_port_that_does_not_exist_is_refused(scene: Scene) -> None:
    with pytest.raises(InvalidInput, match="from 0 to 65535, not 70000"):
        serve(scene, port=70000, open_browser=False)


def test_serve_ends_in_time_and_leaves_nothing_behind(
    scene: Scene, capsys: pytest.CaptureFixture[str]
) -> None:
    before = threading.active_count()
    url = serve(scene, open_browser=False, duration=0.2)
    assert url in capsys.readouterr().out
    assert not listens("127.0.0.1", port_of(url))
    assert threading.active_count() == before


def test_what_comes_too_late_is_left_out(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(scene: Scene, moment: float) -> list[bytes]:
        time.sleep(0.1)
        return original(scene, moment)

    with LiveServer(scene) as server:
        original = drawing.frame_messages
        monkeypatch.setattr(live.drawing, "frame_messages", slow)
        begin = time.monotonic()
        thread = playing(server, 1.0)
        listen(server.url, 0.7)
        thread.join()
    assert time.monotonic() - begin < 1.5


def test_ctrl_c_ends_it_cleanly() -> None:
    assert end_by(lambda process: process.send_signal(signal.SIGINT)) == "ended\n"


def test_a_killed_program_leaves_no_orphan() -> None:
    assert end_by(lambda process: process.kill()) == ""


def end_by(end: Callable[[subprocess.Popen[str]], None]) -> str:
    """What a serving program prints after it was ended; checks that all of it is gone."""
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    url = process.stdout.readline().split(" plays at ")[1].split()[0]
    assert listens("127.0.0.1", port_of(url))
    end(process)
    rest, _ = process.communicate(timeout=10)
    assert not listens("127.0.0.1", port_of(url))
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)  # nobody of its session is left
    return rest


@pytest.mark.browser
def test_the_page_shows_a_moving_robot_and_can_be_left_and_reopened(
    scene: Scene, browser: Browser
) -> None:
    with LiveServer(scene) as server:
        for _ in range(2):
            browser.open(server.url)
            pushing, flying = (look_at(server, browser, time) for time in (0.1, 0.3))
            assert np.sum(pushing[250:].max(axis=-1) < 60) > 1_000  # the dark calves
            assert np.sum(np.abs(pushing - flying).max(axis=-1) > 40) > 5_000
        assert server.pages == 1
    browser.wait("document.getElementById('state').textContent.includes('has ended')")
    assert browser.errors == []


def look_at(server: LiveServer, browser: Browser, time: float) -> np.ndarray:
    """The page once it shows a moment [s] of the scene."""
    ground = dict(server.scene.transforms(time))["ground"][0, 3]
    server.send(drawing.frame_messages(server.scene, time))
    position = "viewer.scene_tree.find(['meshcat', 'ground']).object.position.x"
    browser.wait(f"Math.abs({position} - {ground:.9f}) < 1e-5")
    return browser.look()
