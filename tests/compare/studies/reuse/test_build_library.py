"""Practice over a grid of conditions, and what it is worth in between."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from pronk_pin.compare import Experiment, Results, Scenario, Schedule, load_scenario, run_experiment
from pronk_pin.compare.studies import (
    build_library,
    describe_library,
    describe_library_trial,
    measure_library,
    parse_conditions,
)
from pronk_pin.compare.studies.reuse.build_library import in_conditions
from pronk_pin.control import TorqueLibrary, load_controller
from pronk_pin.errors import FileProblem, InvalidInput, PronkError

SLOPES = [-0.1, 0.0, 0.1]
SHORT = Schedule(0.5, 1.0, 6.0)


def strides_of(results: Results, controller: str, scenario: str) -> xr.Dataset:
    """The strides of one of the compared cells."""
    return next(
        results.strides(cell)
        for cell in results.experiment.compared
        if (cell.controller, cell.scenario) == (controller, scenario)
    )


@pytest.fixture(scope="module")
def hills(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A library of three slopes at two speeds, practised for 6 s each."""
    folder = tmp_path_factory.mktemp("hills")
    library = build_library(
        [0.0, 0.2],
        {"slope": SLOPES},
        "nominal",
        folder / "practice",
        schedule=SHORT,
        workers=1,
        progress=False,
    )
    library.save(folder / "hills.npz")
    return folder / "hills.npz"


def test_a_library_holds_what_was_learned_at_each_place(hills: Path) -> None:
    library = TorqueLibrary.load(hills)
    assert library.torque.shape[:2] == (2, 3)
    assert (library.home, library.robot) == ({"slope": 0.0}, "a1")
    practice = Results.load(hills.parent / "practice")
    assert practice.experiment.scenario_names == ("slope=-0.1", "slope=0", "slope")
    uphill = strides_of(practice, "ilc", "slope")
    wanted = uphill["flight_reference"].isel(speed=1).dropna("stride").to_numpy()[-5:]
    assert np.abs(wanted - library.flight[1, 2]).min() < 1e-3
    # Uphill gravity pulls back, which the thighs have to hold.
    thigh = library.torque[:, :, 0, :, 1::3].mean(axis=(0, 2, 3))
    assert thigh[0] != pytest.approx(thigh[2], abs=0.3)
    assert np.sign(thigh[1] - thigh[0]) == np.sign(thigh[2] - thigh[1])
    assert "slope" in describe_library(library)


def test_a_robot_finds_the_slope_in_a_few_strides_and_tracks_as_if_it_had_practised_there(
    hills: Path, tmp_path: Path
) -> None:
    names = ("library", f"library={hills}", f"library+ilc={hills}")
    experiment = Experiment(
        speeds=(0.1,),
        controllers=("pd", "ilc", *names),
        scenarios=("slope=0.06",),
        schedule=Schedule(0.5, 2.0, 6.0),
    )
    results = run_experiment(experiment, tmp_path / "run", workers=1, progress=False)
    strides = strides_of(results, "library=hills", "slope=0.06")
    told = strides["conditions"].isel(speed=0).sel(condition="slope").dropna("stride").to_numpy()
    learning = strides["learning"].isel(speed=0).dropna("stride").to_numpy() == 1
    assert np.all(told[~learning] == 0.0)  # it begins at home
    assert told[learning][4] == pytest.approx(0.06, abs=0.02)
    peak = strides["peak_error"].isel(speed=0).dropna("stride").mean("joint").to_numpy()
    practised = strides_of(results, "ilc", "slope=0.06")["peak_error"].isel(speed=0)
    at_end = float(practised.dropna("stride").mean("joint").to_numpy()[-5:].mean())
    assert peak[~learning][-1] > 1.2 * at_end
    assert peak[-5:].mean() < 1.25 * at_end
    # Learning on from there, it estimates in its first strides only.
    on = strides_of(results, "library+ilc=hills", "slope=0.06")["conditions"].isel(speed=0)
    later = on.dropna("stride").to_numpy()[:, 0][learning.argmax() + 6 :]
    assert np.all(later == later[0])
    assert later[0] == pytest.approx(0.06, abs=0.02)


def test_driven_on_a_slope_a_robot_finds_it_too(hills: Path, tmp_path: Path) -> None:
    experiment = Experiment(
        controllers=("pd", f"library={hills}"),
        scenarios=("slope=0.06",),
        speeds=(0.0, 0.2),
        commands=("0 3s, 0->0.2 1s, 0.2 3s",),
        schedule=SHORT,
    )
    results = run_experiment(experiment, tmp_path / "run", workers=1, progress=False)
    strides = strides_of(results, "library=hills", "slope=0.06").isel(command=0)
    told = strides["conditions"].sel(condition="slope").dropna("stride").to_numpy()
    assert told[0] == 0.0
    assert told[-1] == pytest.approx(0.06, abs=0.035)  # after so short a practice
    worst = [
        float(
            strides_of(results, name, "slope=0.06")["peak_error"].isel(command=0, stride=-3).max()
        )
        for name in ("pd", "library=hills")
    ]
    assert worst[1] < 0.5 * worst[0]


