"""What looking costs: `python benchmarks/viz.py`.

The stream of `display` with two robots and contact forces, as a page receives it, beside the plain
`MeshcatVisualizer.display` loop with one robot; the size of a file with such a scene of 5 s, and
how long a browser takes from opening it to the first frame drawn, in software rendering. With a
results folder, `python benchmarks/viz.py results/<folder>`: the same of its replay, and how many of
the choices it holds.
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
from tornado.websocket import websocket_connect

from pronk_pin import load_robot
from pronk_pin.compare import Results
from pronk_pin.errors import NoBrowser
from pronk_pin.gait import load_library
from pronk_pin.robot import Robot
from pronk_pin.viz import LiveServer, Scene, gait_scene, write_replay
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


def main() -> None:
    """Measure, and print."""
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
