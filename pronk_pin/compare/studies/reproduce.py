"""Reproduction of the paper's Table I row by row, and candidates for its error metric.

The paper tabulates "tracking errors" in radians and does not say how they are taken. Every reading
below is a number that could stand in such a table; the nearest one is the most likely.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import xarray as xr

from ...robot import JOINTS
from ..metrics import by_joint, mean_interval, of_first_leg, robots, steady, table_1
from ..report import SHOWN, number
from ..results import Results

_SETTLED = 0.05
"""Time after which the touchdown transient is over [s]."""

VARIABLES = (
    *("count", "start", "learning", "planned_duration", "error"),
    *("peak_error", "rms_error", "felt_peak_error", "upright"),
)
"""Variables of the strides that the readings take."""


def _legs(values: xr.DataArray) -> xr.DataArray:
    return by_joint(values).mean("stride")


def _front_left(values: xr.DataArray) -> xr.DataArray:
    """The leg of the paper's Fig. 3."""
    joints = values.sel(joint=[of_first_leg(values, joint) for joint in JOINTS])
    return joints.assign_coords(joint=list(JOINTS)).mean("stride")


def _late(end: xr.Dataset) -> xr.DataArray:
    stance = end["planned_duration"].sel(part="stance")
    return end["error"].where(end["phase"] * stance > _SETTLED)


def _middle(end: xr.Dataset) -> xr.DataArray:
    return abs(end["error"].sel(phase=0.5, method="nearest"))


READINGS: dict[str, Callable[[xr.Dataset], xr.DataArray]] = {
    "peak, mean over legs and strides": lambda end: _legs(end["peak_error"]),
    "peak of the front left leg": lambda end: _front_left(end["peak_error"]),
    "largest peak of any stride": lambda end: by_joint(end["peak_error"]).max("stride"),
    "peak of the mean stride": lambda end: by_joint(abs(end["error"].mean("stride")).max("phase")),
    "peak after the first 50 ms": lambda end: _legs(abs(_late(end)).max("phase")),
    "error in the middle of stance": lambda end: _legs(_middle(end)),
    "peak from when it is felt": lambda end: _legs(end["felt_peak_error"]),
    "RMS": lambda end: _legs(end["rms_error"]),
    "mean magnitude": lambda end: _legs(abs(end["error"]).mean("phase")),
}
"""Ways to make one number of the stance errors of the steady strides, by speed and joint."""


def row_by_row(summary: pd.DataFrame, *, scenario: str, learner: str = "ilc") -> pd.DataFrame:
    """Table I: the paper's value, our peak with its interval over the seeds, and our RMS.

    Args:
        summary: The summary of a result that holds `pd` and the learner.
        scenario: The scenario.
        learner: The controller that stands for the paper's ILC.

    Returns:
        Rows by joint, controller and speed; columns `paper`, `peak`, `peak_low`, `peak_high`,
        `rms` [rad]; intervals are NaN with one seed, and all of ours where no robot stayed up.
    """
    printed = _printed()
    rows = []
    for joint in SHOWN:
        for paper, ours in (("pd", "pd"), ("ilc", learner)):
            peaks, squares = (
                robots(summary, scenario=scenario, controller=ours, metric=metric, joint=joint)
                for metric in ("peak_error", "rms_error")
            )
            for speed in peaks.columns:
                interval = mean_interval(peaks[[speed]])
                rows.append(
                    {
                        "joint": joint,
                        "controller": paper,
                        "speed": speed,
                        "paper": printed.get((joint, paper, speed), np.nan),
                        "peak": interval.value,
                        "peak_low": interval.low,
                        "peak_high": interval.high,
                        "rms": float(squares[speed].mean()),
                    }
                )
    return pd.DataFrame(rows).set_index(["joint", "controller", "speed"]).sort_index()


def _printed() -> pd.Series:
    """The paper's Table I by joint, controller and speed [rad]."""
    return table_1().set_index(["joint", "controller", "speed"])["value"].sort_index()


def readings(results: Results, *, learners: tuple[str, ...]) -> pd.DataFrame:
    """Evaluate every reading of "tracking error" under PD and the learning laws.

    Read are the robots that stayed up.

    Returns:
        Rows by learner and reading; columns by joint and `pd` or `ilc`: the mean [rad], and
        `distance`: root mean square of ln(ours / paper) over speeds, joints and both controllers.
        NaN without any robot.
    """
    printed = _printed()
    values = {name: _read(results, name) for name in ("pd", *learners)}
    rows = []
    for learner in learners:
        for reading in READINGS:
            row: dict[str, object] = {"learner": learner, "reading": reading}
            ratios = []
            for joint in SHOWN:
                for paper, ours in (("pd", "pd"), ("ilc", learner)):
                    values_of = values[ours][reading].sel(joint=joint)
                    row[f"{joint} {paper}"] = float(values_of.mean())
                    for speed, value in zip(
                        values_of["speed"].to_numpy(), values_of.values, strict=True
                    ):
                        if (joint, paper, speed) in printed.index and np.isfinite(value):
                            ratios.append(np.log(value / printed[joint, paper, speed]))
            row["distance"] = float(np.sqrt(np.mean(np.square(ratios)))) if ratios else float("nan")
            rows.append(row)
    return pd.DataFrame(rows).set_index(["learner", "reading"]).sort_values("distance")


