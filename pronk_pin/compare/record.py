"""What happened, stride by stride: preallocated, written at the events only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import control
from .._typing import Array, BoolArray, IntArray
from ..control import PhaseLog, StrideRecord, phase_grid, resample
from ..gait import Gait
from ..robot import NL

_EVERY = 2
SAMPLES = (control.SAMPLES - 1) // _EVERY + 1
"""Samples of the phase grid on which strides are kept: every second one of the control's."""

SHORTEST_STRIDE = 0.5
"""Strides shorter than this share of the planned duration do not occur: it sizes the log."""


class StrideLog:
    """The strides of n robots, numbered from 0; a stride goes from touchdown to touchdown.

    Attributes:
        count: Strides that each robot has finished, shape (n,).
        scalars: Quantities of a stride by name, each of shape (n, strides); NaN where none.
        peak_error: Peak of the stance error [rad], shape (n, strides, 12).
        rms_error: Root mean square of the stance error [rad], shape (n, strides, 12).
        contact_error: Peak from the contact on, before it was felt [rad], shape (n, strides, 12).
        curves: In stance the `error` [rad], `feedback` and `feedforward` [N m], in `flight` the
            joint angles [rad], each of shape (n, strides, samples, 12).
        base: Trunk x, z [m] in `stance` and `flight`, each of shape (n, strides, samples, 2).
    """

    SCALARS = ("start", "duration", "stance", "speed", "apex", "upright", "learning", "skipped")
    PHASES = ("stance", "flight")
    CURVES = ("error", "feedback", "feedforward", "flight")

    def __init__(self, gaits: Sequence[Gait], duration: float, timestep: float) -> None:
        n = len(gaits)
        planned = np.array([gait.duration for gait in gaits])
        size = int(np.ceil(duration / (SHORTEST_STRIDE * planned.min())))
        self._timestep = timestep
        self._open_x = np.zeros(n)
        self.count = np.zeros(n, dtype=np.intp)
        self.scalars = {name: np.full((n, size), np.nan) for name in self.SCALARS}
        self.peak_error, self.rms_error, self.contact_error = np.full((3, n, size, NL), np.nan)
        shape = (n, size, SAMPLES)
        self.curves = {name: np.full((*shape, NL), np.nan, np.float32) for name in self.CURVES}
        self.base = {name: np.full((*shape, 2), np.nan, np.float32) for name in self.PHASES}

    def open(self, rows: IntArray, time: float, x: Array, *, learning: bool) -> None:
        """A stride begins: touchdown at a time [s] and trunk position x (m,) [m]."""
        at = (rows, self.count[rows])
        self.scalars["start"][at], self.scalars["learning"][at] = time, learning
        self._open_x[rows] = x

    def stance(self, rows: IntArray, record: StrideRecord, log: PhaseLog, base: Array) -> None:
        """A stance has ended: its record, its log, and the trunk (m, ticks, 2)."""
        at = (rows, self.count[rows])
        self.peak_error[at] = np.abs(record.error).max(axis=1)
        self.rms_error[at] = np.sqrt(np.mean(record.error**2, axis=1))
        self.contact_error[at] = np.maximum(self.peak_error[at], record.contact_error)
        self.scalars["stance"][at] = log.length * self._timestep
        for name in ("error", "feedback", "feedforward"):
            self.curves[name][at] = getattr(record, name)[:, ::_EVERY]
        self.base["stance"][at] = _on_grid(base, log)

    def flight(self, rows: IntArray, log: PhaseLog, base: Array) -> None:
        """A flight has ended: its log, and the trunk (m, ticks, 2)."""
        at = (rows, self.count[rows])
        self.curves["flight"][at] = _on_grid(log.joints, log)
        self.base["flight"][at] = _on_grid(base, log)
        ticks = np.arange(base.shape[1])
        height = np.where(ticks < log.length[:, None], base[..., 1], -np.inf)
        self.scalars["apex"][at] = height.max(axis=1)

    def close(self, rows: IntArray, time: float, x: Array, upright: BoolArray) -> Array:
        """A stride ends: touchdown at a time [s] and trunk position x (m,) [m].

        Returns:
            Durations of the strides [s], shape (m,).
        """
        at = (rows, self.count[rows])
        duration = time - self.scalars["start"][at]
        self.scalars["duration"][at] = duration
        self.scalars["speed"][at] = (x - self._open_x[rows]) / duration
        self.scalars["upright"][at] = upright
        self.count[rows] = np.minimum(self.count[rows] + 1, self.scalars["start"].shape[1] - 1)
        return np.asarray(duration)

    def judge(self, rows: IntArray, skipped: IntArray) -> None:
        """Why nothing was learned from the strides that have just ended, see `StrideSelection`."""
        made = self.count[rows] > 0
        self.scalars["skipped"][rows[made], self.count[rows[made]] - 1] = skipped[made]

    def finish(self, upright: BoolArray) -> None:
        """The simulation has ended; a fall in an unfinished stride counts for the last finished."""
        self.scalars["upright"][np.arange(len(upright)), np.maximum(self.count - 1, 0)] = upright


def _on_grid(values: Array, log: PhaseLog) -> Array:
    """Values (m, ticks, ...) over the time that the phase lasted, on the phase grid."""
    return resample(values, log.index(phase_grid(SAMPLES)))
