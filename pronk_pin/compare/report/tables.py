"""The tables people read, computed from the summary."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pandas as pd

from ..._typing import Array
from ...robot import JOINTS
from ..metrics import (
    RIVAL,
    Interval,
    beaten,
    compare_controllers,
    family,
    in_family,
    lessons,
    mean_interval,
    robots,
    table_1,
    unit_of,
)
from ..world import load_scenario

SHOWN = ("calf", "thigh")
"""Joints of the paper's Table I."""

_MOVING = 0.05
"""Speed from which on a robot goes somewhere, so that its transport has a cost [m/s]."""


SHOWN_PARAMETERS = {
    "payload": ("payload [kg]", 1.0, ".1f"),
    "torque_constant": ("torque given", 1.0, ".0%"),
    "armature": ("rotor [g m²]", 1e3, ".1f"),
    "damping": ("damping [N m s/rad]", 1.0, ".2f"),
    "coulomb": ("Coulomb friction [N m]", 1.0, ".2f"),
    "ground_time_constant": ("contact [ms]", 1e3, ".1f"),
    "ground_friction": ("ground friction", 1.0, ".2f"),
    "slope": ("slope [rad]", 1.0, "+.3f"),
}
"""What is drawn of a sampled scenario and matters to every base: column, factor of it, format."""


