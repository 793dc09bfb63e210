"""A document of headings, tables and figures, written once and rendered as HTML and Markdown.

Texts are words, not markup, wherever they come from, but for `code` in backticks. Each rendering
escapes them in one place: `_inline` and `markdown_text`.
"""

from __future__ import annotations

import base64
import html
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from string import Template
from typing import Literal

import pandas as pd
from matplotlib.figure import Figure

from ..figure_style import figure_bytes

_PAGE = Template("""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title><style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem;
  color: #222; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; } h3 { font-size: 1rem; }
h2 a, h3 a { color: inherit; text-decoration: none; } h2 a:hover, h3 a:hover { color: #0072B2; }
nav { font-size: 13px; columns: 2; margin: 1rem 0; } nav a { display: block; color: #0072B2; }
.table { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13px; }
table { margin: .6rem 0; }
th, td { padding: .15rem .6rem; text-align: right; } td { white-space: nowrap; }
tbody th { white-space: nowrap; } th:first-child, .left td { text-align: left; }
.left td, .wrap td { white-space: normal; }
thead th { border-bottom: 1px solid #888; } tbody { border-bottom: 1px solid #888; }
.verdict { background: #eef4fa; border-left: 4px solid #0072B2; padding: .6rem 1rem; }
figure { margin: 1rem 0; } img { max-width: 100%; }
figcaption, .note { color: #555; font-size: 13px; }
code, pre { background: #f2f2f2; padding: 0 .25rem; } pre { padding: .5rem; white-space: pre-wrap; }
</style></head><body>
<h1>$title</h1>
$body
</body></html>
""")


@dataclass(frozen=True)
class _Heading:
    text: str
    anchor: str
    level: int


@dataclass(frozen=True)
class _Text:
    text: str
    kind: Literal["plain", "verdict", "note", "code"]


@dataclass(frozen=True)
class _Bullets:
    items: tuple[str, ...]


@dataclass(frozen=True)
class _Table:
    cells: pd.DataFrame
    left: bool
    wrap: bool


@dataclass(frozen=True)
class _Picture:
    name: str
    figure: Figure
    caption: str

    @cached_property
    def svg(self) -> bytes:
        return figure_bytes(self.figure, "svg")


@dataclass
class Document:
    """Blocks in the order of reading; `code` in backticks is set as such.

    Attributes:
        title: Its title.
    """

    title: str
    _blocks: list[_Heading | _Text | _Bullets | _Table | _Picture] = field(default_factory=list)

    def heading(self, text: str, anchor: str, *, level: int = 2) -> None:
        """A heading that links can lead to, by its anchor."""
        self._blocks.append(_Heading(text, slug(anchor), level))

    def text(self, text: str, kind: Literal["plain", "verdict", "note", "code"] = "plain") -> None:
        """A paragraph; nothing where the text is empty."""
        if text:
            self._blocks.append(_Text(text, kind))

    def bullets(self, items: Sequence[str]) -> None:
        """A list."""
        self._blocks.append(_Bullets(tuple(items)))

    def table(self, cells: pd.DataFrame, *, left: bool = False, wrap: bool = False) -> None:
        """A table of texts, with its index as the first column.

        Args:
            cells: The texts.
            left: Words rather than numbers, without a header.
            wrap: Break long cells, rather than let the table become wider than the page.
        """
        self._blocks.append(_Table(cells, left, wrap))

    def picture(self, name: str, figure: Figure, caption: str) -> None:
        """A figure; the name is that of its file beside a Markdown document."""
        self._blocks.append(_Picture(slug(name), figure, caption))

    def to_html(self) -> str:
        """One page without references to anything outside it."""
        links = [
            f'<a href="#{block.anchor}">{html.escape(block.text)}</a>'
            for block in self._blocks
            if isinstance(block, _Heading) and block.level == 2
        ]
        parts = [_html(block) for block in self._blocks]
        first = next(
            (k for k, block in enumerate(self._blocks) if isinstance(block, _Heading)), len(parts)
        )
        parts.insert(first, f"<nav>{''.join(links)}</nav>")
        return _PAGE.substitute(title=html.escape(self.title), body="\n".join(parts))

    def to_markdown(self, folder: str) -> str:
        """Markdown that shows the figures as files of a folder, see `pictures`."""
        title = f"# {markdown_text(self.title)}"
        parts = [title, *(_markdown(block, folder) for block in self._blocks)]
        return "\n\n".join(parts) + "\n"

    def pictures(self) -> dict[str, bytes]:
        """The figures as SVG, by the names of their files."""
        return {
            f"{block.name}.svg": block.svg for block in self._blocks if isinstance(block, _Picture)
        }


