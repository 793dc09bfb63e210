from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin.compare import Experiment, Results, default_folder, summarize
from pronk_pin.errors import FileProblem, InvalidInput


@pytest.fixture
def copy(comparison: Results, tmp_path: Path) -> Results:
    """A copy of the comparison that a test may damage."""
    folder = shutil.copytree(comparison.folder, tmp_path / "copy")
    return Results(folder, comparison.experiment)


def message(call: Callable[[], Any], path: Path) -> str:
    """What a call complains about a file, in one line."""
    with pytest.raises(FileProblem) as caught:
        call()
    text = str(caught.value)
    assert caught.value.path == path
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


def test_a_folder_gives_back_the_experiment_it_was_made_for(tmp_path: Path) -> None:
    experiment = Experiment(speeds=(0.1, 0.35), controllers=("pd",), seeds=(2, 5))
    Results.create(experiment, tmp_path / "new" / "run")
    assert Results.load(tmp_path / "new" / "run").experiment == experiment


def test_the_config_says_what_ran_where(comparison: Results) -> None:
    config = comparison.config
    assert config["finished"] is True
    assert config["wall_time_s"] > 0.0
    assert {"pin", "mujoco", "numpy", "pronk-pin"} <= set(config["versions"])
    assert config["cpu"]
    assert config["experiment"]["schedule"]["learning"] == 6.0


def test_the_summary_that_is_read_is_the_one_that_was_computed(comparison: Results) -> None:
    tables = [summarize(comparison.strides(cell)) for cell in comparison.experiment.cells()]
    stored = comparison.summary()
    keys = list(stored.columns[:8])
    assert len(stored) == sum(map(len, tables))
    pd.testing.assert_frame_equal(stored, stored.sort_values(keys, ignore_index=True))
    computed = pd.concat(tables).sort_values(keys, ignore_index=True)
    pd.testing.assert_frame_equal(stored, computed, check_dtype=False, rtol=1e-12)


def test_strides_survive_the_disk_to_the_bit(copy: Results) -> None:
    cell = copy.find(controller="pd")
    strides = copy.strides(cell)
    copy.save(cell, strides)
    xr.testing.assert_identical(copy.strides(cell), strides)
    assert not list(copy.folder.rglob("*.partial"))


def test_a_cell_is_found_by_its_controller(comparison: Results) -> None:
    assert comparison.find(controller="ilc", scenario="nominal").name == "ilc_nominal_0"
    with pytest.raises(InvalidInput) as caught:
        comparison.find(controller="model")
    assert str(caught.value) == (
        "no 'model' in scenario 'nominal'; the result has ilc, library, pd"
    )


def test_the_same_experiment_is_taken_up_again(copy: Results) -> None:
    shutil.rmtree(copy.folder / "strides")
    taken = Results.create(copy.experiment, copy.folder)
    assert not taken.has(taken.find(controller="pd"))
    assert (copy.folder / "strides").is_dir()
    assert taken.config["finished"] is True


def test_another_experiment_is_not_mixed_in(copy: Results) -> None:
    text = message(lambda: Results.create(Experiment(), copy.folder), copy.folder)
    assert text == "holds another experiment; choose another folder"


def test_a_folder_that_holds_no_result_is_refused(tmp_path: Path) -> None:
    text = message(lambda: Results.load(tmp_path), tmp_path)
    assert text == ("not a results folder (no config.json); run 'pronk-pin compare' to make one")


@pytest.mark.parametrize(
    "damage",
    [
        lambda config: "",
        lambda config: json.dumps(config)[:-40],
        lambda config: "[1, 2]",
        lambda config: json.dumps({**config, "experiment": [1]}),
        lambda config: json.dumps({"schema": 2}),
        lambda config: json.dumps({**config, "experiment": {**config["experiment"], "wind": 3}}),
        lambda config: json.dumps({**config, "experiment": {**config["experiment"], "speeds": []}}),
        lambda config: json.dumps({**config, "experiment": {**config["experiment"], "robot": "x"}}),
        lambda config: json.dumps(
            {**config, "experiment": {**config["experiment"], "speeds": [7.0]}}
        ),
    ],
)
def test_a_damaged_config_is_refused(copy: Results, damage: Callable[[Any], str]) -> None:
    path = copy.folder / "config.json"
    path.write_text(damage(json.loads(path.read_text())))
    text = message(lambda: Results.load(copy.folder), path)
    assert text.startswith("damaged (")
    assert text.endswith("; run 'pronk-pin compare' to make one")


def test_a_folder_of_another_version_is_refused(copy: Results) -> None:
    path = copy.folder / "config.json"
    path.write_text(json.dumps({**copy.config, "schema": 99}))
    text = message(lambda: Results.load(copy.folder), path)
    assert text == "schema 99, not 2; run 'pronk-pin compare' to make one"


@pytest.mark.parametrize("keep", [0, 100, 0.5], ids=["empty", "beginning only", "half"])
def test_damaged_strides_are_refused(copy: Results, keep: float) -> None:
    cell = copy.find(controller="ilc")
    whole = copy.path(cell).read_bytes()
    copy.path(cell).write_bytes(whole[: int(keep * len(whole)) if keep < 1 else int(keep)])
    text = message(lambda: copy.strides(cell), copy.path(cell))
    assert text.startswith("damaged (")
    assert text.endswith("; delete it and run 'pronk-pin compare --folder' again")


def test_missing_strides_are_refused(copy: Results) -> None:
    cell = copy.find(controller="ilc")
    copy.path(cell).unlink()
    text = message(lambda: copy.strides(cell), copy.path(cell))
    assert text == "missing; run the same 'pronk-pin compare --folder' again"


def test_a_missing_summary_is_refused(copy: Results) -> None:
    (copy.folder / "summary.csv").unlink()
    text = message(copy.summary, copy.folder / "summary.csv")
    assert text == f"missing; run 'pronk-pin compare --folder {copy.folder}' to make it"


@pytest.mark.parametrize("contents", [b"", b"a,b\n1,2\n", b"\x93\xff\x00", b'"a\n'])
def test_a_damaged_summary_is_refused(copy: Results, contents: bytes) -> None:
    path = copy.folder / "summary.csv"
    path.write_bytes(contents)
    assert message(copy.summary, path).startswith("damaged (")


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    folder = tmp_path / "file" / "results"
    text = message(lambda: Results.create(Experiment(), folder), folder)
    assert text == "cannot be written (Not a directory); choose a folder of yours with --folder"


def test_strides_that_cannot_be_written_are_reported_and_leave_nothing(copy: Results) -> None:
    cell = copy.find(controller="pd")
    strides = copy.strides(cell)
    copy.path(cell).unlink()
    copy.path(cell).mkdir()
    (copy.path(cell) / "in the way").touch()
    text = message(lambda: copy.save(cell, strides), copy.path(cell))
    assert text.startswith("cannot be written (")
    assert not list(copy.folder.rglob("*.partial"))


def test_a_summary_that_cannot_be_written_is_reported(copy: Results) -> None:
    path = copy.folder / "summary.csv"
    path.unlink()
    path.mkdir()
    (path / "in the way").touch()
    assert message(copy.summarize, path).startswith("cannot be written (")


def test_folders_are_named_by_time_and_purpose() -> None:
    assert default_folder("test").parent == Path("results")
    assert default_folder("test").name.endswith("-test")
    assert np.all([character.isdigit() for character in default_folder().name[:8]])
