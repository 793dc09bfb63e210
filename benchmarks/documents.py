"""Figures in documents, made by the commands that stand beside them: `make figures`.

A document asks for the output of a command between two markers, which cog (cogapp) fills:

    <!-- [[[cog from documents import output; output("pronk-pin ilc seeding") ]]] -->
    <!-- [[[end]]] -->

`make figures` runs them all; with `DOCUMENTS=docs/engines.md` those of one page. The slow test
`tests/test_document_figures.py` runs them again and compares the numbers.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tempfile

_OF_THIS_RUN = re.compile(
    r"^(results|report|replay|figure|time that controllers took)\b.*\n?", re.M
)
"""Lines that are otherwise each time."""


def printed(command: str) -> str:
    """What a command of `pronk-pin` prints, without what is of this run alone.

    Of several, joined by " && ", the last one's; they run in the same folder.

    Raises:
        RuntimeError: It fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        return [_run(each, folder) for each in command.split(" && ")][-1]


def _run(command: str, folder: str) -> str:
    program, *words = shlex.split(command)
    if program != "pronk-pin":
        raise ValueError(f"{command}: documents hold the output of pronk-pin")
    done = subprocess.run(
        [sys.executable, "-m", "pronk_pin", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": ""},
    )
    if done.returncode:
        raise RuntimeError(f"{command} ended with {done.returncode}: {done.stderr[-500:]}")
    return _OF_THIS_RUN.sub("", done.stdout).strip("\n")


def output(command: str, *, begin: str = "", end: str = "") -> None:
    """Put a command and what it prints into the document.

    Args:
        command: The command.
        begin: Text of the first line that is shown; by default all of it is.
        end: Text of the first line that is not shown any more.
    """
    import cog  # there while cog runs

    lines = printed(command).splitlines()
    if begin:
        lines = lines[next(k for k, line in enumerate(lines) if begin in line) :]
    if end:
        lines = lines[: next(k for k, line in enumerate(lines) if end in line)]
    cog.outl("\n".join(["```", f"$ {command}", *lines, "```"]))
