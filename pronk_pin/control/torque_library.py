"""The torque library: learned feedforward by speed, the "muscle memory" of section III.B."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .._typing import Array
from ..errors import FileProblem, InvalidInput, SpeedOutOfRange, cannot_write
from .record import resample

SCHEMA = 1
"""Version of the file format."""
_AGAIN = "practise again, and save it with TorqueLibrary.save"


@dataclass(frozen=True)
class TorqueLibrary:
    """Torques by speed, averaged over strides in steady state.

    Attributes:
        speeds: Increasing speeds [m/s], shape (n,).
        torque: Mean feedforward on the phase grids of stance and flight [N m], shape
            (n, 2, samples, 12).
        spread: Its standard deviation over the strides [N m], of the same shape.
    """

    speeds: Array
    torque: Array
    spread: Array

    def __post_init__(self) -> None:
        if self.torque.shape != self.spread.shape or len(self.torque) != len(self.speeds):
            raise InvalidInput("a torque library needs one torque and one spread for each speed")
        if np.any(np.diff(self.speeds) <= 0.0):
            raise InvalidInput("the speeds of a torque library must increase")

    @classmethod
    def from_strides(cls, speeds: Array, torque: Array) -> TorqueLibrary:
        """Average over strides: `torque` has the shape (n, strides, 2, samples, 12)."""
        return cls(speeds, np.nanmean(torque, axis=1), np.nanstd(torque, axis=1))

    def at(self, speeds: Array) -> Array:
        """Torques at given speeds (m,), interpolated between neighbours [N m], (m, 2, ...).

        Raises:
            SpeedOutOfRange: The library does not cover a speed.
        """
        wanted, lowest, highest = np.atleast_1d(speeds), self.speeds[0], self.speeds[-1]
        for speed in wanted:
            if not lowest - 1e-9 <= speed <= highest + 1e-9:
                raise SpeedOutOfRange(float(speed), float(lowest), float(highest))
        position = np.interp(wanted, self.speeds, np.arange(len(self.speeds)))
        return np.asarray(resample(self.torque[None], position[None])[0])

    def without(self, speed: float) -> TorqueLibrary:
        """The library as if the practised speed next to the given one had not been practised."""
        rest = np.arange(len(self.speeds)) != int(np.argmin(np.abs(self.speeds - speed)))
        return TorqueLibrary(self.speeds[rest], self.torque[rest], self.spread[rest])

    def save(self, path: Path | str) -> None:
        """Write the library to an npz file, whole or not at all.

        Raises:
            FileProblem: It cannot be written.
        """
        path = Path(path)
        partial = path.with_name(path.name + ".partial")
        try:
            with partial.open("wb") as file:
                np.savez_compressed(
                    file,
                    schema=np.array(SCHEMA),
                    speeds=self.speeds,
                    torque=self.torque,
                    spread=self.spread,
                )
            partial.replace(path)
        except OSError as error:
            raise cannot_write(path, error) from error

    @classmethod
    def load(cls, path: Path | str) -> TorqueLibrary:
        """Read a library.

        Raises:
            FileProblem: The file is missing or damaged.
        """
        path = Path(path)
        if not path.is_file():
            raise FileProblem(path, "missing", _AGAIN)
        try:
            with np.load(path, allow_pickle=False) as file:
                if int(file["schema"]) != SCHEMA:
                    raise FileProblem(path, f"schema {int(file['schema'])}, not {SCHEMA}", _AGAIN)
                parts = [np.asarray(file[name], float) for name in ("speeds", "torque", "spread")]
            if not all(np.isfinite(part).all() for part in parts):
                raise ValueError("numbers that are not finite")
            return cls(*parts)
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, InvalidInput) as error:
            raise FileProblem(path, f"damaged ({error})", _AGAIN) from error
