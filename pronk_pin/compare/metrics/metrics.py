"""Metrics: from strides to the summary, one long table with a row a number."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
import xarray as xr
from numpy.lib.stride_tricks import sliding_window_view

from ..._checks import instance_of, known_name
from ..._typing import Array, BoolArray, IntArray
from ...control import SKIPPED
from ...robot import JOINTS
from .effort import effort
from .own_metrics import Metric
from .time_to_beat import JUDGED, PeakHistory

STEADY_STRIDES = 30
"""Strides at the end of a simulation that count as steady state (paper, section III.B), if there
are as many after the transient."""

TRANSIENT = 10
"""First strides of learning that are a transient, and no steady state; of a short learning the
first half."""

_WINDOW = 10
"""Strides of the means by which learning is said to grow."""

GROWTH, GROWN = 1.5, 0.005
"""Learning is diverging where its errors end so many times, and so many radians, above the least
that they have been."""

SETTLED = 0.1
"""Learning has settled where this share of the improvement, or less, is still missing."""

LEAST_IMPROVEMENT = 0.05
"""Share of the error that learning must take away for there to be anything that settles; a robot
that learns nothing still drifts by a percent."""

VARIABLES = ("count", "start", "peak_error", "learning", "upright")
"""Variables of the strides that `peak_history` reads."""

KEYS = ["robot", "base", "scenario", "speed", "controller", "seed", "joint", "metric"]
COLUMNS = [*KEYS, "value", "unit"]
"""Columns of the summary; rows are sorted by the keys."""

_SAMPLED = re.compile(r"random-(\d+)-\d+")


def steady(strides: xr.Dataset) -> xr.Dataset:
    """Select the last `STEADY_STRIDES` finished strides of each speed, renumbered from 0.

    None from before the learning was switched on, or would have been for a controller that does
    not learn, so that all are judged on the same strides, and none of its `TRANSIENT`: fewer, then,
    after a short learning. A robot that finished none has NaN in all of them.
    """
    instance_of("strides", strides, xr.Dataset, "strides, as Results.strides() returns them")
    count = strides["count"].to_numpy()
    last = int(_steady_count(count, _switched(strides).sum(axis=1))[count > 0].min(initial=2**31))
    last = last if count.any() else 0
    offset = xr.DataArray(np.arange(last), dims="stride")
    start = xr.DataArray(count - last, dims="speed", coords={"speed": strides["speed"]})
    return strides.isel(stride=start + offset)


def _steady_count(count: IntArray | int, learned: IntArray | int) -> IntArray:
    """How many strides at the end are steady state, of so many, of them so many of learning."""
    settled = np.maximum(learned - TRANSIENT, (learned + 1) // 2)
    return np.minimum(STEADY_STRIDES, np.where(learned > 0, settled, count))


def _switched(strides: xr.Dataset) -> BoolArray:
    """Whether strides began after learning was switched on, or would have been, (n, strides)."""
    if "start" not in strides or "switch" not in strides.attrs:
        return np.asarray(strides["learning"].transpose("speed", "stride") == 1)
    early = float(strides.attrs["timestep"]) / 2
    start = strides["start"].transpose("speed", "stride").to_numpy()
    return np.asarray(start > float(strides.attrs["switch"]) - early)


def of_first_leg(values: xr.DataArray | xr.Dataset, kind: str) -> str:
    """Name of a joint of the first leg, FL of the A1, by its place in the leg: hip, thigh, calf."""
    legs, kinds = values["leg"].to_numpy(), values["kind"].to_numpy()
    return str(values["joint"].to_numpy()[(legs == legs[0]) & (kinds == kind)][0])


def by_joint(values: xr.DataArray) -> xr.DataArray:
    """Mean over the legs: the axis `joint` of twelve becomes one of hip, thigh, calf."""
    kinds = values["kind"].to_numpy()
    values = values.drop_vars(["leg", "kind"], errors="ignore")
    means = [values.isel(joint=np.flatnonzero(kinds == kind)).mean("joint") for kind in JOINTS]
    joined = xr.concat(means, dim="joint", coords="minimal", compat="override")
    return joined.assign_coords(joint=list(JOINTS)).transpose(*values.dims)


def summarize(strides: xr.Dataset, own_metrics: Sequence[Metric] = ()) -> pd.DataFrame:
    """Compute the summary of one simulation.

    Over the N steady strides k, with the error e(s) = q_d - q of a joint in stance:

    Per joint (mean over the legs and the steady strides):
        peak_error: Peak of the stance error against the unmodified reference [rad],
            `mean_k max_t |e_k(t)|`, from the true contact on, whatever the controller felt.
        rms_error: Its root mean square [rad], `sqrt(mean_k mean_t e_k(t)^2)`.
        felt_peak_error: The peak from when the controller felt the contact on, and against its
            own count of time [rad].
        strides_to_converge: See `strides_to_converge`; thigh and calf, and `-` for the later one.
        strides_to_beat_model: See `compare.metrics.time_to_beat`; added where the model was run
        too.
    Per robot:
        strides_of_learning: Strides that were made with the learning law on; where there are some.
        skipped_*: How many of them taught nothing, by the reasons of `control.SKIPPED`.
        error_growth: Mean peak of the last `_WINDOW` strides of learning over the least mean of so
            many, thigh or calf, whichever grew more; 1 where it never was smaller.
        diverging: 1 where the error grew by more than `GROWTH` and by `GROWN` rad, else 0.
        upright: 1 if it never fell; NaN, as all the others, if it finished no stride.
        speed_error, apex_error: Steady mean minus the gait's [m/s], [m].
        apex_deviation: Standard deviation of the apex over the steady strides [m].
        stride_duration: Mean duration of a stride [s].
        feedback_share: Feedback's share of the torque in stance, `rms(fb) / (rms(fb) + rms(ff))`.
        power, cost_of_transport: Mechanical, see `compare.metrics.effort`.

    Args:
        strides: What `Simulation` recorded; the same from memory and from its file.
        own_metrics: Others than these.
    """
    if strides.sizes["stride"] == 0:
        strides = strides.reindex(stride=[0])  # of nobody
    settings = {key: strides.attrs[key] for key in ("robot", "base", "scenario", "controller")}
    settings["seed"] = int(strides.attrs["seed"])
    joints = by_joint(strides[["peak_error", "felt_peak_error"]].to_dataarray("name"))
    squares = by_joint(strides["rms_error"] ** 2)
    per_joint = {
        "peak_error": _array(joints.sel(name="peak_error"), "joint"),
        "felt_peak_error": _array(joints.sel(name="felt_peak_error"), "joint"),
        "rms_error": _array(squares, "joint"),
    }
    scalars = {
        name: _array(strides[name])
        for name in ("upright", "mean_speed", "apex", "duration", "learning")
    }
    stance = strides[["feedback", "feedforward"]].sel(part="stance")
    torques = {str(name): _array(stance[name], "phase", "joint") for name in stance}
    skipped = _array(strides["skipped"]) if "skipped" in strides else None
    spent, switched = effort(strides), _switched(strides)
    rows, others = [], [row for metric in own_metrics for row in metric.rows(strides)]
    for k, speed in enumerate(strides["speed"].to_numpy()):
        count = int(strides["count"][k])
        learning = scalars["learning"][k, :count] == 1
        last = int(_steady_count(count, switched[k, :count].sum()))
        last_strides = slice(count - last, max(count, 1))  # without any, one of NaN
        planned = {"mean_speed": speed, "apex": float(strides["planned_apex"][k])}
        metrics = [
            *_errors({name: values[k, last_strides] for name, values in per_joint.items()}),
            *_motion({name: values[k, last_strides] for name, values in scalars.items()}, planned),
            (
                "-",
                "feedback_share",
                _share(*(torques[name][k, last_strides] for name in torques)),
                "1",
            ),
            *(("-", name, values[k], unit) for name, (values, unit) in spent.items()),
            *_settling(per_joint["peak_error"][k, :count], learning),
            *_growth(per_joint["peak_error"][k, :count][learning]),
            *(_lessons(skipped[k, :count][learning]) if skipped is not None else ()),
            *(row for robot, row in others if robot == k),
        ]
        rows += [
            {**settings, "speed": float(speed), **dict(zip(COLUMNS[-4:], row, strict=True))}
            for row in metrics
        ]
    return pd.DataFrame(rows)[COLUMNS].sort_values(KEYS, ignore_index=True)


_Row: TypeAlias = tuple[str, str, float, str]
"""Joint, metric, value, unit."""


def _array(values: xr.DataArray, *trailing: str) -> Array:
    """Values as (speed, stride, ...)."""
    return np.asarray(values.transpose("speed", "stride", *trailing).to_numpy())


def _errors(end: Mapping[str, Array]) -> Iterator[_Row]:
    """Errors of one robot from its steady strides, each (strides, 3)."""
    for j, joint in enumerate(JOINTS):
        yield joint, "peak_error", float(end["peak_error"][:, j].mean()), "rad"
        yield joint, "rms_error", float(np.sqrt(end["rms_error"][:, j].mean())), "rad"
        yield joint, "felt_peak_error", float(end["felt_peak_error"][:, j].mean()), "rad"


def _motion(end: Mapping[str, Array], planned: Mapping[str, float]) -> Iterator[_Row]:
    """Metrics of the motion of one robot from its steady strides, each (strides,)."""
    yield "-", "upright", float(end["upright"].min()), "1"
    yield "-", "speed_error", float(end["mean_speed"].mean() - planned["mean_speed"]), "m/s"
    yield "-", "apex_error", float(end["apex"].mean() - planned["apex"]), "m"
    yield "-", "apex_deviation", float(end["apex"].std()), "m"
    yield "-", "stride_duration", float(end["duration"].mean()), "s"


def _settling(peaks: Array, learning: BoolArray) -> Iterator[_Row]:
    """Strides until the learning of one robot has settled, from its peaks (strides, 3)."""
    if learning.any():
        counts = [_converged(peaks[:, j], learning) for j in range(1, len(JOINTS))]
        for joint, count in zip((*JOINTS[1:], "-"), (*counts, np.max(counts)), strict=True):
            yield joint, "strides_to_converge", float(count), "1"


def _growth(peaks: Array) -> Iterator[_Row]:
    """How far the errors of one robot came up again while it learned, from its peaks (n, 3)."""
    if len(peaks) < 2 * _WINDOW:
        return
    means = sliding_window_view(peaks[:, 1:], _WINDOW, axis=0).mean(axis=-1)  # thigh, calf
    last, least = means[-1], means.min(axis=0)
    grown = (last > GROWTH * least) & (last - least > GROWN)
    yield "-", "error_growth", float(np.max(last / least)), "1"
    yield "-", "diverging", float(grown.any()), "1"


def _lessons(reasons: Array) -> Iterator[_Row]:
    """Strides of learning of one robot, and how many of them taught nothing, by the reason."""
    if reasons.size:
        yield "-", "strides_of_learning", float(reasons.size), "1"
    for number in np.unique(reasons[reasons > 0]):
        name = SKIPPED[int(number)].replace(" ", "_")
        yield "-", f"skipped_{name}", float(np.count_nonzero(reasons == number)), "1"


def feedback_share(strides: xr.Dataset) -> float:
    """Feedback's share `rms(fb) / (rms(fb) + rms(ff))`; NaN where there is no torque at all."""
    return _share(strides["feedback"].to_numpy(), strides["feedforward"].to_numpy())


