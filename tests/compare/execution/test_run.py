from __future__ import annotations

import pickle
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.errors import (
    FileProblem,
    GaitNotFound,
    InvalidInput,
    PronkError,
    SpeedOutOfRange,
    UnknownName,
)
from tests.compare.conftest import modified


def test_a_run_leaves_strides_summary_and_config_and_nothing_else(comparison: Results) -> None:
    files = {
        path.relative_to(comparison.folder).as_posix() for path in comparison.folder.rglob("*")
    }
    strides = {f"strides/{name}_nominal_0.nc" for name in ("pd", "ilc", "library")}
    written = {"config.json", "manifest.json", "provenance.json", "summary.csv"}
    assert files == {*written, "strides", *strides}


@pytest.mark.parametrize("controller", ["pd", "library"])
def test_a_run_that_lacks_a_cell_makes_the_same_again_and_leaves_the_others(
    comparison: Results, copy: Results, controller: str
) -> None:
    cell = copy.find(controller=controller)
    copy.path(cell).unlink()
    before = modified(copy)

    again = run_experiment(copy.experiment, copy.folder, workers=1, progress=False)

    xr.testing.assert_identical(again.strides(cell), comparison.strides(cell))
    after = modified(again)
    assert before.items() < after.items()
    assert (again.folder / "summary.csv").read_bytes() == (
        comparison.folder / "summary.csv"
    ).read_bytes()


def test_a_whole_run_is_summarized_again_but_stays_on_record_as_it_was_made(
    comparison: Results, copy: Results
) -> None:
    (copy.folder / "summary.csv").unlink()
    before = modified(copy)
    run_experiment(copy.experiment, copy.folder, progress=False)
    assert modified(copy) == before
    assert len(copy.summary()) == len(comparison.summary())
    assert copy.provenance == comparison.provenance


def test_processes_give_the_same_strides_as_one_after_the_other(
    comparison: Results, tmp_path: Path
) -> None:
    experiment = comparison.experiment
    parallel = run_experiment(experiment, tmp_path / "new", workers=2, progress=False)
    for cell in experiment.cells():
        xr.testing.assert_identical(parallel.strides(cell), comparison.strides(cell))


def test_a_run_reads_nothing_that_it_has_just_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(*_: object, **__: object) -> None:
        pytest.fail("strides or the summary were read")

    monkeypatch.setattr("pronk_pin.compare.results.results.decode", read)
    monkeypatch.setattr("pronk_pin.compare.results.results.read_summary", read)
    short = Schedule(startup=0.1, baseline=1.0, learning=0.5)
    experiment = Experiment(speeds=(0.3,), controllers=("pd", "ilc"), schedule=short)
    summary = run_experiment(experiment, tmp_path / "new", workers=1, progress=False).summary()
    monkeypatch.undo()
    stored = Results.load(tmp_path / "new").summary()
    pd.testing.assert_frame_equal(summary, stored, check_exact=True)


def test_an_error_in_a_process_arrives_as_it_was_raised(copy: Results) -> None:
    for controller in ("library", "pd"):
        copy.path(copy.find(controller=controller)).unlink()
    learned = copy.path(copy.find(controller="ilc"))
    learned.write_bytes(b"no strides")
    with pytest.raises(FileProblem, match=r"damaged \(.*\); run .* --resimulate") as caught:
        run_experiment(copy.experiment, copy.folder, workers=2, progress=False)
    assert caught.value.path == learned


@pytest.mark.parametrize(
    "error",
    [
        FileProblem(Path("x"), "missing", "find it"),
        SpeedOutOfRange(2.0, -0.5, 0.8),
        UnknownName("robot", "x", ["a1"]),
        GaitNotFound(0.3, "stopped", {"foot": 1.0}),
        InvalidInput("no"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_errors_keep_their_evidence_between_processes(error: PronkError) -> None:
    arrived = pickle.loads(pickle.dumps(error))
    assert type(arrived) is type(error)
    assert str(arrived) == str(error)
    assert vars(arrived) == vars(error)


def test_the_bar_counts_every_step_of_every_robot(
    copy: Results, capsys: pytest.CaptureFixture[str]
) -> None:
    copy.path(copy.find(controller="pd")).unlink()
    run_experiment(copy.experiment, copy.folder, workers=1)
    shown = capsys.readouterr().err
    assert "simulating 2 robots x 1" in shown
    assert "20.0k/20.0k" in shown


def test_without_a_worker_nothing_can_run(copy: Results) -> None:
    with pytest.raises(InvalidInput, match="workers=0; give a whole number from 1 to 1024"):
        run_experiment(copy.experiment, copy.folder, workers=0)
