"""The pages that a newcomer follows: their commands run as they stand, and their names exist."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import pronk_pin
from pronk_pin import (
    cli,
    compare,
    control,
    dynamics,
    errors,
    gait,
    inverse_dynamics,
    kinematics,
    parity,
    robot,
    viz,
)
from pronk_pin.control import CONTROLLERS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
FACES = (
    *(compare, control, dynamics, errors, gait, inverse_dynamics, kinematics, parity, robot, viz),
    pronk_pin,
)
BLOCK = re.compile(r'^```(sh|python) ?(?:title="(.+?)")?\n(.*?)^```', flags=re.M | re.S)


def commands(page: str) -> list[str]:
    """Commands in a page's blocks of shell."""
    blocks = [match[3] for match in BLOCK.finditer((DOCS / page).read_text()) if match[1] == "sh"]
    return [line for block in blocks for line in block.splitlines() if line.startswith("pronk-pin")]


@pytest.mark.slow
def test_the_first_hour_can_be_followed_to_the_letter(tmp_path: Path) -> None:
    done = 0
    for match in BLOCK.finditer((DOCS / "first_hour.md").read_text()):
        if match[1] == "python":
            (tmp_path / match[2]).write_text(match[3])
            continue
        for line in match[3].splitlines():
            words = [sys.executable, "-m", "pronk_pin", *shlex.split(line)[1:]]
            run = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
            assert run.returncode == 0, f"{line}\n{run.stdout[-500:]}\n{run.stderr[-500:]}"
            done += 1
    assert done >= 6
    assert "mine" in (tmp_path / "first" / "summary.csv").read_text()
    assert (tmp_path / "motion.html").stat().st_size > 10_000


def test_the_first_hours_commands_are_understood(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    for kind in cli.COMMANDS.values():
        monkeypatch.setattr(kind, "run", lambda self: None)
    for command in commands("first_hour.md"):
        assert cli.main(shlex.split(command)[1:]) == 0, command


def exists(name: str) -> bool:
    """Whether a dotted name is one of our faces', or a field of a class there."""
    first, *rest = name.split(".")
    for face in FACES:
        found = getattr(face, first, None)
        if found is not None:
            fields = {
                **getattr(found, "__dataclass_fields__", {}),
                **getattr(found, "__dict__", {}),
            }
            return not rest or rest[0] in fields or hasattr(found, rest[0])
    return False


def test_what_the_page_of_the_paper_names_exists() -> None:
    text = (DOCS / "paper.md").read_text()
    names = set(re.findall(r"`([A-Z]\w+(?:\.\w+)?|[a-z]+_\w+)`", text))
    assert len(names) > 20
    assert not {name for name in names if not exists(name)}
    files = set(re.findall(r"`([\w/]+\.py)`", text))
    for file in files:
        assert (ROOT / file).exists() or (ROOT / "pronk_pin" / file).exists(), file
    controllers = set(re.findall(r"`((?:ilc|model)[\w+-]*)`", text))
    assert controllers <= {*CONTROLLERS, "ilc"}
    for equation in range(1, 15):
        assert f"({equation})" in text


def test_every_page_is_in_the_sites_menu_and_every_room_has_its_page() -> None:
    menu = (ROOT / "mkdocs.yml").read_text()
    pages = {str(page.relative_to(DOCS)) for page in DOCS.rglob("*.md")}
    # Made when the site is built.
    notebooks = {path.stem for path in (ROOT / "examples" / "notebooks").glob("*.py")}
    assert len(notebooks) == 2
    pages |= {"gallery.md"} | {f"notebooks/{name}.md" for name in notebooks}
    assert set(re.findall(r"(\S+\.md)$", menu, flags=re.M)) == pages
    rooms = {path.parent.name for path in (ROOT / "pronk_pin").glob("*/__init__.py")}
    shown = {path.stem for path in (DOCS / "api").glob("*.md")}
    assert rooms - shown == {"cli", "storage"}
