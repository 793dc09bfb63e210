"""Initialisation of worker processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from multiprocessing import connection

from ._checks import whole
from .errors import InvalidInput

_MOST = 1024


def follow_parent() -> None:
    """Leave Ctrl-C to the parent process, and end when it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def worker_count(workers: int | None) -> int:
    """How many processes; None for one for each core.

    Raises:
        InvalidInput: Not a whole number, or none, or more than any machine has.
    """
    if workers is None:
        return os.cpu_count() or 1
    workers = whole("workers", workers)
    if workers < 1:
        raise InvalidInput(f"{workers} workers; at least one is needed")
    if workers > _MOST:
        raise InvalidInput(f"{workers} workers; give {_MOST} or fewer")
    return workers
