"""A comparison that has been run, for tests of what becomes of its folder."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pronk_pin.compare import Results


@pytest.fixture
def copy(comparison: Results, tmp_path: Path) -> Results:
    """A copy of the comparison that a test may damage."""
    folder = shutil.copytree(comparison.folder, tmp_path / "copy")
    return Results(folder, comparison.experiment)


def modified(results: Results) -> dict[str, int]:
    """When each file of strides was written [ns]."""
    return {path.name: path.stat().st_mtime_ns for path in results.folder.glob("strides/*.nc")}
