"""A page of this process: a small web server of our own around MeshCat's viewer.

MeshCat's Python server listens on every network interface, is a process of its own that can be
left behind, and reads nothing from the page. Its viewer only needs a page and a websocket, and
tornado, which comes with MeshCat, gives both: on a thread of this process, which ends with it.

The page asks for the film of what it is to show, and plays it by the clock of its own machine:
each page is paused and scrubbed for itself, and is in real time however busy this process is. A
loop that has no film yet, because it is computing it, sends instants instead.

Requests that name another host than the page's, and pages of another origin, are refused; see
`hosts`.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import threading
import webbrowser
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from string import Template
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket
from tornado.httputil import HTTPServerRequest

from ..._checks import Interval, none_or, real, shown, text, whole
from ...errors import InvalidInput, PortUnavailable, PronkError
from ...robot import as_array, as_q
from ..scenes import CHANNELS, Menu, Scene
from .hosts import Hosts, url_of
from .page import page, player_source, script_json, viewer_source
from .scene_encoding import film_blob, robot_blob, row_bytes, stream_row

PORTS = range(7000, 7100)
"""Ports that are tried when none is asked for; MeshCat's own range."""

_START = """\
<script src="viewer.js"></script>
<script src="player.js"></script>
<script>
  const words = document.getElementById("state");
  async function fetchBytes(path) {
    const answer = await fetch(path).catch(() => { throw new Error("The program has ended."); });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.arrayBuffer();
  }
  let player;
  function listen() {
    const socket = new WebSocket(`$${location.protocol === "https:" ? "wss" : "ws"}://` +
                                 `$${location.host}$${location.pathname}stream`);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => player.stream(event.data);
    socket.onclose = () => {
      words.textContent = "The program behind this page has ended; it is looked for again.";
      const again = () => setTimeout(
        () => fetch("").then(() => location.reload()).catch(again), 1000);
      again();
    };
  }
  fetchBytes("robot").then((robot) => Player.start({
    robot, options: $options, first: $first,
    film: (choice) => fetchBytes("film?" + new URLSearchParams(choice)),
  })).then((started) => { player = started; listen(); })
    .catch((error) => { words.textContent = error.message; });
</script>
"""


SCRIPT = "text/javascript; charset=utf-8"
"""Kind of a script."""

Route: TypeAlias = tuple[str, type[tornado.web.RequestHandler], dict[str, Any]]
"""A path, who answers to it, and with what."""

DURATION = Interval(0, 1e6, "s", above=True)
"""For how long a page can be shown."""


def serve(
    shown: Scene | Menu,
    *,
    port: int | None = None,
    host: str = "127.0.0.1",
    open_browser: bool = True,
    duration: float | None = None,
) -> str:
    """Show a scene, or several to choose from, on a live page until Ctrl-C; its address is printed.

    Args:
        shown: What to show.
        port: Port of the page; without it a free one is found.
        host: Address to listen on; the default can be reached from this machine only. The page
            answers to this host, and to what else `hosts.Hosts` lists.
        open_browser: Open the page in the default browser.
        duration: End after this time [s] instead of waiting for Ctrl-C.

    Returns:
        The address that the page had.

    Raises:
        PortUnavailable: The port is in use or forbidden.
        InvalidInput: There is no such port.
    """
    duration = none_or(real, "duration", duration, DURATION)
    with LiveServer(shown, port=port, host=host) as server:
        ends = "Ctrl-C ends it" if duration is None else f"for {duration:g} s"
        with contextlib.suppress(KeyboardInterrupt):
            print(f"{server.scene.title or 'The scene'} is at {server.url} ({ends})", flush=True)
            if open_browser:
                webbrowser.open(server.url)
            threading.Event().wait(duration)
    return server.url


