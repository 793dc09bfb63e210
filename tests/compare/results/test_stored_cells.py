"""Stored strides are those of the simulation that is asked for, or they are refused by name."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pronk_pin import storage
from pronk_pin.cli import main
from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.compare.experiment.definition import (
    cell_definition,
    define,
    describe,
    differences,
)
from pronk_pin.compare.results.strides_file import encode
from pronk_pin.control import CONTROLLERS, ControllerSpec, PDTypeILC
from pronk_pin.errors import FileProblem, InvalidInput, OtherMachine
from tests.compare.conftest import modified


def refused(call: Callable[[], object]) -> str:
    with pytest.raises(FileProblem) as caught:
        call()
    return str(caught.value)


def run(experiment: Experiment, results: Results, **options: bool) -> Results:
    return run_experiment(experiment, results.folder, workers=1, progress=False, **options)


@pytest.mark.parametrize("manifest", [True, False])
def test_strides_of_another_schedule_are_not_taken_where_the_config_is_lost(
    copy: Results, manifest: bool
) -> None:
    (copy.folder / "config.json").unlink()
    if not manifest:
        (copy.folder / "manifest.json").unlink()
    other = dataclasses.replace(copy.experiment, schedule=Schedule(baseline=4.0, learning=1.0))
    text = refused(lambda: run(other, copy))
    assert "strides/ilc_nominal_0.nc: is of another simulation" in text
    assert "schedule.learning 6.0 there, 1.0 here" in text
    assert text.endswith("choose another folder, or add --resimulate to simulate it again")
    assert not (copy.folder / "config.json").exists()


def test_strides_of_another_schedule_are_simulated_again_where_that_is_asked_for(
    comparison: Results, copy: Results
) -> None:
    (copy.folder / "config.json").unlink()
    other = dataclasses.replace(copy.experiment, schedule=Schedule(baseline=4.0, learning=1.0))
    again = run(other, copy, resimulate=True)
    strides = again.strides(again.find(controller="ilc"))
    assert (
        float(strides["start"].max())
        < 5.0
        < float(comparison.strides(comparison.find(controller="ilc"))["start"].max())
    )


def renamed(results: Results, source: Path, controller: str) -> None:
    """Strides from elsewhere under a controller's name, vouched for by the manifest."""
    results.save(results.find(controller=controller), source.read_bytes())


def test_strides_under_another_controllers_name_are_refused(copy: Results) -> None:
    renamed(copy, copy.path(copy.find(controller="pd")), "ilc")
    for call in (lambda: run(copy.experiment, copy), copy.summary):
        text = refused(call)
        assert "ilc_nominal_0.nc: is of another simulation" in text
        assert "controller.name pd there, ilc here" in text


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"scenarios": ("slope",)}, "scenario.name slope there, nominal here"),
        ({"robot": "go1"}, "robot.name go1 there, a1 here"),
        ({"seeds": (3,)}, "seed 3 there, 0 here"),
        ({"base": "sagittal"}, "base sagittal there, locked here"),
        ({"speeds": (0.0, 0.3)}, "gaits.0.3 "),
    ],
)
def test_strides_of_another_world_robot_seed_base_or_speed_are_refused(
    copy: Results, tmp_path: Path, change: dict[str, object], named: str
) -> None:
    short = Schedule(startup=0.1, baseline=0.5, learning=0.5)
    settings = {"speeds": (0.0, 0.45), "controllers": ("pd",), "schedule": short}
    other = run_experiment(
        Experiment(**{**settings, **change}),  # type: ignore[arg-type]
        tmp_path / "other",
        workers=1,
        progress=False,
    )
    (cell,) = other.experiment.cells()
    renamed(copy, other.path(cell), "pd")
    assert named in _all_differences(
        refused(lambda: copy.strides(copy.find(controller="pd"))), copy
    )


def _all_differences(text: str, results: Results) -> str:
    """The message, and what it had no room for."""
    cell = results.find(controller="pd")
    data = xr.load_dataset(results.path(cell))
    wanted = cell_definition(define(results.experiment), cell)
    assert "is of another simulation" in text
    return differences(json.loads(data.attrs["definition"]), wanted, most=50)


