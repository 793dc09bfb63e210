"""Metrics of commanded speeds: a row of the summary a number, by command instead of by speed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
import xarray as xr

from ..._typing import Array
from ...control import SpeedProfile
from ...robot import JOINTS
from .metrics import by_joint
from .own_metrics import Metric

COMMAND_KEYS = ["robot", "base", "scenario", "command", "controller", "seed", "joint", "metric"]
COMMAND_COLUMNS = [*COMMAND_KEYS, "value", "unit"]
"""Columns of the summary; rows are sorted by the keys."""

STARTED = 2.0
"""Time after which the start is over [s], at most half of the command."""


def stride_table(strides: xr.Dataset) -> pd.DataFrame:
    """The strides of robots whose speed is commanded, as far as their commands go, in one table.

    Args:
        strides: What `Simulation` recorded.

    Returns:
        A row for each command and stride: `controller`, `command`, `time` of touchdown [s],
        `commanded`, `gait_speed` and mean `speed` of the trunk [m/s], peak stance errors `hip`,
        `thigh` and `calf` from the true contact on, means over the legs [rad], `feedback_share` of
        the torque in stance, whether the robot is `upright`, and whether the stride `counts`:
        those of the first `STARTED` seconds do not.
    """
    peaks = by_joint(strides["peak_error"]).transpose("command", "stride", "joint").to_numpy()
    tables = []
    for k, command in enumerate(strides["command"].values):
        count, ends = int(strides["count"][k]), SpeedProfile.parse(str(command)).duration
        own = strides.isel(command=k, stride=slice(0, count))
        table = pd.DataFrame(
            {
                "controller": strides.attrs["controller"],
                "command": str(command),
                "time": own["start"].to_numpy(),
                "commanded": own["commanded"].to_numpy(),
                "gait_speed": own["gait_speed"].to_numpy(),
                "speed": own["mean_speed"].to_numpy(),
                **{joint: peaks[k, :count, j] for j, joint in enumerate(JOINTS)},
                "feedback_share": _feedback_shares(own),
                "upright": own["upright"].to_numpy() == 1.0,
            }
        )
        table["counts"] = table["time"] >= min(STARTED, 0.5 * ends)
        tables.append(table[table["time"] < ends])
    return pd.concat(tables, ignore_index=True)


def _feedback_shares(strides: xr.Dataset) -> Array:
    """Feedback's share `rms(fb) / (rms(fb) + rms(ff))` of the torque in each stance, (strides,)."""
    one, other = (
        np.sqrt((strides[name].sel(part="stance") ** 2).mean(("phase", "joint")).to_numpy())
        for name in ("feedback", "feedforward")
    )
    return np.asarray(one / np.maximum(one + other, 1e-12))


def summarize_commands(strides: xr.Dataset, own_metrics: Sequence[Metric] = ()) -> pd.DataFrame:
    """Compute the summary of one simulation of commanded speeds.

    Over the strides that count in `stride_table`, with peaks of the stance error as in `summarize`:

    Per joint (mean over the legs):
        peak_error: Mean of the peaks [rad].
        worst_peak_error: Greatest of them [rad].
    Per robot:
        speed_error: Root mean square of the trunk's mean speed less the commanded one [m/s].
        feedback_share: Mean over the strides.
        upright: 1 if it never fell; NaN, as all the others, if it finished no stride.

    Args:
        strides: What `Simulation` recorded.
        own_metrics: Others than these.
    """
    settings = {key: strides.attrs[key] for key in ("robot", "base", "scenario", "controller")}
    settings["seed"] = int(strides.attrs["seed"])
    table, own = stride_table(strides), [row for each in own_metrics for row in each.rows(strides)]
    rows = []
    for k, command in enumerate(map(str, strides["command"].values)):
        metrics = [
            *_of_a_robot(table[table["command"] == command]),
            *(row for robot, row in own if robot == k),
        ]
        rows += [
            {**settings, "command": command, **dict(zip(COMMAND_COLUMNS[-4:], row, strict=True))}
            for row in metrics
        ]
    return pd.DataFrame(rows)[COMMAND_COLUMNS].sort_values(COMMAND_KEYS, ignore_index=True)


def _of_a_robot(strides: pd.DataFrame) -> Iterator[tuple[str, str, float, str]]:
    """Joint, metric, value, unit."""
    there = strides[strides["counts"]]
    for joint in JOINTS:
        yield joint, "peak_error", float(there[joint].mean()), "rad"
        yield joint, "worst_peak_error", float(there[joint].max()), "rad"
    lacking = there["speed"] - there["commanded"]
    yield "-", "speed_error", float(np.sqrt((lacking**2).mean())), "m/s"
    yield "-", "feedback_share", float(there["feedback_share"].mean()), "1"
    yield "-", "upright", float(strides["upright"].astype(float).min()), "1"
