"""The torque library: learned feedforward by speed, the "muscle memory" of section III.B."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._typing import Array
from ..errors import InvalidInput, SpeedOutOfRange
from .record import resample


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