def _read(results: Results, controller: str) -> dict[str, xr.DataArray]:
    """All readings of a controller, by speed and joint, means over its seeds."""
    by_reading: dict[str, list[xr.DataArray]] = {name: [] for name in READINGS}
    for cell in results.experiment.cells():
        if cell.controller == controller:
            strides = results.strides(cell, VARIABLES)
            strides["error"] = strides["error"].sel(part="stance")
            stayed = strides["upright"].min("stride") == 1
            end = steady(strides)
            for name, read in READINGS.items():
                by_reading[name].append(read(end).where(stayed))
    return {name: xr.concat(parts, "seed").mean("seed") for name, parts in by_reading.items()}


def format_reproduction(results: Results, *, learners: tuple[str, ...]) -> str:
    """Table I row by row, and the readings, as text for a terminal."""
    scenario = results.experiment.scenario_names[0]
    summary = results.summary()
    parts = [_format_rows(row_by_row(summary, scenario=scenario), "ILC")]
    for other in learners[1:]:
        rows = row_by_row(summary, scenario=scenario, learner=other)
        means = rows.xs("ilc", level="controller").groupby("joint")[["paper", "peak", "rms"]].mean()
        parts.append(
            f"{other}: mean peak "
            + ", ".join(
                f"{number(means.loc[joint, 'peak'], '.3f')} rad {joint} (paper "
                f"{means.loc[joint, 'paper']:.3f})"
                for joint in SHOWN
            )
        )
    down = summary[(summary["metric"] == "upright") & (summary["value"] != 1.0)]
    if len(down):
        counted = ", ".join(
            f"{n} under {name}" for name, n in down["controller"].value_counts().items()
        )
        parts.append(f"Robots that did not stay up are in no number: {counted}.")
    parts.append(_format_readings(readings(results, learners=learners)))
    return "\n\n".join(parts)


def _format_rows(table: pd.DataFrame, name: str) -> str:
    lines = []
    for joint in SHOWN:
        lines += [
            f"{joint} [rad]: peak stance error, with its 95 % interval over the seeds",
            f"{'speed':>6}  {'PD: paper':>9} {'ours':>6} {'interval':>16} {'RMS':>6}   "
            f"{f'{name}: paper':>10} {'ours':>6} {'interval':>16} {'RMS':>6}",
        ]
        pd_, learned = (table.loc[(joint, controller)] for controller in ("pd", "ilc"))
        lines += [
            f"{speed:6.1f}  {_cells(pd_.loc[speed]):>40}   {_cells(learned.loc[speed]):>41}"
            for speed in pd_.index
        ]
        mean = "  ".join(
            f"paper {part['paper'].mean():.3f}, ours {number(part['peak'].mean(), '.3f')}, RMS "
            f"{number(part['rms'].mean(), '.3f')};"
            for part in (pd_, learned)
        )
        both = pd_["peak"].notna() & learned["peak"].notna()
        less = [
            number(1 - learned[both][column].mean() / pd_[both][column].mean(), ".0%")
            for column in ("paper", "peak")
        ]
        compared = f"less by {less[0]} in the paper, {less[1]} here"
        lines.append(f"  mean  {mean}  {compared if both.any() else 'nothing to compare'}\n")
    return "\n".join(lines).rstrip()


def _cells(row: pd.Series) -> str:
    interval = f"{row['peak_low']:.4f} to {row['peak_high']:.4f}"
    interval = interval if np.isfinite(row["peak_low"]) else "-"
    return (
        f"{number(row['paper'], '.3f'):>9} {number(row['peak'], '.3f'):>6} {interval:>16} "
        f"{number(row['rms'], '.3f'):>6}"
    )


def _format_readings(table: pd.DataFrame) -> str:
    names = ["calf pd", "calf ilc", "thigh pd", "thigh ilc"]
    printed = table_1().groupby(["joint", "controller"])["value"].mean()
    paper = [printed[tuple(name.split())] for name in names]
    lines = [
        "Which metric could be meant: means over the speeds [rad], the nearest first; the distance",
        "is the root mean square of ln(ours / paper) over speeds, joints, PD and ILC",
        f"{'':>12} {'':>34}" + "".join(f"{name:>10}" for name in names) + f"{'distance':>10}",
        f"{'':>12} {'the paper':>34}" + "".join(f"{value:10.3f}" for value in paper),
    ]
    for (learner, reading), row in table.iterrows():
        cells = "".join(f"{number(row[name], '.3f'):>10}" for name in names)
        lines.append(f"{learner:>12} {reading:>34}{cells}{number(row['distance'], '.2f'):>10}")
    return "\n".join(lines)
