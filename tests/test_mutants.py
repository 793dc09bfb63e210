"""Faults that are put in to see whether tests notice: drawn alike, small, and of the program."""

from __future__ import annotations

import ast
import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def mutants() -> ModuleType:
    """The script, which is no module of the package."""
    spec = importlib.util.spec_from_file_location("mutants", ROOT / "benchmarks" / "mutants.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["mutants"] = module  # where its dataclass looks
    spec.loader.exec_module(module)
    return module


def test_a_seed_draws_the_same_faults_as_many_in_each_room(mutants: ModuleType) -> None:
    rooms = ["dynamics", "gait/audit", "viz/figures"]
    drawn = mutants.draw(9, 3, rooms)
    assert drawn == mutants.draw(9, 3, rooms)
    assert drawn != mutants.draw(9, 4, rooms)
    assert sorted(fault.room for fault in drawn) == sorted(3 * rooms)
    with pytest.raises(SystemExit, match="there is no room attic"):
        mutants.draw(3, 0, ["attic"])


def test_a_fault_is_one_change_of_a_program_that_compiles(mutants: ModuleType) -> None:
    for fault in mutants.draw(12, 0, ["dynamics", "gait/audit", "viz/figures"]):
        before = (ROOT / fault.path).read_bytes()
        after = fault.put_into(before)
        assert after[: fault.start] == before[: fault.start]
        assert after.endswith(before[fault.end :])
        trees = [ast.dump(ast.parse(text)) for text in (before, after)]
        assert trees[0] != trees[1]


@pytest.mark.parametrize(
    ("line", "changed"),
    [
        ("x = a + b", {"x = a - b"}),
        ("x = a if b < c else d", {"x = a if b >= c else d"}),
        ("x = min(a, b)", {"x = max(a, b)"}),
        ("x = f(a, k=b)", {"x = f(a, )"}),
        ("x = a and b", {"x = a or b"}),
        ("x = -a", {"x = a"}),
        ("x = 0.5", {"x = 1.0"}),
        ("x = [3, True]", {"x = [4, True]", "x = [3, False]"}),
        ("f(a)", {"pass"}),
        ("x: Literal[3] = a", set()),
        ("raise ValueError(3)", set()),
        ("x = f'{a + b}'", set()),
        ("x = 'a' + b", set()),
        ("f.plot(a, lw=2.0)", {"pass"}),
    ],
)
def test_what_a_line_can_become(
    line: str,
    changed: set[str],
    mutants: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mutants, "ROOT", tmp_path)
    (tmp_path / "one.py").write_text(line)
    found = {fault.put_into(line.encode()).decode() for fault in mutants.faults(Path("one.py"))}
    assert found == changed


def test_the_nearest_tests_come_first_and_each_once(mutants: ModuleType) -> None:
    (fault, *_) = mutants.draw(1, 0, ["gait/audit"])
    stages = list(mutants.stages(fault, own=False))
    assert all(file.startswith("tests/gait/audit/") for file in stages[0])
    everything = [file for stage in stages for file in stage]
    assert len(everything) == len(set(everything))
    files = {str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("test_*.py")}
    assert set(everything) == files
    own = {file for stage in mutants.stages(fault, own=True) for file in stage}
    assert own == {file for file in files if file.startswith("tests/gait/audit/")}