def _share(feedback: Array, feedforward: Array) -> float:
    if not (np.isfinite(feedback).any() and np.isfinite(feedforward).any()):
        return float("nan")
    one, other = (float(np.sqrt(np.nanmean(part**2))) for part in (feedback, feedforward))
    return one / (one + other) if one + other > 0.0 else float("nan")


def strides_to_converge(strides: xr.Dataset, joint: str) -> float:
    """Count the strides of learning until the peak error reaches its final level for good.

    The first stride k with `p_j <= p_end + SETTLED (p_before - p_end)` for all j >= k: peak errors
    p (means over the legs) between the steady states before learning and at the end. NaN if
    learning did not improve the error, or if there were no strides before it.

    Args:
        strides: The strides of one robot.
        joint: "thigh" or "calf".
    """
    count = int(strides["count"])
    peak = by_joint(strides["peak_error"]).sel(joint=joint).to_numpy()[:count]
    return _converged(peak, strides["learning"].to_numpy()[:count] == 1)


def _converged(peak: Array, learning: BoolArray) -> float:
    start = int(np.argmax(learning))
    if start == 0:
        return float("nan")
    before = float(np.mean(peak[:start][-STEADY_STRIDES:]))
    final = float(np.mean(peak[start:][-STEADY_STRIDES:]))
    return settling_stride(peak[start:], before, final)


