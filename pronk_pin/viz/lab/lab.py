"""A live session on a page, from Python."""

from __future__ import annotations

import contextlib
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path

from ..._checks import none_or, real
from ...compare import Experiment
from ...compare.results import default_folder
from ...compare.session import LiveSession
from ..player import DURATION
from .lab_server import LabServer, known_folder

CONTROLLERS = ("pd", "model", "ilc")
"""Those that are shown where none are named: the question of the paper."""


def live_lab(
    experiment: Experiment | None = None,
    *,
    speed: float | None = None,
    rate: float = 1.0,
    folder: Path | str | None = None,
    port: int | None = None,
    host: str = "127.0.0.1",
) -> LabServer:
    """Simulate robots live on a page where they are taught, loaded and pushed; returns at once.

    In a notebook its value shows the page; its `session` is asked in Python, too.

    Args:
        experiment: Robot, gaits, up to three controllers, and the first of its scenarios; by
            default the A1 under PD, the model's feedforward and learning.
        speed: Commanded speed to begin with [m/s]; by default the experiment's nearest to 0.5.
        rate: Simulated seconds for each second of the wall's.
        folder: Where to record to; by default results/<time>-play below the current folder.
        port: Port of the page; without it a free one is found.
        host: Address to listen on; the default can be reached from this machine only.

    Returns:
        The page, which ends with its `close` or with the process; its address is `address`.

    Raises:
        InvalidInput: There are too many controllers, one cannot be played live, or the folder is
            there.
        PortUnavailable: The port is in use or forbidden.
    """
    if experiment is None:
        experiment = Experiment(controllers=CONTROLLERS)
    return LabServer(
        LiveSession(experiment, speed=speed),
        port=port,
        host=host,
        rate=rate,
        folder=_folders(known_folder(folder)),
    )


def _folders(first: Path | None) -> Callable[[], Path]:
    """Makes names of folders to record to: the first is the given one, if there is any."""
    given = [] if first is None else [first]
    return lambda: given.pop() if given else default_folder("play")


def serve_lab(lab: LabServer, *, open_browser: bool = True, duration: float | None = None) -> None:
    """Print where the page of a session is, and wait until Ctrl-C, which ends it.

    Args:
        lab: The page.
        open_browser: Open it in the default browser.
        duration: End after this time [s] instead of waiting for Ctrl-C.
    """
    duration = none_or(real, "duration", duration, DURATION)
    ends = "Ctrl-C ends it" if duration is None else f"for {duration:g} s"
    with lab, contextlib.suppress(KeyboardInterrupt):
        print(f"the robots are at {lab.address} ({ends})", flush=True)
        if open_browser:
            webbrowser.open(lab.address)
        threading.Event().wait(duration)
