from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import shutil
import stat
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin.compare import (
    Experiment,
    Results,
    Schedule,
    default_folder,
    run_cell,
    run_experiment,
    summarize,
)
from pronk_pin.compare.metrics import KEYS, join_summaries, summarize_cell
from pronk_pin.compare.results import check_completion, locked, make_folder
from pronk_pin.compare.results.config_file import SCHEMA
from pronk_pin.compare.results.provenance import describe_run, git_state
from pronk_pin.compare.results.strides_file import encode
from pronk_pin.errors import FileProblem, InvalidInput


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
    make_folder(Results.of(experiment, tmp_path / "new" / "run"))
    assert Results.load(tmp_path / "new" / "run").experiment == experiment


def test_the_provenance_says_what_ran_where_and_how_long(comparison: Results) -> None:
    known = comparison.provenance
    assert known["finished"] is True
    (run,) = known["runs"]
    assert run["wall_time_s"] > 0.0
    assert {"pin", "mujoco", "numpy", "pronk-pin"} <= set(run["versions"])
    assert run["cpu"]
    assert set(run["cells"]) == {cell.name for cell in comparison.experiment.cells()}


def test_the_config_is_the_experiment_and_nothing_that_changes(comparison: Results) -> None:
    config = json.loads((comparison.folder / "config.json").read_text())
    assert set(config) == {"schema", "experiment", "definition", "sha256"}
    assert config["experiment"]["schedule"]["learning"] == 6.0


def test_git_is_on_record_only_for_a_source_that_it_tracks(tmp_path: Path) -> None:
    def git(*arguments: str) -> None:
        who = ["-c", "user.name=x", "-c", "user.email=x@y"]
        subprocess.run(["git", "-C", str(tmp_path), *who, *arguments], check=True)

    source = tmp_path / "module.py"
    source.write_text("")
    assert git_state(source) is None
    git("init", "-q")
    assert git_state(source) is None
    git("add", "module.py")
    git("commit", "-qm", "first")
    commit = git_state(source)
    assert commit is not None
    assert len(commit) == 40
    source.write_text("changed")
    assert git_state(source) == f"{commit}, changed"


def test_a_result_that_other_versions_began_is_not_completed(copy: Results) -> None:
    check_completion(copy)
    known = copy.provenance
    known["runs"][-1]["versions"]["mujoco"] = "3.9.0"
    copy.write_provenance(known)
    text = message(lambda: check_completion(copy), copy.folder)
    assert text.startswith("was begun with mujoco 3.9.0, and this is ")
    assert text.endswith("; install that version again, or choose another folder")


@pytest.mark.parametrize("damage", ["", "[1]", '{"finished": true}', '{"runs": []}'])
def test_a_damaged_provenance_is_refused(copy: Results, damage: str) -> None:
    path = copy.folder / "provenance.json"
    path.write_text(damage)
    text = message(lambda: copy.provenance, path)
    assert text.startswith("damaged (")
    assert text.endswith("; delete it: only the record of who made it is lost")
    path.unlink()
    assert copy.provenance == {"finished": False, "runs": []}


def test_the_summary_is_the_same_to_the_bit_from_memory_and_from_files(copy: Results) -> None:
    """Workers hand back rows of strides that were in no file yet; who goes on reads the files."""
    cell = copy.find(controller="ilc")
    simulated, stored = run_cell(cell), copy.strides(cell)
    made, read = summarize_cell(simulated), summarize_cell(stored)
    pd.testing.assert_frame_equal(made.rows, read.rows, check_exact=True)
    assert made.peaks.settings == read.peaks.settings
    for one, other in zip(made.peaks[1:], read.peaks[1:], strict=True):
        np.testing.assert_equal(one, other)


def test_the_summary_that_is_read_is_the_one_that_was_computed(comparison: Results) -> None:
    cells = comparison.experiment.cells()
    computed = join_summaries(summarize_cell(comparison.strides(cell)) for cell in cells)
    for stored in (comparison.summary(), Results.load(comparison.folder).summary()):
        pd.testing.assert_frame_equal(stored, computed, check_exact=True)
    assert len(computed) == sum(len(summarize(comparison.strides(cell))) for cell in cells)
    assert computed.equals(computed.sort_values(KEYS, ignore_index=True))


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
        "no 'model' in scenario 'nominal'; the result has the controllers ilc, library, pd in the "
        "scenarios nominal"
    )


