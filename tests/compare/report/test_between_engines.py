"""The same scenarios in two engines, one of which is the other under another name."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.compare import (
    Experiment,
    MujocoEngine,
    Results,
    Scenario,
    Schedule,
    World,
    run_experiment,
)
from pronk_pin.compare.report import (
    errors_between_engines,
    format_between_engines,
    winners_between_engines,
)
from pronk_pin.compare.report.between_engines import same_but_for_the_engine
from pronk_pin.control import Gains
from pronk_pin.robot import Robot


@dataclass(frozen=True)
class Other(MujocoEngine):
    """MuJoCo under another name, whose motors may give less."""

    name: str = "other"
    torque_constant: float = 1.0

    def world(
        self, robot: Robot, scenario: Scenario, n: int, *, base: str, servo: Gains | None = None
    ) -> World:
        scenario = replace(scenario, torque_constant=self.torque_constant)
        return super().world(robot, scenario, n, base=base, servo=servo)


same, weak = Other("same"), Other("weak", 0.6)


def compared(folder: Path, engine: str) -> Results:
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", "model"),
        scenarios=("ideal", f"ideal+{__name__}:{engine}", "nominal"),
        schedule=Schedule(0.5, 3.0, 0.0),
    )
    return run_experiment(experiment, folder, workers=1, progress=False)


def test_an_engine_under_another_name_names_the_same_winners(tmp_path: Path) -> None:
    results = compared(tmp_path / "same", "same")
    assert same_but_for_the_engine(results.experiment) == {
        "ideal": {"mujoco": "ideal", "same": "ideal+same"}
    }
    errors = errors_between_engines(results)
    assert errors.index.tolist() == [("ideal", "pd"), ("ideal", "model")]
    np.testing.assert_array_equal(errors["mujoco"].to_numpy(), errors["same"].to_numpy())
    model = errors.loc[("ideal", "model"), ("mujoco", "calf")]
    pd_ = errors.loc[("ideal", "pd"), ("mujoco", "calf")]
    winners = winners_between_engines(results)
    row = winners.loc[("model", "pd", "ideal", "calf"), "mujoco"]
    assert row["change"] == pytest.approx(model / pd_ - 1.0)
    assert (row["ahead"], row["pairs"]) == (2.0, 2.0)
    text = format_between_engines(results)
    assert "In 2 of 2 comparisons" in text
    assert "Nowhere do they name different ones." in text


def test_the_table_has_the_errors_of_each_engine(tmp_path: Path) -> None:
    results = compared(tmp_path / "weak", "weak")
    errors = errors_between_engines(results) * 1e3
    text = format_between_engines(results)
    for engine in ("mujoco", "weak"):
        for controller in ("pd", "model"):
            peaks = errors.loc[("ideal", controller), engine]
            assert f"{peaks['calf']:.1f}, {peaks['thigh']:.1f}" in text


def test_one_engine_has_nothing_beside_it(tmp_path: Path) -> None:
    experiment = Experiment(speeds=(0.0,), controllers=("pd",), schedule=Schedule(0.2, 1.0, 0.0))
    results = run_experiment(experiment, tmp_path / "one", workers=1, progress=False)
    assert format_between_engines(results) == ""
