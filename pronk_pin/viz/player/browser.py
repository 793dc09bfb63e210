"""A browser without a window that draws pages: Chromium or Chrome, over its DevTools protocol.

It hangs on a pipe of this process, so that it ends with it, however that ends. Its software
renderer needs no graphics card and no display.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

from ...errors import NoBrowser
from ...storage import temporary_folder

VARIABLE = "PRONK_PIN_BROWSER"
"""Environment variable that names the browser's program."""

_NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
)

_FLAGS = (
    *("--headless", "--remote-debugging-pipe", "--disable-gpu", "--hide-scrollbars"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--no-first-run", "--disable-background-networking", "--disable-component-update"),
    *("--disable-sync", "--disable-quic"),
)

_TIMEOUT = 60.0
"""Timeout of an answer [s]."""


def find_browser() -> str:
    """Path of the browser's program.

    Raises:
        NoBrowser: There is none.
    """
    named = os.environ.get(VARIABLE)
    for name in [named] if named else _NAMES:
        if program := shutil.which(name):
            return program
    raise NoBrowser(f"{VARIABLE}={named} is no program" if named else "none is installed")


class Browser:
    """A page in a browser without a window; a context manager.

    Attributes:
        errors: What the page reported on its console as errors.
    """

    def __init__(self, width: int = 800, height: int = 600) -> None:
        self._program = find_browser()
        self.errors: list[str] = []
        self._resources = contextlib.ExitStack()
        profile = self._resources.enter_context(temporary_folder())
        command = [self._program, *_FLAGS, f"--user-data-dir={profile}", "--no-startup-window"]
        command.insert(1, f"--window-size={width},{height}")
        if os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # which it refuses to have for root, in containers
        theirs_in, self._to = os.pipe()
        self._from, theirs_out = os.pipe()
        self._count, self._session, self._buffer = 0, "", b""
        self._log = self._resources.enter_context((profile / "log").open("wb+"))
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=self._log,
            start_new_session=True,  # Ctrl-C is ours to handle
            pass_fds=(3, 4),
            preexec_fn=lambda: _as_3_and_4(theirs_in, theirs_out),
        )
        os.close(theirs_in)
        os.close(theirs_out)
        try:
            self._attach()
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
            self.call("Emulation.setDeviceMetricsOverride", **size)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol; errors that the page reports are kept.

        Raises:
            NoBrowser: The browser has ended, or does not answer.
        """
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        try:
            os.write(self._to, json.dumps(message).encode() + b"\0")
        except OSError:
            raise self._gone() from None
        end = time.monotonic() + _TIMEOUT
        while True:
            answer = self._read(end, method)
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise NoBrowser(f"it refuses {method} ({answer['error'].get('message')})")
                return dict(answer.get("result", {}))
            params_received = answer.get("params", {})
            failed = params_received.get("entry", {}).get("level") == "error"
            if answer.get("method") == "Runtime.exceptionThrown" or failed:
                self.errors.append(json.dumps(params_received))

    def run(self, expression: str) -> Any:
        """Value of a JavaScript expression in the page; a promise is waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in answer:
            self.errors.append(json.dumps(answer["exceptionDetails"]))
        return answer["result"].get("value")

    def open(self, url: str) -> None:
        """Open an address of a page of ours, and wait until its player has drawn a frame."""
        # Through a blank page: an address that differs after the # only is not loaded again.
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=url)
        self.wait("typeof player !== 'undefined' && player && player.ready")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript condition holds.

        Raises:
            NoBrowser: It never does.
        """
        end = time.monotonic() + _TIMEOUT
        while not self.run(condition):
            if time.monotonic() > end:
                raise NoBrowser(f"its page never gets so far as '{condition}': {self.errors}")
            time.sleep(0.02)

    def screenshot(self) -> bytes:
        """Screenshot, as PNG."""
        # Two frames on, what was true before is drawn and composed.
        self.run("new Promise((f) => requestAnimationFrame(() => requestAnimationFrame(f)))")
        return base64.b64decode(self.call("Page.captureScreenshot")["data"])

    def close(self) -> None:
        """End the browser."""
        for end in (self._to, self._from):
            with contextlib.suppress(OSError):
                os.close(end)
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._resources.close()

    def _attach(self) -> None:
        """Speak with the page from here on."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def _read(self, end: float, method: str) -> dict[str, Any]:
        """The next message."""
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._from], [], [], max(end - time.monotonic(), 0.0))
            if not ready:
                raise NoBrowser(f"it does not answer to {method} within {_TIMEOUT:g} s")
            data = os.read(self._from, 1 << 20)
            if not data:
                raise self._gone()
            self._buffer += data
        text, self._buffer = self._buffer.split(b"\0", 1)
        message: dict[str, Any] = json.loads(text)
        return message

    def _gone(self) -> NoBrowser:
        """Last output of the browser."""
        self._log.seek(0)
        words = self._log.read().decode(errors="replace").strip().splitlines()
        return NoBrowser(f"{Path(self._program).name} ended ({' '.join(words[-2:])})")


def _as_3_and_4(reading: int, writing: int) -> None:
    """In the child: the numbers at which the browser expects its pipe."""
    high = os.dup(writing)
    while high < 5:
        high = os.dup(high)
    os.dup2(reading, 3)
    os.dup2(high, 4)
