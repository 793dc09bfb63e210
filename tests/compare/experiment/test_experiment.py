from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from pronk_pin.compare import (
    DEFAULT_CONTROLLERS,
    Experiment,
    Results,
    Schedule,
    run_cell,
    steady,
)
from pronk_pin.compare.experiment import torque_library
from pronk_pin.control import phase_grid
from pronk_pin.errors import InvalidInput, PronkError
from pronk_pin.gait import SPEEDS
from pronk_pin.robot import Robot
from pronk_pin.robot.formats.urdf import mujoco_spec

SHORT = Schedule(startup=0.1, baseline=1.0, learning=0.5)


def test_the_default_is_the_papers_speeds_under_five_controllers() -> None:
    experiment = Experiment()
    assert len(experiment.speeds) == 14
    assert (experiment.speeds[0], experiment.speeds[-1]) == (-0.5, 0.8)
    assert experiment.speeds == SPEEDS
    assert sorted(cell.controller for cell in experiment.cells()) == sorted(DEFAULT_CONTROLLERS)


def test_what_the_library_replays_is_learned_before() -> None:
    experiment = Experiment(
        controllers=("library", "pd"), scenarios=("nominal", "payload"), seeds=(0, 1)
    )
    done: list[object] = []
    for cell in experiment.cells():
        assert cell.depends_on is None or cell.depends_on in done
        done.append(cell)
    # Learning was not asked for, but each scenario and seed needs it.
    assert len(done) == len(set(done)) == 3 * 2 * 2


def test_each_cell_has_a_file_name_of_its_own() -> None:
    experiment = Experiment(scenarios=("nominal", "payload"), seeds=(0, 1))
    names = [cell.name for cell in experiment.cells()]
    assert len(names) == len(set(names)) == len(DEFAULT_CONTROLLERS) * 2 * 2
    assert "ilc+rotors_payload_1" in names


def test_scenarios_are_known_by_one_spelling() -> None:
    experiment = Experiment(scenarios=("nominal+slope+payload=3", "ideal"))
    assert experiment.scenarios == ("payload+slope", "ideal")


def test_the_same_robot_from_an_mjcf_makes_the_same_strides(robot: Robot, tmp_path: Path) -> None:
    """But for the six digits of the file."""
    spec = mujoco_spec(robot)
    spec.compile()
    path = tmp_path / "robot.xml"
    path.write_text(spec.to_xml())
    settings: dict[str, Any] = {"speeds": (0.3,), "controllers": ("pd",), "schedule": SHORT}
    own, other = (
        run_cell(Experiment(**settings, mjcf=world).cells()[0]) for world in ("", str(path))
    )
    assert other.attrs["mjcf"] == str(path)
    assert len(other.attrs["mjcf_sha256"]) == 64
    first = {"stride": slice(0, 2)}
    np.testing.assert_allclose(
        other["peak_error"].isel(first), own["peak_error"].isel(first), atol=2e-4
    )


