"""The strides of a simulation as a labelled dataset; `quantities` has the names and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from ..._typing import Array
from ...control import PARTS, SKIPPED, SpeedCommand, TorqueLibrary, phase_grid
from ...gait import Gait
from ...robot import Robot
from .log import StrideLog
from .quantities import (
    COMMAND_QUANTITIES,
    CONDITION_QUANTITIES,
    GAIT_QUANTITIES,
    LABELS,
    SAMPLES,
    STRIDE_QUANTITIES,
    TICK_QUANTITIES,
    Quantity,
)


def to_dataset(
    log: StrideLog,
    robot: Robot,
    gaits: Sequence[Gait],
    *,
    attributes: Mapping[str, str | int | float],
    command: SpeedCommand | None = None,
    library: TorqueLibrary | None = None,
) -> xr.Dataset:
    """Label the strides of a simulation.

    Dimensions: `speed`, `stride` (from 0), `part` ("stance", "flight"), `phase` (t / T of the
    reference, 0 to 1), `joint` (by name, in Pinocchio's order), `axis` (x, z), `rotation` (roll,
    pitch, heading). Unfinished strides are cut off. Variables that begin with `tick_` hold the last
    strides at every tick (`tick`, of `tick` times the attribute `timestep`; `foot`, `direction`),
    NaN after the end of a part; a
    state is that before the tick, a torque and a force act during it.

    Where speeds are commanded, the dimension `command` takes the place of `speed`, with the
    profiles as they are written, and what is of a gait has the dimension `stride` too. Where the
    conditions of a torque library are estimated, these are the dimension `condition`.
    """
    last = int(log.count.max(initial=0))
    robots, given, quantities = _robots(gaits, command)
    conditions = () if library is None else tuple(library.conditions)
    if conditions:
        quantities = (*quantities, *CONDITION_QUANTITIES)
    values = {
        "count": log.count,
        **{name: log[name][:, :last] for name in log.names},
        **log.ticks(),
        **(_planned(gaits) if command is None else _planned_by_stride(log, command, last)),
    }
    labels = {dimension: list(names) for dimension, names in LABELS.items()}
    dataset = xr.Dataset(
        {
            quantity.name: (
                [robots if name == "speed" else name for name in quantity.dimensions],
                values[quantity.name],
            )
            for quantity in quantities
        },
        coords={
            robots: given,
            "stride": np.arange(last),
            "part": labels["part"],
            "phase": ("phase", phase_grid(SAMPLES), {"units": "1"}),
            **robot.joint_coordinates,
            "axis": labels["axis"],
            "rotation": labels["rotation"],
            "foot": list(robot.legs),
            "direction": labels["direction"],
            **({"condition": list(conditions)} if conditions else {}),
        },
        attrs=dict(attributes),
    )
    finished = dataset["stride"] < dataset["count"]
    for quantity in quantities:
        if "stride" in quantity.dimensions:
            dataset[quantity.name] = dataset[quantity.name].where(finished)
        names = {"units": quantity.unit, "long_name": quantity.long_name}
        dataset[quantity.name].attrs.update(names)
    dataset["skipped"].attrs.update(
        flag_values=list(range(len(SKIPPED))),
        flag_meanings=" ".join(reason.replace(" ", "_") for reason in SKIPPED),
    )
    return dataset


def _robots(
    gaits: Sequence[Gait], command: SpeedCommand | None
) -> tuple[str, tuple[str, list[Any], dict[str, str]], tuple[Quantity, ...]]:
    """What robots are told apart by: dimension and coordinate; and what is known of them."""
    if command is None:
        speeds = [gait.speed for gait in gaits]
        quantities: tuple[Quantity, ...] = (
            *GAIT_QUANTITIES,
            *STRIDE_QUANTITIES,
            *TICK_QUANTITIES,
        )
        return "speed", ("speed", speeds, {"units": "m/s"}), quantities
    profiles = [str(profile) for profile in command.profiles]
    changing = (
        replace(quantity, dimensions=("speed", "stride", *quantity.dimensions[1:]))
        for quantity in GAIT_QUANTITIES
        if quantity.name != "count"
    )
    count = next(quantity for quantity in GAIT_QUANTITIES if quantity.name == "count")
    quantities = (count, *changing, *COMMAND_QUANTITIES, *STRIDE_QUANTITIES, *TICK_QUANTITIES)
    return "command", ("command", profiles, {}), quantities


def _planned(gaits: Sequence[Gait]) -> dict[str, Any]:
    """What is of a gait, where each robot has its own."""
    parts = [[getattr(gait, part) for part in PARTS] for gait in gaits]
    grid = phase_grid(SAMPLES)
    return {
        "planned_apex": [gait.apex for gait in gaits],
        "planned_duration": [[part.duration for part in gait] for gait in parts],
        "reference": np.array([[part.joint_reference(grid)[0] for part in own] for own in parts]),
    }


def _planned_by_stride(log: StrideLog, command: SpeedCommand, last: int) -> dict[str, Array]:
    """What is of a gait, where it changes: the stance's gait is the one before's landing."""
    speeds = np.stack([log["gait_speed"][:, :last], log["landing_speed"][:, :last]], axis=-1)
    there = np.isfinite(speeds)
    each, place = np.unique(speeds[there], return_inverse=True)
    gaits, grid = command.gaits_at(each), phase_grid(SAMPLES)
    part = np.nonzero(there)[-1]  # 0 in stance, 1 in flight
    apex, duration = np.full((2, *speeds.shape), np.nan)
    reference = np.full((*speeds.shape, *log["error"].shape[3:]), np.nan, np.float32)
    parts = [[getattr(gait, name) for name in PARTS] for gait in gaits]
    curves = np.array([[own.joint_reference(grid)[0] for own in gait] for gait in parts])
    curves = curves.reshape(-1, *reference.shape[2:])
    lasts = np.array([[own.duration for own in gait] for gait in parts]).reshape(-1, len(PARTS))
    apex[there] = np.array([gait.apex for gait in gaits])[place]
    duration[there], reference[there] = lasts[place, part], curves[place, part]
    return {"planned_apex": apex[..., 0], "planned_duration": duration, "reference": reference}
