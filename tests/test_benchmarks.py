"""One command runs all measurements of speed, and says which has failed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import speed  # of benchmarks/


def test_each_that_is_run_is_there() -> None:
    assert not [name for name in speed.BENCHMARKS if not (speed.FOLDER / f"{name}.py").is_file()]


def test_a_benchmark_that_fails_is_named_below_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dynamics.py").write_text("print('measured')")
    (tmp_path / "viz.py").write_text("raise SystemExit(3)")
    monkeypatch.setattr(speed, "FOLDER", tmp_path)
    monkeypatch.setattr(sys, "argv", ["speed.py", "dynamics", "viz"])
    with pytest.raises(SystemExit, match="failed: viz"):
        speed.main()
    out = capfd.readouterr().out
    assert "measured" in out
    rows = [line.split() for line in out.splitlines() if line.startswith(("dynamics", "viz"))]
    assert [(row[0], row[-1]) for row in rows] == [("dynamics", "done"), ("viz", "3")]


def test_one_that_is_not_there_is_named() -> None:
    words = [sys.executable, str(speed.FOLDER / "speed.py"), "everything"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "no benchmark everything; choose command_line" in done.stderr
