"""The strides of a simulation as a labelled dataset; `quantities` has the names and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from ...control import PARTS, SKIPPED, phase_grid
from ...gait import Gait
from ...robot import Robot
from .log import StrideLog
from .quantities import GAIT_QUANTITIES, LABELS, SAMPLES, STRIDE_QUANTITIES, TICK_QUANTITIES


def to_dataset(
    log: StrideLog,
    robot: Robot,
    gaits: Sequence[Gait],
    *,
    attributes: Mapping[str, str | int | float],
) -> xr.Dataset:
    """Label the strides of a simulation.

    Dimensions: `speed`, `stride` (from 0), `part` ("stance", "flight"), `phase` (t / T of the
    reference, 0 to 1), `joint` (by name, in Pinocchio's order), `axis` (x, z), `rotation` (roll,
    pitch, heading). Unfinished strides are cut off. Variables that begin with `tick_` hold the last
    strides at every tick (`tick`, of `tick` times the attribute `timestep`; `foot`, `direction`),
    NaN after the end of a part; a
    state is that before the tick, a torque and a force act during it.
    """
    last = int(log.count.max(initial=0))
    grid = phase_grid(SAMPLES)
    parts = [[getattr(gait, part) for part in PARTS] for gait in gaits]
    reference = [[part.joint_reference(grid)[0] for part in gait] for gait in parts]
    values = {
        "count": log.count,
        "planned_apex": [gait.apex for gait in gaits],
        "planned_duration": [[part.duration for part in gait] for gait in parts],
        "reference": np.array(reference),
        **{quantity.name: log[quantity.name][:, :last] for quantity in STRIDE_QUANTITIES},
        **log.ticks(),
    }
    quantities = (*GAIT_QUANTITIES, *STRIDE_QUANTITIES, *TICK_QUANTITIES)
    labels = {dimension: list(names) for dimension, names in LABELS.items()}
    dataset = xr.Dataset(
        {quantity.name: (quantity.dimensions, values[quantity.name]) for quantity in quantities},
        coords={
            "speed": ("speed", [gait.speed for gait in gaits], {"units": "m/s"}),
            "stride": np.arange(last),
            "part": labels["part"],
            "phase": ("phase", grid, {"units": "1"}),
            **robot.joint_coordinates,
            "axis": labels["axis"],
            "rotation": labels["rotation"],
            "foot": list(robot.legs),
            "direction": labels["direction"],
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
