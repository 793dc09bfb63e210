"""Figures of learning over its strides: foreseen and measured, and by what it began with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ...compare.report import SHOWN
from ...compare.studies import Prediction, stayed_up
from ...robot import JOINTS
from ..figure_style import (
    PALETTE,
    TWO_COLUMNS,
    in_order,
    legend_below,
    look,
    new_figure,
    say,
    styled,
)

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