def test_a_law_changed_behind_its_name_is_noticed(
    copy: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed = dataclasses.replace(CONTROLLERS["ilc"], law=PDTypeILC(gain=0.3))
    monkeypatch.setitem(CONTROLLERS, "ilc", changed)  # type: ignore[arg-type]
    text = refused(lambda: run(copy.experiment, copy))
    assert text == (
        f"{copy.folder}: was begun with another controllers.ilc.law.gain 0.5 there, 0.3 here; "
        "choose another folder, or add --resimulate to simulate it again"
    )
    assert copy.summary() is not None  # what was made then can still be read
    (copy.folder / "config.json").unlink()
    text = refused(lambda: run(copy.experiment, copy))
    assert "controller.law.gain 0.5 there, 0.3 here" in text


def test_a_library_learned_by_another_law_is_noticed_though_it_is_the_same_by_name(
    copy: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed = dataclasses.replace(CONTROLLERS["ilc"], law=PDTypeILC(gain=0.3))
    monkeypatch.setitem(CONTROLLERS, "ilc", changed)  # type: ignore[arg-type]
    before = modified(copy)
    run(copy.experiment, copy, resimulate=True)
    again = {name for name, time in modified(copy).items() if time != before[name]}
    assert again == {"ilc_nominal_0.nc", "library_nominal_0.nc"}


class Law:
    """A law from outside, no dataclass."""

    def __init__(self, gain: float) -> None:
        self.gain = gain

    def __call__(self) -> None: ...


def test_a_class_from_outside_is_described_by_where_it_is_what_it_holds_and_its_source() -> None:
    told = describe(Law(0.4))
    assert told["class"] == f"{__name__}:Law"
    assert told["gain"] == 0.4
    assert told["source_sha256"] == storage.sha256(Path(__file__).read_bytes())
    assert describe(ControllerSpec("x"))["class"] == "ControllerSpec"
    assert differences(describe(Law(0.4)), describe(Law(0.5))) == "gain 0.4 there, 0.5 here"


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.999])
def test_a_single_bit_that_flips_in_strides_is_noticed(copy: Results, share: float) -> None:
    cell = copy.find(controller="pd")
    data = bytearray(copy.path(cell).read_bytes())
    data[int(share * len(data))] ^= 4
    copy.path(cell).write_bytes(data)
    assert "is not the file that was written there" in refused(lambda: copy.strides(cell))


def test_hdf5_itself_notices_flipped_bits_of_strides_out_of_their_folder(
    comparison: Results, tmp_path: Path
) -> None:
    strides = comparison.strides(comparison.find(controller="pd"))
    marked = strides["count"].to_numpy()
    data = encode(strides.assign(count=("speed", np.full_like(marked, 0x5A5B5C5D5E5F))))
    at = data.index(np.full_like(marked, 0x5A5B5C5D5E5F).tobytes())
    changed = bytearray(data)
    changed[at] ^= 1
    path = tmp_path / "strides.nc"
    path.write_bytes(changed)
    with pytest.raises((OSError, RuntimeError)), xr.open_dataset(path) as file:
        file.load()


def test_damaged_strides_are_simulated_again_where_that_is_asked_for(
    comparison: Results, copy: Results
) -> None:
    cell = copy.find(controller="pd")
    copy.path(cell).write_bytes(b"no strides")
    assert "damaged" in refused(lambda: run(copy.experiment, copy))
    run(copy.experiment, copy, resimulate=True)
    assert copy.path(cell).read_bytes() == comparison.path(cell).read_bytes()


def test_a_run_killed_before_it_wrote_what_it_had_announced_simulates_it_again(
    comparison: Results, copy: Results
) -> None:
    cell = copy.find(controller="pd")
    copy.path(cell).unlink()  # the manifest has it already
    run(copy.experiment, copy)
    assert copy.path(cell).read_bytes() == comparison.path(cell).read_bytes()


@pytest.mark.parametrize("name", ["config.json", "manifest.json", "provenance.json"])
def test_documents_that_were_edited_are_refused(copy: Results, name: str) -> None:
    path = copy.folder / name
    path.write_text(path.read_text().replace('"pin": "', '"pin": "9').replace("4.0", "5.0", 1))
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, "more": 1}))
    text = refused(lambda: (Results.load(copy.folder).summary(), copy.provenance))
    assert text.startswith(f"{path}: damaged (it was changed after it was written); ")


