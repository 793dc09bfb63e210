"""A document of headings, tables and figures, written once and rendered as HTML and Markdown.

Texts are words, not markup, wherever they come from, but for `code` in backticks. Each rendering
escapes them in one place: `_inline` and `markdown_text`.
"""

from __future__ import annotations

import base64
import html
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from string import Template
from typing import Literal

import pandas as pd
from matplotlib.figure import Figure

from ..figure_style import figure_bytes

_PAGE = Template("""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>
:root { color-scheme: light dark; --page: #fff; --ink: #222; --faint: #555; --line: #888;
  --link: #0072B2; --box: #eef4fa; --code: #f2f2f2; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem;
  color: var(--ink); background: var(--page); overflow-wrap: break-word; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; } h3 { font-size: 1rem; }
a { color: var(--link); }
h2 a, h3 a { color: inherit; text-decoration: none; } h2 a:hover, h3 a:hover { color: var(--link); }
nav { font-size: 13px; columns: 20rem 2; margin: 1rem 0; } nav a { display: block; }
.table { overflow-x: auto; margin: .6rem 0; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13px; }
caption { text-align: left; color: var(--faint); padding-bottom: .2rem; }
th, td { padding: .15rem .45rem; text-align: right; } td { white-space: nowrap; }
thead th { vertical-align: bottom; }
tbody th { white-space: nowrap; } th:first-child, .left td { text-align: left; }
tbody th, thead tr:first-child th:first-child { position: sticky; left: 0;
  background: var(--page); }
thead th[scope=colgroup] { text-align: center; border-left: 1px solid var(--line); }
.left td, .wrap td { white-space: normal; }
thead tr:last-child th { border-bottom: 1px solid var(--line); }
tbody { border-bottom: 1px solid var(--line); }
.verdict { background: var(--box); border-left: 4px solid var(--link); padding: .6rem 1rem; }
figure { margin: 1.2rem 0; max-width: 62rem; }
img { width: 100%; display: block; background: #fff; }
figcaption, .note { color: var(--faint); font-size: 13px; }
code, pre { background: var(--code); padding: 0 .25rem; }
pre { padding: .5rem; white-space: pre-wrap; }
@media (prefers-color-scheme: dark) {
  :root { --page: #181a1c; --ink: #e2e2e0; --faint: #a9abad; --line: #777; --link: #6cb8ea;
    --box: #1d2b36; --code: #26292c; }
  img { border-radius: 4px; }
}
@media (max-width: 40rem) {
  body { margin-top: 1rem; } th, td { padding: .15rem .35rem; }
  tbody th { white-space: normal; max-width: 8rem; }
}
@page { size: A4; margin: 14mm; }
@media print {
  :root { color-scheme: light; --page: #fff; --ink: #000; --faint: #444; --line: #888;
    --link: #005a8c; --box: #eef4fa; --code: #f2f2f2; }
  body { font-size: 10pt; max-width: none; margin: 0; padding: 0; }
  .table { overflow: visible; } table { font-size: 7pt; width: 100%; }
  th, td { padding: .1rem .15rem; overflow-wrap: normal; } td, tbody th { white-space: normal; }
  tbody th { min-width: 16mm; position: static; } .left td { overflow-wrap: anywhere; }
  h2, h3 { break-after: avoid; } thead { display: table-header-group; }
  tr, figure, .verdict { break-inside: avoid; } caption { break-after: avoid; }
  figcaption, .note { font-size: 8pt; } pre { font-size: 8pt; overflow-wrap: anywhere; }
}
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
class _Link:
    words: str
    address: str


@dataclass(frozen=True)
class _Links:
    links: tuple[_Link, ...]


@dataclass(frozen=True)
class _Table:
    cells: pd.DataFrame
    caption: str
    left: bool
    wrap: bool


@dataclass(frozen=True)
class _Picture:
    name: str
    figure: Figure
    caption: str
    address: str

    @cached_property
    def svg(self) -> bytes:
        return figure_bytes(self.figure, "svg")


_Block = _Heading | _Text | _Bullets | _Links | _Table | _Picture


@dataclass
class Document:
    """Blocks in the order of reading; `code` in backticks is set as such.

    Attributes:
        title: Its title.
    """

    title: str
    _blocks: list[_Block] = field(default_factory=list)

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

    def links(self, addresses: Mapping[str, str]) -> None:
        """A line of links to files beside the document: their addresses by their words."""
        if addresses:
            self._blocks.append(_Links(tuple(_Link(*entry) for entry in addresses.items())))

    def table(
        self, cells: pd.DataFrame, *, caption: str = "", left: bool = False, wrap: bool = False
    ) -> None:
        """A table of texts, with its index as the first column.

        Args:
            cells: The texts; the names of the columns may be of several levels, and the name of
                the index heads the first column.
            caption: What it is a table of.
            left: Words rather than numbers, without a header.
            wrap: Break long cells, rather than let the table become wider than the page.
        """
        self._blocks.append(_Table(cells, caption, left, wrap))

    def picture(self, name: str, figure: Figure, caption: str, *, address: str = "") -> None:
        """A figure; the name is that of its file beside a Markdown document.

        With an address it is a link to a file beside the document.
        """
        self._blocks.append(_Picture(slug(name), figure, caption, address))

    def to_html(self) -> str:
        """One page that needs nothing outside it; `links` lead to files beside it."""
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


def _html(block: _Block) -> str:
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
    if isinstance(block, _Links):
        return f"<p>{' &middot; '.join(map(_anchor, block.links))}</p>"
    if isinstance(block, _Table):
        return _html_table(block)
    data = base64.b64encode(block.svg).decode()
    caption = html.escape(block.caption)
    image = f'<img alt="{caption}" src="data:image/svg+xml;base64,{data}">'
    if block.address:
        image = f'<a href="{html.escape(block.address)}">{image}</a>'
    return f'<figure id="figure-{block.name}">{image}<figcaption>{caption}</figcaption></figure>'


def _anchor(link: _Link) -> str:
    return f'<a href="{html.escape(link.address)}">{html.escape(link.words)}</a>'


def _html_table(block: _Table) -> str:
    """A table with a caption, and with heads that say which columns or row they are of."""
    cells = block.cells
    kind = "table" + " left" * block.left + " wrap" * block.wrap
    caption = f"<caption>{_inline(block.caption)}</caption>" if block.caption else ""
    rows = "".join(
        f'<tr><th scope="row">{html.escape(str(name))}</th>'
        + "".join(f"<td>{html.escape(str(value))}</td>" for value in row)
        + "</tr>"
        for name, row in zip(*_rows(cells), strict=True)
    )
    head = "" if block.left else f"<thead>{_html_heads(cells)}</thead>"
    return f'<div class="{kind}"><table>{caption}{head}<tbody>{rows}</tbody></table></div>'


def _html_heads(cells: pd.DataFrame) -> str:
    """The rows of heads; one that is of several columns stands over all of them."""
    names = [name if isinstance(name, tuple) else (name,) for name in cells.columns]
    levels = len(names[0]) if names else 1
    corner = html.escape(str(cells.index.name or ""))
    lines = []
    for level in range(levels):
        line = f'<th scope="col" rowspan="{levels}">{corner}</th>' if level == 0 else ""
        below = level + 1
        for path, group in groupby(names, key=lambda name: name[:below]):
            span = f'scope="colgroup" colspan="{len(list(group))}"'
            kind = span if below < levels else 'scope="col"'
            line += f"<th {kind}>{html.escape(str(path[level]))}</th>"
        lines.append(f"<tr>{line}</tr>")
    return "".join(lines)


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


def _markdown(block: _Block, folder: str) -> str:
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
        rows = [
            [block.cells.index.name or "", *names],
            *([str(k), *row] for k, row in zip(*_rows(block.cells), strict=True)),
        ]
        lines = [
            "| " + " | ".join(markdown_text(str(cell), cell=True) for cell in row) + " |"
            for row in rows
        ]
        align = ":--" if block.left else "--:"
        lines.insert(1, "|" + "|".join([":--", *([align] * len(names))]) + "|")
        said = [markdown_text(block.caption), ""] if block.caption else []
        return "\n".join([*said, *lines])
    if isinstance(block, _Links):
        return " · ".join(f"[{markdown_text(link.words)}]({link.address})" for link in block.links)
    caption = markdown_text(block.caption)
    alt = block.caption.replace("[", "(").replace("]", ")")
    image = f"![{markdown_text(alt)}]({folder}/{block.name}.svg)"
    return f"[{image}]({block.address})\n\n{caption}" if block.address else f"{image}\n\n{caption}"


def _rows(cells: pd.DataFrame) -> tuple[list[object], list[list[object]]]:
    return list(cells.index), cells.to_numpy().tolist()
