"""The report's sections about commanded speeds: what comes out, command by command."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from ...compare import Results
from ...compare.metrics import stride_table
from ...compare.report import SHOWN, answer_commands, command_tables, number, shortened
from .. import figures
from ..figures import LABELS
from .document import Document

_CAPTION = (
    "Speed, peak error of the calf, and feedback's share of the torque, stride by stride; grey "
    "where the command changes."
)

_SIDE_BY_SIDE = 2
"""Commands in a figure."""

_READING = (
    "A robot a command: the gait is chosen anew at each lift-off, between those of the library, by "
    "the {reference} speed. Errors are peaks of the joint angle's error in stance, from the true "
    "contact on, means over legs; of the strides of a command the worst, and the mean. The speed "
    "error is the root mean square of the trunk's mean speed, stride by stride, less the commanded "
    "one. Feedback's share of the torque is that of the stances."
)


def add_commands(document: Document, results: Results) -> None:
    """Add the answer, and a section for each scenario, the first with the figures."""
    summary, experiment = results.summary(), results.experiment
    document.text(answer_commands(summary), "verdict")
    for scenario in experiment.scenario_names:
        document.heading(f'Commanded speeds in scenario "{scenario}"', scenario)
        tables = command_tables(summary, scenario=scenario)
        for command in experiment.commands:
            document.heading(shortened(command), f"{scenario}-{command}", level=3)
            document.table(_texts(tables[command]))
        if scenario == experiment.scenario_names[0]:
            for name, figure in command_figures(results).items():
                document.picture(name, figure, _CAPTION)
    document.heading("How to read the numbers", "statistics")
    document.text(_READING.format(reference=experiment.reference))


def command_figures(results: Results) -> dict[str, Figure]:
    """The figures about the first scenario, by name: up to two commands in each."""
    experiment = results.experiment
    strides = pd.concat(
        [stride_table(results.all_strides(controller=name)) for name in experiment.controller_names]
    )
    commands = experiment.commands
    groups = [commands[k : k + _SIDE_BY_SIDE] for k in range(0, len(commands), _SIDE_BY_SIDE)]
    return {
        "driving" if len(groups) == 1 else f"driving-{k}": figures.driving_figure(
            strides[strides["command"].isin(group)]
        )
        for k, group in enumerate(groups, start=1)
    }


def _texts(table: pd.DataFrame) -> pd.DataFrame:
    """A table of `command_tables` as texts."""
    rows = {}
    for name, row in table.iterrows():
        cells: dict[str, str] = {}
        for joint in SHOWN:
            cells[f"{joint}: worst peak [rad]"] = number(row[f"worst_{joint}"], ".4f")
            cells[f"{joint}: mean peak [rad]"] = number(row[joint], ".4f")
        cells["speed error [m/s]"] = number(row["speed_error"], ".3f")
        cells["feedback's share"] = number(row["feedback_share"], ".0%")
        known = {*SHOWN, *(f"worst_{joint}" for joint in SHOWN), "speed_error", "feedback_share"}
        for metric in [key for key in table if key not in {*known, "upright", "robots"}]:
            cells[metric] = number(row[metric], ".4g")
        cells["upright"] = f"{row['upright']:.0f} of {row['robots']:.0f}"
        rows[LABELS.get(str(name), str(name))] = cells
    return pd.DataFrame.from_dict(rows, orient="index")