def test_places_are_tried_beside_practice_and_told_in_words(hills: Path) -> None:
    library = TorqueLibrary.load(hills)
    table = measure_library(
        library, load_scenario("nominal"), points=1, rng=np.random.default_rng(0)
    )
    row = table.iloc[0]
    assert -0.1 <= row["slope"] <= 0.1
    assert 0.0 <= row["speed"] <= 0.2
    assert row["slope_late"] == pytest.approx(row["slope"], abs=0.02)
    assert row["library_calf"] < 0.5 * row["model_calf"]
    text = describe_library_trial(table)
    assert "worse than the model at 0" in text
    again = measure_library(
        library, load_scenario("nominal"), points=1, rng=np.random.default_rng(0)
    )
    assert again.equals(table)


def test_a_library_of_another_robot_or_another_file_is_refused(hills: Path, tmp_path: Path) -> None:
    experiment = Experiment(
        robot="go1",
        speeds=(0.0,),
        controllers=("pd", f"library={hills}"),
        schedule=Schedule(0.2, 0.5, 0.5),
    )
    with pytest.raises(InvalidInput, match="of a1, and the robot is go1"):
        run_experiment(experiment, tmp_path / "go1", workers=1, progress=False)
    kept = tmp_path / "kept.npz"
    kept.write_bytes(hills.read_bytes())
    spec = load_controller(f"library={kept}")
    TorqueLibrary.load(kept).in_conditions().save(kept)
    with pytest.raises(FileProblem, match="another torque library than"):
        run_experiment(
            Experiment(speeds=(0.0,), controllers=("pd", spec), schedule=Schedule(0.2, 0.5, 0.5)),
            tmp_path / "other",
            workers=1,
            progress=False,
        )


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("slope",), "as slope="),
        (("slope=0.1,0",), "increasing"),
        (("slope=0.1",), "two values"),
        (("slope=a,b",), "as slope="),
        (("slope=0,0.1", "slope=0,0.2"), "once"),
        (("wind=0,1",), "wind"),
        (("slope=0,nan",), "slope"),
        ((), "no conditions"),
    ],
)
def test_conditions_that_are_none_are_refused(words: tuple[str, ...], told: str) -> None:
    with pytest.raises(PronkError, match=told):
        parse_conditions(words)


def test_conditions_come_on_top_of_a_scenario() -> None:
    assert in_conditions(load_scenario("ideal"), {"slope": 0.05}).slope == 0.05
    both = in_conditions(load_scenario("payload=1+delay"), {"slope": 0.05, "gravity": 9.0})
    assert (both.payload, both.delay, both.slope, both.gravity) == (1.0, 0.004, 0.05, 9.0)
    own = in_conditions(Scenario("mine", payload=2.0), {"slope": 0.0})
    assert (own.payload, own.slope) == (2.0, 0.0)
    with pytest.raises(InvalidInput, match="payload"):
        in_conditions(load_scenario("payload=1"), {"payload": 2.0})


def test_only_what_begins_with_a_library_takes_a_file(hills: Path) -> None:
    with pytest.raises(InvalidInput, match="is not used by source 'none'"):
        load_controller(f"pd={hills}")
    with pytest.raises(FileProblem):
        load_controller("library=nowhere.npz")


def test_an_equals_sign_without_a_file_is_refused() -> None:
    with pytest.raises(InvalidInput, match="names no file"):
        load_controller("library=")


def test_a_library_of_other_gaits_is_refused_before_anything_is_simulated(
    hills: Path, tmp_path: Path
) -> None:
    """Of another apex, of gaits for a trunk that may turn, or of gaits that do not go so far."""
    asked: list[dict[str, Any]] = [{"apex": 0.35}, {"base": "sagittal"}, {"base": "free"}]
    for other in asked:
        experiment = Experiment(
            speeds=(0.1,), controllers=("pd", f"library={hills}"), schedule=SHORT, **other
        )
        with pytest.raises(InvalidInput, match="learned for other gaits"):
            run_experiment(experiment, tmp_path / "other", workers=1, progress=False)
        assert not (tmp_path / "other").exists()


def test_names_of_files_that_cannot_name_a_controller_are_refused_with_the_remedy(
    hills: Path, tmp_path: Path
) -> None:
    odd = tmp_path / "my hills.npz"
    odd.write_bytes(hills.read_bytes())
    with pytest.raises(InvalidInput, match="rename it"):
        load_controller(f"library={odd}")
    same = tmp_path / "hills.npz"
    same.write_bytes(hills.read_bytes())
    with pytest.raises(InvalidInput, match="its name counts, not its folder"):
        Experiment(controllers=(f"library={hills}", f"library={same}"))
