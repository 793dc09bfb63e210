"""Figures of learning over its strides: foreseen and measured, and by what it began with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from ..._typing import Array
from ...compare import steady
from ...compare.metrics import by_joint
from ...compare.report import SHOWN
from ...compare.studies import Prediction, stayed_up
from ...robot import JOINTS
from ..figure_style import (
    PALETTE,
    TWO_COLUMNS,
    in_order,
    legend_below,
    log_axis,
    look,
    new_figure,
    say,
    styled,
)
from .tracking_figures import upright_strides

_COLORS = dict(zip(SHOWN, (PALETTE["blue"], PALETTE["vermilion"]), strict=True))


@styled
def predicted_and_measured(predictions: Sequence[Prediction]) -> Figure:
    """RMS of the stance error over the strides of learning, one panel a speed."""
    figure = new_figure(max(TWO_COLUMNS, 2.4 * len(predictions)), 3.0)
    panels = figure.subplots(1, len(predictions), squeeze=False, sharey=True)[0]
    for axes, prediction in zip(panels, predictions, strict=True):
        strides = np.arange(len(prediction.measured))
        for joint in SHOWN:
            for rms, line, name in (
                (prediction.measured, "-", "measured"),
                (prediction.rehearsed, "--", "rehearsed"),
                (prediction.predicted, ":", "lifted model"),
            ):
                curve = {"ls": line, "color": _COLORS[joint], "label": f"{joint}, {name}"}
                axes.semilogy(strides, rms[:, JOINTS.index(joint)], **curve)
        radius = prediction.analysis.radius
        axes.set_title(f"{prediction.speed:g} m/s, spectral radius {radius:.3f}")
        axes.set_xlabel("strides of learning")
    panels[0].set_ylabel("RMS of the stance error [rad]")
    figure.suptitle(predictions[0].controller)
    legend_below(figure, *panels[0].get_legend_handles_labels())
    return figure


@styled
def errors_by_seed(table: pd.DataFrame) -> Figure:
    """Peak error over the strides of learning by what it began with: median and range of speeds.

    Args:
        table: What `compare.seeding.measure_seeding` returns.
    """
    table = stayed_up(table)
    figure = new_figure(TWO_COLUMNS, 3.0)
    panels = figure.subplots(1, len(SHOWN), sharey=True)
    for axes, joint in zip(panels, SHOWN, strict=True):
        for name in in_order(table["controller"]):
            errors = table[table["controller"] == name].groupby("stride")[joint]
            middle, style = errors.median(), look(name)
            axes.semilogy(middle.index, middle, **style.curve)
            low, high = errors.min(), errors.max()
            axes.fill_between(middle.index, low, high, color=style.color, alpha=0.15, lw=0)
        if table.empty:
            say(axes, "no robot stayed up")
        axes.set_title(joint)
        axes.set_xlabel("strides of learning")
    panels[0].set_ylabel("peak stance error [rad]")
    legend_below(figure, *panels[0].get_legend_handles_labels())
    return figure


@styled
def learning_curves(strides: Mapping[str, xr.Dataset]) -> Figure:
    """Peak error over the strides of learning, with the levels of those that do not learn.

    Args:
        strides: The strides by controller; of robots that fell nothing is drawn.
    """
    strides = {name: upright_strides(those) for name, those in strides.items()}
    strides = {name: those for name, those in strides.items() if those.sizes["speed"]}
    figure = new_figure(TWO_COLUMNS, 2.7)
    panels = figure.subplots(1, 2)
    for axes, joint in zip(panels, SHOWN, strict=True):
        for controller in in_order(strides):
            curves, style = _learning(strides[controller], joint), look(controller)
            if curves is None:
                peak = by_joint(steady(strides[controller])["peak_error"]).sel(joint=joint)
                level = float(peak.mean())
                axes.axhline(level, color=style.color, ls=":", label=style.label)
                axes.plot([-2], [level], style.marker, color=style.color)
                continue
            k = np.arange(-2, curves.shape[1] - 2)
            axes.plot(k, np.mean(curves, axis=0), **style.curve)
            axes.fill_between(k, curves.min(0), curves.max(0), color=style.color, alpha=0.2, lw=0)
        if not strides:
            say(axes, "no robot stayed up")
        axes.set_title(f"{joint}: mean and range over the speeds")
        axes.set_xlabel("strides since the learning was switched on")
        axes.set_ylabel("peak stance error [rad]")
        log_axis(axes)
    legend_below(figure, *panels[0].get_legend_handles_labels())
    return figure


def _learning(strides: xr.Dataset, joint: str, length: int = 27) -> Array | None:
    """Peak errors from two strides before the switch on, (speeds, strides); None without one."""
    strides = strides.isel(speed=np.flatnonzero((strides["learning"] == 1).any("stride")))
    if not strides.sizes["speed"]:
        return None
    peak = by_joint(strides["peak_error"]).sel(joint=joint).to_numpy()
    first = np.argmax(strides["learning"].to_numpy() == 1, axis=1)
    length = min(length, int((strides["count"].to_numpy() - first).min()) + 2)
    index = first[:, None] + np.arange(-2, length - 2)
    return np.asarray(np.take_along_axis(peak, np.maximum(index, 0), axis=1))
