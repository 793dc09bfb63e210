"""Figure of the knowledge that a model needs: its errors over what it knows, practice as a line."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ...compare.metrics import LEARNER
from ...compare.report import SHOWN, Overview
from ..figure_style import TWO_COLUMNS, legend_below, log_axis, look, new_figure, styled

LADDER = {
    "pd": "nothing",
    "model": "URDF",
    "model+rotors": "URDF,\nrotors",
    "identified+gait": "identified",
}
"""Rivals from the one that knows least to the one that knows most, and what that is."""

PRACTICE = (LEARNER, "ilc+rotors")
"""Practice on the gaits of the URDF, and on those that are planned with the rotors."""


def shows_knowledge(tables: Mapping[str, Overview]) -> bool:
    """Whether there is something to compare: practice, and models that know different things."""
    return any(LEARNER in table and len(set(LADDER) & set(table)) > 2 for table in tables.values())


@styled
def knowledge_ladder(tables: Mapping[str, Overview]) -> Figure:
    """Mean peak error over what the model knows, a panel a scenario; practice as lines.

    Args:
        tables: `compare.report.answer`; scenarios without practice are left out.
    """
    tables = {name: table for name, table in tables.items() if LEARNER in table}
    columns = min(3, len(tables))
    rows = -(-len(tables) // columns)
    figure = new_figure(TWO_COLUMNS, 0.7 + 1.7 * rows)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    handles: dict[str, object] = {}
    for axes, (scenario, table) in zip(panels[: len(tables)], tables.items(), strict=True):
        known = [name for name in LADDER if name in table]
        place = [list(LADDER).index(name) for name in known]
        for joint, style in zip(SHOWN, ({"marker": "o"}, {"marker": "s", "ls": ":"}), strict=True):
            peaks = [table[name].joints[joint].peak.value for name in known]
            (handles[f"model, {joint}"],) = axes.plot(place, peaks, color="black", **style)
            for name in PRACTICE:
                if name in table and np.isfinite(table[name].joints[joint].peak.value):
                    handles[f"{look(name).label}, {joint}"] = axes.axhline(
                        table[name].joints[joint].peak.value,
                        color=look(name).color,
                        ls=style.get("ls", "-"),
                    )
        axes.set_title(scenario)
        log_axis(axes)
        axes.set_xticks(range(len(LADDER)), list(LADDER.values()))
    for axes in panels[len(tables) :]:
        axes.set_visible(False)
    for axes in panels[::columns]:
        axes.set_ylabel("mean peak error [rad]")
    legend_below(figure, handles.values(), handles)
    return figure
