"""Figures of the report say what they are to say: read back from what is drawn."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.compare.report import answer
from pronk_pin.errors import InvalidInput
from pronk_pin.robot import Robot
from pronk_pin.viz.figure_style import look
from pronk_pin.viz.figures import SPREAD, errors_by_speed, heat_map, still, torque_surface


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Results:
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", "ilc", "model", "library"),
        scenarios=("slope", "nominal"),
        schedule=Schedule(startup=0.2, baseline=2.0, learning=3.0),
    )
    folder = tmp_path_factory.mktemp("figures") / "result"
    return run_experiment(experiment, folder, workers=1, progress=False)


def labels(figure: Figure) -> list[str]:
    figure.draw_without_rendering()
    return [label.get_text() for axes in figure.axes for label in axes.get_xticklabels()]


def test_scenarios_stand_in_the_order_in_which_they_were_asked_for(result: Results) -> None:
    """Summary, tables and figures: the same everywhere, not by the alphabet."""
    summary = result.summary()
    assert list(summary["scenario"].unique()) == ["slope", "nominal"]
    figure = heat_map(answer(summary))
    assert [t.get_text() for t in figure.axes[0].get_yticklabels()] == ["slope", "nominal"]
    text = result.folder.joinpath("summary.csv").read_text()
    assert Results.load(result.folder).summary().equals(summary), text[:200]


def test_the_heat_maps_bar_is_in_the_unit_of_its_cells_and_is_not_cut(result: Results) -> None:
    summary = result.summary()
    figure = heat_map(answer(summary))
    figure.draw_without_rendering()
    *_, bar = figure.axes
    assert "[mrad]" in bar.get_xlabel()
    cells = [float(text.get_text().split("\n")[0]) for text in figure.axes[0].texts]
    low, high = bar.get_xlim()
    assert low - 0.5 <= min(cells) < max(cells) <= high + 0.5
    box, page = bar.xaxis.label.get_window_extent(), figure.bbox
    assert page.x0 <= box.x0 < box.x1 <= page.x1
    assert page.y0 <= box.y0 < box.y1 <= page.y1


def test_learners_that_lie_on_each_other_are_both_seen(result: Results) -> None:
    """Small errors are as far apart as large ones, markers are hollow, ticks plain numbers."""
    figure = errors_by_speed(result.summary(), scenario="nominal")
    for axes in figure.axes:
        assert axes.get_yscale() == "log"
        named = {line.get_label(): line for line in axes.lines}
        for controller in ("ilc", "library"):
            assert named[look(controller).label].get_markerfacecolor() == "none"
    figure.draw_without_rendering()
    ticks = [t.get_text() for t in figure.axes[0].get_yticklabels() if t.get_text()]
    assert ticks
    assert all(float(tick) > 0.0 for tick in ticks)


def test_one_speed_is_no_surface(result: Results) -> None:
    strides = result.all_strides(controller="ilc", scenario="nominal")
    assert torque_surface(strides).axes
    with pytest.raises(InvalidInput, match="one speed is no surface"):
        torque_surface(strides.isel(speed=[0]))


def test_the_still_shows_the_largest_error_before_and_after(result: Results, robot: Robot) -> None:
    strides = result.all_strides(controller="ilc", scenario="nominal")
    one = strides.sel(speed=0.4)
    before, after = still(strides, robot, speed=0.4).axes
    began = int(np.argmax(one["learning"].to_numpy() == 1))
    calf = one["error"].sel(part="stance", joint="FL_calf").transpose("stride", "phase")
    peaks = np.abs(calf).max("phase").to_numpy()
    assert f"{1e3 * peaks[began - 1]:.0f} mrad" in before.get_title()
    assert f"{1e3 * peaks[int(one['count']) - 1]:.0f} mrad" in after.get_title()
    assert SPREAD > 1.0

    def apart(axes: object) -> float:
        """How far the robot's front foot is drawn from the reference's [m]."""
        feet = [line.get_xydata()[-1] for line in axes.lines if len(line.get_xydata()) == 3]  # type: ignore[attr-defined]
        return float(np.linalg.norm(feet[0] - feet[len(feet) // 2]))

    assert apart(after) < 0.5 * apart(before)
    for axes in (before, after):  # nothing is cut off
        points = np.concatenate([line.get_xydata() for line in axes.lines[:6]])
        assert axes.get_xlim()[0] < points[:, 0].min()
        assert points[:, 0].max() < axes.get_xlim()[1]
