"""Quantities of the strides: name, dimensions, unit and long name of each, in one list.

`StrideLog` allocates its arrays by them, `to_dataset` labels them, and `check_memory` counts them.
A new quantity of a stride takes a row of `STRIDE_QUANTITIES` here, and in `StrideLog` the line that
assigns it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import control
from ...control import PARTS
from ...gait import Gait

EVERY = 4
SAMPLES = (control.SAMPLES - 1) // EVERY + 1
"""Samples of the phase grid on which strides are kept: every fourth one of the control's."""

LAST = 12
"""Strides at the end that are kept tick by tick."""

LABELS = {
    "part": PARTS,
    "axis": ("x", "z"),
    "rotation": ("roll", "pitch", "heading"),
    "direction": ("x", "y", "z"),
}
"""Coordinates along the dimensions that are the same for all robots."""

_SIZES = {
    **{dimension: len(labels) for dimension, labels in LABELS.items()},
    "phase": SAMPLES,
    "last": LAST,
}


@dataclass(frozen=True)
class Quantity:
    """A quantity of the strides.

    Attributes:
        name: Its name, in `StrideLog` and in datasets.
        dimensions: Names of its dimensions.
        unit: Its unit.
        long_name: What it is.
    """

    name: str
    dimensions: tuple[str, ...]
    unit: str
    long_name: str

    @property
    def dtype(self) -> np.dtype[np.floating[Any]]:
        """Double precision; single where a stride has a curve of many samples."""
        curve = "phase" in self.dimensions or "tick" in self.dimensions
        return np.dtype(np.float32 if curve else np.float64)

    def shape(self, sizes: Mapping[str, int]) -> tuple[int, ...]:
        """Shape of its array.

        Args:
            sizes: Sizes of the dimensions that are not the same in all simulations: `speed`,
                `stride` and `tick`, and those of `sizes_of`.
        """
        return tuple({**_SIZES, **sizes}[dimension] for dimension in self.dimensions)

    def empty(self, sizes: Mapping[str, int]) -> npt.NDArray[np.floating[Any]]:
        """An array for it, full of NaN; `sizes` as in `shape`."""
        return np.full(self.shape(sizes), np.nan, self.dtype)


def sizes_of(gait: Gait) -> dict[str, int]:
    """Sizes of the dimensions that depend on the robot, read from one of its gaits."""
    joints = gait.stance.joints.shape[0]
    return {"joint": joints, "foot": gait.stance.lam.shape[0]}


_STRIDE = ("speed", "stride")
_JOINT = (*_STRIDE, "joint")
_CURVE = (*_STRIDE, "part", "phase")
_TICK = ("speed", "last", "part", "tick")

GAIT_QUANTITIES = (
    Quantity("count", ("speed",), "1", "finished strides"),
    Quantity("planned_apex", ("speed",), "m", "apex of the gait"),
    Quantity(
        "planned_duration", ("speed", "part"), "s", "duration of the gait's stance and flight"
    ),
    Quantity("reference", ("speed", "part", "phase", "joint"), "rad", "joint angle of the gait"),
)
"""Quantities of each robot that are the same in all its strides; `to_dataset` computes them."""

STRIDE_QUANTITIES = (
    Quantity("start", _STRIDE, "s", "time of touchdown, from the first one on"),
    Quantity("duration", _STRIDE, "s", "from touchdown to touchdown"),
    Quantity("stance", _STRIDE, "s", "duration of stance"),
    Quantity("mean_speed", _STRIDE, "m/s", "mean forward speed of the trunk over the stride"),
    Quantity("apex", _STRIDE, "m", "greatest height of the trunk in flight"),
    Quantity("upright", _STRIDE, "1", "1 as long as the robot has not fallen"),
    Quantity("learning", _STRIDE, "1", "1 where the stride was played with the learning law on"),
    Quantity(
        "skipped",
        _STRIDE,
        "1",
        "why nothing was learned from the stride, 0 if nothing was wrong with it",
    ),
    Quantity("heading", _STRIDE, "rad", "heading of the trunk at the end of the stride"),
    Quantity("tilt", _STRIDE, "rad", "largest angle between the trunk and the gait's"),
    Quantity("flight_reference", _STRIDE, "s", "how long the reference of the flight lasted"),
    Quantity(
        "peak_error",
        _JOINT,
        "rad",
        "peak of the stance error from the true contact on, against the unmodified reference",
    ),
    Quantity("rms_error", _JOINT, "rad", "root mean square of the stance error from there on"),
    Quantity(
        "felt_peak_error",
        _JOINT,
        "rad",
        "peak of the stance error from when the controller felt the contact, as it counts",
    ),
    Quantity("error", (*_CURVE, "joint"), "rad", "reference minus measured joint angle"),
    Quantity("feedback", (*_CURVE, "joint"), "N m", "torque of the feedback"),
    Quantity("feedforward", (*_CURVE, "joint"), "N m", "torque of the feedforward"),
    Quantity("base", (*_CURVE, "axis"), "m", "trunk position"),
    Quantity("attitude", (*_CURVE, "rotation"), "rad", "roll, pitch and heading of the trunk"),
)
"""Quantities of every stride."""

COMMAND_QUANTITIES = (
    Quantity("commanded", _STRIDE, "m/s", "commanded speed at the beginning of the stride"),
    Quantity("gait_speed", _STRIDE, "m/s", "speed of the gait of the stance"),
    Quantity(
        "landing_speed", _STRIDE, "m/s", "speed of the gait of the flight, which is landed in"
    ),
)
"""Quantities of every stride of robots whose speed is commanded."""

CONDITION_QUANTITIES = (
    Quantity(
        "conditions",
        (*_STRIDE, "condition"),
        "SI",
        "conditions by whose torques the stride was played, as estimated",
    ),
)
"""Quantities of every stride of robots that estimate the conditions of a torque library."""

TICK_QUANTITIES = (
    Quantity("tick_joints", (*_TICK, "joint"), "rad", "measured joint angle at each tick"),
    Quantity(
        "tick_joint_rates", (*_TICK, "joint"), "rad/s", "measured joint velocity at each tick"
    ),
    Quantity(
        "tick_torque", (*_TICK, "joint"), "N m", "torque that the motor was told, within its limits"
    ),
    Quantity("tick_feedforward", (*_TICK, "joint"), "N m", "feedforward in it"),
    Quantity("tick_base", (*_TICK, "axis"), "m", "trunk position at each tick"),
    Quantity("tick_base_rate", (*_TICK, "axis"), "m/s", "trunk velocity at each tick"),
    Quantity(
        "tick_force", (*_TICK, "foot", "direction"), "N", "ground's force on the foot, world frame"
    ),
)
"""Quantities of the last strides at every tick."""
