"""The house is in order: one idea a room, rooms used through their faces, no name twice.

Who stands above whom is checked by `lint-imports`, see pyproject.toml.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "pronk_pin").rglob("*.py"))
FACES = [path for path in MODULES if path.name == "__init__.py"]
MOST = 10
"""Files of a room, its face aside."""


def dotted(path: Path) -> str:
    """Name of a module or of a package, as imports spell it."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


ROOMS = {dotted(path) for path in FACES}
NAMES = {dotted(path) for path in MODULES}


def room(module: str) -> str:
    """The package a module stands in; a package is its own."""
    return module if module in ROOMS else module.rpartition(".")[0]


def around(inner: str, outer: str) -> bool:
    """Whether a room is, or stands within, another."""
    return f"{inner}.".startswith(f"{outer}.")


def imports(path: Path) -> Iterator[tuple[int, str, str]]:
    """Line, module and name of every import of ours in a file, late ones too."""
    module = dotted(path)
    package = room(module).split(".")
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*base, *(node.module or "").split(".")]).rstrip(".")
            for alias in node.names:
                yield node.lineno, source, alias.name
        elif isinstance(node, ast.Import):
            for alias in node.names:
                yield node.lineno, alias.name, ""


def offered(package: str) -> set[str]:
    """What a face exports; some functions bear their module's name."""
    face = ROOT / package.replace(".", "/") / "__init__.py"
    if not face.exists():
        return set()
    lists = [
        ast.literal_eval(node.value)
        for node in ast.parse(face.read_text()).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    ]
    return {name for each in lists for name in each}


def trespasses(path: Path) -> list[str]:
    """Imports of a file that go past the face of another room, or through that of its own."""
    mine, found = room(dotted(path)), []
    for line, source, name in imports(path):
        if not around(source, "pronk_pin") or name == "__name__":  # that one is no face's
            continue
        module = f"{source}.{name}" in NAMES - ROOMS and name not in offered(source)
        target = f"{source}.{name}" if module else source
        if dotted(path) == "pronk_pin.__main__" or path.name == "__init__.py":
            own = False
        else:
            own = target in ROOMS and around(mine, target) and f"{source}.{name}" not in ROOMS
        past = target not in ROOMS and not around(mine, room(target))
        private = name.startswith("_") and not around(mine, room(target))
        if own or past or private:
            found.append(f"{path.relative_to(ROOT)}:{line}: {name} of {source}")
    return found


def test_another_room_is_used_through_its_face() -> None:
    found = [each for path in MODULES for each in trespasses(path)]
    assert not found, "\n".join(found)


def test_a_trespass_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    path = tmp_path / "pronk_pin" / "compare" / "world" / "ground.py"
    path.parent.mkdir(parents=True)
    seen = {
        "from ...robot.robot import Robot": True,  # past a face
        "from ...control.signals import tape": True,  # past it, too
        "from .. import World": True,  # through the face of one's own house
        "from ...robot import Robot": False,
        "from ...control.signals import Tape": False,
        "from .scenario import Scenario": False,
        "from ...errors import PronkError": False,
        "from ... import control": False,
    }
    for line, wrong in seen.items():
        path.write_text(line + "\n")
        assert bool(trespasses(path)) == wrong, line


@pytest.mark.parametrize("face", FACES, ids=dotted)
def test_a_room_holds_ten_files_at_most(face: Path) -> None:
    files = [path.name for path in face.parent.glob("*.py") if path != face]
    assert len(files) <= MOST, f"{len(files)} files in {dotted(face)}: give an idea its own room"


def test_a_file_name_stands_once_in_the_house() -> None:
    places = defaultdict(list)
    for path in MODULES:
        if path.name != "__init__.py":
            places[path.name].append(dotted(path))
    assert not {name: where for name, where in places.items() if len(where) > 1}


@pytest.mark.parametrize("face", FACES, ids=dotted)
def test_a_face_says_what_comes_in_and_what_goes_out(face: Path) -> None:
    if dotted(face) in {"pronk_pin", "pronk_pin.cli"}:
        pytest.skip("the whole house, and its door")
    text = ast.get_docstring(ast.parse(face.read_text())) or ""
    assert "Comes in:" in text, text
    assert "Goes out:" in text, text


def test_tests_stand_as_the_rooms_do() -> None:
    """A test that bears the name of a room or of a module lies in the folder of that room."""
    rooms = defaultdict(set)
    for path in MODULES:
        folder = path.parent.relative_to(ROOT / "pronk_pin").as_posix()
        rooms[path.parent.name if path in FACES else path.stem].add(folder)
    for path in sorted((ROOT / "tests").rglob("test_*.py")):
        folder = path.parent.relative_to(ROOT / "tests").as_posix()
        allowed = rooms.get(path.stem.removeprefix("test_"), {folder})
        assert folder in allowed, f"{path.relative_to(ROOT)} belongs into {sorted(allowed)}"


def test_the_map_shows_every_room() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text()
    drawing = page[: page.index("## What flows")]
    words = set(drawing.replace("/", " ").split())
    missing = {dotted(path).rpartition(".")[2] for path in MODULES} - words
    missing = {name for name in missing if not name.startswith("_")}
    assert not missing - {"pronk_pin"}, f"docs/architecture.md does not show {sorted(missing)}"
