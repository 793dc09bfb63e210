"""A result is shown as it was simulated: the strides asked for, beside their reference."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from pronk_pin.compare import Experiment, Results, run_experiment
from pronk_pin.compare.simulation.schedule import Schedule
from pronk_pin.errors import InvalidInput
from pronk_pin.viz.report import scenario_figures
from pronk_pin.viz.scenes import Choice, stride_scenes
from pronk_pin.viz.scenes.stride_scenes import result_menu


def test_the_first_scene_begins_three_strides_before_learning(results: Results) -> None:
    scene = result_menu(results).scene()
    strides = results.strides(results.find(controller="ilc")).sel(speed=0.5)
    first = int(np.flatnonzero(strides["learning"].to_numpy() == 1)[0])
    measured, planned, *_ = scene.tracks
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


def test_the_question_is_shown_first_practice_beside_pd_and_the_model(results: Results) -> None:
    """The same strides side by side, in the colours of the figures, with their errors."""
    scene = result_menu(results).scene()
    robots = [track for track in scene.tracks if not track.ghost]
    assert [track.name for track in robots] == ["ILC", "PD", "PD + model"]
    assert [track.q[0, 1] for track in robots] == pytest.approx([0.0, 0.55, 1.1])
    assert len({track.color for track in scene.tracks}) == 4  # and the references' own
    numbers = [[mark.stride for mark in track.marks] for track in robots]
    assert numbers[0] == numbers[1] == numbers[2]
    for track, name in zip(robots, ("ilc", "pd", "model"), strict=True):
        strides = results.strides(results.find(controller=name)).sel(speed=0.5)
        count, history = int(strides["count"]), track.history
        assert history is not None
        assert history.stride.tolist() == list(range(count))
        calves = [joint for joint in strides["joint"].to_numpy() if "calf" in str(joint)]
        peaks = strides["peak_error"].sel(joint=calves).isel(stride=slice(count)).mean("joint")
        np.testing.assert_allclose(history.errors["calf"], peaks)
        shown = history.stride.tolist().index(track.marks[0].stride)
        assert history.t[shown] == pytest.approx(track.t[0])
        assert (history.began is None) == (name != "ilc")
    ilc, pd, model = (track.history.errors["calf"][-1] for track in robots)  # type: ignore[union-attr]
    assert ilc < model < pd


def test_a_rival_without_a_stride_is_left_out_and_named(
    results: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    load = stride_scenes._Reader._strides

    def strides(self: Any, controller: str, choice: Choice) -> xr.Dataset:
        found = load(self, controller, choice)
        return found.assign(count=0 * found["count"]) if controller == "pd" else found

    monkeypatch.setattr(stride_scenes._Reader, "_strides", strides)
    scene = result_menu(results).scene()
    assert [track.name for track in scene.tracks if not track.ghost] == ["ILC", "PD + model"]
    assert scene.caption.endswith("fell: PD at once")


def test_what_learns_is_shown_first_whatever_it_is_called(tmp_path: Path) -> None:
    experiment = Experiment(
        speeds=(0.0,),
        controllers=("pd", "ilc-stance"),
        schedule=Schedule(baseline=2.0, learning=2.0),
    )
    made = run_experiment(experiment, tmp_path / "own", workers=1, progress=False)
    first = result_menu(made).first
    assert (first["controller"], first["beside it"]) == ("ilc-stance", "pd")


def test_a_file_holds_each_scenario_and_controller_before_their_combinations(
    results: Results,
) -> None:
    menu = result_menu(results)
    choices = [tuple(choice.values()) for choice in menu.choices()]
    assert len(set(choices)) == len(choices)
    assert choices[0] == tuple(menu.first.values())
    early = [dict(zip(menu.options, choice, strict=True)) for choice in choices[:6]]
    assert {choice["controller"] for choice in early} == {"pd", "ilc", "model"}
    assert {choice["speed [m/s]"] for choice in early} == {"0", "0.5"}
    assert {choice["strides"] for choice in early} >= {"the last ones"}
    for choice in early:
        assert menu.scene(choice).tracks


def test_feet_stand_on_the_ground_in_stance_and_arrows_end_with_it(results: Results) -> None:
    """What the page draws between two rows of the film, at any time of a stride."""
    menu = result_menu(results)
    scene = menu.scene({**menu.first, "strides": "the last ones", "beside it": "nothing"})
    track, times = scene.leader, scene.times(60.0)
    (row, *_) = scene.rows(times)
    begins = np.array([mark.t for mark in track.marks])
    assert all(np.abs(times - t).min() < 1e-6 for t in begins if times[0] <= t <= times[-1])
    fine = np.arange(times[0], begins[-1], 0.0005)
    of_stance = np.searchsorted(begins, fine + 1e-9, side="right") % 2 == 1
    feet = np.array([np.interp(fine, times, column) for column in row["feet"].T[2::3]])
    height = feet - scene.robot.foot_radius
    assert height[:, of_stance].max() < 0.004  # it was 11 mm
    forces = np.array([np.interp(fine, times, column) for column in row["forces"].T[2::3]])
    assert np.nanmedian(forces[:, of_stance].max(axis=0)) > 20.0
    assert np.nanpercentile(forces[:, ~of_stance].max(axis=0), 90) < 5.0


def test_slope_payload_and_soft_ground_are_told_to_the_page(tmp_path: Path) -> None:
    experiment = Experiment(
        speeds=(0.0,),
        controllers=("pd",),
        scenarios=("payload=2+slope=0.08", "soft-ground"),
        schedule=Schedule(baseline=1.0, learning=0.5),
    )
    made = run_experiment(experiment, tmp_path / "worlds", workers=1, progress=False)
    scene = result_menu(made).scene()
    assert (scene.slope, scene.payload, scene.soft) == (0.08, 2.0, False)
    assert scene.payload_position[2] > 0.0
    soft = result_menu(made, scenario="soft-ground").scene()
    assert (soft.slope, soft.payload, soft.soft) == (0.0, 0.0, True)


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


def test_a_scenario_with_learning_and_a_model_has_six_figures(results: Results) -> None:
    found = scenario_figures(results, "nominal")
    assert set(found) == {"errors", "learning", "tracking", "torques", "surface", "difference"}


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


def test_the_reference_begins_each_stride_where_the_robot_touches_down(results: Results) -> None:
    """And is the gait's from there, in place, time and posture; at 0.5 m/s strides are 0.2 m."""
    scene = result_menu(results, speed=0.5, controller="pd").scene()
    measured, planned = scene.tracks
    (gait,) = results.experiment.planned_at([0.5])
    touchdowns = [mark.t for mark in measured.marks if mark.phase == "stance"]
    assert len(touchdowns) == 12
    for begin in touchdowns:
        there = measured.at(np.array([begin]))["q"][0]
        np.testing.assert_allclose(planned.at(np.array([begin]))["q"][0, 0], there[0], atol=1e-9)
        for s in (0.25, 0.75):
            time = begin + s * gait.stance.duration
            q = planned.at(np.array([time]))["q"][0]
            base = gait.stance.base_reference(np.array([s]))[0][0]
            np.testing.assert_allclose(q[[0, 2]] - [there[0], 0.0], base[:2], atol=2e-4)
            joints = gait.stance.joint_reference(np.array([s]))[0][0]
            np.testing.assert_allclose(q[7:], joints, atol=2e-3)


