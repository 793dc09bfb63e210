"""A scene on a live page: a small web server of our own around MeshCat's viewer.

MeshCat's Python server listens on every network interface, is a process of its own that can be
left behind, and reads nothing from the page. Its viewer only needs a page and a websocket, and
tornado, which comes with MeshCat, gives both: on a thread of this process, which ends with it.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
import webbrowser
from collections.abc import Sequence
from types import TracebackType

import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket

from ..errors import InvalidInput, PortUnavailable
from . import drawing
from .scene import Scene

PORTS = range(7000, 7100)
"""Ports that are tried when none is asked for; MeshCat's own range."""

RATE = 60.0
"""Frames sent per second [1/s]."""

_START = """\
<script src="viewer.js"></script>
<script>
  const viewer = createViewer();
  viewer.connect(`ws://${location.host}/stream`);
  viewer.connection.onclose = () => {
    document.getElementById("state").textContent = "The program behind this page has ended.";
  };
</script>
"""


def serve(
    scene: Scene,
    *,
    port: int | None = None,
    host: str = "127.0.0.1",
    open_browser: bool = True,
    duration: float | None = None,
) -> str:
    """Play a scene on a live page, over and over, until Ctrl-C; its address is printed.

    The page keeps to the wall clock: what comes too late is left out, nothing is slowed down.

    Args:
        scene: What to show.
        port: Port of the page; without it a free one is found.
        host: Address to listen on; the default can be reached from this machine only.
        open_browser: Open the page in the default browser.
        duration: End after this time [s] instead of waiting for Ctrl-C.

    Returns:
        The address that the page had.

    Raises:
        PortUnavailable: The port is in use or forbidden.
        InvalidInput: There is no such port.
    """
    with LiveServer(scene, port=port, host=host) as server:
        ends = "Ctrl-C ends it" if duration is None else f"for {duration:g} s"
        with contextlib.suppress(KeyboardInterrupt):
            print(f"{scene.title or 'Scene'} plays at {server.url} ({ends})", flush=True)
            if open_browser:
                webbrowser.open(server.url)
            server.play(duration)
    return server.url


class LiveServer:
    """The page of a scene, served from a thread; a context manager.

    Any number of pages may be open, and come and go.

    Attributes:
        scene: What is shown.
        url: Address of the page.
    """

    def __init__(self, scene: Scene, *, port: int | None = None, host: str = "127.0.0.1") -> None:
        self.scene = scene
        self._setup = drawing.setup_messages(scene)
        self._sockets = _bind(host, port)
        self.url = f"http://{host}:{self._sockets[0].getsockname()[1]}/"
        self._pages: set[_Stream] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="pronk_pin live page", daemon=True)

    def __enter__(self) -> LiveServer:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    @property
    def pages(self) -> int:
        """How many pages are open."""
        return len(self._pages)

    def play(self, duration: float | None = None) -> None:
        """Play the scene over and over, for a time [s] or for ever, at the rate of the wall clock.

        The open pages get the frame that is due now; a page that is still busy with an earlier one
        goes without.
        """
        times = self.scene.times(RATE)
        frames: dict[int, list[bytes]] = {}
        begin = time.monotonic()
        tick = 0
        while duration is None or tick < duration * RATE:
            k = tick % len(times)
            if self._pages:
                if k not in frames:
                    frames[k] = drawing.frame_messages(self.scene, float(times[k]))
                self.send(frames[k])
            elapsed = time.monotonic() - begin
            tick = max(int(elapsed * RATE), tick) + 1
            time.sleep(tick / RATE - elapsed)

    def send(self, messages: Sequence[bytes]) -> None:
        """Hand messages (see `drawing`) to the open pages, and return at once."""
        self._loop.call_soon_threadsafe(self._broadcast, messages)

    def _broadcast(self, messages: Sequence[bytes]) -> None:
        for page in self._pages:
            page.offer(messages)

    def _run(self) -> None:
        """The thread: serve until the loop is stopped, then leave nothing open."""
        asyncio.set_event_loop(self._loop)
        server = tornado.httpserver.HTTPServer(self._application())
        server.add_sockets(self._sockets)
        self._loop.run_forever()
        server.stop()
        for page in tuple(self._pages):
            page.close()
        self._loop.run_until_complete(server.close_all_connections())
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    def _application(self) -> tornado.web.Application:
        viewer = {"text": drawing.viewer_source(), "kind": "text/javascript"}
        return tornado.web.Application(
            [
                ("/", _Text, {"text": drawing.page(self.scene, _START), "kind": "text/html"}),
                ("/viewer.js", _Text, viewer),
                ("/stream", _Stream, {"pages": self._pages, "setup": self._setup}),
            ],
            log_function=lambda handler: None,
        )


class _Text(tornado.web.RequestHandler):
    """Answers with one text."""

    def initialize(self, text: str, kind: str) -> None:
        self._text, self._kind = text, kind

    def get(self) -> None:
        self.set_header("Content-Type", f"{self._kind}; charset=utf-8")
        self.set_header("Cache-Control", "no-store")
        self.write(self._text)


class _Stream(tornado.websocket.WebSocketHandler):
    """The connection to one open page; tornado refuses pages of other origins."""

    def initialize(self, pages: set[_Stream], setup: Sequence[bytes]) -> None:
        self._pages, self._setup = pages, setup
        self._sending: asyncio.Task[None] | None = None

    def open(self, *args: str, **kwargs: str) -> None:
        self.set_nodelay(True)
        self.offer(self._setup)
        self._pages.add(self)

    def on_message(self, message: str | bytes) -> None:
        """The viewer has nothing to say."""

    def on_close(self) -> None:
        self._pages.discard(self)

    def offer(self, messages: Sequence[bytes]) -> None:
        """Send messages, unless the page has not yet taken the previous ones."""
        if self._sending is None or self._sending.done():
            self._sending = asyncio.ensure_future(self._send(messages))

    async def _send(self, messages: Sequence[bytes]) -> None:
        with contextlib.suppress(tornado.websocket.WebSocketClosedError):
            for message in messages:
                await self.write_message(message, binary=True)


def _bind(host: str, port: int | None) -> list[socket.socket]:
    """Sockets that listen on the port asked for, or on the first free one."""
    if port is not None and not 0 <= port <= 65535:
        raise InvalidInput(f"a port is a number from 0 to 65535, not {port}")
    ports = PORTS if port is None else range(port, port + 1)
    for candidate in ports:
        try:
            return tornado.netutil.bind_sockets(candidate, address=host)
        except OSError as error:
            reason = error.strerror or str(error)
    raise PortUnavailable(host, ports, reason)
