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
import urllib.error
import urllib.request
from collections.abc import Callable
from typing import TYPE_CHECKING
from urllib.parse import urlparse

import numpy as np
import pytest
from tornado.websocket import websocket_connect

from pronk_pin.errors import InvalidInput, PortUnavailable, PronkError
from pronk_pin.viz import Menu, Scene, Track, serve
from pronk_pin.viz.player.browser import Browser
from pronk_pin.viz.player.hosts import Hosts
from pronk_pin.viz.player.live import LiveServer
from pronk_pin.viz.player.scene_encoding import film_blob, robot_blob

if TYPE_CHECKING:
    from conftest import Eye

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


def listen(url: str, seconds: float) -> list[np.ndarray]:
    """What a page receives in that time [s]."""

    async def receive() -> list[np.ndarray]:
        page = await websocket_connect(f"{url.replace('http', 'ws')}stream")
        received, end = [], time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            try:
                message = await asyncio.wait_for(page.read_message(), left)
            except asyncio.TimeoutError:
                break
            if not isinstance(message, bytes):
                break
            received.append(np.frombuffer(message, "<f4"))
        page.close()
        return received

    return asyncio.run(receive())


def get(url: str) -> bytes:
    return bytes(urllib.request.urlopen(url, timeout=20).read())


def test_a_page_gets_each_instant_that_a_loop_displays(scene: Scene) -> None:
    robot, hop = scene.robot, scene.tracks[0]
    posture = Scene(robot, (Track("robot", np.zeros(1), hop.q[:1]),))
    with LiveServer(posture) as server:
        stop = threading.Event()

        def loop() -> None:
            k = 0
            while not stop.wait(0.01):
                server.display(hop.q[k := (k + 1) % 100])

        thread = threading.Thread(target=loop)
        thread.start()
        received = listen(server.url, 1.0)
        stop.set()
        thread.join()
    assert len(received) > 30
    shown = np.stack(received)[:, 2:21]
    distances = np.abs(shown[:, None] - hop.q[None, :100].astype("<f4")).max(axis=-1).min(axis=1)
    assert distances.max() < 1e-6


def test_a_page_that_comes_late_gets_the_last_instant(scene: Scene) -> None:
    with LiveServer(scene) as server:
        server.seek(0.3)
        (row,) = listen(server.url, 0.5)
    np.testing.assert_allclose(row[2:21], scene.tracks[0].at(np.array([0.3]))["q"][0], atol=1e-6)


def test_the_page_its_parts_and_its_films_come_from_the_server(scene: Scene) -> None:
    with LiveServer(scene) as server:
        page = get(server.url).decode()
        assert "MeshCat" in get(f"{server.url}viewer.js").decode()
        assert "class Player" in get(f"{server.url}player.js").decode()
        assert get(f"{server.url}robot") == robot_blob(scene)
        assert get(f"{server.url}film") == film_blob(scene)
    assert "<title>Hop</title>" in page


def test_a_choice_that_does_not_exist_is_told(scene: Scene) -> None:
    menu = Menu(lambda choice: scene, {"speed": ["1", "2"]}, {"speed": "1"})
    with LiveServer(menu) as server:
        assert get(f"{server.url}film?speed=2") == film_blob(scene)
        with pytest.raises(urllib.error.HTTPError) as caught:
            get(f"{server.url}film?speed=3")
    assert caught.value.code == 400
    assert "there is no speed 3; choose one of: 1, 2" in caught.value.read().decode()


def test_an_instant_must_fit_the_scene(scene: Scene) -> None:
    q = scene.robot.standing
    with LiveServer(scene) as server:
        with pytest.raises(InvalidInput, match="1 configurations for 2 tracks"):
            server.display(q)
        with pytest.raises(InvalidInput, match=r"track 'robot' shows forces; give forces=\[...\]"):
            server.display(q, q)
        with pytest.raises(InvalidInput, match="forces has shape"):
            server.display(q, q, forces=[np.zeros(5)])
        with pytest.raises(InvalidInput, match="no channel lift"):
            server.display(q, q, lift=[np.zeros(3)])


def test_only_this_machine_can_reach_it(scene: Scene) -> None:
    with LiveServer(scene) as server:
        assert listens("127.0.0.1", port_of(server.url))
        # A server on all interfaces would answer on the whole of 127.0.0.0/8.
        assert not listens("127.0.0.2", port_of(server.url))


PATHS = ("/", "/viewer.js", "/player.js", "/robot", "/film", "/stream", "/elsewhere")


