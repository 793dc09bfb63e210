"""The lock of a results folder: one run at a time writes there."""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from ...errors import FileProblem
from ...storage import clear_partial_files


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other runs out of a folder, and clear away what a killed one left half written.

    The lock ends with the process, however it ends.

    Raises:
        FileProblem: Another run is at it, or it is not ours to write in.
    """
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        clear_partial_files(folder)
        yield
    except BlockingIOError as error:
        raise FileProblem(
            folder, "another run is writing there", "wait for it, or end it first"
        ) from error
    finally:
        os.close(handle)