def settling_stride(peak: Array, before: float, final: float) -> float:
    """Number of the stride (1 is the first) from which on peaks have settled; NaN if never."""
    if not final < (1.0 - LEAST_IMPROVEMENT) * before or peak.size == 0:
        return float("nan")
    outside = np.flatnonzero(peak > final + SETTLED * (before - final))
    if outside.size == 0:
        return 1.0
    return float(outside[-1] + 2) if outside[-1] + 1 < peak.size else float("nan")


def peak_history(strides: xr.Dataset) -> PeakHistory:
    """Read a simulation's `PeakHistory`."""
    names = ("robot", "base", "scenario", "controller")
    peaks = by_joint(strides["peak_error"]).sel(joint=list(JUDGED))
    peaks = peaks.transpose("speed", "stride", "joint")
    level = by_joint(steady(strides)["peak_error"]).mean("stride").sel(joint=list(JUDGED))
    count = strides["count"].to_numpy()
    on = strides["learning"].to_numpy() == 1
    return PeakHistory(
        {**{name: strides.attrs[name] for name in names}, "seed": int(strides.attrs["seed"])},
        strides["speed"].to_numpy(),
        tuple(peaks.to_numpy()[k, : count[k]][on[k, : count[k]]] for k in range(len(count))),
        level.transpose("speed", "joint").to_numpy(),
        strides["upright"].transpose("speed", "stride").min("stride").to_numpy()
        if strides.sizes["stride"]
        else np.full(len(count), np.nan),
    )