def ask(address: str, port: int, head: str) -> str:
    """What a server answers to the lines of a request, byte for byte as they are given."""
    with socket.create_connection((address, port), timeout=20) as connection:
        connection.sendall(f"{head}\r\nConnection: close\r\n\r\n".encode())
        answer = b""
        while part := connection.recv(1 << 16):
            answer += part
    return answer.decode("utf-8", "replace")


def status(answer: str) -> int:
    return int(answer.split()[1])


def upgrade(origin: str, host: str) -> str:
    """A browser's request for the stream."""
    return (
        f"GET /stream HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nUpgrade: websocket\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="
    )


def handshake(address: str, port: int, origin: str, host: str) -> int:
    """Status of the answer to a browser's request for the stream."""
    with socket.create_connection((address, port), timeout=20) as connection:
        connection.sendall(f"{upgrade(origin, host)}\r\nConnection: Upgrade\r\n\r\n".encode())
        return status(connection.recv(1 << 12).decode("utf-8", "replace"))


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("host", ["rebound.example", "127.0.0.1.rebound.example", "127.0.0.2"])
def test_a_name_that_was_rebound_to_this_machine_reads_nothing(
    scene: Scene, path: str, host: str
) -> None:
    with LiveServer(scene) as server:
        port = port_of(server.url)
        answer = ask("127.0.0.1", port, f"GET {path} HTTP/1.1\r\nHost: {host}:{port}")
        posted = ask("127.0.0.1", port, f"POST {path} HTTP/1.1\r\nHost: {host}:{port}")
    assert status(answer) == status(posted) == 403
    assert f"does not answer to the host '{host}:{port}'. Open {server.url}" in answer
    assert "text/plain" in answer
    assert len(answer) < 1000


def test_this_machines_own_names_are_answered_at_the_right_port(scene: Scene) -> None:
    with LiveServer(scene) as server:
        port = port_of(server.url)

        def get_as(host: str) -> int:
            return status(ask("127.0.0.1", port, f"GET / HTTP/1.1\r\nHost: {host}"))

        for name in ("127.0.0.1", "localhost", "LOCALHOST", "localhost.", "[::1]"):
            assert get_as(f"{name}:{port}") == 200, name
            assert get_as(name) == 200, name
            assert get_as(f"{name}:{port + 1}") == 403, name
        for name in ("::1", "localhost:", "[localhost", "127.0.0.1:7000:7000", "a@localhost"):
            assert get_as(name) in (400, 403), name
        assert get_as(f"localhost:{port}\r\nHost: rebound.example:{port}") in (400, 403)
        assert status(ask("127.0.0.1", port, "GET / HTTP/1.0")) == 403  # names nobody


def test_the_stream_is_for_pages_of_the_same_hosts_only(scene: Scene) -> None:
    with LiveServer(scene) as server:
        port = port_of(server.url)
        own = f"127.0.0.1:{port}"
        for origin in (f"http://{own}", f"http://localhost:{port}", f"http://[::1]:{port}"):
            assert handshake("127.0.0.1", port, origin, own) == 101, origin
        for origin in (
            f"http://rebound.example:{port}",
            "http://localhost",  # another server of this machine
            f"http://localhost:{port + 1}",
            "null",
            "http://[",
        ):
            assert handshake("127.0.0.1", port, origin, own) == 403, origin
        rebound = f"rebound.example:{port}"
        assert handshake("127.0.0.1", port, f"http://{rebound}", rebound) == 403


def test_a_page_of_ipv6_has_an_address_that_can_be_opened(scene: Scene) -> None:
    try:
        server = LiveServer(scene, host="::1")
    except PortUnavailable:
        pytest.skip("this machine has no IPv6")
    with server:
        port = port_of(server.url)
        assert server.url == f"http://[::1]:{port}/"
        assert "MeshCat" in get(f"{server.url}viewer.js").decode()
        for host, code in (("[0:0:0:0:0:0:0:1]", 200), ("localhost", 200), ("[::2]", 403)):
            answer = ask("::1", port, f"GET / HTTP/1.1\r\nHost: {host}:{port}")
            assert status(answer) == code, host


