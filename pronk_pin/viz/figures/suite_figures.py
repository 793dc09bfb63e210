"""Figures over many scenarios: who has which error where, and when practice beats the model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..._typing import Array
from ...compare.metrics import RIVAL, PeakHistory
from ...compare.report import SHOWN, ControllerOverview, Overview
from ..figure_style import (
    SEQUENTIAL,
    TWO_COLUMNS,
    in_order,
    legend_below,
    log_axis,
    look,
    new_figure,
    plain_ticks,
    say,
    styled,
)

_STRIDES = 40
"""Strides of learning that are shown."""

_COLUMNS = 4


@styled
def heat_map(tables: Mapping[str, Overview]) -> Figure:
    """Mean peak error of every controller in every scenario, one panel a joint.

    Args:
        tables: `compare.report.answer`. Where robots fell, their number stands below the error, or
            instead of it.
    """
    controllers = in_order(name for table in tables.values() for name in table)
    figure = new_figure(TWO_COLUMNS, 1.6 + 0.27 * len(tables))
    panels = figure.subplots(1, len(SHOWN), sharey=True)
    rows = [[table.get(name) for name in controllers] for table in tables.values()]
    peaks = {
        joint: 1e3 * np.array([[_peak(cell, joint) for cell in row] for row in rows])
        for joint in SHOWN
    }
    errors = np.concatenate([values[np.isfinite(values)] for values in peaks.values()])
    norm = LogNorm(errors.min(), errors.max()) if errors.size else LogNorm(1.0, 1e3)
    for axes, joint in zip(panels, SHOWN, strict=True):
        image = axes.imshow(peaks[joint], cmap=SEQUENTIAL, norm=norm, aspect="auto")
        _write_cells(axes, rows, peaks[joint], norm)
        axes.set_xticks(
            range(len(controllers)), [look(name).label for name in controllers], rotation=25
        )
        for label in axes.get_xticklabels():
            label.set_horizontalalignment("right")
        axes.set_yticks(range(len(tables)), list(tables))
        axes.grid(visible=False)
        axes.set_title(joint)
    # Below: beside a low figure its name would be cut off.
    bar = figure.colorbar(image, ax=panels, location="bottom", aspect=50, shrink=0.6)
    bar.set_label("mean peak stance error [mrad], as in the cells")
    plain_ticks(bar.ax.xaxis)
    return figure


def _peak(cell: ControllerOverview | None, joint: str) -> float:
    return np.nan if cell is None else cell.joints[joint].peak.value


def _write_cells(
    axes: Axes, rows: list[list[ControllerOverview | None]], peaks: Array, norm: LogNorm
) -> None:
    """The error of each cell [mrad], and how many fell."""
    for (row, column), value in np.ndenumerate(peaks):
        cell, color = rows[row][column], "black"
        if cell is None:
            continue
        if np.isfinite(value):
            text = f"{value:.0f}" + (f"\n{cell.fell} fell" if cell.fell else "")
            light = np.dot(colormaps[SEQUENTIAL](float(norm(value)))[:3], (0.3, 0.6, 0.1)) > 0.5
            color = "black" if light else "white"
        else:
            text = "all\nfell" if cell.fell == cell.robots else "no\nstride"
        axes.text(column, row, text, ha="center", va="center", fontsize=6, color=color)


@styled
def peak_curves(histories: Mapping[str, list[PeakHistory]], *, joint: str) -> Figure:
    """Peak error over the strides of learning in every scenario, with the model's level as a line.

    Means over the robots that did not fall; the band is from the first to the third quartile.

    Args:
        histories: The simulations of each scenario.
        joint: "calf" or "thigh".
    """
    rows = -(-len(histories) // _COLUMNS)
    columns = -(-len(histories) // rows)
    figure = new_figure(TWO_COLUMNS, 0.7 + 1.6 * rows)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes in panels.ravel()[len(histories) :]:
        axes.set_visible(False)
    handles: dict[str, object] = {}
    for axes, (scenario, simulations) in zip(panels.ravel(), histories.items(), strict=False):
        for controller in in_order(str(history.settings["controller"]) for history in simulations):
            of_controller = [
                history for history in simulations if history.settings["controller"] == controller
            ]
            line = _draw(axes, of_controller, SHOWN.index(joint), controller)
            if line is not None:
                handles[look(controller).label] = line
        axes.set_title(scenario)
        if axes.lines:
            log_axis(axes)
        else:
            say(axes, "no robot stayed up")
    for column in panels.T:
        lowest = [axes for axes in column if axes.get_visible()][-1]
        lowest.set_xlabel("strides of learning")
        lowest.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel(f"{joint}: peak [rad]")
    legend_below(figure, handles.values(), handles)
    return figure


@styled
def by_scenario(table: pd.DataFrame) -> Figure:
    """Mean peak error in each sampled scenario, one line a world and one panel a joint.

    Args:
        table: `compare.tables.sampled_scenarios`.
    """
    controllers = in_order(table["calf"].columns)
    figure = new_figure(TWO_COLUMNS, 0.9 + 0.14 * len(table))
    panels = figure.subplots(1, len(SHOWN), sharey=True)
    rows = np.arange(len(table))
    for axes, joint in zip(panels, SHOWN, strict=True):
        errors = table[joint]
        axes.hlines(rows, errors.min(axis=1), errors.max(axis=1), color="0.8", lw=0.8)
        for controller in controllers:
            style = look(controller)
            axes.plot(errors[controller], rows, style.marker, color=style.color, label=style.label)
        if np.isfinite(errors.to_numpy(dtype=float)).any():
            log_axis(axes, "x")
        else:
            say(axes, "no robot stayed up")
        axes.set_title(joint)
        axes.set_xlabel("mean peak stance error [rad]")
    panels[0].set_yticks(rows, table.index)
    panels[0].invert_yaxis()
    legend_below(figure, *panels[0].get_legend_handles_labels())
    return figure


def _draw(axes: Axes, simulations: list[PeakHistory], joint: int, controller: str) -> object:
    """One controller: a curve if it learns, a level if it is PD or the model."""
    style = look(controller)
    upright = [history.upright == 1 for history in simulations]
    curves = [
        peaks[:_STRIDES, joint]
        for history, up in zip(simulations, upright, strict=True)
        for peaks, stands in zip(history.learning, up, strict=True)
        if stands and len(peaks)
    ]
    if curves:
        length = min(map(len, curves))
        values = np.array([curve[:length] for curve in curves])
        k = np.arange(1, length + 1)
        low, high = np.quantile(values, [0.25, 0.75], axis=0)
        axes.fill_between(k, low, high, color=style.color, alpha=0.2, lw=0)
        return axes.plot(k, values.mean(axis=0), **style.curve)[0]
    if controller not in ("pd", RIVAL):
        return None
    levels = np.concatenate(
        [history.level[up, joint] for history, up in zip(simulations, upright, strict=True)]
    )
    return axes.axhline(levels.mean(), **style.curve) if levels.size else None
