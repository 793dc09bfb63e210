"""How sure the numbers are: intervals, paired differences, and who beats whom how often.

What is compared are errors of the same robots (same speed, scenario and seed) under two
controllers. The unit that is drawn again and again is the sampled scenario, whose robots share what
was drawn, or the seed in a world that is not sampled. Where there are fewer than `LEAST_UNITS` of
them, the speeds are the unit, each the mean over its seeds; the interval then says how the mean
would scatter over other speeds and starting postures like these, and nothing about other scenarios.
Every result names its unit.

A robot that fell has no error worth a number: it counts among the fallen, loses every comparison
with one that did not fall, and is left out of means and differences. Two that fell say nothing of
each other.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from ..._typing import Array

CONFIDENCE = 0.95
"""Level of every interval."""

LEAST_UNITS = 5
"""Fewest sampled scenarios, or seeds, that are drawn from to make an interval."""

RESAMPLES = 4999
"""Samples that the bootstrap draws."""

CONTROL_ARM = "ilc-zero"
"""The controller that learns with gain 0: all the machinery of learning, and nothing learned."""

_NOTHING = 1e-12
"""Relative scatter that is round-off."""

_SAMPLED = re.compile(r"random-(\d+)-\d+")


class Interval(NamedTuple):
    """An estimate with its confidence interval."""

    value: float
    """The estimate."""
    low: float
    """Lower end; NaN with fewer than two units."""
    high: float
    """Upper end."""

    @property
    def known(self) -> bool:
        """Whether there is one."""
        return bool(np.isfinite([self.low, self.high]).all())

    def holds(self, value: float) -> bool:
        """Whether a value lies in the interval."""
        return self.low <= value <= self.high


NO_INTERVAL = Interval(float("nan"), float("nan"), float("nan"))
"""That of what there is not."""


class Comparison(NamedTuple):
    """A controller against another, pair by pair."""

    difference: Interval
    """Mean error of the one minus that of the other; negative where the one is better."""
    reduction: Interval
    """1 - mean error of the one / mean error of the other."""
    improvement: Interval
    """Share of the pairs in which the one has the smaller error; ties count half (Wilson). Pairs of
    which both fell are left out: NaN without any other."""
    pairs: int
    """Pairs in which neither fell: those of the difference and the reduction."""
    unit: str
    """What was drawn: "scenario", "seed" or "speed"."""

    @property
    def better(self) -> bool | None:
        """Whether the one is better beyond doubt, or worse; None where the interval holds 0."""
        if np.isnan(self.difference.low) or self.difference.holds(0.0):
            return None
        return self.difference.value < 0.0


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


def mean_interval(values: pd.DataFrame, *, rng: np.random.Generator | None = None) -> Interval:
    """The mean over all robots with its interval.

    Args:
        values: As `robots` gives them.
        rng: What the bootstrap draws with; by default the same numbers each time.
    """
    return _bootstrap(np.mean, _by_unit(values)[0], rng=rng)


def compare_controllers(
    summary: pd.DataFrame,
    *,
    scenario: str,
    controller: str,
    against: str,
    metric: str = "peak_error",
    joint: str = "calf",
    rng: np.random.Generator | None = None,
) -> Comparison:
    """Compare two controllers on the same robots.

    Args:
        summary: See `compare.metrics`.
        scenario: A scenario or a family of sampled ones.
        controller: The one.
        against: The other, "pd" or "model" as a rule.
        metric: An error, of which less is better.
        joint: Which joint.
        rng: What the bootstrap draws with; by default the same numbers each time.
    """
    one, other = (
        robots(summary, scenario=scenario, controller=name, metric=metric, joint=joint)
        for name in (controller, against)
    )
    return compare_pairs(*one.align(other, join="inner"), rng=rng)


def compare_pairs(
    one: pd.DataFrame, other: pd.DataFrame, *, rng: np.random.Generator | None = None
) -> Comparison:
    """Compare two tables of the same robots, as `robots` gives them."""
    both = one.notna() & other.notna()
    (ours, unit), (theirs, _) = _by_unit(one.where(both)), _by_unit(other.where(both))
    # Worse than any error is a fall; of two falls neither wins, and they are no tie either.
    first, second = one.fillna(np.inf), other.fillna(np.inf)
    wins = (first < second).astype(float) + 0.5 * (first == second)
    wins = wins.where(one.notna() | other.notna())
    return Comparison(
        difference=_bootstrap(np.mean, ours - theirs, rng=rng),
        reduction=_bootstrap(_reduction, ours, theirs, rng=rng),
        improvement=_wilson(_by_unit(wins)[0]),
        pairs=int(both.to_numpy().sum()),
        unit=unit,
    )


def control_arm(summary: pd.DataFrame) -> float | None:
    """Largest difference that learning with gain 0 makes to any number of any robot.

    Returns:
        The largest |ilc-zero - pd| over all metrics, in their units; None if it was not run.
    """
    keys = ["scenario", "speed", "seed", "joint", "metric"]
    arms = summary[summary["controller"].isin(["pd", CONTROL_ARM])]
    wide = arms.pivot_table(index=keys, columns="controller", values="value")
    if not {"pd", CONTROL_ARM} <= set(wide.columns):
        return None
    return float((wide[CONTROL_ARM] - wide["pd"]).abs().max())


def _reduction(ours: Array, theirs: Array, axis: int = -1) -> Array:
    return np.asarray(1.0 - np.mean(ours, axis=axis) / np.mean(theirs, axis=axis))


def _pivot(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.set_index(["scenario", "seed", "speed"])["value"].unstack("speed")


def unit_of(values: pd.DataFrame) -> str:
    """What is drawn from a table of `robots`: "scenario", "seed" or "speed"."""
    scenarios = (
        values.index.unique("scenario") if "scenario" in values.index.names else values.index
    )
    several, units = len(scenarios) > 1, len(scenarios) if len(scenarios) > 1 else len(values)
    if units < LEAST_UNITS:
        return "speed"
    return "scenario" if several else "seed"


def _by_unit(values: pd.DataFrame) -> tuple[Array, str]:
    """Mean of each unit, and what the unit is; units without any value are left out."""
    unit = unit_of(values)
    if unit == "scenario":
        values = values.groupby(level="scenario", sort=False).mean()
    means = values.mean(axis="index" if unit == "speed" else "columns").to_numpy(dtype=float)
    return means[~np.isnan(means)], unit


def _bootstrap(
    statistic: Callable[..., Array], *data: Array, rng: np.random.Generator | None
) -> Interval:
    """BCa bootstrap over units that belong together across the arrays."""
    if data[0].size == 0:
        return NO_INTERVAL
    value = float(statistic(*data, axis=-1))
    if data[0].size < 2:
        return Interval(value, np.nan, np.nan)
    without = [
        float(statistic(*(np.delete(part, k) for part in data), axis=-1))
        for k in range(data[0].size)
    ]
    if np.ptp(without) <= _NOTHING * abs(value):
        return Interval(value, value, value)  # nothing scatters, and BCa would divide by it
    done = stats.bootstrap(
        data,
        statistic,
        paired=True,
        vectorized=True,
        n_resamples=RESAMPLES,
        confidence_level=CONFIDENCE,
        rng=np.random.default_rng(0) if rng is None else rng,
    )
    return Interval(value, *map(float, done.confidence_interval))


def _wilson(shares: Array) -> Interval:
    """Interval of a share from its values by unit; a bootstrap of all ones would be sure of 1."""
    n = shares.size
    if n == 0:
        return NO_INTERVAL
    z, share = float(stats.norm.ppf(0.5 + CONFIDENCE / 2)), float(shares.mean())
    centre = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return Interval(share, max(0.0, centre - half), min(1.0, centre + half))
