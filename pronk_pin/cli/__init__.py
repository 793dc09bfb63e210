"""The command line `pronk-pin`, whose commands have no logic of their own."""

from __future__ import annotations

import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from types import FrameType
from typing import Annotated, Any, Protocol, TextIO, Union

import tyro
from tyro.conf import OmitSubcommandPrefixes, subcommand

from .._state import known_name
from ..compare.suites import SUITES, load_suite
from ..errors import LeakyFilter, PronkError
from .comparison import Compare, Explain, Report, Reproduce
from .gaits import Gaits
from .ilc import Ilc
from .parity import Parity
from .view import View


class _Runs(Protocol):
    """A command: does it, and says with which code to exit if not with 0."""

    def run(self) -> int | None: ...


def _commands(arguments: list[str]) -> Any:
    """All commands; the defaults of `compare` are those of the suite that is asked for."""
    words = [word for argument in arguments for word in argument.split("=", 1)]
    following = dict(pairwise(words))
    suite = following.get("--suite", "default")
    known_name("suite", suite, SUITES)
    default = Compare(experiment=load_suite(suite), suite=suite)
    return Union[  # noqa: UP007 -- its first member is made here
        Annotated[Compare, subcommand("compare", default=default)], Command
    ]


Command = (
    Annotated[Gaits, subcommand("gaits")]
    | Annotated[Ilc, subcommand("ilc")]
    | Annotated[View, subcommand("view")]
    | Annotated[Report, subcommand("report")]
    | Annotated[Reproduce, subcommand("reproduce")]
    | Annotated[Explain, subcommand("explain")]
    | Annotated[Parity, subcommand("parity")]
)


def main(arguments: list[str] | None = None) -> int:
    """Entry point; the exit code is 0, 1 for an error of ours or models that differ, 2 for wrong
    usage, 130 on Ctrl-C, and 143 or 129 where the program is asked to end by SIGTERM or SIGHUP."""
    with _orderly_end() as asked:
        try:
            return _run(arguments)
        except PronkError as error:
            if not asked:
                print(f"pronk-pin: {error}", file=sys.stderr)
                return 1
        except KeyboardInterrupt:
            if not asked:
                print("pronk-pin: interrupted", file=sys.stderr)
                return 130
        except SystemExit:
            if not asked:
                raise
    # Some libraries make errors of their own of what comes amid them.
    print(f"pronk-pin: ended by {signal.Signals(asked[0]).name}", file=sys.stderr)
    return 128 + asked[0]


def _run(arguments: list[str] | None) -> int:
    command: _Runs = tyro.cli(
        _commands(sys.argv[1:] if arguments is None else arguments),
        prog="pronk-pin",
        description="When a legged robot repeats a motion, does practice beat the model?",
        args=arguments,
        config=(OmitSubcommandPrefixes,),
    )
    with warnings.catch_warnings():
        warnings.simplefilter("once", LeakyFilter)
        warnings.showwarning = _show_warning
        return command.run() or 0


@contextmanager
def _orderly_end() -> Iterator[list[int]]:
    """Have the signals that ask a program to end do what Ctrl-C does, so that nothing stays behind:
    temporary folders, processes, half a file. Yields a list that holds the signal once it came."""
    asked: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        if not asked:  # `timeout` sends two; the second must not disturb the clearing up
            asked.append(number)
            raise SystemExit(128 + number)

    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) == signal.SIG_DFL:  # `nohup` wants it ignored
                before[number] = signal.signal(number, end)
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """A warning in one line, as errors are shown."""
    print(f"pronk-pin: warning: {message}", file=sys.stderr)
