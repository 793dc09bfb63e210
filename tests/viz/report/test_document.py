"""One document, two renderings, nothing from outside."""

from __future__ import annotations

import re

import pandas as pd
import pytest
from matplotlib.figure import Figure

from pronk_pin.viz.report.document import Document, markdown_text, slug


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


STRANGE = (
    "my|robot.xml",
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "[x](javascript:alert(1))",
    "![x](javascript:alert(1))",
    "[x`y`](javascript:alert(1))",
    "[x][y]",
    "*bold* _italic_ ~~struck~~ $x$",
    "a `tick",
    "a `code|with \\| pipes` b",
    "back\\slash|",
    "line\nbreak\r\n\n# heading",
    "&lt;b&gt;",
)


def strange_document(text: str) -> Document:
    document = Document(text)
    document.text(text, "verdict")
    document.text(text)
    document.heading(text, text)
    document.bullets([text])
    document.table(pd.DataFrame({text: [text]}, index=[text]))
    document.picture("figure", Figure(figsize=(1, 1)), text)
    return document


@pytest.mark.parametrize("text", STRANGE)
def test_names_from_outside_neither_break_a_table_nor_become_markup(text: str) -> None:
    lines = strange_document(text).to_markdown("figures").splitlines()
    (table,) = (k for k, line in enumerate(lines) if line == "|:--|--:|")
    for row in (lines[table - 1], lines[table + 1]):
        assert len(re.findall(r"(?<!\\)(?:\\\\)*\|", row)) == 3, row  # the cells' ends
    assert lines[table + 2] == ""
    quotations = [line for line in lines if line.startswith("> ")]
    headings = [line for line in lines if line.startswith("#")]
    assert (len(quotations), len(headings)) == (1, 2)
    for line in lines:
        if line.startswith("<a id=") or line.endswith("](figures/figure.svg)"):
            continue  # ours
        plain = re.sub(r"`[^`]*`", "", re.sub(r"\\.", "", line))  # without what is escaped, or code
        assert not re.search(r"[<*_~$`]|\]\(|\]\[", plain), line
    (picture,) = (line for line in lines if line.endswith("](figures/figure.svg)"))
    assert re.fullmatch(r"!\[(\\.|[^\[\]])*\]\(figures/figure.svg\)", picture), picture


@pytest.mark.parametrize("text", STRANGE)
def test_names_from_outside_are_words_on_the_page(text: str) -> None:
    page = strange_document(text).to_html()
    assert "<script" not in page
    assert "onerror=alert(1)>" not in page.replace("&gt;", "")
    assert len(re.findall(r"<img ", page)) == 1
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", page)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("- no list", "\\- no list"),
        ("+ no list", "\\+ no list"),
        ("12. no list", "12\\. no list"),
        ("12) no list", "12\\) no list"),
        ("--- no rule", "\\--- no rule"),
        ("> no quotation", "\\> no quotation"),
        ("[x]: no-definition", "\\[x]: no-definition"),
        ("# no heading", "\\# no heading"),
        ("    no code", "no code"),
        ("-0.5 to 0.8 m/s in `a_b*c`", "-0.5 to 0.8 m/s in `a_b*c`"),
        ("1.5 times [kg], a < b & c", "1.5 times [kg], a &lt; b & c"),
    ],
)
def test_a_line_begins_as_words_do(text: str, line: str) -> None:
    assert markdown_text(text) == line
