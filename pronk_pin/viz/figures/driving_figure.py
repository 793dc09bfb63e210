"""Figure of a drive by commanded speeds: speed, errors and feedback, controller by controller."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...compare.report import shortened
from ...control import SpeedProfile
from ..figure_style import ACCENT, REFERENCE, TWO_COLUMNS, legend_below, look, new_figure, styled

_MOST = 4
"""Commands that are drawn side by side."""

_AWAY = 0.02
"""Difference [m/s] between gait and command from which on gaits are drawn by controller."""


@styled
def driving_figure(table: pd.DataFrame) -> Figure:
    """Speeds, peak errors of the calf and feedback's share, by stride; a column a command.

    Speeds: commanded, of the gait, and measured. Grey: where the command changes.

    Args:
        table: Strides, as `compare.metrics.stride_table` returns them.
    """
    commands = list(dict.fromkeys(table["command"]))[:_MOST]
    figure = new_figure(max(TWO_COLUMNS, 2.6 * len(commands)), 5.4)
    panels = figure.subplots(3, len(commands), sharex="col", sharey="row", squeeze=False)
    for column, command in zip(panels.T, commands, strict=True):
        rows, profile = table[table["command"] == command], SpeedProfile.parse(command)
        speed, error, share = column
        speed.plot(profile.times, profile.speeds, "--", color=REFERENCE, lw=1.2, label="commanded")
        for controller, strides in rows.groupby("controller", sort=False):
            curve = look(str(controller)).curve
            speed.plot(strides["time"], strides["speed"], lw=1.0, **curve)
            error.plot(strides["time"], 1e3 * strides["calf"], lw=1.0, **curve)
            share.plot(strides["time"], 100.0 * strides["feedback_share"], lw=1.0, **curve)
            if (strides["gait_speed"] - strides["commanded"]).abs().median() > _AWAY:
                own = {**curve, "ls": ":", "label": f"{curve['label']}: gait"}
                speed.step(strides["time"], strides["gait_speed"], where="post", lw=0.8, **own)
        _gait(speed, rows)
        for axes in column:
            for begin, end in transitions(profile):
                axes.axvspan(
                    begin, max(end, begin + 0.01 * profile.duration), color="0.92", lw=0, zorder=0
                )
        speed.set_title("\n".join(_lines(shortened(command, 100))), fontsize=7)
        share.set_xlabel("time [s]")
        error.set_ylim(bottom=0.0)
        share.set_ylim(0.0, 105.0)
    panels[0, 0].set_ylabel("speed [m/s]")
    panels[1, 0].set_ylabel("peak calf error [mrad]")
    panels[2, 0].set_ylabel("feedback's share [%]")
    legend_below(figure, *panels[0, 0].get_legend_handles_labels())
    return figure


def _gait(axes: Axes, rows: pd.DataFrame) -> None:
    """The speed of the gaits, where all controllers have that of the command."""
    if (rows["gait_speed"] - rows["commanded"]).abs().median() <= _AWAY:
        first = rows[rows["controller"] == rows["controller"].iloc[0]]
        time, speed = first["time"], first["gait_speed"]
        axes.step(time, speed, ":", where="post", color=ACCENT, lw=0.8, label="gait")


def transitions(profile: SpeedProfile) -> Iterator[tuple[float, float]]:
    """When a commanded speed begins and ends to change [s]; a step does both at once."""
    changing = [
        (begin, end)
        for (begin, before), (end, after) in pairwise(
            zip(profile.times, profile.speeds, strict=True)
        )
        if before != after
    ]
    ends = [*np.flatnonzero([a[1] != b[0] for a, b in pairwise(changing)]), len(changing) - 1]
    begins = [0, *(end + 1 for end in ends[:-1])]
    if changing:
        yield from ((changing[a][0], changing[b][1]) for a, b in zip(begins, ends, strict=True))


def _lines(text: str, most: int = 40) -> list[str]:
    """A command in lines that end after a piece."""
    lines = [""]
    for piece in text.split(", "):
        if lines[-1] and len(lines[-1]) + len(piece) > most:
            lines.append("")
        lines[-1] += f", {piece}" if lines[-1] else piece
    return lines