def test_more_controllers_scenarios_and_seeds_are_added_and_what_is_there_is_kept(
    copy: Results,
) -> None:
    before = modified(copy)
    more = dataclasses.replace(
        copy.experiment, controllers=("model",), scenarios=("nominal", "slope"), seeds=(0, 1)
    )
    extended = run(dataclasses.replace(more, scenarios=("nominal",), seeds=(0,)), copy)
    assert extended.experiment.controllers == ("pd", "ilc", "library", "model")
    after = modified(copy)
    assert before.items() < after.items()
    assert set(after) - set(before) == {"model_nominal_0.nc"}
    assert set(extended.summary()["controller"]) == {"pd", "ilc", "library", "model"}
    assert Results.load(copy.folder).experiment == extended.experiment


def test_speeds_that_are_added_are_simulated_by_themselves_and_read_together(
    copy: Results, tmp_path: Path
) -> None:
    before = modified(copy)
    extended = run(dataclasses.replace(copy.experiment, speeds=(0.2,)), copy)
    assert extended.experiment.speeds == (0.0, 0.2, 0.45)
    assert extended.experiment.batches == ((0.0, 0.45), (0.2,))
    assert before.items() < modified(copy).items()
    together = extended.all_strides(controller="ilc")
    assert together["speed"].to_numpy().tolist() == [0.0, 0.2, 0.45]
    for cell in extended.experiment.cells():
        if cell.controller == "ilc":
            alone = extended.strides(cell)
            kept = together.sel(speed=alone["speed"]).isel(stride=slice(alone.sizes["stride"]))
            np.testing.assert_array_equal(kept["peak_error"], alone["peak_error"])
    assert set(extended.summary()["speed"]) == {0.0, 0.2, 0.45}
    anew = run_experiment(extended.experiment, tmp_path / "new", workers=1, progress=False)
    assert (anew.folder / "summary.csv").read_bytes() == (copy.folder / "summary.csv").read_bytes()


def test_what_contradicts_the_folder_is_named(copy: Results) -> None:
    other = dataclasses.replace(copy.experiment, base="sagittal")
    text = refused(lambda: run(other, copy))
    assert "holds another experiment (base is 'locked' there, and 'sagittal' here)" in text


def test_batches_hold_each_speed_once() -> None:
    with pytest.raises(InvalidInput, match="batches must hold each speed once"):
        Experiment(speeds=(0.0, 0.1), batches=((0.0,),))


def test_the_folder_alone_goes_on_and_options_add(
    copy: Results, capsys: pytest.CaptureFixture[str]
) -> None:
    before = modified(copy)
    assert main(["compare", "--folder", str(copy.folder)]) == 0
    assert modified(copy) == before
    assert (
        main(
            [
                "compare",
                "--folder",
                str(copy.folder),
                "--workers",
                "1",
                "--controllers",
                "pd",
                "model",
            ]
        )
        == 0
    )
    assert set(modified(copy)) - set(before) == {"model_nominal_0.nc"}
    capsys.readouterr()
    assert main(["compare", "--folder", str(copy.folder), "--schedule.learning", "3"]) == 1
    assert "schedule.learning is 6.0 there, and 3.0 here" in capsys.readouterr().err


def test_a_command_that_fails_leaves_no_folder_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def fail(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("pronk_pin.compare.execution.run.run_cell", fail)
    assert main(["compare", "--speeds", "0.3", "--controllers", "pd", "--workers", "1"]) == 130
    assert main(["compare", "--mjcf", "missing.xml"]) == 1
    assert not list(tmp_path.iterdir())


def test_a_run_that_goes_on_elsewhere_says_so(copy: Results) -> None:
    known = copy.provenance
    known["runs"][-1]["blas"] = "openblas 0.3 Haswell"
    copy.write_provenance(known)
    copy.path(copy.find(controller="pd")).unlink()
    with pytest.warns(OtherMachine, match="blas openblas 0.3 Haswell there, .* here"):
        run(copy.experiment, copy)
