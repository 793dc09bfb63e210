"""A result is shown as it was simulated: the strides asked for, beside their reference."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pronk_pin.compare import Experiment, Results, run_experiment
from pronk_pin.compare.simulation.schedule import Schedule
from pronk_pin.errors import InvalidInput
from pronk_pin.viz.report import scenario_figures
from pronk_pin.viz.scenes.stride_scenes import result_menu


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """Two speeds and two controllers, a few seconds each."""
    experiment = Experiment(
        speeds=(0.0, 0.5),
        controllers=("pd", "ilc", "model"),
        schedule=Schedule(baseline=5.0, learning=6.0),
    )
    folder: Path = tmp_path_factory.mktemp("results") / "short"
    return run_experiment(experiment, folder, workers=1, progress=False)


def test_the_first_scene_begins_three_strides_before_learning(results: Results) -> None:
    scene = result_menu(results).scene()
    strides = results.strides(results.find(controller="ilc")).sel(speed=0.5)
    first = int(np.flatnonzero(strides["learning"].to_numpy() == 1)[0])
    measured, planned = scene.tracks
    assert [mark.stride for mark in measured.marks[::2]] == [*range(first - 3, first + 9)]
    assert planned.ghost
    assert measured.t[0] == planned.t[0] == 0.0
    assert "learning starts after" in scene.caption


def test_the_robot_is_shown_as_it_was_measured(results: Results) -> None:
    menu = result_menu(results, speed=0.0, controller="pd")
    (measured, planned), strides = (
        menu.scene().tracks,
        results.strides(results.find(controller="pd")),
    )
    mine = strides.sel(speed=0.0)
    count = int(mine["count"])
    stance = mine.isel(stride=count - 12).sel(part="stance", phase=0.5)
    t = 0.5 * float(mine["planned_duration"].sel(part="stance"))
    row = measured.at(np.array([t]))
    joints = (stance["reference"] - stance["error"]).to_numpy()
    np.testing.assert_allclose(row["q"][0, 7:], joints, atol=1e-9)
    np.testing.assert_allclose(row["error"][0], stance["error"], atol=1e-9)
    reference = planned.at(np.array([t]))["q"][0, 7:]
    np.testing.assert_allclose(reference, stance["reference"], atol=1e-9)


def test_the_last_strides_have_forces_that_carry_the_robot(results: Results) -> None:
    menu = result_menu(results)
    scene = menu.scene({**menu.first, "strides": "the last ones"})
    track = scene.tracks[0]
    assert track.forces is not None
    times = np.arange(track.t[0], track.marks[-2].t, 0.001)
    rows = track.at(times)
    vertical = rows["forces"].reshape(-1, 4, 3)[:, :, 2].sum(axis=1)
    weight = scene.robot.mass * scene.robot.gravity
    # Over whole strides the ground gives back what gravity takes.
    assert np.mean(vertical) == pytest.approx(weight, rel=0.05)
    apex = np.argmax(track.q[:, 2])
    # On its way through the air a foot may brush the ground, no more.
    assert np.abs(track.forces[apex]).max() < 0.05 * weight


def test_a_trunk_that_pitches_is_shown_pitching(tmp_path: Path) -> None:
    experiment = Experiment(
        speeds=(0.5,),
        controllers=("pd",),
        base="sagittal",
        schedule=Schedule(baseline=3.0, learning=0.5),
    )
    results = run_experiment(experiment, tmp_path / "pitching", workers=1, progress=False)
    strides = results.strides(results.find(controller="pd")).isel(speed=0)
    shown = result_menu(results).scene().tracks[0]
    first = shown.marks[0].stride
    stance = strides.isel(stride=first).sel(part="stance", phase=0.5)
    t = 0.5 * float(strides["planned_duration"].sel(part="stance"))
    q = shown.at(np.array([t]))["q"][0]
    pitch = 2.0 * np.arctan2(q[4], q[6])
    measured = float(stance["attitude"].sel(rotation="pitch"))
    assert abs(measured) > 1e-3
    assert pitch == pytest.approx(measured, abs=1e-6)


def test_strides_before_learning_run_beside_those_with_it(results: Results) -> None:
    scene = result_menu(results, beside="before learning").scene()
    first, _, second, _ = scene.tracks
    assert second.name == "before learning"
    assert second.q[0, 1] - first.q[0, 1] == pytest.approx(0.55)
    assert second.marks[-1].stride < first.marks[-1].stride
    assert first.error is not None
    assert second.error is not None
    last = slice(-40, None)  # of the stride that ends the windows
    assert np.abs(first.error[last]).max() < 0.7 * np.abs(second.error[last]).max()


def test_any_stride_and_any_pair_can_be_chosen(results: Results) -> None:
    menu = result_menu(results, stride=20, beside="model", controller="pd")
    tracks = menu.scene().tracks
    assert [mark.stride for mark in tracks[0].marks[::2]] == [*range(12, 24)]
    assert tracks[2].name == "PD + model, beside"


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"speed": 0.3}, "no speed 0.3; choose one of: 0, 0.5"),
        ({"stride": 999}, "there is no stride 999; choose one from 0 to"),
        ({"controller": "library"}, "no 'library'"),
        ({"beside": "nobody"}, "there is no beside it nobody; choose one of: nothing"),
    ],
)
def test_what_is_not_there_is_named(
    results: Results, asked: dict[str, object], message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        result_menu(results, **asked)  # type: ignore[arg-type]


def test_before_learning_needs_learning(results: Results) -> None:
    menu = result_menu(results, controller="pd")
    with pytest.raises(InvalidInput, match="no strides before learning"):
        menu.scene({**menu.first, "beside it": "before learning"})


def test_every_figure_has_its_axes_named_with_units(results: Results) -> None:
    found = scenario_figures(results, "nominal")
    assert set(found) == {"errors", "learning", "tracking", "torques", "surface", "difference"}
    for name, figure in found.items():
        labels = [a.get_ylabel() for a in figure.axes] + [a.get_xlabel() for a in figure.axes]
        assert any("[" in label for label in labels), name


def test_the_difference_is_the_learned_torque_less_the_models(results: Results) -> None:
    figure = scenario_figures(results, "nominal")["difference"]
    torque = {}
    for controller in ("ilc", "model"):
        strides = results.strides(results.find(controller=controller)).sel(speed=0.5)
        count, learned = int(strides["count"]), strides["learning"] == 1
        made = int(learned.sum())
        last = min(30, max(made - 10, -(-made // 2)) or count)  # without the transient
        mine = strides["feedforward"].isel(stride=slice(count - last, count))
        torque[controller] = mine.sel(part="stance", joint="FL_calf").mean("stride").to_numpy()
    (curve,) = (line for line in figure.axes[0].lines if line.get_label() == "0.5")
    np.testing.assert_allclose(curve.get_ydata(), torque["ilc"] - torque["model"], atol=0.2)