def slug(text: str) -> str:
    """A text as an anchor or a file name: letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def _html(block: _Heading | _Text | _Bullets | _Table | _Picture) -> str:
    if isinstance(block, _Heading):
        link = f'<a href="#{block.anchor}">{html.escape(block.text)}</a>'
        return f'<h{block.level} id="{block.anchor}">{link}</h{block.level}>'
    if isinstance(block, _Text):
        if block.kind == "code":
            return f"<pre>{html.escape(block.text)}</pre>"
        kind = "" if block.kind == "plain" else f' class="{block.kind}"'
        return f"<p{kind}>{_inline(block.text)}</p>"
    if isinstance(block, _Bullets):
        return "<ul>" + "".join(f"<li>{_inline(item)}</li>" for item in block.items) + "</ul>"
    if isinstance(block, _Table):
        kind = "table" + " left" * block.left + " wrap" * block.wrap
        table = block.cells.to_html(border=0, header=not block.left)
        return f'<div class="{kind}">{table}</div>'
    data = base64.b64encode(block.svg).decode()
    caption = html.escape(block.caption)
    return (
        f'<figure id="figure-{block.name}"><img alt="{caption}" '
        f'src="data:image/svg+xml;base64,{data}"><figcaption>{caption}</figcaption></figure>'
    )


_CODE = re.compile(r"`([^`]+)`")
_MARKUP = re.compile(
    r"""[\\`*_~$\#]     # emphasis, code, formulas, headings
    | \](?=[(\[])      # links and images
    | &(?=\#?\w+;)     # entities
    | <                # HTML""",
    re.VERBOSE,
)
_BEGINS = re.compile(r"\[|>|-(?=-|\s|$)|\+(?=\s|$)|(?<=\d)[.)](?=\s|$)")
"""Marks that make a line something else where it begins with them, or with them after a number."""


def _inline(text: str) -> str:
    return _CODE.sub(r"<code>\1</code>", html.escape(text, quote=False))


def markdown_text(text: str, *, cell: bool = False) -> str:
    """A text as one line of Markdown that shows it as it is; `code` in backticks stays code.

    Args:
        text: Words, a file's name, an error: whatever it is, it does not become markup.
        cell: Whether it stands in a table, and not at the beginning of a line.
    """
    line = "".join(
        piece  # in a cell, "|" ends code too, and a backslash before it is shown
        if _CODE.fullmatch(piece) and not (cell and "|" in piece)
        else _MARKUP.sub(_escaped, piece)
        for piece in re.split(r"(`[^`]+`)", " ".join(text.split()))
    )
    if cell:
        return line.replace("|", "\\|")
    number = re.match(r"\d*", line)
    at = number.end() if number else 0
    return f"{line[:at]}\\{line[at:]}" if _BEGINS.match(line, at) else line


def _escaped(mark: re.Match[str]) -> str:
    return "&lt;" if mark[0] == "<" else f"\\{mark[0]}"


def _markdown(block: _Heading | _Text | _Bullets | _Table | _Picture, folder: str) -> str:
    if isinstance(block, _Heading):
        return f'<a id="{block.anchor}"></a>\n\n{"#" * block.level} {markdown_text(block.text)}'
    if isinstance(block, _Text):
        if block.kind == "code":
            return textwrap.indent(block.text, "    ")
        return ("> " if block.kind == "verdict" else "") + markdown_text(block.text)
    if isinstance(block, _Bullets):
        return "\n".join(f"- {markdown_text(item)}" for item in block.items)
    if isinstance(block, _Table):
        names = [" ".join(name) if isinstance(name, tuple) else name for name in block.cells]
        rows = [["", *names], *([str(k), *row] for k, row in zip(*_rows(block.cells), strict=True))]
        lines = [
            "| " + " | ".join(markdown_text(str(cell), cell=True) for cell in row) + " |"
            for row in rows
        ]
        align = ":--" if block.left else "--:"
        lines.insert(1, "|" + "|".join([":--", *([align] * len(names))]) + "|")
        return "\n".join(lines)
    caption = markdown_text(block.caption)
    alt = block.caption.replace("[", "(").replace("]", ")")
    return f"![{markdown_text(alt)}]({folder}/{block.name}.svg)\n\n{caption}"


def _rows(cells: pd.DataFrame) -> tuple[list[object], list[list[object]]]:
    return list(cells.index), cells.to_numpy().tolist()
