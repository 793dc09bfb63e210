"""The tables people read, computed from the summary."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable
from typing import Any

import numpy as np
import pandas as pd

from ...robot import JOINTS
from ..metrics import in_family, of_papers_robot, robots, table_1
from ..world import Scenario, shipped_scenario

SHOWN = ("calf", "thigh")
"""Joints of the paper's Table I."""

SHOWN_PARAMETERS = {
    "payload": ("payload [kg]", 1.0, ".1f"),
    "torque_constant": ("torque given", 1.0, ".0%"),
    "armature": ("rotor [g m²]", 1e3, ".1f"),
    "damping": ("damping [N m s/rad]", 1.0, ".2f"),
    "coulomb": ("Coulomb friction [N m]", 1.0, ".2f"),
    "ground_time_constant": ("contact [ms]", 1e3, ".1f"),
    "ground_friction": ("ground friction", 1.0, ".2f"),
    "slope": ("slope [rad]", 1.0, "+.3f"),
    "delay": ("motors late [ms]", 1e3, ".0f"),
    "touchdown_latency": ("contact sensor late [ms]", 1e3, ".0f"),
    "touchdown_jitter": ("its jitter [ms]", 1e3, ".0f"),
}
"""What is drawn of a sampled scenario and matters to every base: column, factor of it, format."""


def sampled_scenarios(
    summary: pd.DataFrame, *, scenario: str, worlds: Iterable[str | Scenario] = ()
) -> pd.DataFrame:
    """Each sampled scenario of a family: what it is like, and the mean errors in it.

    Means are over the robots that did not fall.

    Args:
        summary: See `compare.metrics`.
        scenario: The family.
        worlds: Scenarios of one's own among them; of one that is not known there are errors only.

    Returns:
        Rows by world, from the one in which learning (`ilc`) leaves the smallest calf error to the
        one with the largest; columns ("scenario", attribute of `Scenario`), ("calf" and "thigh",
        controller) [rad] and ("fallen", controller).
    """
    family_rows = in_family(summary, scenario)
    controllers = list(dict.fromkeys(family_rows["controller"]))
    columns: dict[tuple[str, str], Any] = {}
    own = {world.name: world for world in worlds if isinstance(world, Scenario)}
    names = family_rows["scenario"].unique()
    scenarios = {name: own.get(name) or shipped_scenario(name) for name in names}
    for attribute in SHOWN_PARAMETERS:
        columns["scenario", attribute] = pd.Series(
            {name: getattr(world, attribute, np.nan) for name, world in scenarios.items()}
        )
    for joint, name in itertools.product(SHOWN, controllers):
        peaks = robots(family_rows, scenario=scenario, controller=name, joint=joint)
        columns[joint, name] = peaks.groupby(level="scenario").mean().mean(axis="columns")
    for name in controllers:
        up = robots(family_rows, scenario=scenario, controller=name, metric="upright", joint="-")
        columns["fallen", name] = (up == 0.0).sum(axis="columns").groupby(level="scenario").sum()
    table = pd.DataFrame(columns).rename_axis("scenario")
    order = ("calf", "ilc") if "ilc" in controllers else ("calf", controllers[0])
    return table.sort_values(order)


def paper_learner(controllers: Collection[str]) -> str:
    """Which of the controllers stands beside the paper's ILC: the nearest to it in scope.

    The paper learns in stance only: `ilc-stance` does so with our law, `ilc-paper` with the
    paper's; `ilc`, which learns the flight and its timing too, stands in where neither ran.
    """
    return next((name for name in ("ilc-stance", "ilc-paper") if name in controllers), "ilc")


def beside_the_paper(summary: pd.DataFrame, *, scenario: str) -> pd.DataFrame:
    """Table I: peak stance errors [rad] with PD and with ILC, ours beside the paper's.

    Ours are means over the robots that stayed up; a speed at which none did has no row. The ILC is
    the one of the paper's scope, see `paper_learner`.

    Args:
        summary: The summary of a result that holds `pd` and an ILC.
        scenario: The scenario.

    Returns:
        Rows by speed, and one of means over the speeds that have all of ours; columns by joint,
        source ("ours", "paper") and quantity ("PD", "ILC", "reduction"). Empty where nobody stayed
        up, and of another robot than the paper's.
    """
    printed, there, parts = table_1(), set(summary["controller"]), {}
    own = {"pd": "pd", "ilc": paper_learner(there)}
    for joint, controller in itertools.product(SHOWN, ("pd", "ilc")):
        paper = printed[(printed["joint"] == joint) & (printed["controller"] == controller)]
        parts[joint, "paper", controller.upper()] = paper.set_index("speed")["value"]
        if own[controller] in there:
            peaks = robots(summary, scenario=scenario, controller=own[controller], joint=joint)
            parts[joint, "ours", controller.upper()] = peaks.mean()
    table = pd.DataFrame(parts)
    measured = [name for name in table.columns if name[1] == "ours"]
    table = table.dropna(subset=measured, how="all") if measured else table.iloc[:0]
    table = table if of_papers_robot(summary) else table.iloc[:0]
    if len(table):
        table.loc["mean"] = table.dropna(subset=measured).mean()
    for joint in SHOWN:
        for source in ("ours", "paper"):
            if (joint, source, "PD") in table and (joint, source, "ILC") in table:
                ratio = table[joint, source, "ILC"] / table[joint, source, "PD"]
                table[joint, source, "reduction"] = 1.0 - ratio
    order = itertools.product(SHOWN, ("ours", "paper"), ("PD", "ILC", "reduction"))
    return table[[name for name in order if name in table]].rename_axis("speed")


def worst_reduction(summary: pd.DataFrame, *, scenario: str, controller: str) -> dict[str, float]:
    """Smallest reduction of the peak error of any robot, by joint; negative is worse than PD.

    NaN without a robot that stayed up under both.
    """
    worst = {}
    for joint in JOINTS:
        one, other = (
            robots(summary, scenario=scenario, controller=name, joint=joint)
            for name in (controller, "pd")
        )
        worst[joint] = float((1.0 - one / other).min(axis=None)) if one.size else np.nan
    return worst
