"""What each controller reaches in a scenario, and how sure that is, computed from the summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from ..._typing import Array
from ..metrics import (
    METRICS,
    NO_INTERVAL,
    RIVAL,
    Interval,
    beaten,
    compare_controllers,
    family,
    in_family,
    lessons,
    mean_interval,
    robots,
    unit_of,
)
from .tables import SHOWN

MOVING = 0.1
"""Measured speed from which on a robot goes somewhere, so that its transport has a cost [m/s]."""


@dataclass(frozen=True)
class JointOverview:
    """Errors of one joint under a controller, means over the robots that did not fall.

    Attributes:
        peak: Mean peak error from the true contact on [rad].
        felt: The same from when the controller felt it [rad].
        rms: Mean root mean square error [rad].
        reduction: Of the mean peak against PD's; NaN where that was not run.
        difference: Of the mean peak from the model's, pair by pair [rad]; likewise.
        wins: Share of the robots that have a smaller error than with the model; likewise.
        better: Whether it is better than with the model beyond doubt, or worse; None where the
            interval of the difference holds 0.
        pairs: Robots that stayed up under both.
    """

    peak: Interval
    felt: float
    rms: float
    reduction: Interval = NO_INTERVAL
    difference: Interval = NO_INTERVAL
    wins: Interval = NO_INTERVAL
    better: bool | None = None
    pairs: int = 0


class Beat(NamedTuple):
    """When learning came to beat the model in calf and thigh, for good."""

    strides: float
    """Strides of learning, the median over the robots that did; NaN without one."""
    robots: int
    """Robots that did."""
    learners: int
    """Robots that learned."""


@dataclass(frozen=True)
class ControllerOverview:
    """What a controller reaches in a scenario, over all speeds and seeds.

    Attributes:
        joints: Errors of `SHOWN`.
        settled: Strides to converge, the slowest robot; NaN if one does not, or falls.
        taught: Strides that something was learned from; None without learning.
        beat: When it came to beat the model.
        feedback: The feedback's share of the torque.
        power: Mean mechanical power [W].
        cost: Mean cost of transport of the robots that move.
        moving: How many those are: at 0.1 m/s or more, as measured.
        speed_error: Mean magnitude [m/s].
        apex_error: Mean magnitude [m].
        upright: Robots that stayed up.
        fell: Robots that did not.
        diverging: Robots whose errors grew again while they learned, see `compare.metrics`.
        robots: How many there were, with those that finished no stride, of which neither is known.
        unit: What the intervals are drawn over, see `compare.metrics.statistics`.
        own: Mean and unit of a user's own metrics, over the robots that did not fall.
    """

    joints: Mapping[str, JointOverview]
    settled: float
    taught: int | None
    beat: Beat
    feedback: float
    power: float
    cost: float
    moving: int
    speed_error: float
    apex_error: float
    upright: int
    fell: int
    diverging: int
    robots: int
    unit: str
    own: Mapping[str, tuple[float, str]] = field(default_factory=dict)


Overview: TypeAlias = dict[str, ControllerOverview]
"""What each controller reaches in one scenario, the largest error of the calf first."""


def overview(summary: pd.DataFrame, *, scenario: str) -> Overview:
    """What each controller reaches in a scenario, in the order of the calf's error.

    Args:
        summary: See `compare.metrics`.
        scenario: A scenario, or a family of sampled ones.
    """
    rows = in_family(summary, scenario)
    names = [str(name) for name in rows["controller"].unique()]
    found = {name: _reached(rows, scenario, name, rivals=set(names) - {name}) for name in names}

    def place(name: str) -> tuple[bool, float]:
        error = found[name].joints["calf"].peak.value
        return bool(np.isnan(error)), -error

    return {name: found[name] for name in sorted(names, key=place)}


def answer(summary: pd.DataFrame) -> dict[str, Overview]:
    """The overviews of all scenarios, sampled ones by family, in the summary's order."""
    families = dict.fromkeys(map(family, summary["scenario"].unique()))
    return {name: overview(summary, scenario=name) for name in families}


def _reached(
    summary: pd.DataFrame, scenario: str, controller: str, *, rivals: set[str]
) -> ControllerOverview:
    own = summary[summary["controller"] == controller]

    def table(metric: str, joint: str = "-") -> pd.DataFrame:
        return robots(own, scenario=scenario, controller=controller, metric=metric, joint=joint)

    def values(metric: str) -> Array:
        return np.asarray(table(metric).to_numpy(dtype=float)).ravel()

    settled, cost = values("strides_to_converge"), table("cost_of_transport")
    measured = table("speed_error").reindex_like(cost) + cost.columns.to_numpy(float)
    costs = cost.where(np.abs(measured) >= MOVING).to_numpy(dtype=float)
    learned = lessons(summary, controller=controller)
    upright = own[own["metric"] == "upright"]["value"]
    return ControllerOverview(
        joints={joint: _joint(summary, scenario, controller, joint, rivals) for joint in SHOWN},
        settled=float(settled.max()) if settled.size else np.nan,
        taught=None if learned is None else learned.taught,
        beat=Beat(*beaten(summary, controller=controller)),
        feedback=_mean(values("feedback_share")),
        power=_mean(values("power")),
        cost=_mean(costs),
        moving=int(np.isfinite(costs).sum()),
        speed_error=_mean(np.abs(values("speed_error"))),
        apex_error=_mean(np.abs(values("apex_error"))),
        upright=int((upright == 1.0).sum()),
        fell=int((upright == 0.0).sum()),
        diverging=int(np.nansum(values("diverging"))),
        robots=len(upright),
        unit=unit_of(table("upright")),
        own={name: (_mean(values(name)), unit) for name, unit in own_metrics(own)},
    )


def own_metrics(summary: pd.DataFrame) -> list[tuple[str, str]]:
    """Names and units of a user's own metrics in a summary."""
    found = summary[~summary["metric"].isin(list(METRICS))]
    return list(dict.fromkeys(zip(found["metric"], found["unit"], strict=True)))


def _joint(
    summary: pd.DataFrame, scenario: str, controller: str, joint: str, rivals: set[str]
) -> JointOverview:
    def errors(metric: str) -> pd.DataFrame:
        return robots(summary, scenario=scenario, controller=controller, metric=metric, joint=joint)

    own = JointOverview(
        peak=mean_interval(errors("peak_error")),
        felt=_mean(errors("felt_peak_error").to_numpy(dtype=float)),
        rms=_mean(errors("rms_error").to_numpy(dtype=float)),
    )
    if "pd" in rivals:
        beside_pd = compare_controllers(
            summary, scenario=scenario, controller=controller, against="pd", joint=joint
        )
        own = replace(own, reduction=beside_pd.reduction)
    if RIVAL in rivals:
        beside = compare_controllers(
            summary, scenario=scenario, controller=controller, against=RIVAL, joint=joint
        )
        own = replace(
            own,
            difference=beside.difference,
            wins=beside.improvement,
            better=beside.better,
            pairs=beside.pairs,
        )
    return own


def _mean(values: Array) -> float:
    """Mean of what there is; NaN without anything."""
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