def test_the_same_experiment_is_taken_up_again(copy: Results) -> None:
    shutil.rmtree(copy.folder / "strides")
    taken = Results.of(copy.experiment, copy.folder)
    make_folder(taken)
    assert not taken.has(taken.find(controller="pd"))
    assert (copy.folder / "strides").is_dir()
    assert taken.provenance["finished"] is True


def test_another_experiment_is_not_mixed_in(copy: Results) -> None:
    other = dataclasses.replace(copy.experiment, base="free", schedule=Schedule(scatter=0.0))
    text = message(lambda: Results.of(other, copy.folder), copy.folder)
    assert text == (
        "holds another experiment (base is 'locked' there, and 'free' here; schedule.baseline is "
        "4.0 there, and 20.0 here; schedule.learning is 6.0 there, and 20.0 here; schedule.scatter "
        "is 0.01 there, and 0.0 here); leave these options out to go on with it, or choose another "
        "folder"
    )


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
        lambda config: json.dumps({"schema": SCHEMA}),
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
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema": 99}))
    text = message(lambda: Results.load(copy.folder), path)
    assert text == f"schema 99, not {SCHEMA}; run 'pronk-pin compare' to make one"


@pytest.mark.parametrize("keep", [0, 100, 0.5], ids=["empty", "beginning only", "half"])
def test_damaged_strides_are_refused(copy: Results, keep: float) -> None:
    cell = copy.find(controller="ilc")
    whole = copy.path(cell).read_bytes()
    copy.path(cell).write_bytes(whole[: int(keep * len(whole)) if keep < 1 else int(keep)])
    text = message(lambda: copy.strides(cell), copy.path(cell))
    assert text.startswith("damaged (")
    assert text.endswith(f"; {anew(copy)}")


def anew(results: Results) -> str:
    return f"run 'pronk-pin compare --folder {results.folder} --resimulate' to make it anew"


def test_missing_strides_are_refused(copy: Results) -> None:
    cell = copy.find(controller="ilc")
    copy.path(cell).unlink()
    text = message(lambda: copy.strides(cell), copy.path(cell))
    assert text == f"missing; {anew(copy)}"


