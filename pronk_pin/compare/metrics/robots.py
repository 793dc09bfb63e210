"""Robots of a summary: a metric of each one, and which scenarios are samples of one family."""

from __future__ import annotations

import re

import pandas as pd

_SAMPLED = re.compile(r"random-(\d+)-\d+")


def family(scenario: str) -> str:
    """What a scenario is a sample of: "random-3" for "random-3-0"; itself if it is not sampled."""
    return _SAMPLED.sub(r"random-\1", scenario)


def sampled(scenario: str) -> bool:
    """Whether a world, or what `family` says of it, is a sample."""
    return re.match(r"random-\d", scenario) is not None


def in_family(summary: pd.DataFrame, scenario: str) -> pd.DataFrame:
    """The rows of a world, or of a family of sampled ones."""
    members = [name for name in summary["scenario"].unique() if family(name) == scenario]
    return summary[summary["scenario"].isin(members)]


def robots(
    summary: pd.DataFrame,
    *,
    scenario: str,
    controller: str,
    metric: str = "peak_error",
    joint: str = "calf",
) -> pd.DataFrame:
    """A metric of each robot: a row a unit (scenario and seed), a column a speed.

    Args:
        summary: See `compare.metrics`.
        scenario: A scenario or a family of sampled ones.
        controller: Whose.
        metric: Which metric.
        joint: Which joint, "-" for a metric of the robot.

    Returns:
        Values, NaN where the robot fell (but for the metric `upright` itself).
    """
    rows = in_family(summary[summary["controller"] == controller], scenario)
    values = _pivot(rows[(rows["metric"] == metric) & (rows["joint"] == joint)])
    if metric == "upright":
        return values
    upright = _pivot(rows[rows["metric"] == "upright"]).reindex_like(values)
    return values.where(upright != 0.0)


def _pivot(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.set_index(["scenario", "seed", "speed"])["value"].unstack("speed")
