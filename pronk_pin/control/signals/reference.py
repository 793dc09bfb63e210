"""Joint references of gaits, tick by tick, and the adaptation of the flight's duration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..._checks import SHARE, Interval, keep_reals
from ..._typing import Array, IntArray
from ...errors import InvalidInput
from ...gait import GaitPhase, joint_references

LATEST_TOUCHDOWN = 2.0
"""Longest flight, over its planned duration, after which it ends without a touchdown."""

_NOTICED = 2e-5
"""Change of a duration [s] below which a reference stays unchanged."""


@dataclass(frozen=True)
class FlightTiming:
    """Adaptation of the duration of the flight's reference to that of the last flights.

    `T_{k+1} = T_k + gain (T_measured - T_k)`, within `limit` of the planned duration.

    The legs swing at 20 rad/s when they touch down. A flight that lasts 5 ms longer than planned
    (motors that act late push for longer) ends 0.1 rad from the posture in which the stance begins,
    however well it was tracked; and no torque learned in stance makes up for that.

    Attributes:
        gain: Part of the difference that is taken over in a stride; 0 to 1.
        limit: Largest relative change of the planned duration.
    """

    gain: float = 0.5
    limit: float = 0.15

    def __post_init__(self) -> None:
        checks = {"gain": SHARE, "limit": Interval(0, 1, below=True)}
        keep_reals(self, checks, "a flight's timing: ")

    def next(self, duration: Array, measured: Array, planned: Array) -> Array:
        """Compute the next reference's duration from the last, the measured and the planned [s]."""
        following = duration + self.gain * (measured - duration)
        return np.clip(following, (1.0 - self.limit) * planned, (1.0 + self.limit) * planned)


@dataclass(frozen=True)
class Reference:
    """Joint references of n gaits in one part of the stride, at each tick.

    Attributes:
        parts: That part of each gait.
        timestep: Length of a tick [s].
        planned: Planned durations [s], shape (n,).
        duration: Durations that the reference is stretched to [s], shape (n,).
        ticks: Ticks after which the part ends at the latest, shape (n,).
        phase: Phase s at each tick, held at 1, shape (n, ticks).
        position: Joint angles [rad], shape (n, ticks, 12).
        velocity: Joint velocities [rad/s], zero where the phase is held, shape (n, ticks, 12).
    """

    parts: list[GaitPhase]
    timestep: float
    planned: Array
    duration: Array
    ticks: IntArray
    phase: Array
    position: Array
    velocity: Array

    @classmethod
    def of(
        cls,
        parts: Sequence[GaitPhase],
        timestep: float,
        latest: float,
        *,
        others: Sequence[GaitPhase] = (),
    ) -> Reference:
        """Tabulate one part of each gait, for up to `latest` times its planned duration.

        There is room for those `others`, which `change` may bring.
        """
        planned = np.array([part.duration for part in parts])
        ticks = np.round(latest * planned / timestep).astype(np.intp)
        longest = max([planned.max(), *(part.duration for part in others)])
        shape = (len(parts), int(np.round(latest * longest / timestep)))
        joints = parts[0].joint_reference(np.zeros(1))[0].shape[1]
        curves = (np.empty((*shape, joints)) for _ in range(2))
        reference = cls(
            list(parts), timestep, planned, planned.copy(), ticks, np.empty(shape), *curves
        )
        reference._tabulate(np.arange(len(parts)))
        return reference

    def change(
        self,
        rows: IntArray,
        parts: Sequence[GaitPhase],
        latest: float,
        *,
        stretched: Array | None = None,
    ) -> None:
        """Change some robots to another gait's part.

        Args:
            rows: Which robots.
            parts: Their parts, for up to `latest` times the planned duration.
            latest: See `of`.
            stretched: Durations over the planned ones, shape (m,); by default as theirs were.

        Raises:
            InvalidInput: A part is longer than those that there is room for.
        """
        if stretched is None:
            stretched = self.duration[rows] / self.planned[rows]
        for row, part, longer in zip(rows, parts, stretched, strict=True):
            ticks = int(np.round(latest * part.duration / self.timestep))
            if ticks > self.phase.shape[1]:
                raise InvalidInput(
                    f"a {part.name} of {part.duration:g} s is longer than any that was announced; "
                    "name its gait among those that may be changed to"
                )
            self.parts[row], self.planned[row], self.ticks[row] = part, part.duration, ticks
            self.duration[row] = longer * part.duration
        self._tabulate(rows)

    def stretch(self, rows: IntArray, duration: Array) -> None:
        """Stretch the references of some robots to durations (m,) [s]; postures stay the same."""
        noticed = np.abs(duration - self.duration[rows]) > _NOTICED
        self.duration[rows[noticed]] = duration[noticed]
        self._tabulate(rows[noticed])

    def _tabulate(self, rows: IntArray) -> None:
        if not rows.size:
            return
        ends = self.ends(rows)
        phases = [
            np.minimum(np.arange(end) * self.timestep / self.duration[row], 1.0)
            for row, end in zip(rows, ends, strict=True)
        ]
        curves = joint_references([self.parts[row] for row in rows], phases)
        for row, end, s, (position, velocity) in zip(rows, ends, phases, curves, strict=True):
            part, duration = self.parts[row], self.duration[row]
            velocity[s >= 1.0] = 0.0
            # Past its end a flight holds the posture of touchdown.
            self.phase[row, :end], self.phase[row, end:] = s, s[-1]
            self.position[row, :end], self.position[row, end:] = position, position[-1]
            self.velocity[row, :end] = velocity * (part.duration / duration)
            self.velocity[row, end:] = 0.0

    def acceleration(self, rows: IntArray, ticks: slice = slice(None)) -> Array:
        """Joint accelerations of some robots [rad/s^2], shape (m, ticks, 12); zero where the phase
        is held."""
        phase = self.phase[rows, ticks]
        acceleration = np.zeros_like(self.position[rows, ticks])
        for own, row, s in zip(acceleration, rows, phase, strict=True):
            own[:] = self.parts[row].joint_acceleration(s)
            own *= (self.parts[row].duration / self.duration[row]) ** 2
        acceleration[phase >= 1.0] = 0.0
        return acceleration

    def ends(self, rows: IntArray) -> IntArray:
        """Ticks after which the references of some robots are constant, shape (m,)."""
        ends = np.ceil(self.duration[rows] / self.timestep).astype(np.intp) + 1
        return np.minimum(ends, self.phase.shape[1])
