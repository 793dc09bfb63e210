"""How sure the numbers are: intervals, paired differences, and who beats whom how often.

What is compared are errors of the same robots (same speed, scenario and seed) under two
controllers. The unit is the sampled scenario, whose robots share what was drawn, or the seed in a
world that is not sampled; intervals are t-intervals over the units' means (Student 1908), which
hold what they promise from 8 units on, where a bootstrap of so few is too narrow. Where there are
fewer than `LEAST_UNITS` of them, the speeds are the unit, each the mean over its seeds. They are
chosen and not drawn: such an interval says how the mean would scatter over other speeds and
starting postures like these, and nothing about other scenarios. Fewer than 8 of any unit have no
interval, nor have numbers that do not scatter at all. Every result names its unit.

A robot that fell has no error worth a number: it counts among the fallen, loses every comparison
with one that did not fall, and is left out of means and differences. Two that fell say nothing of
each other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from ..._typing import Array
from .metrics import robots

CONFIDENCE = 0.95
"""Level of every interval."""

LEAST_UNITS = 8
"""Fewest units that make an interval, or a "yes"."""

CONTROL_ARM = "ilc-zero"
"""The controller that learns with gain 0: all the machinery of learning, and nothing learned."""

_NOTHING = 1e-12
"""Relative scatter that is round-off."""


class Interval(NamedTuple):
    """An estimate with its confidence interval."""

    value: float
    """The estimate."""
    low: float
    """Lower end; NaN with fewer than `LEAST_UNITS`, or where nothing scatters."""
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


def mean_interval(values: pd.DataFrame) -> Interval:
    """The mean over all robots with its interval.

    Args:
        values: As `robots` gives them.
    """
    return _mean(_by_unit(values)[0])


def compare_controllers(
    summary: pd.DataFrame,
    *,
    scenario: str,
    controller: str,
    against: str,
    metric: str = "peak_error",
    joint: str = "calf",
) -> Comparison:
    """Compare two controllers on the same robots.

    Args:
        summary: See `compare.metrics`.
        scenario: A scenario or a family of sampled ones.
        controller: The one.
        against: The other, "pd" or "model" as a rule.
        metric: An error, of which less is better.
        joint: Which joint.
    """
    one, other = (
        robots(summary, scenario=scenario, controller=name, metric=metric, joint=joint)
        for name in (controller, against)
    )
    return compare_pairs(*one.align(other, join="inner"))


def compare_pairs(one: pd.DataFrame, other: pd.DataFrame) -> Comparison:
    """Compare two tables of the same robots, as `robots` gives them."""
    both = one.notna() & other.notna()
    (ours, unit), (theirs, _) = _by_unit(one.where(both)), _by_unit(other.where(both))
    # Worse than any error is a fall; of two falls neither wins, and they are no tie either.
    first, second = one.fillna(np.inf), other.fillna(np.inf)
    wins = (first < second).astype(float) + 0.5 * (first == second)
    wins = wins.where(one.notna() | other.notna())
    return Comparison(
        difference=_mean(ours - theirs),
        reduction=_reduction(ours, theirs),
        improvement=_wilson(_by_unit(wins)[0]),
        pairs=int(both.to_numpy().sum()),
        unit=unit,
    )


def control_arm(summary: pd.DataFrame) -> float | None:
    """Largest difference that learning with gain 0 makes to the mean peak error of any robot [rad].

    It has all the machinery of learning, the flight's timing included, and learns nothing.

    Returns:
        The largest |ilc-zero - pd| over joints and robots; None if it was not run.
    """
    keys = ["scenario", "speed", "seed", "joint"]
    arms = summary[summary["controller"].isin(["pd", CONTROL_ARM])]
    arms = arms[arms["metric"] == "peak_error"]
    wide = arms.pivot_table(index=keys, columns="controller", values="value")
    if not {"pd", CONTROL_ARM} <= set(wide.columns):
        return None
    return float((wide[CONTROL_ARM] - wide["pd"]).abs().max())


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


def _mean(values: Array) -> Interval:
    """Mean of units with its t-interval."""
    if values.size == 0:
        return NO_INTERVAL
    value = float(values.mean())
    # Seeds of a world without chance give the same number each: nothing was drawn.
    if values.size < LEAST_UNITS or np.ptp(values) <= _NOTHING * abs(value):
        return Interval(value, np.nan, np.nan)
    ends = stats.ttest_1samp(values, 0.0).confidence_interval(CONFIDENCE)
    return Interval(value, float(ends.low), float(ends.high))


def _reduction(ours: Array, theirs: Array) -> Interval:
    """`1 - R`, `R = mean(ours) / mean(theirs)`, with the t-interval of R to first order.

    By the delta method: that of the mean of `R + (ours - R theirs) / mean(theirs)`.
    """
    if theirs.size == 0:
        return NO_INTERVAL
    ratio = ours.mean() / theirs.mean()
    value, low, high = _mean(ratio + (ours - ratio * theirs) / theirs.mean())
    return Interval(1.0 - value, 1.0 - high, 1.0 - low)


def _wilson(shares: Array) -> Interval:
    """Interval of a share from its values by unit; a t-interval of all ones would be sure of 1."""
    n = shares.size
    if n == 0:
        return NO_INTERVAL
    z, share = float(stats.norm.ppf(0.5 + CONFIDENCE / 2)), float(shares.mean())
    if n < LEAST_UNITS:
        return Interval(share, np.nan, np.nan)
    centre = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return Interval(share, max(0.0, centre - half), min(1.0, centre + half))
