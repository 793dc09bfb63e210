"""Figures of tracking, and of the learned torque: over time, phase and speed, as in the paper."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._typing import Array, IntArray
from ...compare import steady
from ...compare.metrics import of_first_leg, of_papers_robot, robots, table_1
from ...compare.report import SHOWN
from ...errors import InvalidInput
from ..figure_style import (
    ACCENT,
    DIVERGING,
    LOOKS,
    REFERENCE,
    SEQUENTIAL,
    TWO_COLUMNS,
    in_order,
    legend_below,
    log_axis,
    look,
    new_figure,
    styled,
)

LABELS = {name: entry.label for name, entry in LOOKS.items()}
"""Controllers in words."""


def stance(strides: xr.Dataset, name: str) -> xr.DataArray:
    """A curve of the stance: (speed, stride, phase, joint), or without what it does not have."""
    return strides[name].sel(part="stance")


def upright_strides(strides: xr.Dataset) -> xr.Dataset:
    """The strides of the robots that never fell, and finished some."""
    upright = strides["upright"].transpose("speed", "stride").to_numpy()
    finished = strides["count"].to_numpy() > 0
    return strides.isel(speed=np.flatnonzero(finished & ~(upright == 0).any(axis=1)))


@styled
def tracking(strides: xr.Dataset, *, speed: float, seconds: tuple[float, float]) -> Figure:
    """Fig. 3 of the paper: the stance before and after the learning is switched on.

    Args:
        strides: The strides of a learning controller.
        speed: Which robot [m/s].
        seconds: How much to show before and after the switch [s].
    """
    of_speed = strides.sel(speed=speed, method="nearest")
    count = int(of_speed["count"])
    learning = np.flatnonzero(of_speed["learning"].to_numpy()[:count] == 1)
    switch = int(learning[0]) if learning.size else count
    start = of_speed["start"].to_numpy()
    began = start[min(switch, count - 1)]
    shown = np.flatnonzero((start >= began - seconds[0]) & (start <= began + seconds[1]))
    figure = new_figure(TWO_COLUMNS, 3.6)
    grid = figure.add_gridspec(2, 4, width_ratios=[2.1, 2.1, 1.2, 1.2])
    time: Axes | None = None
    for row, joint in enumerate(SHOWN):
        time = figure.add_subplot(grid[row, :2], sharex=time)
        name = of_first_leg(strides, joint)
        _over_time(time, of_speed, name, shown, switch)
        if learning.size:
            time.axvline(began, color=ACCENT, lw=1.0)
            time.annotate("learning on", (began, 1.02), xycoords=("data", "axes fraction"))
        time.set_ylabel(f"{name} [rad]")
        first: Axes | None = None
        for column, (controller, stride) in enumerate((("pd", switch - 1), ("ilc", count - 1))):
            if stride < 0:
                continue  # nothing before the learning
            first = figure.add_subplot(grid[row, 2 + column], sharey=first)
            _one_stance(first, of_speed, name, stride, controller)
            if row == 1:
                first.set_xlabel("stance phase")
    if time is not None:
        time.set_xlabel("time [s]; stance only; dashed: reference")
    figure.suptitle(f"Tracking before and after the learning is switched on, {speed:g} m/s")
    return figure


def _over_time(axes: Axes, strides: xr.Dataset, joint: str, shown: IntArray, switch: int) -> None:
    """Measured and planned angle of a joint in the stances of some strides."""
    measured, planned = _joint_curves(strides, joint)
    since = strides["phase"].to_numpy() * float(strides["planned_duration"].sel(part="stance"))
    for k in shown:
        t = strides["start"].to_numpy()[k] + since
        axes.plot(t, planned, "--", color=REFERENCE, lw=0.8)
        axes.plot(t, measured[k], color=look("ilc" if k >= switch else "pd").color)


def _one_stance(axes: Axes, strides: xr.Dataset, joint: str, stride: int, name: str) -> None:
    """Measured and planned angle of a joint in the stance of one stride."""
    measured, planned = _joint_curves(strides, joint)
    axes.plot(strides["phase"], planned, "--", color=REFERENCE)
    axes.plot(strides["phase"], measured[stride], color=look(name).color)
    peak = float(np.max(np.abs(measured[stride] - planned)))
    axes.set_title(f"{LABELS[name]}: {peak:.3f} rad")


@styled
def torque_library(strides: xr.Dataset) -> Figure:
    """Fig. 4 of the paper: the learned torque over the stance phase, by speed."""
    return _by_speed(_learned(strides), strides["phase"].to_numpy(), "learned torque [N m]")


@styled
def torque_surface(strides: xr.Dataset) -> Figure:
    """The learned torque as a surface over speed and stance phase, by its contours.

    Raises:
        InvalidInput: There is one speed only, which is a curve and no surface.
    """
    if strides.sizes["speed"] < 2:
        raise InvalidInput("one speed is no surface; draw `torque_library`")
    torque = _learned(strides)
    figure = new_figure(TWO_COLUMNS, 2.6)
    for axes, joint in zip(figure.subplots(1, 2), SHOWN, strict=True):
        name = of_first_leg(torque, joint)
        surface = torque.sel(joint=name).transpose("speed", "phase")
        x, y, z = (a.to_numpy() for a in (strides["phase"], strides["speed"], surface))
        signed = bool(z.min() < 0.0 < z.max())
        largest = float(np.abs(z).max())
        limits = {"vmin": -largest, "vmax": largest} if signed else {}
        cmap = DIVERGING if signed else SEQUENTIAL
        filled = axes.pcolormesh(x, y, z, cmap=cmap, shading="gouraud", rasterized=True, **limits)
        if np.ptp(z) > 0.0:
            color = "0.15" if signed else "white"
            lines = axes.contour(x, y, z, levels=8, colors=color, linewidths=0.5)
            axes.clabel(lines, fontsize=6)
        axes.grid(visible=False)
        axes.set_title(name)
        axes.set_xlabel("stance phase")
        axes.set_ylabel("speed [m/s]")
        figure.colorbar(filled, ax=axes, label="learned torque [N m]")
    return figure


@styled
def learned_minus_model(learned: xr.Dataset, model: xr.Dataset) -> Figure:
    """Learned minus the model's feedforward torque, by speed.

    Args:
        learned: The strides of a learning controller.
        model: Those of the model's feedforward, at the same speeds.
    """
    difference = _learned(learned) - _learned(model)
    return _by_speed(difference, learned["phase"].to_numpy(), "learned minus model torque [N m]")


def _learned(strides: xr.Dataset) -> xr.DataArray:
    """The steady strides' mean feedforward in stance [N m]: (speed, phase, joint)."""
    return stance(steady(strides), "feedforward").mean("stride")


