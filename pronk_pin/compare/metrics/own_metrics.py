"""Metrics by name: ours with their units, and those of a user's own.

def swing_height(strides):
    return strides["tick_joints"].isel(joint=2).max(("last", "tick", "part"))

Experiment(metrics=(Metric("swing_height", "rad", swing_height),))
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from ..._checks import file_name, text
from ..._registry import find
from ...control import SKIPPED
from ...errors import InvalidInput

METRICS: Mapping[str, tuple[str, str]] = {
    "peak_error": ("rad", "peak of the error in stance, from the true contact on; by joint"),
    "rms_error": ("rad", "its root mean square; by joint"),
    "felt_peak_error": ("rad", "the peak from when the controller felt the contact on; by joint"),
    "strides_to_converge": ("1", "strides of learning until a tenth is missing; by joint"),
    "strides_to_beat_model": ("1", "strides of learning until below the model's error; by joint"),
    "strides_of_learning": ("1", "strides with the learning on"),
    "error_growth": ("1", "last error of learning over the least"),
    "diverging": ("1", "whether the error grew again"),
    "upright": ("1", "whether it never fell"),
    "speed_error": ("m/s", "mean speed less the gait's"),
    "apex_error": ("m", "mean apex less the gait's"),
    "apex_deviation": ("m", "standard deviation of the apex"),
    "stride_duration": ("s", "mean duration of a stride"),
    "feedback_share": ("1", "feedback's share of the torque in stance"),
    "power": ("W", "mechanical power"),
    "cost_of_transport": ("1", "mechanical energy over weight and way"),
    **{
        f"skipped_{reason.replace(' ', '_')}": ("1", f"strides that taught nothing: {reason}")
        for reason in SKIPPED[1:]
    },
}
"""Names of ours: unit, and what it is; see `summarize`."""


@dataclass(frozen=True)
class Metric:
    """A metric of a user's own: a number for each robot of a simulation, from its strides.

    Attributes:
        name: Its name in summary, tables and comparisons.
        unit: Its unit; "1" without one.
        compute: From the strides, see `compare.simulation.dataset`, to values of shape (n,), one a
            speed, or command. NaN where there is nothing to say.
    """

    name: str
    unit: str
    compute: Callable[[xr.Dataset], Any]

    def __post_init__(self) -> None:
        file_name("name of a metric", self.name)
        if self.name in METRICS:
            raise InvalidInput(f"metric '{self.name}' is one of ours; give yours another name")
        text(f"unit of metric '{self.name}'", self.unit)
        if not callable(self.compute):
            raise InvalidInput(
                f"metric '{self.name}': compute={self.compute!r} cannot be called; give a function "
                "of the strides"
            )

    def values(self, strides: xr.Dataset) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Its values, shape (n,).

        Raises:
            InvalidInput: The function answers something else.
        """
        answer, n = self.compute(strides), strides["count"].size
        try:
            values = np.asarray(answer, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"metric '{self.name}' answers no numbers ({error})") from error
        if values.shape != (n,):
            raise InvalidInput(
                f"metric '{self.name}' answers values of shape {values.shape}; let it answer one "
                f"for each of the {n} robots, ({n},)"
            )
        return values

    def rows(self, strides: xr.Dataset) -> Iterator[tuple[int, tuple[str, str, float, str]]]:
        """Rows of the summary: robot, and joint, metric, value and unit."""
        for k, value in enumerate(self.values(strides)):
            yield k, ("-", self.name, float(value), self.unit)


def load_metric(name: str | Metric) -> Metric:
    """A metric by its address, module:object, or the name of an entry point, or one itself.

    Raises:
        UnknownName: There is none of that name.
        InvalidInput: What is there is something else.
    """
    if isinstance(name, Metric):
        return name
    if name in METRICS:
        raise InvalidInput(f"metric '{name}' is one of ours, which are there always; leave it out")
    return find("metric", name, {}, Metric)
