"""The examples, as files outside the package: each runs, and its folder can be reported on."""

from __future__ import annotations

import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pronk_pin import cli

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))


SLOW = ("own_robot", "whole_body_qp", "dart_engine")

ALONE = "own_law"
"""The example that is run as a process of its own, with two workers; the others run in this one."""

LONGEST = {"dart_engine": 270}
"""Lines of an example, 90 without a word of its own."""


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SLOW), id=path.stem)
        for path in EXAMPLES
    ],
)
def test_an_example_runs_where_it_was_copied_to(
    example: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Then its result is reported where its classes are not known any more."""
    if example.stem == "dart_engine":
        pytest.importorskip("dartpy")
    script, folder = tmp_path / example.name, tmp_path / "result"
    shutil.copy(example, script)
    if example.stem == ALONE:
        done = subprocess.run(
            [sys.executable, script, folder],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        printed = done.stdout
    else:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", [str(script), str(folder)])
        monkeypatch.setattr("pronk_pin.compare.execution.run.worker_count", lambda _: 1)
        runpy.run_path(str(script), run_name="__main__")
        printed = capsys.readouterr().out
    assert "controller" in printed
    assert len(script.read_text().splitlines()) < LONGEST.get(example.stem, 90)
    assert cli.main(["report", str(folder)]) == 0
    assert "report.html" in capsys.readouterr().out
    assert (folder / "replay.html").is_file()


def test_every_example_is_named_in_the_documentation() -> None:
    page = (EXAMPLES[0].parents[1] / "docs" / "laboratory.md").read_text()
    assert len(EXAMPLES) >= 6
    assert not [path.name for path in EXAMPLES if path.name not in page]
