"""Figures of a result, read back: each curve is what the strides say, at the stride it says."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from pronk_pin._typing import Array
from pronk_pin.compare import Results
from pronk_pin.compare.metrics import PeakHistory, table_1
from pronk_pin.compare.report import answer
from pronk_pin.viz.figure_style import ACCENT, look
from pronk_pin.viz.figures import (
    errors_by_speed,
    heat_map,
    learned_minus_model,
    learning_curves,
    peak_curves,
    torque_library,
    torque_surface,
    tracking,
)
from pronk_pin.viz.report import scenario_figures

SHOWN = {"calf": 2, "thigh": 1}
"""Joints of the figures, with their places in a leg."""


@pytest.fixture(scope="module")
def strides(results: Results) -> dict[str, xr.Dataset]:
    names = results.experiment.controller_names
    return {name: results.strides(results.find(controller=name)).load() for name in names}


def curve(axes: Axes, label: str) -> Array:
    """The line of a label, (n, 2)."""
    (line,) = (line for line in axes.lines if line.get_label() == label)
    return np.column_stack([np.asarray(each, dtype=float) for each in line.get_data()])


def reach_of(axes: Axes, controller: str, x: float) -> tuple[float, float]:
    """Least and greatest height of a controller's band at a place."""
    (band,) = (
        each
        for each in axes.collections
        if to_rgba(each.get_facecolor()[0])[:3] == to_rgba(look(controller).color)[:3]
    )
    corners = band.get_paths()[0].vertices
    heights = corners[np.isclose(corners[:, 0], x), 1]
    return float(heights.min()), float(heights.max())


def panel(figure: Figure, start: str) -> Axes:
    """The one panel whose title begins so."""
    (found,) = (axes for axes in figure.axes if axes.get_title().startswith(start))
    return found


def first_of_learning(strides: xr.Dataset, speed: int) -> int:
    return int(np.flatnonzero(strides["learning"].to_numpy()[speed] == 1)[0])


def peaks_of(strides: xr.Dataset, joint: str) -> Array:
    """Peak errors, mean over the legs, (speeds, strides)."""
    peaks = strides["peak_error"].transpose("speed", "stride", "joint").to_numpy()
    return np.asarray(peaks[..., SHOWN[joint] :: 3].mean(axis=-1))


