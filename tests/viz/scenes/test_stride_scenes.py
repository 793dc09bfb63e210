"""A result is shown as it was simulated: the strides asked for, beside their reference."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.compare import Experiment, Results, run_experiment
from pronk_pin.compare.simulation.schedule import Schedule
from pronk_pin.errors import InvalidInput
from pronk_pin.viz.report import scenario_figures
from pronk_pin.viz.scenes.stride_scenes import result_menu


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
