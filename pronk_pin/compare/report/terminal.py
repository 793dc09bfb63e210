"""Tables and verdict as text for a terminal."""

from __future__ import annotations

import itertools
import textwrap

import numpy as np
import pandas as pd

from ..metrics import by_command, in_family, of_papers_robot
from .cells import against_model, beat_text, between, number, units_of_intervals
from .commands import format_commands
from .overview import MOVING, Overview, answer
from .tables import SHOWN, beside_the_paper, paper_learner
from .verdict import answer_in_words, families

_WIDTH = 100


def format_summary(summary: pd.DataFrame) -> str:
    """Tables and verdict as text for a terminal: `format_tables` of one scenario, `format_suite` of
    many, `format_commands` where speeds were commanded."""
    if by_command(summary):
        return format_commands(summary)
    worlds = families(list(summary["scenario"].unique()))
    return format_suite(summary) if len(worlds) > 1 else format_tables(summary, scenario=worlds[0])


def format_tables(summary: pd.DataFrame, *, scenario: str) -> str:
    """Table I beside the paper's, of its robot; the overview and the verdict, as text for a
    terminal."""
    tables = answer(in_family(summary, scenario))
    single = bool((summary["scenario"] == scenario).any())
    mine = tables[scenario]
    parts = [
        _format_beside(beside_the_paper(summary, scenario=scenario), paper_learner(mine))
        if single
        else "",
        beside_note(mine) if single and of_papers_robot(summary) else "",
        format_overview(mine),
        textwrap.fill(answer_in_words(in_family(summary, scenario), tables=tables), _WIDTH),
    ]
    return "\n\n".join(part for part in parts if part)


def beside_note(table: Overview) -> str:
    """Who is missing beside the paper's Table I, from an `overview`; empty if nobody is."""
    mine = [table[name] for name in ("pd", paper_learner(table)) if name in table]
    robots, missing = sum(row.robots for row in mine), sum(row.robots - row.upright for row in mine)
    if not missing:
        return ""
    if missing == robots:
        return "Nothing stands beside the paper's Table I: no robot stayed up."
    return (
        f"Beside the paper's Table I are the robots that stayed up: {missing} of {robots} did not."
    )


def format_suite(summary: pd.DataFrame) -> str:
    """The overviews of all scenarios and the verdict over them, as text for a terminal."""
    tables = answer(summary)
    parts = [f"{scenario}\n{format_overview(table)}" for scenario, table in tables.items()]
    return "\n\n".join([*parts, textwrap.fill(answer_in_words(summary, tables=tables), _WIDTH)])


def _format_beside(table: pd.DataFrame, learner: str) -> str:
    if table.empty:
        return ""
    lines = [
        " " * 8 + "".join(f"{f'{joint}: peak stance error [rad]':^44}" for joint in SHOWN),
        f"{'speed':>6}  " + f"{f'this run, {learner}':^22}{'paper, Table I':^22}" * len(SHOWN),
        f"{'[m/s]':>6}" + f"{'PD':>8}{'ILC':>7}{'less':>7}" * 2 * len(SHOWN),
    ]
    for speed, row in table.iterrows():
        cells = ""
        for joint, source in itertools.product(SHOWN, ("ours", "paper")):
            pd_, ilc, less = (
                row.get((joint, source, name), np.nan) for name in ("PD", "ILC", "reduction")
            )
            cells += f"{number(pd_, '.3f'):>8}{number(ilc, '.3f'):>7}{number(less, '.0%'):>7}"
        lines.append(f"{speed if isinstance(speed, str) else f'{speed:.2g}':>6}{cells}")
    return "\n".join(line.rstrip() for line in lines)


def format_overview(table: Overview) -> str:
    """An `overview` as text: peaks with their intervals, and against the model."""
    wide = max(10, *map(len, table))
    lines = [
        f"{'':>{wide}}  {'calf: peak error [rad]':^27} {'thigh: peak error [rad]':^27}"
        "  beats model  strides to  feedb.  cost of  stayed",
        f"{'controller':>{wide}}  "
        + f"{'mean':>6} {'95 % interval':>13} {'felt':>6} " * 2
        + f" {'calf/thigh':>11}  {'beat it':>10}  {'share':>6}  {'transp.':>7}  upright",
    ]
    for name, row in table.items():
        cells = " ".join(
            f"{number(own.peak.value, '.4f'):>6} {between(own.peak, '.4f', '-'):>13} "
            f"{number(own.felt, '.4f'):>6}"
            for own in (row.joints[joint] for joint in SHOWN)
        )
        lines.append(
            f"{name:>{wide}}  {cells}  {against_model(row):>11}  {beat_text(row):>10}  "
            f"{number(row.feedback, '.0%'):>6}  {number(row.cost, '.2f'):>7}  "
            f"{row.upright} of {row.robots}"
            + (f", {row.diverging} diverging" if row.diverging else "")
        )
    own = {metric: unit for row in table.values() for metric, (_, unit) in row.own.items()}
    for metric, unit in own.items():
        means = [
            f"{name} {number(row.own[metric][0], '.4g')}"
            for name, row in table.items()
            if metric in row.own
        ]
        lines.append(f"{'':>{wide}}  {metric} [{unit}]: {', '.join(means)}")
    if units := units_of_intervals(table):
        lines.append(f"{'':>{wide}}  intervals over the {units}")
    lines.append(
        f"{'':>{wide}}  peaks from the true contact on; felt: from when the controller felt it; "
        f"cost from {MOVING:g} m/s on"
    )
    return "\n".join(lines)
