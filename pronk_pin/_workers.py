"""Processes: what a worker does first, and how one is ended, amid a solver's work too.

It imports the standard library only: a worker is to watch its parent before it imports the rest of
this package, which takes seconds.
"""

from __future__ import annotations

import ast
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import connection
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from types import FrameType

_steps_done: Synchronized[int] | None = None
_listener: Callable[[int], object] | None = None


def begin_worker(folder: str, counter: Synchronized[int] | None = None) -> None:
    """Set a worker up: it leaves Ctrl-C to the parent, ends when that ends, and counts its steps.

    Args:
        folder: A folder of the parent's for temporary files: workers are ended without notice,
            and could not clear away what they have in a place of their own.
        counter: Robot-steps done by all workers; None where nobody asks.
    """
    global _steps_done
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = folder
    _steps_done = counter
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        connection.wait([parent.sentinel])
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def leave_main_to_parent() -> None:
    """End a worker that comes here while it imports the script that started it.

    Processes import the script that they are to work for; one whose main code is not guarded would
    start its own. The parent finds its workers gone, and says why, see `unguarded_script`.
    """
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)


def unguarded_script() -> str:
    """The main script, if nothing in it asks for `__name__`; empty otherwise."""
    path = getattr(sys.modules["__main__"], "__file__", None)
    try:
        tree = ast.parse(Path(path).read_bytes()) if path else None
    except (OSError, SyntaxError, ValueError):  # no script that can be looked at
        return ""
    if tree is None:
        return ""
    tests = [node.test for node in tree.body if isinstance(node, ast.If)]
    names = [node.id for test in tests for node in ast.walk(test) if isinstance(node, ast.Name)]
    return "" if "__name__" in names else str(path)


def count_steps(steps: int) -> None:
    """Tell how many more robot-steps are done, if this process is a worker that counts them, or
    somebody listens."""
    if _listener is not None:
        _listener(steps)
    if _steps_done is not None:
        with _steps_done.get_lock():
            _steps_done.value += steps


@contextmanager
def listening(listener: Callable[[int], object]) -> Iterator[None]:
    """Have somebody told of the robot-steps that this process does meanwhile."""
    global _listener
    before, _listener = _listener, listener
    try:
        yield
    finally:
        _listener = before


@contextmanager
def heeding_signals() -> Iterator[None]:
    """Around a solver in C++ that takes an interruption for a failure of its own and goes on.

    A signal ends the solver at once, and is sent again when that has returned, to whoever handles
    it outside.
    """
    came: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        came.append(number)
        raise KeyboardInterrupt

    handled = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    try:
        with handling(end, [one for one in handled if callable(signal.getsignal(one))]):
            yield
    finally:
        if came:
            signal.raise_signal(came[0])


@contextmanager
def handling(
    handler: Callable[[int, FrameType | None], None], signals: Iterable[signal.Signals]
) -> Iterator[None]:
    """Have a handler answer to signals, and who did before do so again afterwards.

    Nothing changes in a thread that is not the main one, where signals do not arrive.
    """
    before = {}
    if threading.current_thread() is threading.main_thread():
        before = {number: signal.signal(number, handler) for number in signals}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)