def test_phases_are_named_as_the_feet_stand(results: Results) -> None:
    for controller in ("pd", "ilc"):
        scene = result_menu(results, speed=0.5, controller=controller).scene()
        marks = scene.tracks[0].marks
        assert [mark.phase for mark in marks[:4]] == ["stance", "flight", "stance", "flight"]
        assert [mark.stride for mark in marks[:4]] == [marks[0].stride + k for k in (0, 0, 1, 1)]
        for mark, following in pairwise(marks):
            middle = np.array([0.5 * (mark.t + following.t)])
            height = scene.rows(middle)[0]["feet"].reshape(4, 3)[:, 2] - scene.robot.foot_radius
            if mark.phase == "stance":
                assert np.abs(height).max() < 0.004
            else:
                assert height.min() > 0.01


def test_marks_are_where_the_strides_begin(results: Results) -> None:
    strides = results.strides(results.find(controller="pd")).sel(speed=0.5)
    measured = result_menu(results, speed=0.5, controller="pd").scene().tracks[0]
    starts, stances = strides["start"].to_numpy(), strides["stance"].to_numpy()
    first = measured.marks[0].stride
    for mark in measured.marks:
        expected = starts[mark.stride] - starts[first]
        expected += stances[mark.stride] if mark.phase == "flight" else 0.0
        assert mark.t == pytest.approx(expected)


def test_torques_are_those_that_the_motors_gave_and_never_more(results: Results) -> None:
    menu = result_menu(results, speed=0.0, controller="pd")
    scene = menu.scene()
    mine = results.strides(results.find(controller="pd")).sel(speed=0.0)
    stride = mine.isel(stride=scene.tracks[0].marks[4].stride).sel(phase=0.25)
    for part in ("stance", "flight"):
        at = stride.sel(part=part)
        asked = (at["feedback"] + at["feedforward"]).to_numpy()
        begin = next(mark.t for mark in scene.tracks[0].marks[4:] if mark.phase == part)
        t = begin + 0.25 * float(mine["planned_duration"].sel(part=part))
        limit = scene.robot.tau_max
        drawn = scene.tracks[0].at(np.array([t]))["torque"][0]
        np.testing.assert_allclose(drawn, np.clip(asked, -limit, limit), atol=1e-9)


def test_the_robot_beside_is_asked_for_by_name_and_shown_in_its_own_colour(
    results: Results,
) -> None:
    scene = result_menu(results, beside="model", speed=0.5, controller="pd").scene()
    second = scene.tracks[2]
    alone = result_menu(results, speed=0.5, controller="model").scene().tracks[0]
    np.testing.assert_allclose(second.q[:, 2:], alone.q[:, 2:])
    np.testing.assert_allclose(second.q[:, 1] - alone.q[:, 1], 0.55)
    assert second.color != scene.tracks[0].color
    assert [track.ghost for track in scene.tracks] == [False, True, False, True]
