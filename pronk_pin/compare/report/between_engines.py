"""The same scenarios in several engines: errors side by side, and whether the same ones win."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pandas as pd

from ..experiment import Experiment
from ..metrics import compare_controllers, robots
from ..results import Results
from ..world import Scenario
from .cells import number
from .tables import SHOWN

QUESTIONS = (
    *(("ilc", "pd"), ("model", "pd"), ("ilc", "model"), ("library", "model")),
    *(("ilc", "model+rotors"), ("ilc+rotors", "model+rotors")),
)
"""Who is compared with whom."""


def same_but_for_the_engine(experiment: Experiment) -> dict[str, dict[str, str]]:
    """Scenarios that stand in an experiment in two engines or more.

    Returns:
        By scenario, under its name without the engine: the full name of each, by engine.
    """
    groups: dict[Scenario, dict[str, str]] = {}
    for name in experiment.scenario_names:
        scenario = experiment.scenario(name)
        bare = replace(scenario, name="same", engine="", engine_sha256="")
        # One of a user's own is called as it joined the scenario's name.
        own = ":" in scenario.engine
        engine = name.rpartition("+")[2] if own else scenario.engine
        groups.setdefault(bare, {})[engine] = name
    return {min(found.values(), key=len): found for found in groups.values() if len(found) > 1}


def errors_between_engines(results: Results) -> pd.DataFrame:
    """Mean peaks of each controller, engine by engine.

    Returns:
        A row for each scenario and controller, index (`scenario`, `controller`); columns (engine,
        joint), means over the robots that stayed up [rad], and (engine, "fell"), how many fell.
    """
    summary, rows = results.summary(), {}
    for scenario, engines in same_but_for_the_engine(results.experiment).items():
        for controller in results.experiment.controller_names:
            row: dict[tuple[str, str], float] = {}
            for engine, name in engines.items():
                for joint in SHOWN:
                    peaks = robots(summary, scenario=name, controller=controller, joint=joint)
                    values = peaks.to_numpy(dtype=float)
                    row[engine, joint] = (
                        float(np.nanmean(values)) if np.isfinite(values).any() else np.nan
                    )
                up = robots(
                    summary, scenario=name, controller=controller, metric="upright", joint="-"
                )
                row[engine, "fell"] = int((up == 0.0).to_numpy().sum())
            rows[scenario, controller] = row
    table = pd.DataFrame.from_dict(rows, orient="index")
    if table.empty:
        return table
    table.index = pd.MultiIndex.from_tuples(table.index, names=["scenario", "controller"])
    table.columns = pd.MultiIndex.from_tuples(table.columns, names=["engine", "quantity"])
    return table


def winners_between_engines(results: Results) -> pd.DataFrame:
    """Who has the smaller mean peak in each engine, question by question.

    Returns:
        A row for each question of `QUESTIONS`, scenario and joint, index (`controller`, `against`,
        `scenario`, `joint`); columns (engine, quantity): `change` of the mean peak over that of the
        other, negative where it is smaller, `ahead`, in how many robots it is, of how many `pairs`.
    """
    summary, rows = results.summary(), {}
    there = results.experiment.controller_names
    groups = same_but_for_the_engine(results.experiment)
    for (controller, against), scenario in itertools.product(QUESTIONS, groups):
        if not {controller, against} <= set(there):
            continue
        for joint in SHOWN:
            row: dict[tuple[str, str], float] = {}
            for engine, name in groups[scenario].items():
                found = compare_controllers(
                    summary, scenario=name, controller=controller, against=against, joint=joint
                )
                row[engine, "change"] = -found.reduction.value
                row[engine, "ahead"] = found.improvement.value * found.pairs
                row[engine, "pairs"] = found.pairs
            rows[controller, against, scenario, joint] = row
    table = pd.DataFrame.from_dict(rows, orient="index")
    if table.empty:
        return table
    names = ["controller", "against", "scenario", "joint"]
    table.index = pd.MultiIndex.from_tuples(table.index, names=names)
    table.columns = pd.MultiIndex.from_tuples(table.columns, names=["engine", "quantity"])
    return table


def format_between_engines(results: Results) -> str:
    """Both tables and their conclusion for a terminal; empty with one engine."""
    errors = errors_between_engines(results)
    if errors.empty:
        return ""
    return "\n\n".join([_format_errors(errors), *_format_winners(winners_between_engines(results))])


def _format_errors(errors: pd.DataFrame) -> str:
    engines = list(errors.columns.unique("engine"))
    wide = max(len(name) for name in errors.index.get_level_values("controller"))
    where = max(8, *(len(name) for name in errors.index.get_level_values("scenario")))
    lines = [
        "the same scenarios in each engine: mean peaks in calf and thigh [mrad]",
        f"{'scenario':<{where}}  {'controller':>{wide}}" + "".join(f"{e:>20}" for e in engines),
    ]
    for (scenario, controller), row in errors.iterrows():
        cells = ""
        for engine in engines:
            peaks = ", ".join(number(1e3 * row[engine, joint], ".1f") for joint in SHOWN)
            fell = int(row[engine, "fell"])
            cells += f"{peaks + (f', {fell} fell' if fell else ''):>20}"
        lines.append(f"{scenario:<{where}}  {controller:>{wide}}{cells}")
    return "\n".join(lines)


def _format_winners(winners: pd.DataFrame) -> list[str]:
    if winners.empty:
        return []
    engines = list(winners.columns.unique("engine"))
    where = max(8, *(len(name) for name in winners.index.get_level_values("scenario")))
    pairs = winners.index.droplevel(["scenario", "joint"]).unique()
    wide = max(len(" against ".join(pair)) for pair in pairs)
    lines = [
        "change of the mean peak over the other's, and in how many robots it is smaller",
        f"{'':<{wide}}  {'scenario':<{where}}  {'joint':<5}" + "".join(f"{e:>18}" for e in engines),
    ]
    differ, open_ = [], 0
    for (controller, against, scenario, joint), row in winners.iterrows():
        cells = "".join(f"{number(row[e, 'change'], '+.0%') + _of(row, e):>18}" for e in engines)
        question = f"{controller} against {against}"
        found = {_winner(row, engine) for engine in engines}
        mark = "  open" if None in found else "  differ" if len(found) > 1 else ""
        open_ += mark == "  open"
        if mark == "  differ":
            differ.append(f"{question} in the {joint} in {scenario}")
        lines.append(f"{question:<{wide}}  {scenario:<{where}}  {joint:<5}{cells}{mark}")
    same, said = len(winners) - len(differ) - open_, " and ".join(engines)
    words = [
        f"In {same} of {len(winners)} comparisons {said} name the same winner for every robot.",
        f"In {open_} an engine's robots do not agree among themselves (open)." if open_ else "",
        f"They name another one in: {'; '.join(differ)}."
        if differ
        else "Nowhere do they name different ones.",
    ]
    return ["\n".join(lines), "\n".join(filter(None, words))]


def _winner(row: pd.Series, engine: str) -> bool | None:
    """Whether the one is ahead in every robot (True) or in none (False)."""
    ahead, pairs = row[engine, "ahead"], row[engine, "pairs"]
    return None if not pairs or 0.0 < ahead < pairs else bool(ahead)


def _of(row: pd.Series, engine: str) -> str:
    return f" ({row[engine, 'ahead']:.0f} of {row[engine, 'pairs']:.0f})"