def _by_speed(torque: xr.DataArray, phase: Array, label: str) -> Figure:
    """Curves over the stance phase, coloured by speed."""
    speeds = torque["speed"].to_numpy()
    figure = new_figure(TWO_COLUMNS, 2.6)
    panels = figure.subplots(1, 2)
    colors = colormaps[SEQUENTIAL](np.linspace(0.0, 0.92, len(speeds)))
    for axes, joint in zip(panels, SHOWN, strict=True):
        for k in range(len(speeds)):
            curve = torque.isel(speed=k).sel(joint=of_first_leg(torque, joint))
            axes.plot(phase, curve, color=colors[k], label=f"{speeds[k]:g}")
        axes.axhline(0.0, color="0.6", lw=0.6)
        axes.set_title(of_first_leg(torque, joint))
        axes.set_xlabel("stance phase")
        axes.set_ylabel(label)
    handles, labels = panels[0].get_legend_handles_labels()
    columns = 1 if len(labels) <= 8 else 2
    title = "speed [m/s]"
    figure.legend(handles, labels, title=title, loc="outside right center", ncols=columns)
    return figure


@styled
def errors_by_speed(summary: pd.DataFrame, *, scenario: str) -> Figure:
    """Peak stance error over the speed, for every controller, beside the Table I of the paper.

    Means over the robots that stayed up. The table is there if this is its robot.
    """
    shown = in_order(summary[summary["scenario"] == scenario]["controller"].unique())
    figure = new_figure(TWO_COLUMNS, 2.9)
    panels = figure.subplots(1, 2)
    for axes, joint in zip(panels, SHOWN, strict=True):
        printed = table_1()
        beside = (("pd", "x"), ("ilc", "+")) if of_papers_robot(summary) else ()
        for controller, marker in beside:
            paper = printed[(printed["joint"] == joint) & (printed["controller"] == controller)]
            label = f"paper, {LABELS[controller]}"
            axes.plot(
                paper["speed"], paper["value"], marker, color=look("paper").color, label=label
            )
        for controller in shown:
            peaks = robots(summary, scenario=scenario, controller=controller, joint=joint)
            mean, style = peaks.mean().dropna(), look(controller)
            if len(mean):
                # Hollow: of two that lie on each other both are seen.
                axes.plot(mean.index, mean, marker=style.marker, mfc="none", **style.curve)
        axes.set_title(joint)
        axes.set_xlabel("speed [m/s]")
        axes.set_ylabel("peak stance error [rad]")
        log_axis(axes)
    legend_below(figure, *panels[0].get_legend_handles_labels())
    return figure


def _joint_curves(strides: xr.Dataset, joint: str) -> tuple[Array, Array]:
    """Measured (strides, samples) and reference (samples,) angle of a joint in stance [rad]."""
    planned = stance(strides, "reference").sel(joint=joint).to_numpy()
    return planned - stance(strides, "error").sel(joint=joint).to_numpy(), planned
