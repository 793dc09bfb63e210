"""Experiments of commanded speeds: cells, what they depend on, and what their strides hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.compare.experiment import (
    cell_definition,
    define,
    fingerprint,
    read_config,
    to_document,
)
from pronk_pin.compare.metrics import stride_table
from pronk_pin.errors import FileProblem, InvalidInput, SpeedOutOfRange

RAMP, STEP = "0.1 2s, 0.1->0.3 1s, 0.3 2s", "0.2 2s, 0.1 1s"
SHORT = Schedule(0.5, 1.0, 3.0)


def experiment(*controllers: str, commands: tuple[str, ...] = (RAMP, STEP)) -> Experiment:
    return Experiment(controllers=controllers, commands=commands, schedule=SHORT)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("driven") / "result"
    return run_experiment(experiment("pd", "library"), folder, workers=1, progress=False)


def test_what_is_learned_is_learned_at_the_shipped_speeds_that_the_commands_span() -> None:
    driven = experiment("pd", "library", "ilc")
    assert driven.speeds == (0.1, 0.2, 0.3)
    assert experiment("pd", commands=("0.25 3s",)).speeds == (0.2, 0.3)
    names = [cell.name for cell in driven.cells()]
    assert names == ["ilc_nominal_0.practice", *(f"{c}_nominal_0" for c in driven.controller_names)]
    needed = {cell.name: cell.depends_on for cell in driven.cells()}
    assert needed["library_nominal_0"] == driven.cells()[0]
    assert not [name for name, on in needed.items() if on is not None and "library" not in name]
    assert not any(cell.practice for cell in experiment("pd", "model").cells())


def test_the_learning_beforehand_is_that_of_an_experiment_at_these_speeds(results: Results) -> None:
    alone = Experiment(controllers=("ilc",), speeds=(0.1, 0.2, 0.3), schedule=SHORT)
    (plain,), practice = alone.cells(), results.experiment.cells()[0]
    assert practice.practice
    assert results.strides(practice).attrs["fingerprint"] == fingerprint(
        cell_definition(define(alone), plain)
    )


def test_a_command_that_stays_is_driven_as_a_speed_is(tmp_path: Path) -> None:
    constant = Experiment(controllers=("pd",), speeds=(0.3,), schedule=Schedule(0.5, 0.0, 3.0))
    commanded = experiment("pd", commands=("0.3 3s",))
    one, other = (
        run_experiment(each, tmp_path / name, workers=1, progress=False).dataset().squeeze()
        for name, each in (("speed", constant), ("command", commanded))
    )
    for name in ("start", "peak_error", "mean_speed", "reference", "error", "tick_joints"):
        there = other[name]
        if name == "reference":
            there = there.isel(stride=3)
        np.testing.assert_allclose(there, one[name], atol=1e-6, err_msg=name)


def test_reference_less_error_is_where_the_joints_are(results: Results) -> None:
    """In every part of the last strides, whose gaits change between stance and flight."""
    strides = results.all_strides(controller="pd").sel(command=RAMP)
    count, last, timestep = int(strides["count"]), strides.sizes["last"], 1e-3
    checked = 0
    for k in range(count - last, count):
        for part in range(2):
            own = strides.isel(stride=k, part=part)
            joints = (own["reference"] - own["error"]).transpose("phase", "joint").to_numpy()
            ticks = own["tick_joints"].isel(last=k - (count - last)).transpose("tick", "joint")
            ticks = ticks.to_numpy()[np.isfinite(ticks.to_numpy()).all(axis=1)]
            lasts = own["planned_duration"] if part == 0 else own["flight_reference"]
            index = own["phase"].to_numpy() * float(lasts) / timestep
            there = (index > 2.0) & (index < len(ticks) - 1)  # from when contact is felt
            for j in range(joints.shape[1]):
                seen = np.interp(index[there], np.arange(len(ticks)), ticks[:, j])
                np.testing.assert_allclose(joints[there, j], seen, atol=2e-3)
            checked += 1
    assert checked == 24
    assert np.ptp(strides["gait_speed"].to_numpy()[:count]) > 0.15


def test_the_summary_is_by_command_and_says_what_the_strides_do(results: Results) -> None:
    summary = results.summary()
    assert set(summary["command"]) == {RAMP, STEP}
    assert set(summary["controller"]) == {"pd", "library"}
    strides = results.all_strides(controller="library")
    table = stride_table(strides)
    mine = table[(table["command"] == STEP) & (table["time"] >= 1.5)]
    assert mine["time"].max() < 3.0 < strides["start"].max()  # held on, and not counted
    rows = summary[(summary["command"] == STEP) & (summary["controller"] == "library")]
    values = rows.set_index(["joint", "metric"])["value"]
    assert values["calf", "worst_peak_error"] == mine["calf"].max()
    off = mine["speed"] - mine["commanded"]
    assert values["-", "speed_error"] == pytest.approx(np.sqrt(np.mean(off**2)))
    assert values["-", "upright"] == 1.0
    worst = summary[(summary["metric"] == "worst_peak_error") & (summary["joint"] == "calf")]
    by_controller = worst.groupby("controller")["value"].max()
    assert by_controller["library"] < 0.5 * by_controller["pd"]


def test_a_folder_is_read_again_and_extended(results: Results, tmp_path: Path) -> None:
    folder, few = tmp_path / "result", experiment("pd")
    before = run_experiment(few, folder, workers=1, progress=False)
    strides = before.path(before.experiment.compared[0]).read_bytes()
    assert Results.load(folder).experiment == few
    after = run_experiment(experiment("library"), folder, workers=1, progress=False)
    assert after.experiment.controller_names == ("pd", "library")
    assert after.path(after.experiment.compared[0]).read_bytes() == strides
    assert after.summary().equals(results.summary())
    assert Results.load(folder).dataset()["peak_error"].sizes["command"] == 2


def test_a_folder_takes_no_other_commands(results: Results) -> None:
    for other in (
        Experiment(controllers=("pd",), speeds=(0.1,), schedule=SHORT),
        replace(results.experiment, commands=(RAMP,)),
        replace(results.experiment, reference="measured"),
    ):
        with pytest.raises(FileProblem, match=r"another experiment \((commands|reference) is"):
            run_experiment(other, results.folder, workers=1, progress=False)


def test_what_cannot_be_commanded_is_refused() -> None:
    with pytest.raises(SpeedOutOfRange):
        experiment("pd", commands=("0 2s, 0->0.9 2s",))
    with pytest.raises(SpeedOutOfRange):
        replace(experiment("pd"), speeds=(0.1, 0.2))
    with pytest.raises(InvalidInput, match="leave the commands out, or choose base 'locked'"):
        replace(experiment("pd"), base="free")
    with pytest.raises(InvalidInput, match="make it 1 s or more"):
        experiment("pd", commands=("0.1 0.5s",))
    with pytest.raises(InvalidInput, match="none of them twice"):
        experiment("pd", commands=(RAMP, RAMP))


def test_commands_are_read_from_files_beside_a_config(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text("time,speed\n0,0.1\n2,0.1\n3,0.3\n")
    (tmp_path / "mine.yaml").write_text("controllers: [pd]\ncommands: [drive.csv, 0.2 3s]\n")
    assert read_config(tmp_path / "mine.yaml").commands == ("0.1 2s, 0.1->0.3 1s", "0.2 3s")


def test_without_commands_a_document_is_what_it_was() -> None:
    assert not {"commands", "reference"} & to_document(Experiment()).keys()
    assert to_document(experiment("pd"))["commands"] == (RAMP, STEP)
