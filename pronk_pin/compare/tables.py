"""The tables people read, computed from the summary."""

from __future__ import annotations

import itertools
import textwrap

import numpy as np
import pandas as pd

from ..robot import JOINTS
from .metrics import reduction
from .paper import table_1

SHOWN = ("calf", "thigh")
"""Joints of the paper's Table I."""

_WIDTH = 96
_QUANTITIES = ("PD", "ILC", "reduction")


def beside_the_paper(summary: pd.DataFrame, *, scenario: str) -> pd.DataFrame:
    """Table I: peak stance errors [rad] with PD and with ILC, ours beside the paper's.

    Args:
        summary: The summary of a result that holds `pd` and `ilc`.
        scenario: The world.

    Returns:
        Rows by speed, and one of means; columns by joint, source ("ours", "paper") and quantity
        ("PD", "ILC", "reduction").
    """
    ours = summary[(summary["metric"] == "peak_error") & (summary["scenario"] == scenario)]
    parts = {}
    for joint in SHOWN:
        for source, table in (("ours", ours), ("paper", table_1())):
            rows = table[(table["joint"] == joint) & table["controller"].isin(["pd", "ilc"])]
            wide = rows.pivot_table(index="speed", columns="controller", values="value")
            for controller in ("pd", "ilc"):
                if controller in wide:
                    parts[joint, source, controller.upper()] = wide[controller]
    table = pd.DataFrame(parts)
    measured = [name for name in table.columns if name[1] == "ours"]
    table = table.dropna(subset=measured, how="all")
    table.loc["mean"] = table.mean()
    for joint in SHOWN:
        for source in ("ours", "paper"):
            if (joint, source, "PD") in table and (joint, source, "ILC") in table:
                ratio = table[joint, source, "ILC"] / table[joint, source, "PD"]
                table[joint, source, "reduction"] = 1.0 - ratio
    order = itertools.product(SHOWN, ("ours", "paper"), _QUANTITIES)
    return table[[name for name in order if name in table]].rename_axis("speed")


def overview(summary: pd.DataFrame, *, scenario: str) -> pd.DataFrame:
    """One row a controller: means over the speeds and seeds, in the order of the calf's error.

    Columns: `calf`, `thigh` (mean peak [rad]), `calf_reduction`, `thigh_reduction` (of the mean
    peak against PD's), `calf_rms`, `thigh_rms` [rad], `strides` (to converge, the slowest speed),
    `feedback` (its share of the torque), `speed_error` [m/s], `apex_error` [m] (mean magnitudes),
    `upright` (robots that stayed up) and `robots`.
    """
    mine = summary[summary["scenario"] == scenario]
    rows = {}
    for controller, part in mine.groupby("controller"):
        strides, upright = _values(part, "strides_to_converge"), _values(part, "upright")
        rows[controller] = {
            **{joint: _values(part, "peak_error", joint).mean() for joint in SHOWN},
            **{f"{joint}_rms": _values(part, "rms_error", joint).mean() for joint in SHOWN},
            "strides": strides.max(skipna=False),
            "feedback": _values(part, "feedback_share").mean(),
            "speed_error": _values(part, "speed_error").abs().mean(),
            "apex_error": _values(part, "apex_error").abs().mean(),
            "upright": upright.sum(),
            "robots": len(upright),
        }
    table = pd.DataFrame(rows).T.rename_axis("controller")
    if "pd" in table.index:
        for joint in SHOWN:
            table[f"{joint}_reduction"] = 1.0 - table[joint] / table.loc["pd", joint]
    return table.sort_values("calf", ascending=False)


def _values(rows: pd.DataFrame, metric: str, joint: str = "-") -> pd.Series[float]:
    """All values of one metric and joint."""
    return rows[(rows["metric"] == metric) & (rows["joint"] == joint)]["value"]


def worst_reduction(summary: pd.DataFrame, *, scenario: str, controller: str) -> dict[str, float]:
    """Smallest reduction of the peak error over the speeds, by joint; negative is worse than PD."""
    peaks = reduction(summary, "peak_error")
    mine = peaks[(peaks["scenario"] == scenario) & (peaks["controller"] == controller)]
    return {joint: float(mine[mine["joint"] == joint]["value"].min()) for joint in JOINTS}


