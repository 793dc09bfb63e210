"""Figure of a drive by commanded speeds: speed and errors over time, controller by controller."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from ..figure_style import REFERENCE, TWO_COLUMNS, legend_below, look, new_figure, styled


@styled
def driving_figure(table: pd.DataFrame) -> Figure:
    """Commanded and actual speed, and peak errors of the calf, by stride; a column a command.

    Args:
        table: What `compare.studies.measure_driving` returns.
    """
    commands = list(dict.fromkeys(table["command"]))
    figure = new_figure(max(TWO_COLUMNS, 2.6 * len(commands)), 4.2)
    panels = figure.subplots(2, len(commands), sharex="col", sharey="row", squeeze=False)
    for (above, below), command in zip(panels.T, commands, strict=True):
        rows = table[table["command"] == command]
        first = rows[rows["controller"] == rows["controller"].iloc[0]]
        above.plot(
            first["time"], first["commanded"], "--", color=REFERENCE, lw=1.2, label="commanded"
        )
        for controller, strides in rows.groupby("controller", sort=False):
            style = look(str(controller))
            above.plot(strides["time"], strides["speed"], lw=1.0, **style.curve)
            below.plot(strides["time"], 1e3 * strides["calf"], lw=1.0, **style.curve)
        above.set_title(command, fontsize=7)
        below.set_xlabel("time [s]")
        below.set_ylim(bottom=0.0)
    panels[0, 0].set_ylabel("speed [m/s]")
    panels[1, 0].set_ylabel("peak calf error [mrad]")
    legend_below(figure, *panels[0, 0].get_legend_handles_labels())
    return figure
