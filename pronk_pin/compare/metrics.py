"""From strides to the summary: one long table, a row a number."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from .._typing import Array
from ..robot import JOINTS

STEADY_STRIDES = 30
"""Strides at the end of a simulation that count as steady state (paper, section III.B)."""

SETTLED = 0.1
"""Learning has settled where this share of the improvement, or less, is still missing."""

KEYS = ["robot", "base", "scenario", "speed", "controller", "seed", "joint", "metric"]
COLUMNS = [*KEYS, "value", "unit"]
"""Columns of the summary; rows are sorted by the keys."""


def steady(strides: xr.Dataset) -> xr.Dataset:
    """The last `STEADY_STRIDES` finished strides of each speed, renumbered from 0.

    Where a law learned, none from before it was switched on: fewer, then, after a short learning.
    """
    count = strides["count"].to_numpy()
    learned = (strides["learning"] == 1).sum("stride").to_numpy()
    last = min(STEADY_STRIDES, int(np.where(learned > 0, learned, count).min()))
    offset = xr.DataArray(np.arange(last), dims="stride")
    start = xr.DataArray(count - last, dims="speed", coords={"speed": strides["speed"]})
    return strides.isel(stride=start + offset)


def by_joint(values: xr.DataArray) -> xr.DataArray:
    """Mean over the four legs: the axis `joint` of twelve becomes one of hip, thigh, calf."""
    kind = [str(name).split("_")[1] for name in values["joint"].to_numpy()]
    return values.assign_coords(joint=kind).groupby("joint").mean().sel(joint=list(JOINTS))


def summarize(strides: xr.Dataset) -> pd.DataFrame:
    """The summary of one simulation.

    Per joint (mean over the legs and the steady strides):
        peak_error: Peak of the stance error against the unmodified reference [rad].
        rms_error: Its root mean square [rad].
        contact_error: The peak counted from the contact on, two ticks before it is felt [rad].
        strides_to_converge: See `strides_to_converge`; thigh and calf, and `-` for the later one.
    Per robot:
        upright: 1 if it never fell.
        speed_error, apex_error: Steady mean minus the gait's [m/s], [m].
        apex_deviation: Standard deviation of the apex over the steady strides [m].
        stride_duration: Mean duration of a stride [s].
        feedback_share: Feedback's share of the torque in stance, as root mean squares.

    Args:
        strides: What `Simulation` recorded, as `compare.results` stores it.
    """
    settings = {key: strides.attrs[key] for key in ("robot", "base", "scenario", "controller")}
    settings["seed"] = int(strides.attrs["seed"])
    rows = [
        {**settings, "speed": float(speed), **row}
        for k, speed in enumerate(strides["speed"].to_numpy())
        for row in _rows(strides, k)
    ]
    return pd.DataFrame(rows)[COLUMNS].sort_values(KEYS, ignore_index=True)


def _rows(strides: xr.Dataset, k: int) -> Iterator[dict[str, object]]:
    """Rows of the robot number k."""
    mine = strides.isel(speed=[k])
    end = steady(mine).isel(speed=0)

    def row(metric: str, value: object, unit: str, joint: str = "-") -> dict[str, object]:
        return {"joint": joint, "metric": metric, "value": float(value), "unit": unit}  # type: ignore[arg-type]

    peak = by_joint(end["peak_error"]).mean("stride")
    rms = by_joint(end["rms_error"] ** 2).mean("stride") ** 0.5
    contact = by_joint(end["contact_error"]).mean("stride")
    for joint in JOINTS:
        yield row("peak_error", peak.sel(joint=joint), "rad", joint)
        yield row("rms_error", rms.sel(joint=joint), "rad", joint)
        yield row("contact_error", contact.sel(joint=joint), "rad", joint)
    yield row("upright", end["upright"].min(), "1")
    yield row("speed_error", end["mean_speed"].mean() - end["speed"], "m/s")
    yield row("apex_error", end["apex"].mean() - end["planned_apex"], "m")
    yield row("apex_deviation", end["apex"].std(), "m")
    yield row("stride_duration", end["duration"].mean(), "s")
    yield row("feedback_share", feedback_share(end.sel(part="stance")), "1")
    if bool((mine["learning"] == 1).any()):
        settled = {joint: strides_to_converge(mine.isel(speed=0), joint) for joint in JOINTS[1:]}
        for joint, count in settled.items():
            yield row("strides_to_converge", count, "1", joint)
        yield row("strides_to_converge", np.max(list(settled.values())), "1")


def feedback_share(strides: xr.Dataset) -> float:
    """RMS of the feedback torque over the sum of both RMS; NaN where there is no torque at all."""
    feedback = float(np.sqrt((strides["feedback"] ** 2).mean()))
    feedforward = float(np.sqrt((strides["feedforward"] ** 2).mean()))
    total = feedback + feedforward
    return feedback / total if total > 0.0 else float("nan")


def strides_to_converge(strides: xr.Dataset, joint: str) -> float:
    """Strides of learning until the peak error is down to its final level, and stays there.

    The first stride from which on every peak error (mean over the legs) misses at most `SETTLED` of
    the improvement between the steady states before learning and at the end. NaN if learning did
    not improve the error, or if there were no strides before it.

    Args:
        strides: The strides of one robot.
        joint: "thigh" or "calf".
    """
    peak = by_joint(strides["peak_error"]).sel(joint=joint).to_numpy()
    peak = peak[: int(strides["count"])]
    learning = strides["learning"].to_numpy()[: len(peak)] == 1
    start = int(np.argmax(learning))
    if start == 0:
        return float("nan")
    before = float(np.mean(peak[:start][-STEADY_STRIDES:]))
    final = float(np.mean(peak[start:][-STEADY_STRIDES:]))
    return settling_stride(peak[start:], before, final)


def settling_stride(peak: Array, before: float, final: float) -> float:
    """Number of strides (1 is the first) after which the peaks have settled; NaN if never."""
    if not final < before or peak.size == 0:
        return float("nan")
    outside = np.flatnonzero(peak > final + SETTLED * (before - final))
    if outside.size == 0:
        return 1.0
    return float(outside[-1] + 2) if outside[-1] + 1 < peak.size else float("nan")


def reduction(summary: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Relative reduction of an error against PD, on the same scenario, speed, seed and joint.

    Returns:
        The rows of the other controllers with their `value` replaced by `1 - value / PD`.
    """
    rows = summary[summary["metric"] == metric]
    keys = [key for key in KEYS if key != "controller"]
    pd_rows = rows[rows["controller"] == "pd"].set_index(keys)["value"]
    others = rows[rows["controller"] != "pd"].copy()
    against = pd_rows.reindex(pd.MultiIndex.from_frame(others[keys])).to_numpy()
    others["value"] = 1.0 - others["value"].to_numpy() / against
    others["unit"] = "1"
    return others
