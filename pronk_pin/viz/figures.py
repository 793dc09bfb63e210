"""Figures of the paper and of the report: results in, matplotlib figures out.

Colours are those of Okabe and Ito, which readers with any colour vision tell apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .._typing import Array
from ..compare.metrics import by_joint, steady
from ..compare.paper import table_1

COLORS = {
    "pd": "#000000",
    "model": "#E69F00",
    "library": "#56B4E9",
    "ilc": "#0072B2",
    "model+ilc": "#009E73",
    "ilc-paper": "#D55E00",
    "paper": "#CC79A7",
}
"""Colour of a controller; "paper" are the paper's own numbers."""

LABELS = {
    "pd": "PD",
    "model": "PD + model",
    "library": "PD + library",
    "ilc": "ILC",
    "model+ilc": "ILC seeded by the model",
    "ilc-paper": "ILC, the paper's law",
}

_JOINTS = ("calf", "thigh")
_LEG = "FL"  # the leg that the paper shows


def tracking(strides: xr.Dataset, *, speed: float, seconds: tuple[float, float]) -> Figure:
    """Fig. 3 of the paper: the stance before and after the learning is switched on.

    Args:
        strides: The strides of a learning controller.
        speed: Which robot [m/s].
        seconds: How much to show before and after the switch [s].
    """
    mine = strides.sel(speed=speed, method="nearest")
    count = int(mine["count"])
    learning = np.flatnonzero(mine["learning"].to_numpy()[:count] == 1)
    switch = int(learning[0]) if learning.size else count
    start = mine["start"].to_numpy()
    figure = _figure(9.0, 5.2)
    grid = figure.add_gridspec(2, 4, width_ratios=[2.1, 2.1, 1.2, 1.2])
    columns: dict[str, Axes] = {}
    for row, joint in enumerate(_JOINTS):
        measured, planned = _joint_curves(mine, f"{_LEG}_{joint}")
        axes = figure.add_subplot(grid[row, :2], sharex=columns.get("time"))
        columns["time"] = axes
        axes.set_title("measured, and the reference dashed", fontsize=8, loc="right")
        inside = (start >= start[switch] - seconds[0]) & (start <= start[switch] + seconds[1])
        for k in np.flatnonzero(inside):
            t = start[k] + mine["phase"].to_numpy() * float(mine["stance"][k])
            axes.plot(t, planned, "--", color="0.45", lw=1.0)
            axes.plot(t, measured[k], color=COLORS["ilc"] if k >= switch else COLORS["pd"], lw=1.2)
        axes.axvline(start[switch], color=COLORS["ilc-paper"], lw=1.0)
        axes.set_ylabel(f"{joint}, {_LEG} [rad]")
        axes.annotate("learning on", (start[switch], 1.01), xycoords=("data", "axes fraction"))
        for column, (name, stride) in enumerate((("PD", switch - 1), ("ILC", count - 1))):
            one = figure.add_subplot(grid[row, 2 + column], sharey=columns.get(joint))
            columns[joint] = one
            one.plot(mine["phase"], planned, "--", color="0.45", lw=1.2)
            color = COLORS["pd" if name == "PD" else "ilc"]
            one.plot(mine["phase"], measured[stride], color=color, lw=1.4)
            peak = float(np.max(np.abs(measured[stride] - planned)))
            one.set_title(f"{name}: peak {peak:.3f} rad", fontsize=8)
            if row == 1:
                one.set_xlabel("stance phase")
    columns["time"].set_xlabel("time [s]; stance only")
    figure.suptitle(f"Tracking before and after the learning is switched on, {speed:g} m/s")
    return figure


def torque_library(strides: xr.Dataset) -> Figure:
    """Fig. 4 of the paper: the learned torque over the stance phase, by speed."""
    torque = steady(strides)["feedforward"].sel(part="stance").mean("stride")
    speeds = strides["speed"].to_numpy()
    figure = _figure(8.0, 3.4)
    axes = figure.subplots(1, 2)
    colors = colormaps["viridis"](np.linspace(0.0, 0.95, len(speeds)))
    for one, joint in zip(axes, _JOINTS, strict=True):
        for k in range(len(speeds)):
            curve = torque.isel(speed=k).sel(joint=f"{_LEG}_{joint}")
            one.plot(strides["phase"], curve, color=colors[k], lw=1.2, label=f"{speeds[k]:g}")
        one.set_title(f"{joint}, {_LEG}", fontsize=9)
        one.set_xlabel("stance phase")
        one.set_ylabel("learned torque [N m]")
    axes[1].legend(title="speed [m/s]", fontsize=6, title_fontsize=7, ncols=2)
    return figure


