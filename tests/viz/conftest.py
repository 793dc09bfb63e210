"""A hand-made motion, and a headless browser to look at it with."""

from __future__ import annotations

import asyncio
import base64
import io
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from tornado.websocket import WebSocketClientConnection, websocket_connect

from pronk_pin.robot import Robot, load_robot
from pronk_pin.viz import Scene, Track

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("chrome")

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=800,700",
    "--remote-debugging-port=0",
)


class Browser:
    """A headless Chromium, driven over its DevTools protocol."""

    def __init__(self, profile: Path) -> None:
        assert CHROMIUM is not None
        self._loop = asyncio.new_event_loop()
        command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        self._profile, self._count = profile, 0
        self._page = self._loop.run_until_complete(self._connect())
        self.errors: list[str] = []
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    async def _connect(self) -> WebSocketClientConnection:
        ready = self._profile / "DevToolsActivePort"
        for _ in range(300):
            if ready.is_file() and len(ready.read_text().split()) == 2:
                break
            await asyncio.sleep(0.1)
        port, path = ready.read_text().split()
        browser = await websocket_connect(f"ws://127.0.0.1:{port}{path}")
        await browser.write_message(json.dumps({"id": 0, "method": "Target.getTargets"}))
        answer = json.loads(str(await browser.read_message()))
        target = next(t for t in answer["result"]["targetInfos"] if t["type"] == "page")
        address = f"ws://127.0.0.1:{port}/devtools/page/{target['targetId']}"
        return await websocket_connect(address, max_message_size=1 << 26)

    async def _disconnect(self) -> None:
        self._page.close()

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol; errors that the page reports are kept."""
        return self._loop.run_until_complete(asyncio.wait_for(self._call(method, params), 60.0))

    async def _call(self, method: str, params: dict[str, Any]) -> dict[str, Any]:
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        await self._page.write_message(json.dumps(message))
        while True:
            answer = json.loads(str(await self._page.read_message()))
            if answer.get("id") == self._count:
                return answer.get("result", {})
            text = json.dumps(answer.get("params", {}))
            failed = answer["method"] == "Log.entryAdded" and '"level": "error"' in text
            if failed or answer["method"] == "Runtime.exceptionThrown":
                self.errors.append(text)

    def run(self, expression: str) -> Any:
        """Value of a JavaScript expression in the page; a promise is waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        return answer["result"].get("value")

    def open(self, url: str) -> None:
        """Open an address and wait until both robots have been drawn."""
        # Through a blank page: an address that differs after the # only is not loaded again.
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=url)
        self.wait("typeof viewer !== 'undefined' && viewer.renderer.info.render.triangles > 60000")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript condition holds; half a minute, for software draws slowly."""
        for _ in range(300):
            if self.run(condition):
                return
            time.sleep(0.1)
        raise AssertionError(f"never true in the page: {condition}; errors: {self.errors}")

    def look(self) -> np.ndarray:
        """What is on the screen, shape (height, width, 3), from 0 to 255."""
        # Two frames on, what was true before is drawn and composed.
        self.run("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
        png = base64.b64decode(self.call("Page.captureScreenshot")["data"])
        return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)

    def close(self) -> None:
        try:
            self._loop.run_until_complete(self._disconnect())
        finally:
            self._process.terminate()
            self._process.wait(timeout=20)
            self._loop.close()


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A headless browser for the whole session."""
    if CHROMIUM is None:
        pytest.skip("Chromium is not installed, so the page cannot be looked at")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def robot() -> Robot:
    """The A1."""
    return load_robot("a1")


@pytest.fixture(scope="session")
def hop(robot: Robot) -> Track:
    """A robot that hops on bent legs at 0.5 m/s for five seconds, pushing while it stands."""
    t = np.arange(0.0, 5.0, 0.01)
    phase = (t / 0.4) % 1.0
    bend = np.where(phase < 0.5, np.sin(2.0 * np.pi * phase), 0.0)
    air = np.where(phase >= 0.5, np.sin(2.0 * np.pi * (phase - 0.5)), 0.0)
    q = np.tile(robot.standing, (len(t), 1))
    q[:, 0] = 0.5 * t
    q[:, 2] += 0.06 * air - 0.05 * bend
    q[:, 8::3] += 0.2 * (bend + air)[:, None]
    q[:, 9::3] -= 0.4 * (bend + air)[:, None]
    forces = np.zeros((len(t), 4, 3))
    forces[:, :, 2] = 80.0 * bend[:, None]
    return Track("robot", t, q, forces=forces, caption="hops")


@pytest.fixture(scope="session")
def scene(robot: Robot, hop: Track) -> Scene:
    """The hopping robot and, a little behind it, its ghost."""
    q = hop.q.copy()
    q[:, 0] -= 0.1
    ghost = Track("reference", hop.t, q, ghost=True)
    return Scene(robot, (hop, ghost), title="Hop", caption="0.5 m/s <made by hand>")
