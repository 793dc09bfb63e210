"""How objects and tables look: on a terminal in lines that fit, in a notebook as small tables."""

from __future__ import annotations

import html
import os
import re
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

WIDTH = 100
"""Columns of a screen."""

_LONGEST = 280
"""Characters of a fact; the rest is left out."""

_NAMES = 12
"""Names that `listed` has at most."""


class Displayed:
    """An object with a title and facts, which are all that its `repr` and its table show.

    A dataclass of this kind needs `repr=False`.
    """

    def _title(self) -> str:
        """What it is, in one line."""
        raise NotImplementedError

    def _facts(self) -> Mapping[str, str]:
        """What is worth knowing of it; what is empty is left out."""
        raise NotImplementedError

    def _shown(self) -> list[tuple[str, str]]:
        facts = ((name, textwrap.shorten(fact, _LONGEST)) for name, fact in self._facts().items())
        return [(name, fact) for name, fact in facts if fact]

    def __repr__(self) -> str:
        shown = self._shown()
        margin = max((len(name) for name, _ in shown), default=0) + 4
        lines = [textwrap.shorten(self._title(), WIDTH - 2)]
        for name, fact in shown:
            first = f"  {name}".ljust(margin)
            lines += textwrap.wrap(
                fact,
                WIDTH,
                initial_indent=first,
                subsequent_indent=" " * margin,
                break_on_hyphens=False,
            )
        return "<" + "\n".join(lines) + ">"

    def _repr_html_(self) -> str:
        rows = "".join(
            f'<tr><th style="text-align:left">{html.escape(name)}</th>'
            f'<td style="text-align:left">{html.escape(fact)}</td></tr>'
            for name, fact in self._shown()
        )
        return f"<table><caption>{html.escape(self._title())}</caption>{rows}</table>"


def listed(values: Iterable[Any]) -> str:
    """How many, and which: "3: pd, ilc, model"; of many the first ones."""
    names = [f"{value:g}" if isinstance(value, float) else str(value) for value in values]
    more = ", ..." if len(names) > _NAMES else ""
    return f"{len(names)}: {', '.join(names[:_NAMES])}{more}" if names else ""


def spanned(values: Iterable[float], unit: str) -> str:
    """Sorted numbers with their unit: few by themselves, of many their ends."""
    numbers = [f"{value:g}" for value in values]
    if len(numbers) <= 4:
        return f"{', '.join(numbers)} {unit}" if numbers else ""
    return f"{len(numbers)} from {numbers[0]} to {numbers[-1]} {unit}"


NARROWEST = 80
"""Columns that every text can be made to fit."""

_ROW = re.compile(r"\S\s{2,}\S")
"""In a row of a table, two spaces or more stand between cells."""


def screen_width() -> int | None:
    """Columns of the terminal, or of the variable COLUMNS; None where the output goes elsewhere."""
    columns = os.environ.get("COLUMNS", "")
    if columns.isdecimal():
        return max(int(columns), NARROWEST)
    try:
        return max(os.get_terminal_size(sys.stdout.fileno()).columns, NARROWEST)
    except (OSError, ValueError, AttributeError):
        return None


def show(text: str) -> None:
    """Print a text so that it fits the terminal."""
    print(fit(text, screen_width()))


def fit(text: str, width: int | None) -> str:
    """Make a text of tables and paragraphs no wider than a screen.

    A table that is wider is continued below, with its first column again; long lines are wrapped.

    Args:
        text: The text; an empty line is between a table and what is another one or none.
        width: Columns of the screen; None leaves the text as it is.
    """
    if width is None:
        return text
    blocks = re.split(r"(\n{2,})", text)
    return "".join(block if k % 2 else _fit_block(block, width) for k, block in enumerate(blocks))


def _fit_block(block: str, width: int) -> str:
    lines = block.split("\n")
    if max(map(len, lines)) <= width:
        return block
    rows = [k for k, line in enumerate(lines) if _ROW.search(line)]
    first, last = (rows[0], rows[-1] + 1) if len(rows) > 1 else (0, 0)
    columns = _columns(lines[first:last])
    parts = _continued(lines[first:last], columns, width)
    if not parts:
        hang = columns[1][0] if len(columns) > 1 and columns[1][0] <= width // 2 else None
        return "\n".join(_wrapped(lines, width, hang))
    # Titles and notes around a table are lines by themselves.
    return "\n".join([*_wrapped(lines[:first], width), *parts, *_wrapped(lines[last:], width)])


def _columns(rows: Sequence[str]) -> list[tuple[int, int]]:
    """Where the columns of a table begin and end: between them all rows have two spaces or more."""
    length = max(map(len, rows), default=0)
    taken = [False] * length
    for row in rows:
        for match in re.finditer(r"\S+(?: \S+)*", row):
            taken[match.start() : match.end()] = [True] * len(match[0])
    ends = [k for k in range(length + 1) if (k < length and taken[k]) != (k > 0 and taken[k - 1])]
    return list(zip(ends[::2], ends[1::2], strict=True))


def _continued(rows: Sequence[str], columns: Sequence[tuple[int, int]], width: int) -> list[str]:
    """A table as several, one below the other; nothing where a column alone is too wide."""
    if rows and max(map(len, rows)) <= width:
        return list(rows)
    if len(columns) < 3:
        return []
    label = columns[0][1] + 1  # and a space more, as what follows may begin with one alone
    parts: list[tuple[int, int]] = []  # from where to where each goes
    begin = end = columns[0][1]
    for _, stop in columns[1:]:
        if label + stop - begin > width and end > begin:
            parts.append((begin, end))
            begin = end
        end = stop
        if label + end - begin > width:
            return []
    parts.append((begin, end))
    lines: list[str] = []
    for k, (start, stop) in enumerate(parts):
        part = [f"{row[: label - 1]:<{label}}{row[start:stop]}".rstrip() for row in rows]
        lines += [*([""] * (k > 0)), *filter(None, part)]
    return lines


def _wrapped(lines: Sequence[str], width: int, hang: int | None = None) -> list[str]:
    """Lines of their own, wrapped; one that was wrapped before goes on with the next."""
    joined: list[str] = []
    before = 0
    for line in lines:
        if before >= NARROWEST and line[:1].strip() and not _ROW.search(line):
            joined[-1] = f"{joined[-1]} {line}"
        else:
            joined.append(line)
        before = len(line) if line[:1].strip() else 0
    wrapped: list[str] = []
    for line in joined:
        indent = len(line) - len(line.lstrip()) + 2 if hang is None else hang
        after = "" if hang is None and not line.startswith(" ") else " " * indent
        wrapped += textwrap.wrap(
            line, width, subsequent_indent=after, break_long_words=False, break_on_hyphens=False
        ) or [""]
    return wrapped
