"""Robots with two legs, and with joints that turn against the trunk's axes, from the shell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pronk_pin.cli import main
from pronk_pin.compare import Results
from pronk_pin.kinematics import mirrored
from pronk_pin.robot import load_robot


@pytest.mark.parametrize(("name", "legs"), [("hyq", 4), ("bolt", 2)])
def test_practice_works_on_other_robots_and_can_be_looked_at(
    name: str, legs: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / name)
    asked = ["compare", "--robot", name, "--speeds", "0.2", "--controllers", "pd", "ilc"]
    schedule = ["--schedule.baseline", "2", "--schedule.learning", "5"]
    assert main([*asked, *schedule, "--folder", folder, "--workers", "1"]) == 0
    printed = capsys.readouterr().out
    for page in ("report", "replay"):
        assert f"{page}   {folder}/{page}.html" in printed
    results = Results.load(folder)
    strides = results.dataset().sel(scenario="nominal", seed=0, speed=0.2)
    assert (strides.sizes["joint"], strides.sizes["foot"]) == (3 * legs, legs)
    assert float(strides["upright"].min()) == 1.0
    peaks = {}
    for controller in ("pd", "ilc"):
        of_one = strides.sel(controller=controller)
        last = int(of_one["count"]) - 1
        peaks[controller] = of_one["peak_error"].isel(stride=last).groupby("kind").mean()
        # Left and right do the same, whichever way their joints turn.
        error = of_one["error"].sel(part="stance").isel(stride=last).to_numpy()
        image = mirrored(load_robot(name), error)
        np.testing.assert_allclose(image, error, atol=0.1 * np.abs(error).max())
    for kind in ("thigh", "calf"):
        assert float(peaks["ilc"].sel(kind=kind)) < 0.5 * float(peaks["pd"].sel(kind=kind))