def test_a_page_for_other_machines_answers_to_this_machines_names(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "Lab7")
    monkeypatch.setattr(socket, "getfqdn", lambda: "lab7.uni.example")
    with LiveServer(scene, host="0.0.0.0") as server:
        port = port_of(server.url)
        for host in ("lab7", "lab7.uni.example", "127.0.0.2", "localhost", "0.0.0.0"):
            answer = ask("127.0.0.2", port, f"GET / HTTP/1.1\r\nHost: {host}:{port}")
            assert status(answer) == 200, host
            assert handshake("127.0.0.2", port, f"http://{host}:{port}", f"{host}:{port}") == 101
        for host in ("rebound.example", "lab7.rebound.example", "127.0.0.3", "10.0.0.1"):
            answer = ask("127.0.0.2", port, f"GET / HTTP/1.1\r\nHost: {host}:{port}")
            assert status(answer) == 403, host
            origin = f"http://{host}:{port}"
            assert handshake("127.0.0.2", port, origin, f"127.0.0.2:{port}") == 403, host


def test_a_page_at_one_other_address_answers_to_that_and_the_machines_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(socket, "gethostname", lambda: "lab7")
    monkeypatch.setattr(socket, "getfqdn", lambda: "lab7.uni.example")

    class Listening:
        def getsockname(self) -> tuple[str, int]:
            return "192.168.1.5", 7000

    hosts = Hosts.of("robots.uni.example", [Listening()])  # type: ignore[list-item]
    for host in ("robots.uni.example", "192.168.1.5", "lab7", "lab7.uni.example"):
        assert hosts.answers(f"{host}:7000")
    for host in ("localhost", "127.0.0.1", "192.168.1.6", "rebound.example"):
        assert not hosts.answers(f"{host}:7000")


def test_a_port_in_use_is_refused_with_a_remedy(scene: Scene) -> None:
    with LiveServer(scene) as first:
        port = port_of(first.url)
        with pytest.raises(PortUnavailable, match=f"port {port} .*--port") as caught:
            serve(scene, port=port, open_browser=False, duration=0.1)
        assert isinstance(caught.value, PronkError)
        with LiveServer(scene) as second:
            assert port_of(second.url) != port


def test_a_port_that_does_not_exist_is_refused(scene: Scene) -> None:
    with pytest.raises(InvalidInput, match="port=70000; give a whole number from 0 to 65535"):
        serve(scene, port=70000, open_browser=False)


def test_serve_ends_in_time_and_leaves_nothing_behind(
    scene: Scene, capsys: pytest.CaptureFixture[str]
) -> None:
    before = threading.active_count()
    url = serve(scene, open_browser=False, duration=0.2)
    assert url in capsys.readouterr().out
    assert not listens("127.0.0.1", port_of(url))
    assert threading.active_count() == before


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
    url = process.stdout.readline().split(" is at ")[1].split()[0]
    assert listens("127.0.0.1", port_of(url))
    end(process)
    rest, _ = process.communicate(timeout=10)
    assert not listens("127.0.0.1", port_of(url))
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)  # nobody of its session is left
    return rest


@pytest.mark.browser
def test_the_page_shows_a_moving_robot_and_can_be_left_and_reopened(
    scene: Scene, browser: Eye
) -> None:
    with LiveServer(scene) as server:
        for _ in range(2):
            browser.open(server.url)
            browser.run("player.pause(); player.seek(0.1)")
            pushing = browser.scenery()
            browser.run("player.seek(0.3)")
            assert np.sum(pushing.max(axis=-1) < 60) > 300  # the dark calves
            assert np.sum(np.abs(pushing - browser.scenery()).max(axis=-1) > 40) > 5_000
        browser.wait("true")
        assert server.pages == 1
    browser.wait("document.getElementById('state').textContent.includes('has ended')")
    assert browser.errors == []


@pytest.mark.browser
def test_a_loop_moves_the_robot_on_the_page(scene: Scene, browser: Eye) -> None:
    hop = scene.tracks[0]
    posture = Scene(scene.robot, (Track("robot", np.zeros(1), hop.q[:1]),))
    with LiveServer(posture) as server:
        browser.open(server.url)
        for k in range(1, 60):
            server.display(hop.q[k])
            time.sleep(0.02)
        x = "player.figures[0].nodes[1].position.x"
        browser.wait(f"Math.abs({x} - {hop.q[59, 0]}) < 1e-5")
        assert browser.run("player.received") > 10
    assert browser.errors == []


@pytest.mark.browser
def test_two_pages_are_paused_and_scrubbed_each_for_itself(scene: Scene, browser: Eye) -> None:
    with LiveServer(scene) as server, Browser(400, 300) as second:
        browser.open(server.url)
        second.open(server.url)
        browser.run("player.pause(); player.seek(2.0)")
        second.run("player.seek(0.5)")
        assert server.pages == 2
        assert browser.run("[player.time, player.playing]") == [2.0, False]
        assert second.run("player.playing")