def errors_by_speed(summary: pd.DataFrame, *, scenario: str) -> Figure:
    """Peak stance error over the speed, for every controller, with the paper's Table I."""
    rows = summary[(summary["metric"] == "peak_error") & (summary["scenario"] == scenario)]
    figure = _figure(8.0, 3.7)
    axes = figure.subplots(1, 2)
    for one, joint in zip(axes, _JOINTS, strict=True):
        printed = table_1()
        for controller, marker in (("pd", "x"), ("ilc", "+")):
            paper = printed[(printed["joint"] == joint) & (printed["controller"] == controller)]
            label = f"paper, {LABELS[controller]}"
            one.plot(paper["speed"], paper["value"], marker, color=COLORS["paper"], label=label)
        for controller in _known(rows["controller"].unique()):
            mine = rows[(rows["joint"] == joint) & (rows["controller"] == controller)]
            mean = mine.groupby("speed")["value"].mean()
            style = {"color": COLORS[controller], "label": LABELS[controller], "lw": 1.3}
            dashes = (4, 2) if controller == "library" else (None, None)
            one.plot(mean.index, mean, marker=".", dashes=dashes, **style)
        one.set_title(joint, fontsize=9)
        one.set_xlabel("speed [m/s]")
        one.set_ylabel("peak stance error [rad]")
        one.set_ylim(bottom=0.0)
    _legend_below(figure, axes[0])
    return figure


def learning_curves(strides: Mapping[str, xr.Dataset]) -> Figure:
    """Peak error over the strides of learning, with the levels of those that do not learn.

    Args:
        strides: The strides by controller.
    """
    figure = _figure(8.0, 3.4)
    axes = figure.subplots(1, 2)
    for one, joint in zip(axes, _JOINTS, strict=True):
        for controller in _known(strides):
            curves = _learning(strides[controller], joint)
            color, label = COLORS[controller], LABELS[controller]
            if curves is None:
                peak = by_joint(steady(strides[controller])["peak_error"]).sel(joint=joint)
                one.axhline(float(peak.mean()), color=color, ls=":", lw=1.3, label=label)
                continue
            k = np.arange(-2, curves.shape[1] - 2)
            one.plot(k, np.mean(curves, axis=0), color=color, lw=1.4, label=label)
            one.fill_between(k, curves.min(0), curves.max(0), color=color, alpha=0.2, lw=0)
        one.set_title(f"{joint}: mean and range over the speeds", fontsize=9)
        one.set_xlabel("strides since the learning was switched on")
        one.set_ylabel("peak stance error [rad]")
        one.set_ylim(bottom=0.0)
    _legend_below(figure, axes[0])
    return figure


def _learning(strides: xr.Dataset, joint: str, length: int = 27) -> Array | None:
    """Peak errors from two strides before the switch on, (speeds, strides); None without one."""
    if not bool((strides["learning"] == 1).any()):
        return None
    peak = by_joint(strides["peak_error"]).sel(joint=joint).to_numpy()
    first = np.argmax(strides["learning"].to_numpy() == 1, axis=1)
    length = min(length, int((strides["count"].to_numpy() - first).min()) + 2)
    index = first[:, None] + np.arange(-2, length - 2)
    return np.asarray(np.take_along_axis(peak, np.maximum(index, 0), axis=1))


def _joint_curves(strides: xr.Dataset, joint: str) -> tuple[Array, Array]:
    """Measured (strides, samples) and reference (samples,) angle of a joint in stance [rad]."""
    stance = strides[["reference", "error"]].sel(part="stance", joint=joint)
    planned = stance["reference"].to_numpy()
    return planned - stance["error"].to_numpy(), planned


def _known(controllers: Iterable[str]) -> list[str]:
    """Controllers in the order of the legend."""
    names = set(controllers)
    return [name for name in LABELS if name in names]


def _legend_below(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7)


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")
