"""Torque library: learned feedforward by speed, the "muscle memory" of section III.B."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._checks import numbers
from ..._checks import path as known_path
from ..._display import Displayed, spanned
from ..._typing import Array, BoolArray
from ...errors import InvalidInput, SpeedOutOfRange
from ...storage import read_arrays, write_arrays
from ..signals import resample

SCHEMA = 3
"""Version of the file format."""
LANDS_ALIKE = 5e-4
"""Difference of two flights [s] below which they were learned for the same touchdown: contact is
sensed at whole milliseconds."""
_ROUNDING = 1e-6
_AGAIN = "learn again, and save it with TorqueLibrary.save"


class InitialFeedforward(NamedTuple):
    """Initial feedforward and flight durations of n robots; None is none."""

    feedforward: Array | None = None
    """Torques on the phase grids of stance and flight [N m], shape (n, 2, samples, 12)."""
    flight: Array | None = None
    """Durations of the flights' references [s], shape (n,); None as planned."""


@dataclass(frozen=True, repr=False)
class TorqueLibrary(Displayed):
    """Learned torques by speed, averaged over strides in steady state.

    Attributes:
        speeds: Increasing speeds [m/s], shape (n,).
        torque: Mean feedforward on the phase grids of stance and flight [N m], shape
            (n, 2, samples, 12).
        spread: Its standard deviation over the strides [N m], of the same shape.
        flight: Durations of the flights for which they were learned [s], shape (n,); see
            `FlightTiming`.
    """

    speeds: Array
    torque: Array
    spread: Array
    flight: Array

    def __post_init__(self) -> None:
        given = {name: getattr(self, name) for name in ("speeds", "torque", "spread", "flight")}
        for name, array in zip(given, numbers(**given), strict=True):
            object.__setattr__(self, name, array)
        if self.speeds.ndim != 1 or self.torque.ndim != 4 or self.flight.ndim != 1:
            raise InvalidInput(
                f"speeds, torque and flight of the shapes {self.speeds.shape}, {self.torque.shape} "
                f"and {self.flight.shape}; give (n,), (n, 2, samples, joints) and (n,)"
            )
        lengths = {len(part) for part in (self.torque, self.speeds, self.flight)}
        if self.torque.shape != self.spread.shape or len(lengths) > 1 or not len(self.speeds):
            raise InvalidInput(
                "a torque library needs one torque, one spread and one flight for each speed, "
                "and a speed at least"
            )
        if np.any(np.diff(self.speeds) <= 0.0):
            raise InvalidInput("the speeds of a torque library must increase")

    def _title(self) -> str:
        return f"TorqueLibrary of {len(self.speeds)} speeds"

    def _facts(self) -> dict[str, str]:
        return {
            "speeds": spanned(self.speeds, "m/s"),
            "torque": f"up to {np.nanmax(np.abs(self.torque), initial=0.0):.3g} N m",
            "samples": f"{self.torque.shape[2]} of each part",
        }

    @classmethod
    def from_strides(cls, speeds: Array, torque: Array, flight: Array) -> TorqueLibrary:
        """Average learned strides: means of the torques, medians of the flights' durations.

        Args:
            speeds: Increasing speeds [m/s], shape (n,).
            torque: Feedforward [N m], shape (n, strides, 2, samples, 12); NaN where no stride is.
            flight: Duration of the flight's reference [s], shape (n, strides).
        """
        mean, spread = np.nanmean(torque, axis=1), np.nanstd(torque, axis=1)
        # Contact comes at a whole tick, and a mean of two would be between those that occur.
        return cls(speeds, mean, spread, np.nanmedian(flight, axis=1))

    def at(self, speeds: Array) -> Array:
        """Interpolate the torques at speeds (m,) between neighbours [N m], shape (m, 2, ...).

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
        """
        return np.asarray(resample(self.torque[None], self._places(speeds)[None])[0])

    def initial_feedforward(self, speeds: Array) -> InitialFeedforward:
        """Interpolate the torques at speeds (m,), with the flight durations that they fit.

        A flight lasts as long as that of the nearest learned speed, the lower of two: a torque
        was learned for its touchdown, which comes at a whole tick, so that a mean of two would be
        between those that occur.

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
        """
        nearest = np.ceil(self._places(speeds) - 0.5 - _ROUNDING).astype(np.intp)
        return InitialFeedforward(self.at(speeds), self.flight[nearest])

    def reusable(self, speeds: Array) -> BoolArray:
        """Whether the torques at speeds (m,) may be replayed without learning, shape (m,).

        That is so where the learned speeds around it landed alike (`LANDS_ALIKE`). A tick is
        0.02 rad of swing: torques of two that did not were learned for stances that begin
        elsewhere, and their mean fits neither. It says nothing of scenarios other than that of the
        learning.

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
        """
        places = self._places(speeds)
        lower = self.flight[np.floor(places + _ROUNDING).astype(np.intp)]
        upper = self.flight[np.ceil(places - _ROUNDING).astype(np.intp)]
        return np.asarray(np.abs(upper - lower) < LANDS_ALIKE)

    def _places(self, speeds: Array) -> Array:
        """Fractional indices of speeds into those of the library, shape (m,)."""
        queries, lowest, highest = np.atleast_1d(speeds), self.speeds[0], self.speeds[-1]
        for speed in queries:
            if not lowest - 1e-9 <= speed <= highest + 1e-9:
                raise SpeedOutOfRange(
                    float(speed),
                    float(lowest),
                    float(highest),
                    library="torque library",
                    remedy="learn at speeds around it",
                )
        return np.interp(queries, self.speeds, np.arange(len(self.speeds)))

    def without(self, speed: float) -> TorqueLibrary:
        """The library without the learned speed nearest to the given one."""
        kept = np.arange(len(self.speeds)) != int(np.argmin(np.abs(self.speeds - speed)))
        return TorqueLibrary(
            self.speeds[kept], self.torque[kept], self.spread[kept], self.flight[kept]
        )

    def left_out(self, speeds: Array) -> tuple[InitialFeedforward, BoolArray]:
        """Initial feedforward at learned speeds (m,), each interpolated from its neighbours only.

        Returns:
            The feedforward, and which of it is `reusable`, shape (m,).

        Raises:
            SpeedOutOfRange: A speed is the first or the last, or the library does not cover it.
        """
        reduced = [(self.without(speed), np.array([speed])) for speed in speeds]
        interpolated = [library.initial_feedforward(speed) for library, speed in reduced]
        torque, flight = (np.concatenate(parts) for parts in zip(*interpolated, strict=True))
        reusable = [library.reusable(speed) for library, speed in reduced]
        return InitialFeedforward(torque, flight), np.concatenate(reusable)

    def save(self, path: Path | str) -> None:
        """Write the library to an npz file, whole or not at all.

        Raises:
            FileProblem: It cannot be written.
        """
        arrays = {name: getattr(self, name) for name in ("speeds", "torque", "spread", "flight")}
        write_arrays(path, arrays, schema=SCHEMA)

    @classmethod
    def load(cls, path: Path | str) -> TorqueLibrary:
        """Read a library.

        Raises:
            FileProblem: The file is missing or damaged.
        """
        path = known_path("path", path)
        arrays = read_arrays(path, _AGAIN, what="torque library", schema=SCHEMA)
        speeds = arrays.numbers("speeds", None)
        torque = arrays.numbers("torque", len(speeds), 2, None, None)
        spread = arrays.numbers("spread", *torque.shape)
        flight = arrays.numbers("flight", len(speeds))
        try:
            return cls(speeds, torque, spread, flight)
        except InvalidInput as error:
            raise arrays.damaged(error) from error
