"""One dataset of all cells: each value where its labels say, NaN where there is none, read late."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.errors import FileProblem

SHORT = Experiment(
    speeds=(0.3, 0.0),
    controllers=("pd", "ilc"),
    scenarios=("nominal", "payload"),
    schedule=Schedule(startup=0.2, baseline=0.8, learning=0.7),
)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Two batches of speeds, of which the second lies between those of the first."""
    folder = tmp_path_factory.mktemp("results") / "batches"
    run_experiment(SHORT, folder, workers=1, progress=False)
    return run_experiment(replace(SHORT, speeds=(0.2,)), folder, workers=1, progress=False)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the cells whose files are opened."""
    names: list[str] = []
    whole = Results._open

    def counted(self: Results, cell, **options: bool) -> xr.Dataset:  # type: ignore[no-untyped-def]
        names.append(cell.name)
        return whole(self, cell, **options)

    monkeypatch.setattr(Results, "_open", counted)
    return names


def test_each_value_is_where_its_labels_say(results: Results) -> None:
    data = results.dataset()
    assert results.experiment.batches
    np.testing.assert_array_equal(data["speed"], [0.0, 0.2, 0.3])
    assert list(data["controller"].to_numpy()) == ["pd", "ilc"]
    assert data.attrs["robot"] == "a1"
    longest = {"stride": 0, "tick": 0}
    for cell in results.experiment.cells():
        strides = results.strides(cell)
        key = {name: getattr(cell, name) for name in ("controller", "scenario", "seed")}
        for name, values in strides.data_vars.items():
            found = data[name].sel(key).sel(speed=list(cell.speeds))
            size = {dim: values.sizes[dim] for dim in longest if dim in values.dims}
            first = found.isel({dim: slice(n) for dim, n in size.items()})
            np.testing.assert_array_equal(first, values, err_msg=str(name))
            rest = found.isel({dim: slice(n, None) for dim, n in size.items()}) if size else None
            assert rest is None or bool(rest.isnull().all())
            assert (found.attrs["units"], found.dtype.itemsize) == (
                values.attrs["units"],
                values.dtype.itemsize,
            )
        longest = {dim: max(n, strides.sizes[dim]) for dim, n in longest.items()}
    assert longest == {dim: data.sizes[dim] for dim in longest}
    assert set(data.coords) >= {"part", "phase", "joint", "leg", "kind", "axis", "foot"}


def test_it_answers_as_xarray_does(results: Results) -> None:
    lazy, error = results.dataset(), results.dataset()["error"].load()
    for one in (
        {"speed": 1, "controller": -1},
        {"speed": [2, 0], "phase": slice(None, None, -10), "joint": [3, 3]},
        {"scenario": slice(1, None), "stride": -1, "part": 0},
        {"speed": xr.DataArray([0, 2], dims="p"), "joint": xr.DataArray([1, 5], dims="p")},
    ):
        xr.testing.assert_identical(lazy["error"].isel(one), error.isel(one))
    some = lazy.where(lazy["speed"] > 0.1, drop=True)["peak_error"]
    assert some.groupby("kind").mean().sizes["kind"] == 3


def test_only_what_is_asked_for_is_read(results: Results, opened: list[str]) -> None:
    data = results.dataset()
    assert len(opened) == 8  # for the sizes of them
    opened.clear()
    assert data["peak_error"].mean() > 0.0  # numbers of strides are there at once
    part = data["error"].sel(controller="ilc", scenario="payload", speed=[0.0, 0.3])
    assert opened == []
    part.load()
    assert opened == ["ilc_payload_0"]
    _ = part.values
    assert opened == ["ilc_payload_0"]


def test_an_unfinished_folder_gives_what_is_there(results: Results, tmp_path: Path) -> None:
    part = Results(tmp_path / "part", results.experiment)
    with pytest.raises(FileProblem, match=r"has no strides yet; run 'pronk-pin compare --folder"):
        part.dataset()
    for cell in results.experiment.cells():
        if cell.controller == "pd" and cell.batch == 0:
            part.save(cell, results.strides(cell))
    data = part.dataset()
    there = data["count"].notnull()
    assert data.sizes["controller"] == 2
    assert int(there.sum()) == 4
    assert not there.sel(controller="ilc").any()
    assert not there.sel(speed=0.2).any()
    whole = results.dataset()["peak_error"].sel(controller="pd", speed=0.3)
    np.testing.assert_array_equal(data["peak_error"].sel(controller="pd", speed=0.3), whole)


def test_a_damaged_file_is_refused(results: Results, tmp_path: Path) -> None:
    part = Results(tmp_path / "part", results.experiment)
    cell = results.experiment.cells()[0]
    part.save(cell, results.strides(cell))
    data = part.dataset()
    path = part.path(cell)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(FileProblem, match="is not the file that was written"):
        part.dataset()
    with pytest.raises(FileProblem, match="is not the file that was written"):
        data["error"].load()


def test_the_summary_is_tidy(results: Results) -> None:
    """A row a number: no two rows of the same thing, and no number without a unit."""
    summary = results.summary()
    keys = [name for name in summary.columns if name not in ("value", "unit")]
    assert not summary.duplicated(keys).any()
    assert summary["unit"].notna().all()
    assert set(summary["speed"]) == {0.0, 0.2, 0.3}
