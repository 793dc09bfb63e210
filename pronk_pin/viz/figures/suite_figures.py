"""Figures over many scenarios: who has which error where, and when practice beats the model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...compare.metrics import RIVAL, PeakHistory
from ...compare.report import SHOWN
from ..figure_style import (
    SEQUENTIAL,
    TWO_COLUMNS,
    in_order,
    legend_below,
    look,
    new_figure,
    say,
    styled,
)

_STRIDES = 40
"""Strides of learning that are shown."""

_COLUMNS = 3


@styled
def heat_map(table: pd.DataFrame) -> Figure:
    """Mean peak error of every controller in every scenario, one panel a joint.

    Args:
        table: `compare.tables.answer`. Where robots fell, their number stands below the error, or
            instead of it.
    """
    scenarios = list(dict.fromkeys(table.index.get_level_values("scenario")))
    controllers = in_order(table.index.get_level_values("controller"))
    figure = new_figure(TWO_COLUMNS, 1.1 + 0.27 * len(scenarios))
    panels = figure.subplots(1, len(SHOWN), sharey=True)
    errors = table[list(SHOWN)].to_numpy(dtype=float)
    errors = errors[np.isfinite(errors)]
    norm = LogNorm(errors.min(), errors.max()) if errors.size else LogNorm(1e-3, 1.0)
    for axes, joint in zip(panels, SHOWN, strict=True):
        values = table[joint].unstack("controller").reindex(index=scenarios, columns=controllers)
        image = axes.imshow(values, cmap=SEQUENTIAL, norm=norm, aspect="auto")
        _write_cells(axes, table, values, norm)
        axes.set_xticks(
            range(len(controllers)), [look(name).label for name in controllers], rotation=25
        )
        for label in axes.get_xticklabels():
            label.set_horizontalalignment("right")
        axes.set_yticks(range(len(scenarios)), scenarios)
        axes.grid(visible=False)
        axes.set_title(joint)
    bar = figure.colorbar(image, ax=panels, shrink=0.9)
    bar.set_label("mean peak stance error [rad]")
    return figure


def _write_cells(axes: Axes, table: pd.DataFrame, values: pd.DataFrame, norm: LogNorm) -> None:
    """The error of each cell in milliradians, and how many fell."""
    for (row, column), value in np.ndenumerate(values.to_numpy(dtype=float)):
        key = (values.index[row], values.columns[column])
        if not np.isfinite(value):
            text = _why_empty(table.loc[key]) if key in table.index else ""
            axes.text(column, row, text, ha="center", va="center", fontsize=6)
            continue
        fallen = int(table.loc[key, "fell"])
        text = f"{1e3 * value:.0f}" + (f"\n{fallen} fell" if fallen else "")
        light = np.dot(colormaps[SEQUENTIAL](float(norm(value)))[:3], (0.3, 0.6, 0.1)) > 0.5
        color = "black" if light else "white"
        axes.text(column, row, text, ha="center", va="center", fontsize=6, color=color)


def _why_empty(row: pd.Series) -> str:
    return "all\nfell" if row["fell"] == row["robots"] else "no\nstride"


@styled
def peak_curves(histories: Mapping[str, list[PeakHistory]], *, joint: str) -> Figure:
    """Peak error over the strides of learning in every scenario, with the model's level as a line.

    Means over the robots that did not fall; the band is from the first to the third quartile.

    Args:
        histories: The simulations of each scenario.
        joint: "calf" or "thigh".
    """
    rows = -(-len(histories) // _COLUMNS)
    columns = min(_COLUMNS, len(histories))
    figure = new_figure(TWO_COLUMNS, 0.5 + 1.45 * rows)
    panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
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
            axes.set_yscale("log")
        else:
            say(axes, "no robot stayed up")
    for axes in panels[-1]:
        axes.set_xlabel("strides of learning")
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
            axes.set_xscale("log")
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