def reduction(summary: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Reduction `1 - e / e_PD` of an error, on the same scenario, speed, seed and joint.

    Returns:
        The rows of the other controllers with their `value` replaced by `1 - value / PD`.
    """
    instance_of("summary", summary, pd.DataFrame, "the table of Results.summary()")
    known_name("metric", metric, sorted(set(summary["metric"])))
    rows = summary[summary["metric"] == metric]
    keys = [key for key in KEYS if key != "controller"]
    pd_rows = rows[rows["controller"] == "pd"].set_index(keys)["value"]
    others = rows[rows["controller"] != "pd"].copy()
    against = pd_rows.reindex(pd.MultiIndex.from_frame(others[keys])).to_numpy()
    others["value"] = 1.0 - others["value"].to_numpy() / against
    others["unit"] = "1"
    return others


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
    # As arrays: reports ask for hundreds of these tables.
    columns = {name: rows[name].to_numpy() for name in ("scenario", "seed", "speed", "value")}
    metrics = rows["metric"].to_numpy()
    values = _pivot(columns, (metrics == metric) & (rows["joint"].to_numpy() == joint))
    if metric == "upright":
        return values
    upright = _pivot(columns, metrics == "upright").reindex_like(values)
    return values.where(upright != 0.0)


def _pivot(columns: Mapping[str, Any], chosen: BoolArray) -> pd.DataFrame:
    """Values of the rows that are chosen, a row a unit, a column a speed; NaN where there is none.

    Raises:
        ValueError: There are two of a robot.
    """
    scenario, seed, speed, value = (columns[name][chosen] for name in columns)
    names = list(zip(scenario, seed, strict=True))
    units, speeds = sorted(set(names)), np.unique(speed.astype(float))
    place = {unit: k for k, unit in enumerate(units)}
    at = np.array([place[name] for name in names], dtype=int), np.searchsorted(speeds, speed)
    if len(set(zip(*at, strict=True))) < len(names):
        raise ValueError("two values of a robot")
    table = np.full((len(units), len(speeds)), np.nan)
    table[at] = value
    index = [[unit[k] for unit in units] for k in (0, 1)]
    return pd.DataFrame(
        table,
        pd.MultiIndex.from_arrays(index, names=["scenario", "seed"]),
        pd.Index(speeds, name="speed"),
    )
