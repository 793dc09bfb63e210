"""Tables of commanded speeds, computed from the summary: a table a command, a row a controller."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

import pandas as pd

from ...control import CONTROLLERS
from .cells import number
from .tables import SHOWN


def command_tables(summary: pd.DataFrame, *, scenario: str) -> dict[str, pd.DataFrame]:
    """Errors by command, and in it by controller, of a scenario.

    Args:
        summary: The summary of a result of commanded speeds.
        scenario: The scenario.

    Returns:
        By command a table with a row each controller: `worst_calf`, `calf` (mean) and the like of
        the thigh [rad], `speed_error` [m/s], `feedback_share`, and metrics of one's own, means over
        the seeds but for the worst ones; how many robots stayed `upright`, of how many `robots`.
    """
    here = summary[summary["scenario"] == scenario]
    found = {}
    for command, rows in here.groupby("command", sort=False):
        names = rows["controller"].unique()
        order = [name for name in CONTROLLERS if name in names]
        order += [name for name in names if name not in CONTROLLERS]
        found[str(command)] = pd.DataFrame.from_dict(
            {name: _row(rows[rows["controller"] == name]) for name in order}, orient="index"
        )
    return found


def _row(rows: pd.DataFrame) -> Mapping[str, Any]:
    """A controller under a command, over the seeds."""
    cells: dict[str, Any] = {}
    for joint in SHOWN:
        of_joint = rows[rows["joint"] == joint].groupby("metric")["value"]
        cells[f"worst_{joint}"] = of_joint.max()["worst_peak_error"]
        cells[joint] = of_joint.mean()["peak_error"]
    of_robot = rows[rows["joint"] == "-"].groupby("metric")["value"]
    cells |= of_robot.mean().to_dict()
    upright = of_robot.get_group("upright")
    return {**cells, "upright": int((upright == 1.0).sum()), "robots": len(upright)}


def answer_commands(summary: pd.DataFrame) -> str:
    """What comes out of commanded speeds, in sentences: the worst errors, and who fell."""
    sentences = []
    for scenario in summary["scenario"].unique():
        here = summary[summary["scenario"] == scenario]
        calf = here[(here["metric"] == "worst_peak_error") & (here["joint"] == "calf")]
        worst = calf.groupby("controller")["value"].max()
        order = [name for name in CONTROLLERS if name in worst]
        order += [name for name in worst.index if name not in CONTROLLERS]
        said = ", ".join(f"{name} {number(1e3 * worst[name], '.0f')}" for name in order)
        upright = here[here["metric"] == "upright"]["value"]
        fell = int((upright != 1.0).sum())
        sentences.append(
            f"Driven by {_counted(here['command'].nunique())} in scenario {scenario}, the worst "
            f"peak of the calf's error is, in milliradians: {said}. "
            + (f"{fell} of {len(upright)} robots fell." if fell else "Nothing fell.")
        )
    return " ".join(sentences)


def _counted(commands: int) -> str:
    return "one command" if commands == 1 else f"{commands} commands"


def format_commands(summary: pd.DataFrame) -> str:
    """The tables of all scenarios as text for a terminal."""
    scenarios = list(summary["scenario"].unique())
    lines = [
        "peaks of stance errors from the true contact on, worst and mean of all strides [mrad];",
        "speed: root mean square of what the trunk's mean speed lacks of the command [m/s]",
    ]
    for scenario in scenarios:
        for command, table in command_tables(summary, scenario=scenario).items():
            where = f"scenario {scenario}: " if len(scenarios) > 1 else ""
            lines += ["", f"{where}{shortened(command)}", *_format(table)]
    lines += ["", textwrap.fill(answer_commands(summary), 100)]
    return "\n".join(lines)


def _format(table: pd.DataFrame) -> list[str]:
    wide = max(12, *(len(str(name)) for name in table.index)) + 2
    known = {*(f"worst_{joint}" for joint in SHOWN), *SHOWN, "speed_error", "feedback_share"}
    own = [name for name in table if name not in {*known, "upright", "robots"}]
    heading = "".join(f"{joint:>14}" for joint in SHOWN) + f"{'speed':>8}{'feedback':>10}"
    lines = [f"{'controller':<{wide}}{heading}" + "".join(f"  {name}" for name in own)]
    for name, row in table.iterrows():
        peaks = "".join(f"{_worst_and_mean(row, joint):>14}" for joint in SHOWN)
        cells = f"{number(row['speed_error'], '.3f'):>8}{number(row['feedback_share'], '.0%'):>10}"
        extra = "".join(f"  {number(row[name], '.4g'):>{len(name)}}" for name in own)
        fell = int(row["robots"] - row["upright"])
        note = "" if not fell else "  fell" if row["robots"] == 1 else f"  {fell} fell"
        lines.append(f"{name:<{wide}}{peaks}{cells}{extra}{note}")
    return lines


def _worst_and_mean(row: pd.Series[Any], joint: str) -> str:
    worst, mean = (number(1e3 * row[name], ".1f") for name in (f"worst_{joint}", joint))
    return f"{worst}, {mean}"


def shortened(command: str, most: int = 90) -> str:
    """A command as it is written, its middle left out where it is long."""
    half = (most - 5) // 2
    return command if len(command) <= most else f"{command[:half]} ... {command[-half:]}"