@pytest.mark.parametrize(
    "contents", [None, b"", b"a,b\n1,2\n", b"\x93\xff\x00", b'"a\n', "half", "a digit"]
)
def test_a_summary_that_is_missing_damaged_or_cut_is_made_again_from_the_strides(
    comparison: Results, copy: Results, contents: bytes | str | None
) -> None:
    path = copy.folder / "summary.csv"
    whole = path.read_bytes()
    if contents is None:
        path.unlink()
    elif contents == "half":
        path.write_bytes(whole[: len(whole) // 2].rpartition(b"\n")[0] + b"\n")
    elif contents == "a digit":
        path.write_bytes(whole.replace(b"5", b"6", 1))
    else:
        assert isinstance(contents, bytes)
        path.write_bytes(contents)
    pd.testing.assert_frame_equal(copy.summary(), comparison.summary(), check_exact=True)
    assert path.read_bytes() == whole


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    folder = tmp_path / "file" / "results"
    text = message(lambda: make_folder(Results.of(Experiment(), folder)), folder)
    assert text == "cannot be written (Not a directory); choose a folder of yours with --folder"


def test_a_dataset_makes_the_same_bytes_at_any_time(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="pd"))
    first = encode(strides)
    time.sleep(1.1)  # the clock of HDF5's time stamps has seconds
    assert encode(strides) == first


def test_only_the_variables_asked_for_are_read(comparison: Results) -> None:
    cell = comparison.find(controller="pd")
    few = comparison.strides(cell, ["count", "peak_error", "of another version"])
    assert set(few.data_vars) == {"count", "peak_error"}
    assert few.identical(comparison.strides(cell)[["count", "peak_error"]])


@pytest.mark.parametrize("name", ["strides/pd_nominal_0.nc", "summary.csv", "config.json"])
def test_a_full_disk_loses_nothing_that_was_there(
    copy: Results, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = copy.folder / name
    before = path.read_bytes()

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    text = message(lambda: copy.write(name, b"new"), path)
    assert text == (
        "cannot be written (No space left on device); make room, and run the same command again "
        f"with --folder {copy.folder}"
    )
    assert path.read_bytes() == before
    assert not list(copy.folder.rglob("*.partial"))


def test_a_full_temporary_folder_is_named(
    comparison: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    strides = comparison.strides(comparison.find(controller="pd"))
    monkeypatch.setattr(tempfile, "tempdir", "/nowhere")
    with pytest.raises(FileProblem, match=r"^/nowhere: cannot be written .*set TMPDIR$"):
        encode(strides)


def test_a_second_run_in_the_same_folder_is_refused(copy: Results) -> None:
    with locked(copy.folder):
        text = message(lambda: locked(copy.folder).__enter__(), copy.folder)
    assert text == "another run is writing there; wait for it, or end it first"
    with locked(copy.folder):
        pass


def test_what_a_killed_run_left_half_written_is_cleared_away(copy: Results) -> None:
    (copy.folder / "strides" / "pd_nominal_0.nc.partial").write_bytes(b"half")
    (copy.folder / "summary.csv.partial").write_bytes(b"half")
    with locked(copy.folder):
        assert not list(copy.folder.rglob("*.partial"))


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
    summary = copy.summary()
    assert message(lambda: copy.write_summary(summary), path).startswith("cannot be written (")


@contextlib.contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Take away the right to write in a folder, from the administrator too."""
    describe_run()  # imports what nobody may read where Python lies in the administrator's home
    nobody, administrator = 65534, os.geteuid() == 0
    parts = [folder, *(part for part in folder.rglob("*") if part.is_dir())]
    above = [part for part in folder.parents if part.stat().st_uid == os.geteuid()]
    modes = {part: part.stat().st_mode for part in (*parts, *above)}
    for part in above:
        part.chmod(modes[part] | 0o055)  # others may pass
    for part in parts:
        part.chmod(0o555)
    if administrator:
        os.seteuid(nobody)
    try:
        yield
    finally:
        if administrator:
            os.seteuid(0)
        for part, mode in modes.items():
            part.chmod(stat.S_IMODE(mode))


def everything(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_read_only_folder_loses_nothing_and_is_named(copy: Results) -> None:
    cell = copy.find(controller="pd")
    before, summary = everything(copy.folder), copy.summary()
    with read_only(copy.folder):
        for name, call in (
            (copy.folder / "manifest.json", lambda: copy.save(cell, b"new")),
            (copy.folder / "manifest.json", lambda: copy.write_summary(summary)),
        ):
            text = message(call, name)
            assert text.startswith("cannot be written (Permission denied); ")
        assert len(copy.summary())  # it can still be read
    assert everything(copy.folder) == before


def test_a_run_in_a_read_only_folder_says_so_before_it_simulates(
    copy: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy.path(copy.find(controller="library")).unlink()
    left = copy.folder / "summary.csv.partial"  # of a run that was killed
    left.write_bytes(b"half")
    before = everything(copy.folder)
    monkeypatch.setattr(
        "pronk_pin.compare.execution.run.run_cell", lambda *_: pytest.fail("simulated")
    )
    with read_only(copy.folder):
        text = message(lambda: run_experiment(copy.experiment, copy.folder, workers=1), left)
        assert text.startswith("cannot be removed (Permission denied); ")
    left.unlink()
    del before[str(left)]
    with read_only(copy.folder):
        text = message(
            lambda: run_experiment(copy.experiment, copy.folder, workers=1),
            copy.folder / "provenance.json",
        )
        assert text.startswith("cannot be written (Permission denied); ")
    assert everything(copy.folder) == before


def test_no_folder_is_made_where_one_may_not_write(tmp_path: Path) -> None:
    place = tmp_path / "closed"
    place.mkdir()
    with read_only(place):
        text = message(lambda: make_folder(Results.of(Experiment(), place / "new")), place / "new")
    assert text == "cannot be written (Permission denied); choose a folder of yours with --folder"
    assert not list(place.iterdir())


def test_folders_are_named_by_time_and_purpose() -> None:
    assert default_folder("test").parent == Path("results")
    assert default_folder("test").name.endswith("-test")
    assert np.all([character.isdigit() for character in default_folder().name[:8]])