def steady_of(strides: xr.Dataset, speed: int) -> slice:
    """The last strides, as many as are steady at every speed."""
    count = strides["count"].to_numpy()
    start, switch = strides["start"].to_numpy(), float(strides.attrs["switch"])
    learned = [int(np.sum(start[k, : count[k]] > switch - 5e-4)) for k in range(len(count))]
    last = min(min(30, max(made - 10, -(-made // 2))) for made in learned)
    return slice(int(count[speed]) - last, int(count[speed]))


@pytest.mark.parametrize("joint", SHOWN)
def test_learning_begins_at_stride_0_of_its_curve(
    strides: dict[str, xr.Dataset], joint: str
) -> None:
    axes = panel(learning_curves(strides), joint)
    x, y = curve(axes, "ILC").T
    assert x[:4].tolist() == [-2.0, -1.0, 0.0, 1.0]
    peaks = peaks_of(strides["ilc"], joint)
    for at, drawn in zip(x.astype(int), y, strict=True):
        expected = [peaks[k, first_of_learning(strides["ilc"], k) + at] for k in range(2)]
        assert drawn == pytest.approx(np.mean(expected)), at
        assert reach_of(axes, "ilc", at) == pytest.approx((min(expected), max(expected))), at
    for controller in ("pd", "model"):
        level = np.mean(
            [
                peaks_of(strides[controller], joint)[k, steady_of(strides[controller], k)].mean()
                for k in range(2)
            ]
        )
        np.testing.assert_allclose(curve(axes, look(controller).label)[:, 1], level)


def test_tracking_shows_the_last_stride_before_and_the_last_of_all(
    strides: dict[str, xr.Dataset],
) -> None:
    mine = strides["ilc"]
    figure = tracking(mine, speed=0.5, seconds=(1.5, 5.0))
    switch, count = first_of_learning(mine, 1), int(mine["count"][1])
    for joint, place in SHOWN.items():
        reference = mine["reference"].sel(part="stance").to_numpy()
        planned = (reference[1] if reference.ndim == 3 else reference)[:, place]
        error = mine["error"].sel(part="stance").isel(speed=1, joint=place)
        error = error.transpose("stride", "phase").to_numpy()
        panels = [axes for axes in figure.axes if axes.get_title().endswith("rad")]
        for name, stride in (("pd", switch - 1), ("ilc", count - 1)):
            peak = np.abs(error[stride]).max()
            title = f"{look(name).label}: {peak:.3f} rad"
            found = [axes for axes in panels if axes.get_title() == title]
            drawn = [line.get_ydata() for axes in found for line in axes.lines]
            assert any(np.allclose(values, planned - error[stride]) for values in drawn), joint
            assert any(np.allclose(values, planned) for values in drawn), joint


def test_learning_is_marked_when_it_is_switched_on(strides: dict[str, xr.Dataset]) -> None:
    mine = strides["ilc"]
    figure = tracking(mine, speed=0.5, seconds=(1.5, 5.0))
    began = float(mine["start"][1, first_of_learning(mine, 1)])
    over_time = [axes for axes in figure.axes if axes.get_ylabel().endswith("[rad]")]
    assert [axes.get_ylabel() for axes in over_time] == ["FL_calf [rad]", "FL_thigh [rad]"]
    for axes in over_time:
        (line,) = (one for one in axes.lines if to_rgba(one.get_color()) == to_rgba(ACCENT))
        assert line.get_xdata()[0] == pytest.approx(began)
        solid = [one for one in axes.lines if one.get_linestyle() == "-" and one is not line]
        for one in solid:
            learned = bool(one.get_xdata()[0] > began - 1e-6)
            wanted = look("ilc" if learned else "pd").color
            assert to_rgba(one.get_color()) == to_rgba(wanted)
        starts = [float(one.get_xdata()[0]) for one in solid]
        assert min(starts) == pytest.approx(began - 1.5, abs=0.5)
        assert max(starts) == pytest.approx(began + 5.0, abs=0.5)


def learned(strides: xr.Dataset, speed: int, place: int) -> Array:
    """Mean feedforward of the steady strides in stance, of the first leg [N m]."""
    values = strides["feedforward"].sel(part="stance").isel(speed=speed, joint=place)
    return np.asarray(
        values.transpose("stride", "phase").to_numpy()[steady_of(strides, speed)].mean(axis=0)
    )


@pytest.mark.parametrize("joint", SHOWN)
def test_the_learned_torque_is_the_steady_mean_of_each_speed(
    strides: dict[str, xr.Dataset], joint: str
) -> None:
    mine, model, place = strides["ilc"], strides["model"], SHOWN[joint]
    library = panel(torque_library(mine), f"FL_{joint}")
    difference = panel(learned_minus_model(mine, model), f"FL_{joint}")
    surface = panel(torque_surface(mine), f"FL_{joint}")
    (mesh,) = (each for each in surface.collections if isinstance(each, QuadMesh))
    heights = np.asarray(mesh.get_array()).reshape(2, -1)
    for k, speed in enumerate(("0", "0.5")):
        torque = learned(mine, k, place)
        np.testing.assert_allclose(curve(library, speed)[:, 0], mine["phase"])
        np.testing.assert_allclose(curve(library, speed)[:, 1], torque)
        np.testing.assert_allclose(heights[k], torque)
        expected = torque - learned(model, k, place)
        np.testing.assert_allclose(curve(difference, speed)[:, 1], expected, atol=1e-12)


@pytest.mark.parametrize("joint", SHOWN)
def test_errors_are_drawn_by_speed_beside_the_papers_table(results: Results, joint: str) -> None:
    summary = results.summary()
    axes = panel(errors_by_speed(summary, scenario="nominal"), joint)
    mine = summary[(summary["joint"] == joint) & (summary["metric"] == "peak_error")]
    for controller in results.experiment.controller_names:
        rows = mine[mine["controller"] == controller].sort_values("speed")
        drawn = curve(axes, look(controller).label)
        np.testing.assert_allclose(drawn, rows[["speed", "value"]])
    printed = table_1()
    for controller, label in (("pd", "paper, PD"), ("ilc", "paper, ILC")):
        rows = printed[(printed["joint"] == joint) & (printed["controller"] == controller)]
        np.testing.assert_allclose(curve(axes, label), rows[["speed", "value"]])


def test_the_heat_map_writes_each_mean_in_its_own_cell(results: Results) -> None:
    summary = results.summary()
    figure = heat_map(answer(summary))
    for joint in SHOWN:
        axes = panel(figure, joint)
        names = [label.get_text() for label in axes.get_xticklabels()]
        assert names == [look(name).label for name in ("pd", "model", "ilc")]
        rows = summary[(summary["joint"] == joint) & (summary["metric"] == "peak_error")]
        means = rows.groupby("controller")["value"].mean()
        (image,) = axes.images
        expected = [1e3 * means[name] for name in ("pd", "model", "ilc")]  # mrad
        np.testing.assert_allclose(np.asarray(image.get_array())[0], expected)
        written = {text.get_position(): text.get_text() for text in axes.texts}
        assert written == {(k, 0): f"{mean:.0f}" for k, mean in enumerate(expected)}


def test_curves_of_all_scenarios_begin_with_the_first_stride_of_learning() -> None:
    """Two speeds of two seeds, of which one robot fell; the level of the model as a line."""
    rng = np.random.default_rng(0)
    settings = {"robot": "a1", "base": "locked", "scenario": "nominal"}
    peaks = [rng.uniform(0.01, 0.1, (7 + k, 2)) for k in range(4)]
    learners = [
        PeakHistory(
            {**settings, "controller": "ilc", "seed": seed},
            np.array([0.1, 0.2]),
            (peaks[2 * seed], peaks[2 * seed + 1]),
            np.zeros((2, 2)),
            np.array([1.0, 1.0 - seed]),
        )
        for seed in (0, 1)
    ]
    levels = np.array([[0.03, 0.05], [0.05, 0.09]])
    nothing = (np.empty((0, 2)), np.empty((0, 2)))
    model = PeakHistory(
        {**settings, "controller": "model", "seed": 0},
        np.array([0.1, 0.2]),
        nothing,
        levels,
        np.ones(2),
    )
    for column, joint in enumerate(("calf", "thigh")):
        (axes,) = peak_curves({"nominal": [*learners, model]}, joint=joint).axes
        x, y = curve(axes, "ILC").T
        assert x.tolist() == list(range(1, 8))
        up = [peaks[0][:7, column], peaks[1][:7, column], peaks[2][:7, column]]
        np.testing.assert_allclose(y, np.mean(up, axis=0))
        quartiles = np.quantile(up, [0.25, 0.75], axis=0)
        for k in (1, 4, 7):
            assert reach_of(axes, "ilc", k) == pytest.approx(tuple(quartiles[:, k - 1]))
        level = curve(axes, look("model").label)[:, 1]
        np.testing.assert_allclose(level, levels[:, column].mean())


def test_every_axis_says_its_quantity_and_its_unit(results: Results) -> None:
    """In each panel, both: a unit in brackets, or a phase and counts, which have none."""
    without = ("phase", "stride")
    for name, figure in scenario_figures(results, "nominal").items():
        named = [axes for axes in figure.axes if axes.get_visible()]
        columns = {axes.get_subplotspec().colspan.start for axes in named if axes.get_subplotspec()}
        assert columns, name
        for axes in named:
            spec = axes.get_subplotspec()
            if spec is None:  # a colour bar
                assert axes.get_ylabel().endswith("]"), name
                continue
            x, y = axes.get_xlabel(), axes.get_ylabel()
            if spec.is_last_row():
                assert "[" in x or any(word in x for word in without), (name, x)
            if spec.is_first_col():
                assert y.endswith("]"), (name, y)


def test_a_summary_of_several_seeds_is_drawn_as_their_mean() -> None:
    keys = {"robot": "a1", "base": "locked", "scenario": "nominal", "unit": "rad"}
    rows = [
        {**keys, "controller": "pd", "speed": speed, "seed": seed, "joint": "calf"}
        | {"metric": metric, "value": value}
        for speed in (0.1, 0.3)
        for seed in (0, 1)
        for metric, value in (("peak_error", speed + 0.02 * seed), ("upright", 1.0))
    ]
    table = pd.DataFrame(rows)
    table.loc[table["metric"] == "upright", "joint"] = "-"
    axes = panel(errors_by_speed(table, scenario="nominal"), "calf")
    np.testing.assert_allclose(curve(axes, "PD"), [[0.1, 0.11], [0.3, 0.31]])


def test_errors_that_differ_by_powers_of_ten_are_on_an_axis_that_shows_them_all(
    results: Results, strides: dict[str, xr.Dataset]
) -> None:
    for figure in (
        errors_by_speed(results.summary(), scenario="nominal"),
        learning_curves(strides),
    ):
        for axes in figure.axes:
            drawn = [np.asarray(line.get_ydata(), dtype=float) for line in axes.lines]
            low, high = axes.get_ylim()
            assert axes.get_yscale() == "log"
            assert low <= np.nanmin(np.concatenate(drawn))
            assert high >= np.nanmax(np.concatenate(drawn))