class LiveServer:
    """A page that is served from a thread, until `close` or the end of the process.

    Any number of pages may be open, and come and go. A context manager; in a notebook its value
    shows the page.

    Attributes:
        menu: What can be shown.
        scene: What is shown first, and what `display` moves.
        url: Address of the page.
        hosts: What it answers to.
    """

    def __init__(
        self, shown: Scene | Menu, *, port: int | None = None, host: str = "127.0.0.1"
    ) -> None:
        self.menu = Menu.of(shown)
        self.scene = self.menu.scene()
        self._robot = robot_blob(self.scene)
        self._sockets = _bind(host, port)
        self.hosts = Hosts.of(host, self._sockets)
        self.url = url_of(host, self.hosts.port)
        self._pages: set[_Stream] = set()
        self._last: bytes | None = None
        self._view = self.scene.view(np.array([self.scene.start]))[0]
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="pronk_pin films")
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="pronk_pin live page", daemon=True)
        self._thread.start()

    def __enter__(self) -> LiveServer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" style="width:100%;height:520px;border:0"></iframe>'

    def close(self) -> None:
        """End it; nothing is left behind. Once is enough, and again does no harm."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._worker.shutdown()

    @property
    def pages(self) -> int:
        """How many pages are open."""
        return len(self._pages)

    def display(self, *q: npt.ArrayLike, **channels: Sequence[npt.ArrayLike]) -> None:
        """Show an instant on all open pages, and return at once: for loops that make the motion.

        What comes while a page is still busy with the instant before is left out there, except
        the last.

        Args:
            q: A configuration for each track of the scene, each of shape (19,).
            channels: For each channel that a track has, values for each track that has it:
                `forces` [N], shape (4, 3), `error` [rad] and `torque` [N m], shape (12,).

        Raises:
            InvalidInput: A wrong number of configurations or channels, or a wrong shape.
        """
        robot, tracks = self.scene.robot, self.scene.tracks
        if len(q) != len(tracks):
            raise InvalidInput(f"{len(q)} configurations for {len(tracks)} tracks; give one each")
        rows: list[dict[str, npt.NDArray[np.float64]]] = []
        values_by_channel = {key: iter(values) for key, values in channels.items()}
        if unknown := set(values_by_channel) - set(CHANNELS):
            raise InvalidInput(f"no channel {', '.join(unknown)}; there are {', '.join(CHANNELS)}")
        for track, configuration in zip(tracks, q, strict=True):
            place = as_q(robot, configuration).reshape(1, -1)
            row = {"q": place, "feet": self.scene.appearance.feet(place).reshape(1, -1)}
            for key in track.channels:
                values = next(values_by_channel.get(key, iter(())), None)
                if values is None:
                    raise InvalidInput(f"track '{track.name}' shows {key}; give {key}=[...]")
                size = getattr(track, key).reshape(len(track.t), -1).shape[1]
                row[key] = as_array(key, np.ravel(values), size, ())[None]
            rows.append(row)
        leader = next(i for i, track in enumerate(tracks) if track is self.scene.leader)
        self._view += 0.1 * (rows[leader]["q"][0, :2] - self._view)
        self.send(row_bytes(self.scene, rows, self._view))

    def seek(self, time: float) -> None:
        """Have all open pages show an instant of the first scene [s], and stop there."""
        self.send(stream_row(self.scene, time))

    def send(self, row: bytes) -> None:
        """Hand an instant (see `row_bytes`) to the open pages, and return at once."""
        self._last = row
        self._loop.call_soon_threadsafe(self._broadcast, row)

    def _broadcast(self, row: bytes) -> None:
        for open_page in self._pages:
            open_page.offer(row)

    def _run(self) -> None:
        """The thread: serve until the loop is stopped, then leave nothing open."""
        asyncio.set_event_loop(self._loop)
        server = tornado.httpserver.HTTPServer(self._application())
        server.add_sockets(self._sockets)
        self._loop.run_forever()
        server.stop()
        for open_page in tuple(self._pages):
            open_page.close()
        self._loop.run_until_complete(server.close_all_connections())
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._loop.close()

    def _application(self) -> tornado.web.Application:
        return _Application(
            self, self.routes(), log_function=lambda handler: None, **self.settings()
        )

    def settings(self) -> dict[str, Any]:
        """Settings of tornado's."""
        return {}

    def start_script(self) -> str:
        """The `<script>` elements that start the page."""
        options = {name: list(values) for name, values in self.menu.options.items()}
        return Template(_START).substitute(
            options=script_json(options), first=script_json(dict(self.menu.first))
        )

    def routes(self) -> list[Route]:
        """What is served, and by whom."""
        html = page(self.scene.title, self.start_script())
        return [
            ("/", Bytes, text_as_bytes(html, "text/html; charset=utf-8")),
            ("/viewer.js", Bytes, text_as_bytes(viewer_source(), SCRIPT)),
            ("/player.js", Bytes, text_as_bytes(player_source(), SCRIPT)),
            ("/robot", Bytes, {"data": self._robot, "kind": "application/octet-stream"}),
            ("/film", _Film, {"server": self}),
            ("/stream", _Stream, {"pages": self._pages, "server": self}),
        ]

    def refuses(self, request: HTTPServerRequest) -> str:
        """Whom a request is refused to: another host, a page of another origin; empty for none."""
        arrived_at = _arrived_at(request)
        host, origin = (request.headers.get(name) for name in ("Host", "Origin"))
        if not self.hosts.answers(host, arrived_at=arrived_at):
            return f"the host {host!r}"
        if origin is not None and not self.hosts.trusts(origin, arrived_at=arrived_at):
            return f"pages of {origin!r}"
        return ""

    async def film(self, choice: dict[str, str]) -> bytes:
        """The film of a choice; films are made one after the other, aside from the pages."""

        def make() -> bytes:
            first = choice == dict(self.menu.first)
            return film_blob(self.scene if first else self.menu.scene(choice))

        return await asyncio.get_running_loop().run_in_executor(self._worker, make)


