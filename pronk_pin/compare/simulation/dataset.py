"""The strides of a simulation as a labelled dataset: names, dimensions, units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import xarray as xr

from ...control import PARTS, SKIPPED, phase_grid
from ...gait import Gait
from ...robot import Robot
from .log import SAMPLES, StrideLog

_Variable: TypeAlias = tuple[tuple[str, ...], npt.NDArray[np.floating[Any]]]

_UNITS = {
    "count": ("1", "finished strides"),
    "start": ("s", "time of touchdown, from the first one on"),
    "duration": ("s", "from touchdown to touchdown"),
    "stance": ("s", "duration of stance"),
    "mean_speed": ("m/s", "mean forward speed of the trunk over the stride"),
    "apex": ("m", "greatest height of the trunk in flight"),
    "upright": ("1", "1 as long as the robot has not fallen"),
    "learning": ("1", "1 where the stride was played with the learning law on"),
    "skipped": ("1", "why nothing was learned from the stride, 0 if nothing was wrong with it"),
    "heading": ("rad", "heading of the trunk at the end of the stride"),
    "tilt": ("rad", "largest angle between the trunk and the gait's"),
    "flight_reference": ("s", "how long the reference of the flight lasted"),
    "attitude": ("rad", "roll, pitch and heading of the trunk"),
    "peak_error": ("rad", "peak of the stance error against the unmodified reference"),
    "rms_error": ("rad", "root mean square of the stance error"),
    "contact_error": ("rad", "peak of the stance error from the contact on, before it was felt"),
    "error": ("rad", "reference minus measured joint angle"),
    "feedback": ("N m", "torque of the feedback"),
    "feedforward": ("N m", "torque of the feedforward"),
    "base": ("m", "trunk position"),
    "reference": ("rad", "joint angle of the gait"),
    "planned_apex": ("m", "apex of the gait"),
    "planned_duration": ("s", "duration of the gait's stance and flight"),
    "tick_joints": ("rad", "measured joint angle at each tick"),
    "tick_joint_rates": ("rad/s", "measured joint velocity at each tick"),
    "tick_torque": ("N m", "torque that the motor was told, within its limits"),
    "tick_feedforward": ("N m", "feedforward in it"),
    "tick_base": ("m", "trunk position at each tick"),
    "tick_base_rate": ("m/s", "trunk velocity at each tick"),
    "tick_force": ("N", "ground's force on the foot, world frame"),
}


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
    recorded = {
        name: (dimensions, values[:, :last])
        for name, (dimensions, values) in _recorded(log).items()
    }
    grid = phase_grid(SAMPLES)
    parts = [[getattr(gait, part) for part in PARTS] for gait in gaits]
    reference = [[part.joint_reference(grid)[0] for part in gait] for gait in parts]
    dataset = xr.Dataset(
        {
            "count": ("speed", log.count),
            "planned_apex": ("speed", [gait.apex for gait in gaits]),
            "planned_duration": (("speed", "part"), [[p.duration for p in g] for g in parts]),
            "reference": (("speed", "part", "phase", "joint"), np.array(reference)),
            **recorded,
            **_ticks(log),
        },
        coords={
            "speed": ("speed", [gait.speed for gait in gaits], {"units": "m/s"}),
            "stride": np.arange(last),
            "part": list(PARTS),
            "phase": ("phase", grid, {"units": "1"}),
            **robot.joint_coordinates,
            "axis": ["x", "z"],
            "rotation": ["roll", "pitch", "heading"],
            "foot": list(robot.legs),
            "direction": ["x", "y", "z"],
        },
        attrs=dict(attributes),
    )
    finished = dataset["stride"] < dataset["count"]
    for name in map(str, dataset.data_vars):
        unit, text = _UNITS[name]
        if "stride" in dataset[name].dims:
            dataset[name] = dataset[name].where(finished)
        dataset[name].attrs.update(units=unit, long_name=text)
    dataset["skipped"].attrs.update(
        flag_values=list(range(len(SKIPPED))),
        flag_meanings=" ".join(reason.replace(" ", "_") for reason in SKIPPED),
    )
    return dataset


def _recorded(log: StrideLog) -> dict[str, _Variable]:
    """Variables of the log by name, with their dimensions."""
    per_stride, per_joint = ("speed", "stride"), ("speed", "stride", "joint")
    curve, path = (*per_stride, "part", "phase", "joint"), (*per_stride, "part", "phase", "axis")
    names = {"speed": "mean_speed"}  # the desired one is the coordinate
    return {
        **{names.get(name, name): (per_stride, array) for name, array in log.scalars.items()},
        "peak_error": (per_joint, log.peak_error),
        "rms_error": (per_joint, log.rms_error),
        "contact_error": (per_joint, log.contact_error),
        **{name: (curve, array) for name, array in log.curves.items()},
        "base": (path, log.base),
        "attitude": ((*path[:-1], "rotation"), log.attitude),
    }


def _ticks(log: StrideLog) -> dict[str, _Variable]:
    """The last strides at every tick, with dimensions."""
    trailing = {"base": ("axis",), "base_rate": ("axis",), "force": ("foot", "direction")}
    return {
        f"tick_{name}": (("speed", "last", "part", "tick", *trailing.get(name, ("joint",))), array)
        for name, array in log.ticks().items()
    }
