"""What the README and the pages of documentation say works."""

from __future__ import annotations

import datetime
import re
import shlex
from pathlib import Path

import pytest

import pronk_pin
from pronk_pin import cli

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def examples() -> list[object]:
    """The Python examples of the README and of the documentation, by their place."""
    found = []
    for page in PAGES:
        for match in re.finditer(r"```python\n(.*?)```", page.read_text(), flags=re.DOTALL):
            line = page.read_text()[: match.start()].count("\n") + 2
            found.append(pytest.param(match[1], id=f"{page.name}:{line}"))
    return found


@pytest.mark.parametrize("code", examples())
def test_examples_run_and_print_what_they_say(
    code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    exec(compile(code, "example", "exec"), {})
    said = re.findall(r"^(?:print|\)).*# (.*)$", code, flags=re.MULTILINE)
    assert capsys.readouterr().out.splitlines() == said
    assert said


def test_examples_are_short() -> None:
    for example in examples():
        (code,) = example.values  # type: ignore[attr-defined]
        assert len(code.splitlines()) <= 13, code


def test_commands_are_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    commands = re.findall(r"^pronk-pin ([^#\n]*)", README, flags=re.MULTILINE)
    assert len(commands) >= 5
    for kind in cli.COMMANDS.values():
        monkeypatch.setattr(kind, "run", lambda self: getattr(self, "experiment", None) and None)
    for command in commands:
        assert cli.main(shlex.split(command)) == 0, command


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
        assert (page.parent / target).exists(), target


def test_the_root_links_lead_into_the_package() -> None:
    for name in ("gait", "control", "compare", "viz"):
        assert (ROOT / name).resolve() == ROOT / "pronk_pin" / name


def test_the_version_and_its_date_are_the_same_everywhere() -> None:
    version = re.search(r'^version = "(.+)"', (ROOT / "pyproject.toml").read_text(), flags=re.M)
    cited = (ROOT / "CITATION.cff").read_text()
    assert version is not None
    assert version[1] == pronk_pin.__version__
    assert f"version: {version[1]}\n" in cited
    date = re.search(r'^date-released: "(.+)"', cited, flags=re.M)
    assert date is not None
    day = datetime.date.fromisoformat(date[1])
    heading = f"## {version[1]}, {day.day} {day:%B %Y}"
    assert heading in (ROOT / "CHANGELOG.md").read_text().splitlines()
