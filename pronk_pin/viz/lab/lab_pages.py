"""What answers the pages of a live session: their connections, and the files of skills."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, cast

import msgspec
import tornado.web
import tornado.websocket

from ...errors import InvalidInput, PronkError

if TYPE_CHECKING:
    from .lab_server import LabServer

_MOST = 60
"""Messages a second that a page may send."""

_BEHIND = 400
"""Messages that wait for a page before it is left."""

_SKILL = 32_000_000
"""Largest file of a skill [bytes]."""


class Control(tornado.websocket.WebSocketHandler):
    """The connection over which a page asks, and is told what happens."""

    def initialize(self, server: LabServer) -> None:
        self._server = server
        self._waiting: deque[bytes] = deque()
        self._sending: asyncio.Task[None] | None = None
        self._second, self._count = 0, 0

    def check_origin(self, origin: str) -> bool:
        """Whether a page of that origin may ask; `LabServer.refuses` has looked already."""
        return not self._server.refuses(self.request)

    def open(self, *args: str, **kwargs: str) -> None:
        self.set_nodelay(True)
        self._server.join(self)
        hello = {**self._server.greeting(), "driving": self._server.drives(self)}
        self.tell(msgspec.json.encode(hello))

    def on_close(self) -> None:
        self._server.leave(self)

    async def on_message(self, message: str | bytes) -> None:
        """Do what the page asks, if it is the one that drives."""
        second = int(time.monotonic())
        self._count = self._count + 1 if second == self._second else 1
        self._second = second
        if not self._server.drives(self):
            answer = {"refused": "Another page drives; this one watches until that one is closed."}
        elif self._count > _MOST:
            answer = {"refused": f"More than {_MOST} messages a second; wait a little."}
        else:
            answer = await self._server.ask(message)
        if answer:
            self.tell(msgspec.json.encode(answer))

    def tell(self, data: bytes) -> None:
        """Send a message after those that wait; a page that takes none is left."""
        self._waiting.append(data)
        if len(self._waiting) > _BEHIND:
            self._waiting.clear()
            self.close()
        elif self._sending is None or self._sending.done():
            self._sending = asyncio.ensure_future(self._send())

    async def _send(self) -> None:
        with contextlib.suppress(tornado.websocket.WebSocketClosedError):
            while self._waiting:
                await self.write_message(self._waiting.popleft().decode())


class Skill(tornado.web.RequestHandler):
    """Answers with a robot's skill as a file, and takes one."""

    def initialize(self, server: LabServer) -> None:
        self._server = server

    async def get(self) -> None:
        """Its file."""
        data = await self._aside(lambda: self._server.save_skill(self._robot()))
        if data is not None:
            self.set_header("Content-Type", "application/octet-stream")
            self.set_header("Content-Disposition", 'attachment; filename="skill.npz"')
            self.set_header("Cache-Control", "no-store")
            self.write(cast("bytes", data))

    async def post(self) -> None:
        """Take one, if a page of ours sends it."""
        if "Origin" not in self.request.headers or len(self.request.body) > _SKILL:
            self.set_status(403)
            return
        body = self.request.body
        await self._aside(lambda: self._server.load_skill(self._robot(), body))

    def _robot(self) -> int:
        try:
            return int(self.get_query_argument("robot", "0"))
        except ValueError:
            raise InvalidInput("robot is no number; load the page again") from None

    async def _aside(self, do: Callable[[], object]) -> object:
        """Do something aside from the pages; what is wrong is told."""
        loop, worker = asyncio.get_running_loop(), self._server._worker
        try:
            return await loop.run_in_executor(worker, do)
        except PronkError as error:
            self.set_status(400)
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.write(str(error))
            return None