def sampled_scenarios(summary: pd.DataFrame, *, scenario: str) -> pd.DataFrame:
    """Each sampled scenario of a family: what it is like, and the mean errors in it.

    Means are over the robots that did not fall.

    Args:
        summary: See `compare.metrics`.
        scenario: The family.

    Returns:
        Rows by world, from the one in which learning (`ilc`) leaves the smallest calf error to the
        one with the largest; columns ("scenario", attribute of `Scenario`), ("calf" and "thigh",
        controller) [rad] and ("fallen", controller).
    """
    family_rows = in_family(summary, scenario)
    controllers = list(dict.fromkeys(family_rows["controller"]))
    columns: dict[tuple[str, str], Any] = {}
    scenarios = {name: load_scenario(name) for name in family_rows["scenario"].unique()}
    for attribute in SHOWN_PARAMETERS:
        columns["scenario", attribute] = pd.Series(
            {name: getattr(values, attribute) for name, values in scenarios.items()}
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


def beside_the_paper(summary: pd.DataFrame, *, scenario: str) -> pd.DataFrame:
    """Table I: peak stance errors [rad] with PD and with ILC, ours beside the paper's.

    Ours are means over the robots that stayed up; a speed at which none did has no row.

    Args:
        summary: The summary of a result that holds `pd` and `ilc`.
        scenario: The scenario.

    Returns:
        Rows by speed, and one of means over the speeds that have all of ours; columns by joint,
        source ("ours", "paper") and quantity ("PD", "ILC", "reduction"). Empty where nobody stayed
        up.
    """
    printed, shown = (
        table_1(),
        [name for name in ("pd", "ilc") if name in set(summary["controller"])],
    )
    parts = {}
    for joint, controller in itertools.product(SHOWN, ("pd", "ilc")):
        paper = printed[(printed["joint"] == joint) & (printed["controller"] == controller)]
        parts[joint, "paper", controller.upper()] = paper.set_index("speed")["value"]
        if controller in shown:
            peaks = robots(summary, scenario=scenario, controller=controller, joint=joint)
            parts[joint, "ours", controller.upper()] = peaks.mean()
    table = pd.DataFrame(parts)
    measured = [name for name in table.columns if name[1] == "ours"]
    table = table.dropna(subset=measured, how="all") if measured else table.iloc[:0]
    if len(table):
        table.loc["mean"] = table.dropna(subset=measured).mean()
    for joint in SHOWN:
        for source in ("ours", "paper"):
            if (joint, source, "PD") in table and (joint, source, "ILC") in table:
                ratio = table[joint, source, "ILC"] / table[joint, source, "PD"]
                table[joint, source, "reduction"] = 1.0 - ratio
    order = itertools.product(SHOWN, ("ours", "paper"), ("PD", "ILC", "reduction"))
    return table[[name for name in order if name in table]].rename_axis("speed")


def overview(summary: pd.DataFrame, *, scenario: str) -> pd.DataFrame:
    """One row a controller, in the order of the calf's error: what it reaches, and how sure it is.

    Means are over the robots that did not fall, of all speeds and seeds; a column with `_low` and
    `_high` beside it has an interval. With `j` for `calf` and `thigh`, the columns are

    - `j`: mean peak error [rad], with interval; `j_rms`: mean RMS error [rad];
    - `j_reduction`: of the mean peak against PD's, with interval;
    - `j_model`: 1 where it is better than the model's feedforward beyond doubt, -1 where it is
      worse, 0 where the interval of the difference holds 0, NaN without a robot that stayed up
      under both;
    - `j_difference`: of the mean peak from the model's, pair by pair [rad], with interval;
    - `j_wins`: share of the robots that have a smaller error than with the model, with interval;
    - `beat_strides`, `beat`, `learners`: strides of learning until calf and thigh beat the model
      (median over the robots that do), how many do, of how many;
    - `strides`: to converge, the slowest robot; NaN if one does not, or falls;
    - `taught`: strides that something was learned from; NaN without learning;
    - `feedback`: its share of the torque; `cost`: mean cost of transport of the robots that move;
    - `speed_error` [m/s], `apex_error` [m]: mean magnitudes;
    - `upright`: robots that stayed up; `fell`: robots that did not; `robots`: how many there were,
      with those that finished no stride, of which neither is known;
    - `unit`: what the intervals are drawn over, see `compare.metrics.statistics`.

    Args:
        summary: See `compare.metrics`.
        scenario: A scenario, or a family of sampled ones.
    """
    family_rows = in_family(summary, scenario)
    names = [str(name) for name in family_rows["controller"].unique()]
    rows = {name: _row(family_rows, scenario, name, rivals=set(names) - {name}) for name in names}
    table = pd.DataFrame.from_dict(rows, orient="index").rename_axis("controller")
    return table.sort_values("calf", ascending=False)


def answer(summary: pd.DataFrame) -> pd.DataFrame:
    """The overviews of all scenarios, indexed by scenario and controller, in the summary's
    order."""
    families = list(dict.fromkeys(map(family, summary["scenario"].unique())))
    return pd.concat(
        {name: overview(summary, scenario=name) for name in families}, names=["scenario"]
    )


def _row(summary: pd.DataFrame, scenario: str, controller: str, *, rivals: set[str]) -> Any:
    """A controller's row of `overview`."""
    cell: dict[str, Any] = {"scenario": scenario, "controller": controller}

    own = summary[summary["controller"] == controller]

    def values(metric: str, joint: str = "-") -> Array:
        values_of_robots = robots(own, **cell, metric=metric, joint=joint)
        return np.asarray(values_of_robots.to_numpy(dtype=float)).ravel()

    row: dict[str, Any] = {}
    for joint in SHOWN:
        row |= _interval(joint, mean_interval(robots(own, **cell, joint=joint)))
        row[f"{joint}_rms"] = _mean(values("rms_error", joint))
        if "pd" in rivals:
            comparison = compare_controllers(summary, **cell, against="pd", joint=joint)
            row |= _interval(f"{joint}_reduction", comparison.reduction)
        if RIVAL in rivals:
            comparison = compare_controllers(summary, **cell, against=RIVAL, joint=joint)
            sign = {True: 1, None: 0, False: -1}[comparison.better]
            row[f"{joint}_model"] = sign if comparison.pairs else np.nan
            row |= _interval(f"{joint}_difference", comparison.difference)
            row |= _interval(f"{joint}_wins", comparison.improvement)
    settled = values("strides_to_converge")
    row["strides"] = float(settled.max()) if settled.size else np.nan
    found_lessons = lessons(summary, controller=controller)
    row["taught"] = np.nan if found_lessons is None else found_lessons.taught
    row["beat_strides"], row["beat"], row["learners"] = beaten(summary, controller=controller)
    row["feedback"] = _mean(values("feedback_share"))
    cost = robots(own, **cell, metric="cost_of_transport", joint="-")
    row["cost"] = _mean(cost.loc[:, np.abs(cost.columns.to_numpy(float)) > _MOVING].to_numpy(float))
    row["speed_error"] = _mean(np.abs(values("speed_error")))
    row["apex_error"] = _mean(np.abs(values("apex_error")))
    upright = own[own["metric"] == "upright"]["value"]
    row["upright"], row["fell"] = int((upright == 1.0).sum()), int((upright == 0.0).sum())
    row["robots"] = len(upright)
    row["unit"] = unit_of(robots(own, **cell, metric="upright", joint="-"))
    return row


def _interval(name: str, interval: Interval) -> dict[str, float]:
    return {name: interval.value, f"{name}_low": interval.low, f"{name}_high": interval.high}


def _mean(values: Array) -> float:
    """Mean of what there is; NaN without anything."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


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
