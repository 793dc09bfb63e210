"""One small comparison, and simulations to order, for all tests of what happens."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import (
    Experiment,
    Results,
    Schedule,
    Simulation,
    load_scenario,
    run_experiment,
)
from pronk_pin.compare.metrics import COLUMNS
from pronk_pin.control import ControllerSpec
from pronk_pin.gait import Gait, GaitLibrary, load_library
from pronk_pin.robot import Robot

SPEEDS = (0.0, 0.45)
EXPERIMENT = Experiment(
    speeds=SPEEDS,
    controllers=("pd", "ilc", "library"),
    schedule=Schedule(baseline=4.0, learning=6.0),
)


@pytest.fixture(scope="session")
def gaits() -> list[Gait]:
    library = load_library("a1")
    return [library.at(speed) for speed in SPEEDS]


@pytest.fixture(scope="session")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A small comparison that has been run; tests that change it work on a copy."""
    folder = tmp_path_factory.mktemp("results") / "small"
    return run_experiment(EXPERIMENT, folder, workers=1, progress=False)


@pytest.fixture
def copy(comparison: Results, tmp_path: Path) -> Results:
    """A copy of the comparison that a test may damage."""
    folder = shutil.copytree(comparison.folder, tmp_path / "copy")
    return Results(folder, comparison.experiment)


def modified(results: Results) -> dict[str, int]:
    """When each file of strides was written [ns]."""
    return {path.name: path.stat().st_mtime_ns for path in results.folder.glob("strides/*.nc")}


@pytest.fixture(scope="session")
def simulation(robot: Robot, gaits: list[Gait]) -> Callable[..., Simulation]:
    def build(
        spec: ControllerSpec,
        *,
        seconds: float = 1.5,
        seed: int = 0,
        feedforward: Array | None = None,
    ) -> Simulation:
        return Simulation(
            robot,
            gaits,
            spec,
            load_scenario("nominal"),
            schedule=Schedule(startup=0.2, baseline=seconds, learning=0.0),
            rng=np.random.default_rng(seed),
            feedforward=feedforward,
        )

    return build


@pytest.fixture(scope="session")
def twin() -> GaitLibrary:
    """The A1's gaits as those of a robot of another name."""
    library = load_library("a1")
    gaits = tuple(replace(gait, robot="twin") for gait in library.gaits)
    audits = tuple(
        replace(audit, motion=gait.sha256) for gait, audit in zip(gaits, library.audit, strict=True)
    )
    metadata = {**library.metadata, "robot": "twin"}
    return replace(library, gaits=gaits, audit=audits, metadata=metadata)


PEAKS = {"pd": (0.10, 0.05), "ilc": (0.02, 0.01), "model": (0.03, 0.005)}
"""Peak errors of calf and thigh in the made summary."""


@pytest.fixture
def summary() -> pd.DataFrame:
    """Two speeds, of which the paper has one; errors twice as large at the other."""
    return made_summary({0.3: 1.0, 0.35: 2.0})


@pytest.fixture
def eight() -> pd.DataFrame:
    """Eight speeds, enough for intervals; errors twice as large at every other one."""
    return made_summary({0.3 + 0.05 * k: 1.0 + k % 2 for k in range(8)})


def made_summary(scales: dict[float, float]) -> pd.DataFrame:
    """A summary of three controllers at speeds whose errors are so many times `PEAKS`."""
    rows: list[dict[str, object]] = []
    for controller, peaks in PEAKS.items():
        for speed, scale in scales.items():
            key = {"robot": "a1", "base": "locked", "scenario": "nominal", "speed": speed}
            key |= {"controller": controller, "seed": 0}
            for joint, peak in zip(("calf", "thigh"), peaks, strict=True):
                for metric, share in (
                    ("peak_error", 1.0),
                    ("felt_peak_error", 0.5),
                    ("rms_error", 0.1),
                ):
                    value = scale * share * peak
                    rows.append({**key, "joint": joint, "metric": metric, "value": value})
            scalars = {"upright": 1.0, "feedback_share": 0.2, "speed_error": 0.1 * (scale - 1.5)}
            scalars["apex_error"] = 0.0
            if controller == "ilc":
                scalars["strides_to_converge"] = 4.0 * scale
                scalars["strides_to_beat_model"] = 3.0 if scale < 2.0 else np.nan
            rows += [{**key, "joint": "-", "metric": m, "value": v} for m, v in scalars.items()]
    return pd.DataFrame(rows).assign(unit="1")[COLUMNS]
