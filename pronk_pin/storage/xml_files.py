"""XML documents: read within bounds of size and depth."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from .reading import damaged, read_bytes, reading

LARGEST_DOCUMENT = 2**24
"""Size beyond which no XML is read [bytes]; robots have a hundred kilobytes."""

_DEEPEST = 200
"""Elements within elements beyond which no XML is read: libraries in C follow them by recursion."""


def read_xml(path: Path | str, remedy: str, *, what: str = "") -> ElementTree.Element:
    """Read an XML document; the root of its tree.

    Raises:
        FileProblem: It cannot be read, or is no XML.
    """
    return parse_xml(read_bytes(path, remedy, limit=LARGEST_DOCUMENT), path, remedy, what=what)


def parse_xml(data: bytes, path: Path | str, remedy: str, *, what: str = "") -> ElementTree.Element:
    """The root of the tree of an XML document that was read from a file.

    Raises:
        FileProblem: It is no XML, or is nested too deeply, or declares a document type, by which
            a short document may become a long one.
    """
    with reading(path, remedy, what=what):
        parser = ElementTree.XMLParser(target=_Builder())
        parser.feed(data)
        root: ElementTree.Element = parser.close()
        return root


def refuse_nan(root: ElementTree.Element, path: Path, remedy: str, *, what: str = "") -> None:
    """Refuse a description of a robot in which a number is none.

    Raises:
        FileProblem: An attribute that is no name has NaN in it.
    """
    for element in root.iter():
        for key, text in element.items():
            if key not in ("name", "class", "link") and "nan" in text.lower().split():
                raise damaged(path, f'<{element.tag} {key}="{text}">', remedy, what=what)


class _Builder(ElementTree.TreeBuilder):
    """Builds trees that are not too deep."""

    _depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ElementTree.Element:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise ValueError(f"more than {_DEEPEST} elements within one another")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise ValueError("it declares a document type")
