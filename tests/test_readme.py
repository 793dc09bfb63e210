"""What the README says works."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from pronk_pin import cli

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


@pytest.mark.parametrize("code", re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL))
def test_examples_run_and_print_what_they_say(
    code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    exec(compile(code, "README.md", "exec"), {})
    said = re.findall(r"^print.*# (.*)$", code, flags=re.MULTILINE)
    assert capsys.readouterr().out.splitlines() == said


def test_commands_are_understood(monkeypatch: pytest.MonkeyPatch) -> None:
    commands = re.findall(r"^pronk-pin ([^#\n]*)", README, flags=re.MULTILINE)
    assert len(commands) >= 5
    for kind in (cli.Compare, cli.View, cli.Report, cli.Gaits):
        monkeypatch.setattr(kind, "run", lambda self: None)
    for command in commands:
        assert cli.main(shlex.split(command)) == 0, command


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (ROOT / target).exists(), target


def test_the_root_links_lead_into_the_package() -> None:
    for name in ("gait", "control", "compare", "viz"):
        assert (ROOT / name).resolve() == ROOT / "pronk_pin" / name
