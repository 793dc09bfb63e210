"""Figure of the conditions that robots estimate, stride by stride, beside the true ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...compare import KNOWN, Scenario
from ..figure_style import REFERENCE, TWO_COLUMNS, in_order, legend_below, look, new_figure, styled
from .tracking_figures import upright_strides

_SHOWN = 20
"""Strides of learning that are drawn."""


@styled
def estimated_conditions(strides: Mapping[str, Mapping[str, xr.Dataset]]) -> Figure:
    """Estimated conditions over the strides of learning: mean and range over the robots.

    A column a scenario, a row a condition; dashed: the scenario's own value.

    Args:
        strides: Strides that have `conditions`, of constant speeds, by scenario and controller; of
            robots that fell nothing is drawn.
    """
    every = [those for by_name in strides.values() for those in by_name.values()]
    names = list(dict.fromkeys(name for those in every for name in those["condition"].to_numpy()))
    figure = new_figure(max(TWO_COLUMNS, 2.2 * len(strides)), 0.8 + 1.7 * len(names))
    panels = figure.subplots(len(names), len(strides), sharex=True, sharey="row", squeeze=False)
    for column, (scenario, by_name) in zip(panels.T, strides.items(), strict=True):
        for axes, name in zip(column, names, strict=True):
            for controller in in_order(by_name):
                _curve(axes, by_name[controller], controller, str(name))
        column[0].set_title(scenario)
        column[-1].set_xlabel("strides of learning")
    for axes, name in zip(panels[:, 0], names, strict=True):
        axes.set_ylabel(f"{name} [{KNOWN[str(name)].unit}]")
    legend_below(figure, *panels[0, 0].get_legend_handles_labels())
    return figure


def _curve(axes: Axes, strides: xr.Dataset, controller: str, name: str) -> None:
    """One controller's estimates of a condition, and the true value."""
    true = _true_value(strides, name)
    if true is not None:
        axes.axhline(true, ls="--", color=REFERENCE, lw=1.0)
    strides = upright_strides(strides)
    if name not in strides["condition"] or not strides.sizes["speed"]:
        return
    told = strides["conditions"].sel(condition=name).transpose("speed", "stride").to_numpy()
    first = np.argmax(strides["learning"].transpose("speed", "stride").to_numpy() == 1, axis=1)
    length = min(_SHOWN, int((strides["count"].to_numpy() - first).min()))
    rows = np.take_along_axis(told, first[:, None] + np.arange(length), axis=1)
    style = look(controller)
    axes.plot(np.arange(length), rows.mean(axis=0), **style.curve)
    axes.fill_between(
        np.arange(length), rows.min(axis=0), rows.max(axis=0), color=style.color, alpha=0.2, lw=0
    )


def _true_value(strides: xr.Dataset, name: str) -> float | None:
    """The scenario's own value of a condition, where it is a number."""
    scenario = Scenario.from_json(strides.attrs["scenario_parameters"])
    value = getattr(scenario, next(iter(KNOWN[name].changes(KNOWN[name].value))))
    return value if isinstance(value, float) else None
