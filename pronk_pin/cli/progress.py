"""A sign on stderr that work goes on, of commands that take longer than one looks at nothing."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from .._workers import listening

PATIENCE = 2.0
"""Time after which it is shown [s]."""


@contextmanager
def progress(what: str, *, counted: bool = True) -> Iterator[None]:
    """Show what is done meanwhile: in place on a terminal, in a log once a minute.

    Args:
        what: What is done, in a word or two.
        counted: Whether it simulates: then robot-steps are shown.
    """
    from tqdm import tqdm

    steps = ", {n_fmt} robot-steps, {rate_fmt}" if counted else ""
    bar = tqdm(
        desc=what,
        unit="",
        unit_scale=True,
        bar_format="{desc}: {elapsed}" + steps,
        delay=PATIENCE,
        mininterval=0.5 if sys.stderr.isatty() else 60.0,
        leave=False,
    )
    sign = threading.Timer(PATIENCE, bar.refresh)
    sign.daemon = True
    with bar, listening(bar.update):
        sign.start()
        try:
            yield
        finally:
            sign.cancel()
