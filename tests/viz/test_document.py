"""One document, two renderings, nothing from outside."""

from __future__ import annotations

import re

import pandas as pd
from matplotlib.figure import Figure

from pronk_pin.viz.document import Document, slug


def some_document() -> Document:
    document = Document("Title & more")
    document.text("It says `a < b`.", "verdict")
    document.text("")
    document.heading('World "payload=2+slope"', "payload=2+slope")
    document.table(pd.DataFrame({"x [rad]": ["0.1", "a|b"]}, index=["one", "two"]))
    document.bullets(["first", "second"])
    document.text("pronk-pin compare", "code")
    document.picture("heat map", Figure(figsize=(1, 1)), "A figure")
    return document


def test_the_page_is_whole_and_every_link_of_it_leads_somewhere() -> None:
    text = some_document().to_html()
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", text)
    anchors = set(re.findall(r'id="([^"]+)"', text))
    assert set(re.findall(r'href="#([^"]+)"', text)) <= anchors
    assert "payload-2-slope" in anchors
    assert "<code>a &lt; b</code>" in text
    assert "Title &amp; more" in text


def test_markdown_has_the_same_tables_and_names_the_files_of_the_figures() -> None:
    document = some_document()
    text = document.to_markdown("figures")
    assert text.startswith("# Title & more\n\n> It says `a < b`.\n")
    assert "|  | x [rad] |\n|:--|--:|\n| one | 0.1 |\n| two | a\\|b |" in text
    assert "- first\n- second" in text
    assert "![A figure](figures/heat-map.svg)" in text
    assert list(document.pictures()) == ["heat-map.svg"]


def test_the_same_document_is_the_same_bytes() -> None:
    assert some_document().to_html() == some_document().to_html()


def test_anchors_are_letters_digits_and_hyphens() -> None:
    assert slug("ideal+armature=0.02") == "ideal-armature-0-02"
