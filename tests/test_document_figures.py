"""What documents say commands print, and the commands: the same numbers."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
MARKED = re.compile(r"<!-- \[\[\[cog (.*?) \]\]\] -->\n(.*?)<!-- \[\[\[end\]\]\] -->", re.S)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")

TOLERANCE = 0.1
"""Relative difference of a number that another machine may make: strides fall to another tick."""


def marked() -> list[object]:
    """The marked parts of the documents: what makes each, and what stands there."""
    return [
        pytest.param(match[1], match[2], id=f"{page.name}-{k}")
        for page in PAGES
        for k, match in enumerate(MARKED.finditer(page.read_text()))
    ]


def differences(there: str, made: str) -> list[str]:
    """Numbers that differ by more than the tolerance and the last digit, or other words."""
    words = [re.sub(r"\s+", " ", NUMBER.sub("#", text)) for text in (there, made)]
    if words[0] != words[1]:
        return ["other words"]
    found = []
    for one, other in zip(NUMBER.findall(there), NUMBER.findall(made), strict=True):
        digit = 10.0 ** -len(one.partition(".")[2])
        if abs(float(one) - float(other)) > TOLERANCE * abs(float(one)) + 2.0 * digit:
            found.append(f"{one} there, {other} made")
    return found


def test_what_differs_is_seen() -> None:
    assert differences("a 0.100, 5 of 5", "a 0.101, 5 of 5") == []
    assert differences("a 0.100, 5 of 5", "a 0.150, 5 of 5") == ["0.100 there, 0.150 made"]
    assert differences("a 0.100", "b 0.100") == ["other words"]


def test_every_marker_is_closed_and_filled() -> None:
    for page in PAGES:
        text = page.read_text()
        assert text.count("[[[cog") == len(MARKED.findall(text)) == text.count("[[[end]]]"), page
    for parameters in marked():
        _, there = parameters.values  # type: ignore[attr-defined]
        assert there.startswith("```\n$ pronk-pin ")


@pytest.mark.slow
@pytest.mark.parametrize(("maker", "there"), marked())
def test_a_document_says_what_its_command_prints(maker: str, there: str, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"<!-- [[[cog {maker} ]]] -->\n<!-- [[[end]]] -->\n")
    words = ["-m", "cogapp", "-r", "-I", str(ROOT / "benchmarks"), str(page)]
    subprocess.run([sys.executable, *words], check=True)
    match = MARKED.search(page.read_text())
    assert match is not None
    assert differences(there, match[2]) == []
