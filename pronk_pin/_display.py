"""How objects look: on a terminal in lines that fit on a screen, in a notebook as a small table."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable, Mapping
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
