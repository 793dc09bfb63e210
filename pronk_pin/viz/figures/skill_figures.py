"""Figures of what learned feedforward is good for: smaller gains, and other tasks."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ...compare.report import SHOWN
from ...compare.studies import TOLERANCE
from ..figure_style import ACCENT, PALETTE, TWO_COLUMNS, legend_below, look, new_figure, styled

_WAYS = ((False, "pd", "these gains alone"), (True, "ilc", "with what was learned"))
_TICKS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)


@styled
def gains_figure(table: pd.DataFrame) -> Figure:
    """Peak error over the feedback gains, with and without what was learned.

    Args:
        table: What `compare.gains.sweep_gains` returns.
    """
    figure = new_figure(TWO_COLUMNS, 2.7)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, joint in zip(panels, SHOWN, strict=True):
        for learned, name, label in _WAYS:
            rows = table[table["learned"] == learned].sort_values("share")
            style, share = look(name), 100.0 * rows["share"]
            curve = {**style.curve, "label": label}
            axes.semilogy(share, rows[joint], marker=style.marker, **curve)
            fell = rows["upright"] < rows["robots"]
            if fell.any():
                ring = {"ms": 9, "mfc": "none", "mec": ACCENT, "label": "some fell"}
                axes.plot(share[fell], rows[joint][fell], "o", **ring)
        full = table[~table["learned"]].nlargest(1, "share")[joint].iloc[0]
        axes.axhline(full, color=look("pd").color, ls=":", label="full gains alone")
        axes.set_title(joint)
        axes.set_xlabel("feedback gains, over the controller's own [%]")
        axes.set_ylabel("peak stance error [rad]")
    handles = [panel.get_legend_handles_labels() for panel in panels]
    entries = {label: handle for each in handles for handle, label in zip(*each, strict=True)}
    legend_below(figure, entries.values(), entries)
    return figure


@styled
def transfers_figure(table: pd.DataFrame) -> Figure:
    """Peak error of the stored feedforward in each task beside learning there, and the rule's
    answer.

    Args:
        table: What `compare.transfer.measure_transfers` returns.
    """
    figure = new_figure(TWO_COLUMNS, 1.3 + 0.24 * len(table))
    panels = figure.subplots(1, 2, sharey=True)
    place = np.arange(len(table))
    for axes, joint in zip(panels, SHOWN, strict=True):
        relearned = table[f"{joint}_relearned"].to_numpy()
        for row, (stored, relearned_peak) in enumerate(zip(table[joint], relearned, strict=True)):
            axes.plot([relearned_peak, stored], [row, row], color="0.75", lw=1.5, zorder=1)
        axes.plot(relearned, place, **_points("ilc", "learned there"))
        for reuse, label in (
            (True, "stored feedforward: reuse"),
            (False, "stored feedforward: learn again"),
        ):
            chosen = (table["reuse"] == reuse).to_numpy()
            color = PALETTE["green"] if reuse else ACCENT
            style = {**_points("library", label), "color": color, "marker": "D" if reuse else "s"}
            axes.plot(table[joint][chosen], place[chosen], **style)
        limit = (1.0 + TOLERANCE) * relearned
        axes.plot(limit, place, "|", color="k", ms=8, label=f"{TOLERANCE:.0%} above learning")
        axes.set_xscale("log")
        low, high = axes.get_xlim()
        shown = [tick for tick in _TICKS if low <= tick <= high]
        axes.set_xticks(shown, [f"{tick:g}" for tick in shown])
        axes.minorticks_off()
        axes.set_title(joint)
        axes.set_xlabel("peak stance error [rad]")
    names = [
        task if right else f"{task} (rule wrong)"
        for task, right in zip(table["task"], table["right"], strict=True)
    ]
    panels[0].set_yticks(place, names)
    panels[0].invert_yaxis()
    legend_below(figure, *panels[0].get_legend_handles_labels())
    return figure


def _points(controller: str, label: str) -> dict[str, object]:
    """Markers without a line, in the look of a controller."""
    style = look(controller)
    return {"color": style.color, "marker": style.marker, "ls": "", "ms": 5, "label": label}
