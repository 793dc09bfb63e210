"""What an installed package announces goes by name: it is listed, and run in workers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pronk_pin.compare import Results
from pronk_pin.gait import GaitLibrary

MODULE = """
from dataclasses import dataclass, replace

from pronk_pin.compare import Metric, Scenario
from pronk_pin.control import ControllerSpec
from pronk_pin.robot import ROBOTS


@dataclass(frozen=True)
class HouseLaw:
    gain: float = 0.4

    def update(self, record):
        return record.feedforward + self.gain * record.feedback


def hardest(strides):
    return strides["tick_force"].sel(direction="z").max(("last", "part", "tick", "foot"))


twin = replace(ROBOTS["a1"], name="twin")
law = ControllerSpec("house-law", law=HouseLaw())
worn = Scenario("worn", coulomb=(0.2, 0.3, 0.5))
landing = Metric("hardest_landing", "N", hardest)
"""

POINTS = """
[pronk_pin.controllers]
house-law = house_of_laws.things:law
[pronk_pin.robots]
twin = house_of_laws.things:twin
[pronk_pin.scenarios]
worn = house_of_laws.things:worn
[pronk_pin.metrics]
hardest_landing = house_of_laws.things:landing
"""

MARK = "and now the comparison"
PROGRAM = f"""
import sys
from pronk_pin.cli import main
if __name__ == "__main__":
    for kind in ("controllers", "robots", "scenarios", "metrics"):
        main(["list", kind])
    print("{MARK}")
    sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder in which a small package is installed, as pip would leave it."""
    site = tmp_path / "site-packages"
    package, record = site / "house_of_laws", site / "house_of_laws-1.0.dist-info"
    package.mkdir(parents=True)
    record.mkdir()
    (package / "__init__.py").touch()
    (package / "things.py").write_text(MODULE)
    (record / "METADATA").write_text("Metadata-Version: 2.1\nName: house-of-laws\nVersion: 1.0\n")
    (record / "entry_points.txt").write_text(POINTS)
    return site


def python(site: Path, *words: str) -> str:
    """What Python prints, run where that site is on the path."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd="/",
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *filter(None, sys.path)])},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_what_a_package_announces_is_listed_and_run_by_name(
    site: Path, twin: GaitLibrary, tmp_path: Path
) -> None:
    folder = tmp_path / "result"
    gaits = twin.save(tmp_path / "gaits.npz")
    words = [
        *("compare", "--robot", "twin", "--gaits", str(gaits)),
        *("--speeds", "0.3", "--controllers", "pd", "house-law"),
        *("--scenarios", "worn+slope=0.05", "--metrics", "hardest_landing"),
        *("--schedule.startup", "0.2", "--schedule.baseline", "1", "--schedule.learning", "0.5"),
        *("--workers", "2", "--folder", str(folder)),
    ]
    lists, printed = python(site, "-c", PROGRAM, *words).split(MARK)
    listed = {line.split()[0] for line in lists.splitlines()}
    assert listed > {"house-law", "twin", "worn", "hardest_landing", "ilc", "a1", "nominal"}
    assert "robot twin" in printed
    summary = (folder / "summary.csv").read_text()
    for name in ("twin", "house-law", "worn+slope=0.05", "hardest_landing"):
        assert name in summary
    assert "house_of_laws" not in sys.modules  # the folder holds them whole
    assert Results.load(folder).experiment.scenario_names == ("worn+slope=0.05",)
    assert (folder / "report.html").is_file()
