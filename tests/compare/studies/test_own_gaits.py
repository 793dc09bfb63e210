"""Studies of a result play its own gaits, with its own robot, controllers and worlds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
import xarray as xr

from pronk_pin._typing import Array
from pronk_pin.cli import main
from pronk_pin.compare import (
    Experiment,
    Results,
    Scenario,
    Schedule,
    explain,
    run_experiment,
)
from pronk_pin.compare.studies import close_loop
from pronk_pin.compare.studies.identified_models import _scenarios
from pronk_pin.control import ControllerSpec, LawContext, LearningLaw, PDTypeILC, StrideRecord
from pronk_pin.gait import Gait, GaitLibrary
from pronk_pin.robot import ROBOTS, load_robot

WORN = Scenario("worn", armature=0.01, damping=0.1, coulomb=(0.2, 0.3, 0.4))
SCHEDULE = Schedule(startup=0.2, baseline=1.5, learning=3.0)


@dataclass(frozen=True)
class BoundLaw:
    """It learns only where it was bound."""

    def bind(self, context: LawContext) -> LearningLaw:
        return PDTypeILC(gains=context.gains)

    def update(self, record: StrideRecord) -> Array:
        raise AssertionError("was not bound")


@pytest.fixture(scope="module")
def results(twin: GaitLibrary, tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Of a robot of one's own, at an apex of one's own."""
    experiment = Experiment(
        robot=replace(ROBOTS["a1"], name="twin"),
        gaits=twin,
        apex=0.33,
        speeds=(0.0, 0.3),
        controllers=("ilc", ControllerSpec("mine", law=BoundLaw())),
        scenarios=(WORN,),
        schedule=SCHEDULE,
    )
    folder = tmp_path_factory.mktemp("own") / "result"
    return run_experiment(experiment, folder, workers=1, progress=False)


def test_a_prediction_is_made_along_the_gait_that_was_played(
    results: Results, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["ilc", "analyze", "mine", "--result", str(results.folder), "--speed", "0.3"]
    words += ["--scenario", "worn", "--strides", "5", "--figure", str(tmp_path / "a.png")]
    assert main(words) == 0
    assert "mine at 0.3 m/s" in capsys.readouterr().out


def test_the_loop_is_closed_with_the_gaits_that_were_played(results: Results) -> None:
    strides = results.all_strides(controller="ilc")
    planned_at = results.experiment.planned_at
    explanation = explain(strides, gaits=planned_at((0.0, 0.3)), draws=2)
    asked: list[Gait] = []

    def planned(speeds: object) -> list[Gait]:
        asked.extend(planned_at(speeds))  # type: ignore[arg-type]
        return asked

    table = close_loop(
        explanation,
        strides,
        scenarios=[WORN],
        controllers=("model", "identified"),
        schedule=replace(SCHEDULE, learning=0.0),
        planned_at=planned,
        progress=False,
    )
    assert [(gait.robot, gait.speed, gait.apex) for gait in asked] == [("twin", 0.15, 0.33)]
    assert list(table["controller"]) == ["model", "identified"]
    assert table["upright"].all()


def test_the_command_explains_and_closes_the_loop(
    results: Results, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = []

    def closed(explanation: object, strides: object, **options: object) -> object:
        seen.append(options["planned_at"]((0.15,)))  # type: ignore[operator]
        return close_loop(
            explanation,  # type: ignore[arg-type]
            strides,  # type: ignore[arg-type]
            scenarios=[WORN],
            controllers=("identified",),
            schedule=replace(SCHEDULE, learning=0.0),
            progress=False,
            **options,  # type: ignore[arg-type]
        )

    monkeypatch.setattr("pronk_pin.compare.studies.close_loop", closed)
    assert main(["explain", str(results.folder), "--close-loop", "--draws", "2"]) == 0
    assert "identified" in capsys.readouterr().out
    assert [gait.apex for gait in seen[0]] == [0.33]


@pytest.mark.parametrize(
    ("name", "load"), [("a1", 3.0), ("bolt", 0.27), ("hyq", 19.0)], ids=["a1", "bolt", "hyq"]
)
def test_the_loop_is_closed_under_a_load_that_is_the_same_share_of_each_robot(
    name: str, load: float
) -> None:
    strides = xr.Dataset(attrs={"scenario_parameters": WORN.to_json()})
    own, loaded = _scenarios(load_robot(name), strides, None)
    assert own == WORN
    assert (loaded.name, loaded.payload) == (f"worn+{load:g}kg", load)
