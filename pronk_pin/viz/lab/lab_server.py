"""The page of a live session: it shows the robots, and hands on what a page asks of them.

Who may look and ask is told a token, which stands in the address of the page. Requests without it,
of another host or of another origin are refused; so are messages that are none. One page drives,
the one that has been open the longest; the others watch. A page that cannot follow misses frames,
and is left at last; the robots never wait for it.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from string import Template
from typing import Any, TypeVar

import msgspec
from tornado.httputil import HTTPServerRequest

from ..._checks import path as known_path
from ..._checks import real
from ...compare.session import IMPULSE, LIVE_CONTROLLERS, RATES, LiveSession, LiveStride, Moment
from ...control import TorqueLibrary
from ...errors import InvalidInput, PronkError
from ...storage import read_bytes, temporary_folder, write_file
from ..figure_style import look
from ..player import SCRIPT, Bytes, LiveServer, Route, data_text, text_as_bytes
from .knobs import knobs_of
from .lab_messages import (
    LONGEST,
    Asked,
    Forget,
    Push,
    Record,
    Reset,
    SetController,
    SetLearning,
    SetWorld,
    obey,
    read_message,
)
from .lab_pages import Control, Skill
from .lab_scene import Treadmill, lab_scene

FPS = 50.0
"""Frames that are sent a second, to pages that can follow."""

KEPT = 300
"""Strides of each robot that a page which comes late is told."""

Outcome = TypeVar("Outcome")

_PING = 10.0
"""Time after which a page that says nothing is asked whether it is there [s]."""

_START = """\
<script src="viewer.js"></script>
<script src="player.js"></script>
<script src="lab.js"></script>
<script>Lab.start($settings);</script>
"""


class LabServer(LiveServer):
    """A page of a live session, which it runs until it is closed.

    Args:
        session: The session.
        port: Port of the page; without it a free one is found.
        host: Address to listen on.
        rate: Simulated seconds for each second of the wall's.
        folder: Makes the name of a folder to record to.

    Attributes:
        session: The session.
        address: The address of the page with its token.
    """

    def __init__(
        self,
        session: LiveSession,
        *,
        port: int | None = None,
        host: str = "127.0.0.1",
        rate: float = 1.0,
        folder: Callable[[], Path],
    ) -> None:
        rate = real("rate", rate, RATES)  # before anything is begun
        self.session, self._folder = session, folder
        self._token = secrets.token_urlsafe(16)
        self._pages_that_ask: list[Control] = []
        self._moments: list[Moment | None] = [None] * len(session.robots)
        self._strides: list[deque[dict[str, Any]]] = [deque(maxlen=KEPT) for _ in session.robots]
        self._events: deque[dict[str, Any]] = deque(maxlen=KEPT)
        self._knobs = knobs_of(session)
        self._treadmill = Treadmill(len(session.robots))
        self._began = time.monotonic()
        self.frames = 0
        self._waiter = ThreadPoolExecutor(1, thread_name_prefix="pronk_pin touchdowns")
        super().__init__(lab_scene(session), port=port, host=host)
        self.address = f"{self.url}?token={self._token}"
        self._ending = threading.Event()
        self._context = session.running(rate=rate)
        session.watch(on_moment=self._seen, on_stride=self._finished, on_trouble=self._broken)
        self._context.__enter__()
        self._showing = threading.Thread(target=self._show, name="pronk_pin frames", daemon=True)
        self._showing.start()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.address}" style="width:100%;height:720px;border:0"></iframe>'

    def close(self) -> None:
        """End the session and its page; nothing is left behind."""
        if not self._ending.is_set():
            self._ending.set()
            self._showing.join()
            self._context.__exit__(None, None, None)
            self._waiter.shutdown()
        super().close()

    # --- what the robots tell ----------------------------------------------------------------

    def _seen(self, robot: int, moment: Moment) -> None:
        self._moments[robot] = moment

    def _finished(self, robot: int, stride: LiveStride) -> None:
        name = self.session.robots[robot].controller.name  # on its thread: that of the stride
        told = {**stride._asdict(), "color": look(name).color}
        if stride.number == 0:
            self._strides[robot].clear()
        self._strides[robot].append(told)
        self._tell_all({"strides": [[robot, told]]})

    def _broken(self, error: BaseException) -> None:
        self._tell_all({"refused": f"The simulation has ended: {error}"})

    def _show(self) -> None:
        """The thread that sends frames; robots whose page is closed are not drawn."""
        while not self._ending.wait(1.0 / FPS):
            moments = [moment for moment in self._moments if moment is not None]
            if self.pages and len(moments) == len(self._moments):
                self.send(self._treadmill.row(self.scene, moments))
                self.frames += 1

    # --- what pages are told -----------------------------------------------------------------

    def _tell_all(self, message: dict[str, Any]) -> None:
        data = msgspec.json.encode(message)
        with contextlib.suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._hand_out, data)

    def _hand_out(self, data: bytes) -> None:
        for each in tuple(self._pages_that_ask):
            each.tell(data)

    def state(self) -> dict[str, Any]:
        """What the controls of a page show."""
        session = self.session
        return {
            "speed": session.speed,
            "paused": session.clock.paused,
            "rate": session.clock.rate,
            "slipped": session.clock.slipped,
            "scenario": session.scenario.name,
            "world": session.mismatches,
            "recording": None if session.recording is None else str(session.recording),
            "robots": [
                {
                    "name": spec.name,
                    "label": look(spec.name).label,
                    "color": look(spec.name).color,
                    "learning": learning,
                    "learns": any(spec.laws),
                }
                for spec, learning in zip(session.controllers, session.learning, strict=True)
            ],
        }

    def _tell_state(self) -> None:
        self._tell_all({"state": self.state()})

    def greeting(self) -> dict[str, Any]:
        """What a page is told that has just come."""
        strides = [
            [robot, told] for robot, kept in enumerate(self._strides) for told in tuple(kept)
        ]
        return {"state": self.state(), "strides": strides, "events": list(self._events)}

    # --- what pages ask ----------------------------------------------------------------------

    async def ask(self, message: str | bytes) -> dict[str, Any]:
        """Do what a page asks, aside from the pages; the answer says what came of it."""
        try:
            asked = read_message(message)
            waits = isinstance(asked, Record) and not asked.on
            return await self.aside(lambda: self._do(asked), waits=waits)
        except PronkError as error:
            return {"refused": str(error)}

    async def aside(self, do: Callable[[], Outcome], *, waits: bool = False) -> Outcome:
        """Do something aside from the pages, in turn; what `waits` for touchdowns holds up none."""
        worker = self._waiter if waits else self._worker
        return await asyncio.get_running_loop().run_in_executor(worker, do)

    def _do(self, asked: Asked) -> dict[str, Any]:
        said: dict[str, Any] = {}
        if isinstance(asked, Record):
            said = self._record(asked.on)
        else:
            obey(self.session, asked)
        self._note(asked)
        return said

    def _record(self, on: bool) -> dict[str, Any]:
        if on:
            self.session.record(folder := self._folder())
            return {"said": f"Recording to {folder} from the next touchdowns on."}
        results = self.session.save()
        return {"said": f"Recorded: pronk-pin report {results.folder}"}

    def _note(self, asked: Asked) -> None:
        """Have all pages know what was done, and when."""
        time_of = [0.0 if moment is None else moment.time for moment in self._moments]
        event: dict[str, Any] = {"time": time_of}
        if isinstance(asked, Push | SetLearning | SetWorld | Forget | SetController):
            event.update(msgspec.to_builtins(asked))
            self._events.append(event)
            self._tell_all({"events": [event]})
        if isinstance(asked, Reset):
            self._events.clear()
            self._tell_all({"reset": True})
        if isinstance(asked, SetController | SetWorld):
            self.scene = lab_scene(self.session)
            self._tell_all({"scene": True})
        self._tell_state()

    def save_skill(self, robot: int) -> bytes:
        """The file of what a robot plays."""
        with temporary_folder() as folder:
            self.session.skill(robot).save(folder / "skill.npz")
            return read_bytes(folder / "skill.npz", "save it again")

    def load_skill(self, robot: int, data: bytes) -> None:
        """Have a robot play what a file says.

        Raises:
            PronkError: It is no torque library, or of another robot.
        """
        with temporary_folder() as folder:
            write_file(folder / "skill.npz", data)
            try:
                skill = TorqueLibrary.load(folder / "skill.npz")
            except PronkError:  # which names a file that is none of whoever sent it
                raise InvalidInput(
                    "the file is no torque library, or damaged; load one that was saved here, or "
                    "made by pronk-pin ilc build-library"
                ) from None
        self.session.load_skill(robot, skill)
        self._tell_state()

    # --- who is answered ---------------------------------------------------------------------

    def knows(self, token: str) -> bool:
        """Whether a token is that of the page."""
        return hmac.compare_digest(token.encode(), self._token.encode())

    def refuses(self, request: HTTPServerRequest) -> str:
        """See `LiveServer`; here those without the token, too."""
        refused = super().refuses(request)
        token = request.query_arguments.get("token", [b""])[0].decode(errors="replace")
        if not refused and request.path in ("/", "/lab", "/stream", "/film", "/skill"):
            refused = "" if self.knows(token) else "who does not know its token"
        if not refused and request.path == "/lab" and "Origin" not in request.headers:
            refused = "who does not say which page it is of"
        return refused

    async def film(self, choice: dict[str, str]) -> bytes:
        """The scene as it is now; there is nothing to choose, and the token is none."""
        return await super().film({})

    def start_script(self) -> str:
        """See `LiveServer`."""
        low, high = self.session.speeds
        settings = {
            "controllers": LIVE_CONTROLLERS,
            "speeds": [low, high],
            "knobs": [msgspec.to_builtins(knob) for knob in self._knobs],
            "impulse": IMPULSE.high,
            "rates": [RATES.low, RATES.high],
        }
        text = msgspec.json.encode(settings).decode().replace("<", "\\u003c")
        return Template(_START).substitute(settings=text)

    def routes(self) -> list[Route]:
        """See `LiveServer`."""
        assert __package__ is not None
        script = data_text(__package__, "data/lab.js")
        return [
            *super().routes(),
            ("/lab.js", Bytes, text_as_bytes(script, SCRIPT)),
            ("/lab", Control, {"server": self}),
            ("/skill", Skill, {"server": self}),
        ]

    def settings(self) -> dict[str, Any]:
        """See `LiveServer`."""
        return {
            "websocket_max_message_size": LONGEST,
            "websocket_ping_interval": _PING,
        }

    def drives(self, page: Control) -> bool:
        """Whether a page may ask: the one that has been open the longest."""
        return bool(self._pages_that_ask) and self._pages_that_ask[0] is page

    def join(self, page: Control) -> None:
        """Let a page look on, and drive if there is no other."""
        self._pages_that_ask.append(page)

    def leave(self, page: Control) -> None:
        """A page is gone: the next one drives."""
        if page in self._pages_that_ask:
            self._pages_that_ask.remove(page)
        for each in self._pages_that_ask[:1]:
            each.tell(msgspec.json.encode({"driving": True}))


def known_folder(folder: Path | str | None) -> Path | None:
    """A folder to record to, which is not there yet.

    Raises:
        InvalidInput: It is.
    """
    if folder is None:
        return None
    folder = known_path("folder", folder)
    if folder.exists():
        raise InvalidInput(f"{folder} is there already; record to another folder")
    return folder