def verdict(summary: pd.DataFrame, *, scenario: str) -> str:
    """The answer in words, computed from the numbers; empty without `pd` and `ilc`."""
    table = overview(summary, scenario=scenario)
    if not {"pd", "ilc"} <= set(table.index):
        return ""
    practice = table.loc["ilc"]
    worst = worst_reduction(summary, scenario=scenario, controller="ilc")
    sentences = [
        f"Practice cuts the mean peak error by {practice['calf_reduction']:.0%} in the calf and "
        f"{practice['thigh_reduction']:.0%} in the thigh against PD "
        f"({worst['calf']:.0%} and {worst['thigh']:.0%} at the worst speed)"
        + (
            f", within {practice['strides']:.0f} strides at every speed."
            if np.isfinite(practice["strides"])
            else "; at some speed it has not settled."
        )
    ]
    if "model" in table.index:
        model = table.loc["model"]
        wins = [joint for joint in SHOWN if practice[joint] < model[joint]]
        beats = "beats" if wins else "does not beat"
        where = f" in the {wins[0]} only" if len(wins) == 1 else ""
        numbers = ", ".join(
            f"{practice[joint]:.4f} against {model[joint]:.4f} rad in the {joint}"
            for joint in SHOWN
        )
        sentences.append(f"It {beats} the model's feedforward{where} ({numbers}).")
    fallen = int((table["robots"] - table["upright"]).sum())
    counted = {0: "No robot", 1: "One robot"}.get(fallen, f"{fallen} robots")
    sentences.append(f"{counted} fell.")
    return " ".join(sentences)


def format_tables(summary: pd.DataFrame, *, scenario: str) -> str:
    """Table I beside the paper's, the overview and the verdict, as text for a terminal."""
    parts = [
        _format_beside(beside_the_paper(summary, scenario=scenario)),
        _format_overview(overview(summary, scenario=scenario)),
        textwrap.fill(verdict(summary, scenario=scenario), _WIDTH),
    ]
    return "\n\n".join(part for part in parts if part)


def _format_beside(table: pd.DataFrame) -> str:
    lines = [
        " " * 8 + "".join(f"{f'{joint}: peak stance error [rad]':^44}" for joint in SHOWN),
        f"{'speed':>6}  " + f"{'this run':^22}{'paper, Table I':^22}" * len(SHOWN),
        f"{'[m/s]':>6}" + f"{'PD':>8}{'ILC':>7}{'less':>7}" * 2 * len(SHOWN),
    ]
    for speed, row in table.iterrows():
        cells = ""
        for joint, source in itertools.product(SHOWN, ("ours", "paper")):
            pd_, ilc, less = (row.get((joint, source, name), np.nan) for name in _QUANTITIES)
            cells += f"{_number(pd_, '.3f'):>8}{_number(ilc, '.3f'):>7}{_number(less, '.0%'):>7}"
        lines.append(f"{speed if isinstance(speed, str) else f'{speed:.2g}':>6}{cells}")
    return "\n".join(line.rstrip() for line in lines)


def _format_overview(table: pd.DataFrame) -> str:
    wide = max(10, *(len(str(name)) for name in table.index))
    lines = [
        f"{'':>{wide}}  {'peak [rad]':^15}  {'RMS [rad]':^15}  strides to  feedback's  stayed",
        f"{'controller':>{wide}}  {'calf':>7} {'thigh':>7}  {'calf':>7} {'thigh':>7}  "
        f"{'converge':>10}  {'share':>10}  upright",
    ]
    for name, row in table.iterrows():
        lines.append(
            f"{name:>{wide}}  {row['calf']:7.4f} {row['thigh']:7.4f}  {row['calf_rms']:7.4f} "
            f"{row['thigh_rms']:7.4f}  {_number(row['strides'], '.0f'):>10}  "
            f"{row['feedback']:>10.0%}  {row['upright']:.0f} of {row['robots']:.0f}"
        )
    return "\n".join(lines)


def _number(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "-"
