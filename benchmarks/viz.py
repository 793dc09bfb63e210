"""What looking costs: `python benchmarks/viz.py`.

The stream of `display` with two robots and contact forces, as a page receives it, beside the plain
`MeshcatVisualizer.display` loop with one robot; the size of a file with such a scene of 5 s, and
how long a browser takes from opening it to the first frame drawn, in software rendering. With a
results folder, `python benchmarks/viz.py results/<folder>`: the same of its replay, and how many of
the choices it holds. `python benchmarks/viz.py play`: how near to real time three live robots are
with a page attached, and how long it takes from a push that is asked for to a frame that shows it.
"""

from __future__ import annotations

import asyncio
import statistics
import sys
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
from pinocchio.visualize import MeshcatVisualizer
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from pronk_pin import load_robot
from pronk_pin.compare import Results
from pronk_pin.errors import NoBrowser
from pronk_pin.gait import load_library
from pronk_pin.robot import Robot
from pronk_pin.viz import LabServer, LiveServer, Scene, gait_scene, live_lab, write_replay
from pronk_pin.viz.player import Browser
from pronk_pin.viz.scenes import result_menu

SECONDS = 3.0


def two_robots(robot: Robot) -> Scene:
    """Two gaits side by side, with forces, of at least five seconds."""
    gaits = [load_library(robot.name).at(speed) for speed in (0.3, 0.5)]
    first, second = (gait_scene(robot, gait, strides=14, friction=0.6).tracks[0] for gait in gaits)
    tracks = (first, replace(second.moved(y=0.55), name="beside"))
    return Scene(robot, tracks, title="Two robots", friction=0.6)


def stream_rates(scene: Scene) -> tuple[float, float]:
    """Instants displayed, and received by a page, for each second."""
    rows = scene.rows(scene.times(60.0))
    received = 0

    async def page(url: str) -> None:
        nonlocal received
        socket = await websocket_connect(f"{url.replace('http', 'ws')}stream")
        end = time.monotonic() + SECONDS
        while (left := end - time.monotonic()) > 0.0:
            try:
                await asyncio.wait_for(socket.read_message(), left)
            except asyncio.TimeoutError:
                break
            received += 1
        socket.close()

    with LiveServer(scene) as server:
        thread = threading.Thread(target=lambda: asyncio.run(page(server.url)))
        thread.start()
        while server.pages == 0:
            time.sleep(0.01)
        shown, begin = 0, time.monotonic()
        while thread.is_alive():
            k = shown % len(rows[0]["q"])
            server.display(
                *(row["q"][k] for row in rows),
                forces=[row["forces"][k] for row in rows],
                torque=[row["torque"][k] for row in rows],
            )
            shown += 1
        elapsed = time.monotonic() - begin
    return shown / elapsed, received / SECONDS


def meshcat_rate(robot: Robot, configurations: np.ndarray) -> float:
    """Displays for each second of Pinocchio's own visualizer, one robot and no forces."""
    visuals = pin.buildGeomFromUrdf(
        robot.model,
        str(robot.urdf_path),
        pin.GeometryType.VISUAL,
        package_dirs=[str(robot.package_dir)],
    )
    visualizer = MeshcatVisualizer(robot.model, None, visuals)
    visualizer.initViewer(open=False)
    try:
        visualizer.loadViewerModel()
        shown, begin = 0, time.monotonic()
        while time.monotonic() < begin + SECONDS:
            visualizer.display(configurations[shown % len(configurations)])
            shown += 1
        return shown / (time.monotonic() - begin)
    finally:
        visualizer.viewer.window.server_proc.terminate()


def ready_times(path: Path, count: int = 3) -> list[float]:
    """Times from opening a file to its first frame [s]."""
    found = []
    with Browser(800, 600) as browser:
        for _ in range(count):
            browser.call("Page.navigate", url="about:blank")
            begin = time.monotonic()
            browser.open(path.as_uri())
            found.append(time.monotonic() - begin)
    return found


def result_replay(folder: Path) -> None:
    """Size, choices and first frame of the replay of a result."""
    menu = result_menu(Results.load(folder))
    with tempfile.TemporaryDirectory() as place:
        begin = time.monotonic()
        path = write_replay(menu, Path(place) / "replay.html")
        made = time.monotonic() - begin
        with Browser(1280, 800) as browser:
            browser.open(path.as_uri())
            held = browser.run("player.source.held.length")
        ready = max(ready_times(path))
        print(f"replay                                        {path.stat().st_size / 1e6:8.2f} MB")
        print(f"choices in it                                 {held:8d}")
        print(f"written in                                    {made:8.1f} s")
        print(f"opened to first frame, longest of three       {ready:8.2f} s")


