"""The command line `pronk-pin`, whose commands have no logic of their own.

A command imports what it needs when it runs: its help and its options are to cost nothing but
themselves, and the libraries take seconds. Hence the imports within functions, here alone.
"""

from __future__ import annotations

import contextlib
import functools
import io
import operator
import os
import signal
import sys
import textwrap
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import make_dataclass
from types import FrameType
from typing import Annotated, Any, Protocol, TextIO

import tyro
from tyro.conf import FlagCreatePairsOff, OmitSubcommandPrefixes, arg, subcommand

from .. import __version__
from .._workers import handling
from ..errors import LeakyFilter, OtherMachine, PartNotShown, PronkError, UnknownName
from .comparison import Compare, Explain, Report, Reproduce
from .gaits import Gaits
from .ilc import Ilc
from .listing import List
from .options import REGISTRY
from .parity import Parity
from .play import Play
from .view import View


class _Runs(Protocol):
    """A command: does it, and says with which code to exit if not with 0."""

    def run(self) -> int | None: ...


RENAMED: dict[str, str] = {
    "--schedule.practice": "--schedule.baseline",
    "--world": "--mjcf",
    "--worlds": "--scenarios",
}
"""Options that the last release knew by another name, with their names of today."""

COMMANDS: Mapping[str, type[_Runs]] = {
    "compare": Compare,
    "gaits": Gaits,
    "ilc": Ilc,
    "view": View,
    "play": Play,
    "report": Report,
    "reproduce": Reproduce,
    "explain": Explain,
    "parity": Parity,
    "list": List,
}
"""The commands by name."""

_PURPOSE = "When a legged robot repeats a motion, does practice beat the model?"
_HELP = ("-h", "--help")
SHELLS = ("bash", "zsh", "fish")
"""Shells that can complete commands and options."""

_COMPLETION = ("--tyro-print-completion", "--tyro-write-completion")


def main(arguments: list[str] | None = None) -> int:
    """Entry point; the exit code is 0, 1 for an error of ours or models that differ, 2 for wrong
    usage, 130 on Ctrl-C, 141 where nobody reads the output any more, and 143 or 129 where the
    program is asked to end by SIGTERM or SIGHUP: docs/commands.md."""
    with _orderly_end() as asked:
        try:
            return _run(arguments)
        except PronkError as error:
            if not asked:
                print(f"pronk-pin: {' '.join(str(error).splitlines())}", file=sys.stderr)
                return 1
        except BrokenPipeError:
            if not asked:
                if not _unread():
                    raise
                return 128 + signal.SIGPIPE
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
    arguments = todays_options(sys.argv[1:] if arguments is None else arguments)
    if arguments[:1] == ["--version"]:
        print(f"pronk-pin {__version__}")
        return 0
    if arguments and arguments[0] in _COMPLETION:
        shell = "".join(arguments[1:2])
        if shell not in SHELLS:
            raise UnknownName("shell", shell, SHELLS)
    command = _parsed(arguments)
    with warnings.catch_warnings():
        for category in (LeakyFilter, OtherMachine, PartNotShown):
            warnings.simplefilter("once", category)
        warnings.showwarning = _show_warning
        code = command.run() or 0
    sys.stdout.flush()  # while it is known what to do where nobody reads on
    return code


def _unread() -> bool:
    """Whether nobody reads the output any more, as after `| head`; what is left of it goes."""
    try:
        print(flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return True
    return False


@contextmanager
def _orderly_end() -> Iterator[list[int]]:
    """Have the signals that ask a program to end do what Ctrl-C does, so that nothing stays behind:
    temporary folders, processes, half a file. Yields a list that holds the signal once it came."""
    asked: list[int] = []

    def end(number: int, frame: FrameType | None) -> None:
        if not asked:  # `timeout` sends two; the second must not disturb the clearing up
            asked.append(number)
            raise SystemExit(128 + number)

    signals = (signal.SIGTERM, signal.SIGHUP)
    # `nohup` wants its own ignored.
    with handling(end, [one for one in signals if signal.getsignal(one) == signal.SIG_DFL]):
        yield asked


def _parsed(arguments: list[str]) -> _Runs:
    """The command that the arguments ask for; wrong usage ends the program, told in one line."""
    name, *words = arguments or [""]
    if name not in COMMANDS:  # help, completion, or wrong usage
        name, asked, words = "", _program(whole=name in _COMPLETION), arguments
    else:
        asked = COMMANDS[name]
    given = [word for word in words if word not in _HELP]
    if name == "compare" and given and given != words:  # help, with the values of a suite, say
        begun: Compare = _read(name, asked, given)
        _read(name, asked, words, default=begun.with_values())
    command: _Runs = _read(name, asked, words)
    return command


def _program(*, whole: bool) -> Any:
    """All commands: whole, or only what each is for, which is all that their list shows."""
    kinds: list[Any] = []
    for name, kind in COMMANDS.items():
        only_said = make_dataclass(kind.__name__, (), namespace={"__doc__": kind.__doc__})
        kinds.append(Annotated[kind if whole else only_said, subcommand(name)])
    version = Annotated[
        bool, FlagCreatePairsOff, arg(help="Print the version.", help_behavior_hint="")
    ]
    return make_dataclass(
        "Program",
        [("command", functools.reduce(operator.or_, kinds)), ("version", version, False)],
        namespace={"__doc__": _PURPOSE},
    )


def _read(name: str, asked: Any, words: list[str], **default: Any) -> Any:
    """Read the words that stand after a command's name."""
    told = io.StringIO()
    try:
        with contextlib.redirect_stderr(told):
            command = tyro.cli(
                asked,
                prog=f"pronk-pin {name}".strip(),
                args=words,
                config=(OmitSubcommandPrefixes,),
                registry=REGISTRY,
                **default,
            )
    except SystemExit:
        if text := _in_one_line(told.getvalue()):
            print(f"pronk-pin: {text}", file=sys.stderr)
        raise
    sys.stderr.write(told.getvalue())
    return command


_LONGEST_PART = 200
"""Characters of a part of tyro's answer, which may list many options, that are shown."""


def _in_one_line(framed: str) -> str:
    """What tyro tells in a frame, or below rulers, its parts separated by semicolons."""
    parts: list[list[str]] = [[]]
    for line in framed.splitlines():
        words = line.strip("│|+ ").split()
        if line.startswith(("╭", "╰")) or set("".join(words)) <= set("─-"):
            parts.append([])
        else:
            parts[-1] += words
    told = [textwrap.shorten(" ".join(part), _LONGEST_PART, placeholder=" ...") for part in parts]
    return "; ".join(part for part in told if part)


def todays_options(arguments: list[str]) -> list[str]:
    """Replace options of the last release by their names of today, with a warning for each.

    As on the command line, `--name value` and `--name=value` are the same, and so are hyphens and
    underscores. What is no option stays as it is.
    """
    replaced = []
    for argument in arguments:
        option, equals, value = argument.partition("=")
        today = RENAMED.get(option.replace("_", "-"))
        if today is not None:
            _show_warning(
                f"{option} is called {today} now; the old name goes with the next release",
                FutureWarning,
                __file__,
                0,
            )
            argument = f"{today}{equals}{value}"
        replaced.append(argument)
    return replaced


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
