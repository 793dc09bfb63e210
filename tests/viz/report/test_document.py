"""One document, two renderings, nothing from outside."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
import pytest
from matplotlib.figure import Figure

from pronk_pin.viz.report.document import Document, markdown_text, slug

if TYPE_CHECKING:
    from conftest import Eye


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


def test_heads_stand_over_their_columns_and_say_what_they_are_of() -> None:
    columns = pd.MultiIndex.from_product([["calf", "thigh"], ["ours", "paper"], ["PD", "ILC"]])
    cells = pd.DataFrame([list("12345678")], index=pd.Index(["0.3"], name="speed"), columns=columns)
    document = Document("Heads")
    document.table(cells, caption="A row a speed.")
    text = document.to_html()
    assert "<caption>A row a speed.</caption>" in text
    heads = [
        [
            (int(span or 1), name)
            for span, name in re.findall(r'(?:colspan="(\d)")?>([^<]+)</th>', row)
        ]
        for row in re.findall(r"<tr>(.*?)</tr>", text.split("<thead>")[1].split("</thead>")[0])
    ]
    assert heads[0] == [(1, "speed"), (4, "calf"), (4, "thigh")]
    assert heads[1] == [(2, "ours"), (2, "paper")] * 2
    assert heads[2] == [(1, "PD"), (1, "ILC")] * 4
    assert '<th scope="row">0.3</th><td>1</td>' in text
    markdown = document.to_markdown("figures")
    assert "A row a speed.\n\n| speed | calf ours PD |" in markdown


def test_links_and_pictures_lead_to_files_beside_the_document() -> None:
    document = Document("Links")
    document.links({"watch it": "replay.html#speed=0.3&t=1", "numbers": "summary.csv"})
    document.links({})
    document.picture("still", Figure(figsize=(1, 1)), "A still", address="replay.html")
    text = document.to_html()
    assert '<a href="replay.html#speed=0.3&amp;t=1">watch it</a>' in text
    assert re.search(r'<a href="replay.html"><img alt="A still" src="data:image', text)
    assert text.count("<p>") == 1
    markdown = document.to_markdown("figures")
    assert "[watch it](replay.html#speed=0.3&t=1) · [numbers](summary.csv)" in markdown
    assert "[![A still](figures/still.svg)](replay.html)" in markdown


@pytest.mark.browser
def test_on_paper_no_table_is_cut_off_and_in_the_dark_letters_are_light(
    browser: Eye, tmp_path: Path
) -> None:
    """Fifteen columns, as the widest table of the report has them, within the margins of A4."""
    names = ["knows", "better than model (calf/thigh)", "cost of transport (robots at 0.1 m/s)"]
    names += [f"thigh: felt peak {k} [rad]" for k in range(12)]
    row = ["urdf, rotors", "better/open", "1.21 (14)", *["0.0981"] * 12]
    document = Document("Wide")
    rows = ["PD", "PD + model", "ILC, gaits with rotors"]
    document.table(pd.DataFrame([row] * 3, index=rows, columns=names))
    path = tmp_path / "wide.html"
    path.write_text(document.to_html())
    browser.call("Page.navigate", url=path.as_uri())
    time.sleep(0.5)
    of = "document.querySelector"
    beyond = f"{of}('table').scrollWidth - {of}('.table').clientWidth"
    tall = "document.querySelector('tbody td:nth-child(5)').getClientRects()[0].height"
    try:
        for scheme, dark in (("light", False), ("dark", True)):
            browser.call(
                "Emulation.setEmulatedMedia",
                features=[{"name": "prefers-color-scheme", "value": scheme}],
            )
            page = browser.look()[:, -200:].mean()
            assert (page < 60) == dark
        browser.call("Emulation.setEmulatedMedia", media="print")
        a4 = round((210 - 2 * 14) / 25.4 * 96)  # px between the margins
        size = {"width": a4, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.call("Emulation.setDeviceMetricsOverride", **size)
        assert browser.run(beyond) <= 0
        assert browser.run("document.documentElement.scrollWidth") <= a4
        assert browser.run(tall) < 36  # a number stands in one line
    finally:
        browser.call("Emulation.setEmulatedMedia", media="", features=[])
        size = {"width": 960, "height": 700, "deviceScaleFactor": 1, "mobile": False}
        browser.call("Emulation.setDeviceMetricsOverride", **size)