def pushed_latencies(lab: LabServer, count: int = 10) -> list[float]:
    """Times from asking for a push to the frame in which the trunk goes the other way [s]."""
    found = []

    async def page() -> None:
        token = lab.address.partition("?")[2]
        origin = {"Origin": lab.url.rstrip("/")}
        url = lab.url.replace("http", "ws")
        frames = await websocket_connect(HTTPRequest(f"{url}stream?{token}", headers=origin))
        asks = await websocket_connect(HTTPRequest(f"{url}lab?{token}", headers=origin))

        async def hear() -> None:
            while await asks.read_message() is not None:
                pass

        hearing = asyncio.create_task(hear())
        for _ in range(count):
            end = time.monotonic() + 3.0  # the push before is over
            while time.monotonic() < end:
                row = np.frombuffer(await frames.read_message(), "<f4")
            x, then = row[2], lab.session.clock.now
            began = time.monotonic()
            await asks.write_message('{"do": "push", "robot": 0, "impulse": [-30, 0, 0]}')
            while time.monotonic() < began + 2.0:
                row = np.frombuffer(await frames.read_message(), "<f4")
                now = lab.session.clock.now
                if (row[2] - x) < -0.2 * (now - then):  # it was going forward at 0.5 m/s
                    found.append(time.monotonic() - began)
                    break
                x, then = row[2], now
        hearing.cancel()
        frames.close()
        asks.close()

    asyncio.run(page())
    return found


def real_time_factor(lab: LabServer, seconds: float) -> tuple[float, float]:
    """Simulated time over the wall's, and frames sent a second."""
    clock, frames, began = lab.session.clock, lab.frames, time.monotonic()
    slipped = clock.slipped
    time.sleep(seconds)
    elapsed = time.monotonic() - began
    return 1.0 - (clock.slipped - slipped) / elapsed, (lab.frames - frames) / elapsed


def live_robots() -> None:
    """Three live robots: without a page, with one that reads, and in a browser."""
    with live_lab() as lab:
        time.sleep(2.0)
        alone, _ = real_time_factor(lab, 10.0)
        print(f"real-time factor, three robots, no page       {alone:8.3f}")
        latencies = pushed_latencies(lab)
        print(
            f"push to frame, median of {len(latencies)}                   "
            f"{1e3 * statistics.median(latencies):8.0f} ms"
        )
        print(f"push to frame, longest                        {1e3 * max(latencies):8.0f} ms")
        try:
            with Browser(1280, 800) as browser:
                browser.open(lab.address)
                browser.wait("lab.counts.frames > 5")
                with_page, rate = real_time_factor(lab, 20.0)
                drawn = browser.run("lab.counts.frames")
        except NoBrowser as error:
            print(f"in a browser: not measured, {error.reason}")
            return
        print(f"real-time factor, page in software rendering  {with_page:8.3f}")
        print(f"frames sent to it                             {rate:8.0f} /s, {drawn} drawn")


def main() -> None:
    """Measure, and print."""
    if sys.argv[1:] == ["play"]:
        live_robots()
        return
    if len(sys.argv) > 1:
        result_replay(Path(sys.argv[1]))
        return
    robot = load_robot("a1")
    scene = two_robots(robot)
    with tempfile.TemporaryDirectory() as folder:
        path = write_replay(scene, Path(folder) / "two.html")
        size = path.stat().st_size / 1e6
        print(f"file, {scene.duration:.1f} s of two robots with forces   {size:8.2f} MB")
        try:
            ready = statistics.median(ready_times(path))
            print(f"opened to first frame, software rendering     {ready:8.2f} s")
        except NoBrowser as error:
            print(f"opened to first frame: not measured, {error.reason}")
    shown, received = stream_rates(scene)
    print(f"display, two robots with forces               {shown:8.0f} /s")
    print(f"received by a page                            {received:8.0f} /s")
    plain = meshcat_rate(robot, scene.tracks[0].q)
    print(f"MeshcatVisualizer.display, one robot          {plain:8.0f} /s")


if __name__ == "__main__":
    main()