class _Application(tornado.web.Application):
    """Answers to the hosts of the page only, whatever is asked for."""

    def __init__(self, server: LiveServer, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self._server = server

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        """Who answers a request: for another host, or a page of another origin, the refusal."""
        refused = self._server.refuses(request)
        if not refused:
            return super().find_handler(request, **kwargs)
        return self.get_handler_delegate(
            request, _Refusal, {"refused": refused, "url": self._server.url}
        )


class _Refusal(tornado.web.RequestHandler):
    """Answers nothing but that it does not."""

    def initialize(self, refused: str, url: str) -> None:
        self._refused, self._url = refused, url

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(
            f"This page does not answer to {self._refused}. Open {self._url}, or give the name "
            "that it is to answer to with --host.\n"
        )


class Bytes(tornado.web.RequestHandler):
    """Answers with the same bytes each time."""

    def initialize(self, data: bytes, kind: str) -> None:
        self._data, self._kind = data, kind

    def get(self) -> None:
        self.set_header("Content-Type", self._kind)
        self.set_header("Cache-Control", "no-store")
        self.write(self._data)


class _Film(tornado.web.RequestHandler):
    """Answers with the film of a choice, or with what is wrong with it."""

    def initialize(self, server: LiveServer) -> None:
        self._server = server

    async def get(self) -> None:
        choice = {name: self.get_argument(name, "") for name in self.request.arguments}
        self.set_header("Cache-Control", "no-store")
        try:
            data = await self._server.film(choice)
        except PronkError as error:
            self.set_status(400)
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.write(str(error))
            return
        self.set_header("Content-Type", "application/octet-stream")
        self.write(data)


class _Stream(tornado.websocket.WebSocketHandler):
    """The connection to one open page; pages of other origins are refused."""

    def initialize(self, pages: set[_Stream], server: LiveServer) -> None:
        self._pages, self._server = pages, server
        self._waiting: bytes | None = None
        self._sending: asyncio.Task[None] | None = None

    def check_origin(self, origin: str) -> bool:
        """Whether a page of that origin may listen."""
        return self._server.hosts.trusts(origin, arrived_at=_arrived_at(self.request))

    def open(self, *args: str, **kwargs: str) -> None:
        self.set_nodelay(True)
        self._pages.add(self)
        if self._server._last is not None:
            self.offer(self._server._last)

    def on_message(self, message: str | bytes) -> None:
        """The page has nothing to say here."""

    def on_close(self) -> None:
        self._pages.discard(self)

    def offer(self, row: bytes) -> None:
        """Send an instant; while the page has not taken the one before, only the last one waits."""
        self._waiting = row
        if self._sending is None or self._sending.done():
            self._sending = asyncio.ensure_future(self._send())

    async def _send(self) -> None:
        with contextlib.suppress(tornado.websocket.WebSocketClosedError):
            while self._waiting is not None:
                row, self._waiting = self._waiting, None
                await self.write_message(row, binary=True)


def _arrived_at(request: HTTPServerRequest) -> str:
    """Address of this machine that a request has arrived at; empty once its page has gone."""
    stream = getattr(request.connection, "stream", None)
    try:
        return str(stream.socket.getsockname()[0]) if stream is not None else ""
    except (OSError, AttributeError):
        return ""


def text_as_bytes(text: str, kind: str) -> dict[str, Any]:
    """A text as `Bytes` serves it."""
    return {"data": text.encode(), "kind": kind}


def _no_host(host: str, error: Exception) -> InvalidInput:
    reason = getattr(error, "strerror", None) or error
    return InvalidInput(
        f"host={shown(host)} is no address of this machine ({reason}); give one, as 127.0.0.1"
    )


def known_port(port: int | None) -> int | None:
    """A port, or None for a free one.

    Raises:
        InvalidInput: There is no such port.
    """
    return none_or(whole, "port", port, Interval(0, 65535))


def _bind(host: str, port: int | None) -> list[socket.socket]:
    """Sockets that listen on the port asked for, or on the first free one."""
    port = known_port(port)
    if not text("host", host):
        raise InvalidInput("host is empty; give an address of this machine, as 127.0.0.1")
    ports = PORTS if port is None else range(port, port + 1)
    for candidate in ports:
        try:
            return tornado.netutil.bind_sockets(candidate, address=host)
        except (socket.gaierror, UnicodeError) as error:
            raise _no_host(host, error) from error
        except OSError as error:
            if error.errno == errno.EADDRNOTAVAIL:
                raise _no_host(host, error) from error
            reason = error.strerror or str(error)
    raise PortUnavailable(host, ports, reason)