def test_speeds_come_in_order_and_lists_are_as_good_as_tuples() -> None:
    mixed: dict[str, Any] = {"speeds": [0.3, -0.1], "controllers": ["pd"], "seeds": [3]}
    ordered = Experiment(speeds=(-0.1, 0.3), controllers=("pd",), seeds=(3,))
    assert Experiment(**mixed) == ordered


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"robot": "spot"}, "unknown robot 'spot'; choose one of: a1"),
        (
            {"controllers": ("pd", "lqr")},
            "unknown controller 'lqr'; choose one of: "
            "pd, ilc, model, library, model+ilc, library+ilc, ilc-stance",
        ),
        (
            {"scenarios": ("moon",)},
            "unknown scenario 'moon'; choose one of: ideal, nominal, payload, ",
        ),
        (
            {"speeds": (0.0, 0.9)},
            "speed 0.9 m/s is outside the gait library, which covers -0.5 to 0.8 m/s; choose a "
            "speed in that range, or make a library with it by 'pronk-pin gaits build'",
        ),
        ({"speeds": (0.1, 0.1)}, "speeds must name at least one, and none of them twice"),
        (
            {"scenarios": ("payload+slope", "slope+payload")},
            "scenarios must name at least one, and none of them twice",
        ),
        ({"seeds": ()}, "seeds must name at least one, and none of them twice"),
        ({"controllers": ("pd", "pd")}, "controllers must name at least one, and none of them"),
        ({"seeds": (0, -1)}, "seeds[1]=-1; give a whole number from 0 on"),
        ({"base": "flying"}, "unknown base 'flying'; choose one of: locked, sagittal, free"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_what_cannot_be_run_is_refused_in_one_line_with_the_remedy(
    settings: dict[str, Any], message: str
) -> None:
    with pytest.raises(PronkError) as caught:
        Experiment(**settings)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_a_speed_that_is_not_a_number_is_refused() -> None:
    with pytest.raises(PronkError, match=r"speeds\[0\]=nan; give a number that is finite"):
        Experiment(speeds=(float("nan"),))


def test_a_cell_gives_the_same_strides_whenever_it_is_run() -> None:
    (cell,) = Experiment(speeds=(0.2,), controllers=("ilc",), schedule=SHORT).cells()
    xr.testing.assert_identical(run_cell(cell), run_cell(cell))


def test_the_model_seeds_the_learning_that_goes_on_from_it() -> None:
    experiment = Experiment(speeds=(0.2,), controllers=("model", "model+ilc"), schedule=SHORT)
    model, learner = (run_cell(cell) for cell in experiment.cells())
    np.testing.assert_array_equal(*(run["feedforward"].isel(stride=0) for run in (model, learner)))
    last = {"stride": -1}
    assert np.any(model["feedforward"].isel(last) != learner["feedforward"].isel(last))
    assert np.all(model["feedforward"].isel(stride=0) == model["feedforward"].isel(last))


def test_the_library_cannot_be_replayed_before_it_is_learned() -> None:
    cell = Experiment(speeds=(0.2,), controllers=("library",), schedule=SHORT).cells()[-1]
    with pytest.raises(InvalidInput, match="'library' begins with what 'ilc' has learned; run it"):
        run_cell(cell)


def test_the_library_is_the_mean_of_what_was_learned_in_the_end(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="ilc"))
    library = torque_library(strides)
    np.testing.assert_allclose(library.speeds, comparison.experiment.speeds)
    mean = (
        steady(strides)["feedforward"].mean("stride").transpose("speed", "part", "phase", "joint")
    )
    np.testing.assert_allclose(library.torque[:, :, ::4], mean, atol=1e-4)
    between = 0.5 * (library.torque[:, :, :-1:4] + library.torque[:, :, 4::4])
    bend = np.abs(library.torque[:, :, 2::4] - between)
    assert 0.0 < bend.max() < 0.5  # smooth between the samples, not straight


def test_the_library_repeats_what_was_learned(comparison: Results) -> None:
    replay = comparison.strides(comparison.find(controller="library"))
    learned = torque_library(comparison.strides(comparison.find(controller="ilc")))
    played = replay["feedforward"].isel(stride=3).transpose("speed", "part", "phase", "joint")
    np.testing.assert_allclose(played, learned.torque[:, :, ::4], atol=1e-4)
    pd = comparison.strides(comparison.find(controller="pd"))
    calf = [str(name) for name in pd["joint"].to_numpy() if str(name).endswith("calf")]
    peaks = [steady(run)["peak_error"].sel(joint=calf).mean() for run in (replay, pd)]
    assert peaks[0] < 0.5 * peaks[1]


def test_the_strides_are_labelled_with_names_and_units(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="ilc"))
    assert strides["joint"].to_numpy().tolist()[:3] == ["FL_hip", "FL_thigh", "FL_calf"]
    assert strides["axis"].to_numpy().tolist() == ["x", "z"]
    np.testing.assert_allclose(strides["phase"], phase_grid(strides.sizes["phase"]))
    for name in strides.data_vars:
        assert {"units", "long_name"} <= set(strides[name].attrs), name
    assert strides.attrs["controller"] == "ilc"
    assert "coulomb" in strides.attrs["scenario_parameters"]


def test_unfinished_strides_hold_nothing(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="ilc"))
    for speed, count in enumerate(strides["count"].to_numpy()):
        mine = strides.isel(speed=speed)
        assert mine["duration"][:count].notnull().all()
        assert mine["error"][:count].notnull().all()
        assert mine["error"][count:].isnull().all()


def test_the_steps_of_a_cell_are_those_it_reports(tmp_path: Path) -> None:
    (cell,) = Experiment(speeds=(0.2,), controllers=("pd",), schedule=SHORT).cells()
    reported: list[int] = []
    run_cell(dataclasses.replace(cell), progress=reported.append)
    assert sum(reported) == cell.steps == 1500


@pytest.mark.parametrize("name", ["computed-torque", "whole-body-qp", "model+eso", "model+rotors"])
def test_what_needs_rotors_that_are_not_known_is_refused_before_anything_is_simulated(
    name: str,
) -> None:
    with pytest.raises(InvalidInput, match="the rotors of bolt are not known"):
        Experiment(robot="bolt", controllers=("pd", name))


@pytest.mark.parametrize("name", ["computed-torque", "whole-body-qp", "model+eso"])
def test_what_needs_a_level_trunk_is_refused_before_anything_is_simulated(name: str) -> None:
    with pytest.raises(
        InvalidInput, match=f"'{re.escape(name)}' reckons with trunks that are lock"
    ):
        Experiment(speeds=(0.0,), base="free", controllers=("pd", name))
