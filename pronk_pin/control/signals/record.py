"""Stride records: the logs and curves from which a controller learns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..._checks import Interval, whole
from ..._typing import Array, BoolArray, IntArray

PARTS = ("stance", "flight")
"""Parts of a stride; arrays with an axis for them hold the stance first."""

SAMPLES = 161
"""Samples of the phase grid s = 0 ... 1 on which strides are recorded and learned."""

ONWARD = 32
"""Samples beyond s = 1, on the same spacing, that a law may look ahead into."""


@dataclass(frozen=True)
class PhaseLog:
    """Measurements and commands of n robots over one phase, tick by tick.

    Attributes:
        joints: Joint angles [rad], shape (n, ticks, 12).
        joint_rates: Joint velocities [rad/s], shape (n, ticks, 12).
        feedback: Torque of the feedback [N m], shape (n, ticks, 12).
        feedforward: Torque of the feedforward [N m], shape (n, ticks, 12).
        missing: Torque that the motors' limits cut off: delivered minus commanded [N m], shape
            (n, ticks, 12).
        length: Ticks that the phase lasted; later ones hold nothing of it, shape (n,).
        sensed: Tick at which its beginning was sensed: those before were played on the tape before.
        load: Vertical force on all feet [N], shape (n, ticks); None without force sensors.
        pose: Estimated position and quaternion of the trunk, shape (n, ticks, 7); None where the
            trunk is level.
        twist: Trunk's velocity in its own axes, likewise, shape (n, ticks, 6).
        specific_force: Reading of the accelerometer, in the trunk's frame [m/s^2], shape
            (n, ticks, 3); None without an IMU.
    """

    joints: Array
    joint_rates: Array
    feedback: Array
    feedforward: Array
    missing: Array
    length: IntArray
    sensed: int = 0
    load: Array | None = None
    pose: Array | None = None
    twist: Array | None = None
    specific_force: Array | None = None

    def index(self, s: Array, ticks: Array | None = None) -> Array:
        """Compute the fractional ticks at which phases s (m,) were measured, shape (n, m).

        Args:
            s: Phases.
            ticks: Ticks that s = 1 stands for, shape (n,); by default the last measured one.
                Phases outside those that were felt are held at the first or the last of them.
        """
        last = self.length[:, None] - 1.0
        index = s * (last if ticks is None else ticks[:, None])
        return np.asarray(np.clip(index, self.sensed, last))


@dataclass(frozen=True)
class StrideRecord:
    """Record of one part of a stride of n robots on the phase grid: the stance, or the flight.

    A stance is recorded from the tick on at which the touchdown is sensed, a flight until it is.

    Arrays have the shape (n, samples, 12) where nothing else is said. Phases s = t / T are those of
    the reference; what was not measured holds the nearest value that was.

    Attributes:
        error: Unmodified reference minus measured joint angle [rad]: eq. (8).
        error_rate: Its time derivative [rad/s].
        feedback: Torque of the feedback, eq. (9) [N m].
        feedforward: Torque of the feedforward [N m].
        missing: Torque that the motors' limits cut off: delivered minus commanded [N m].
        relative_duration: Duration of the stride over the reference's, shape (n,); NaN as long as
            the stride goes on.
        error_onward: The error beyond s = 1, shape (n, ONWARD, 12): the last one, where nothing
            else was put there by `onward`.
        rate_onward: The error's time derivative likewise.
        upright: Whether the robot has not fallen, shape (n,).
        robot: Which of the controller's robots made the stride, shape (n,).
    """

    error: Array
    error_rate: Array
    feedback: Array
    feedforward: Array
    missing: Array
    relative_duration: Array
    error_onward: Array
    rate_onward: Array
    upright: BoolArray
    robot: IntArray

    @classmethod
    def unknown(cls, n: int, joints: int) -> StrideRecord:
        """Make the record of n robots that have made no stride yet: NaN."""
        curve, onward = (n, SAMPLES, joints), (n, ONWARD, joints)
        return cls(
            error=np.full(curve, np.nan),
            error_rate=np.full(curve, np.nan),
            feedback=np.full(curve, np.nan),
            feedforward=np.full(curve, np.nan),
            missing=np.full(curve, np.nan),
            relative_duration=np.full(n, np.nan),
            error_onward=np.full(onward, np.nan),
            rate_onward=np.full(onward, np.nan),
            upright=np.ones(n, dtype=bool),
            robot=np.arange(n),
        )

    @classmethod
    def of(
        cls, error: Array, error_rate: Array, feedback: Array, feedforward: Array
    ) -> StrideRecord:
        """Make the record of regular strides from arrays (n, samples, joints)."""
        n = len(error)
        return cls(
            error=error,
            error_rate=error_rate,
            feedback=feedback,
            feedforward=feedforward,
            missing=np.zeros_like(error),
            relative_duration=np.ones(n),
            error_onward=held(error),
            rate_onward=held(error_rate),
            upright=np.ones(n, dtype=bool),
            robot=np.arange(n),
        )

    def onward(self, following: StrideRecord, ratio: Array, share: float = 1.0) -> StrideRecord:
        """The record continued beyond s = 1 by another part of the stride.

        `e(1 + ds) = (1 - share) e(1) + share e_following(ratio ds)`

        Args:
            following: That part, of the same robots.
            ratio: Duration of this part over that of the other, shape (n,).
            share: Share of it that is believed; with 0 the last value is held.
        """
        beyond = (1.0 + np.arange(ONWARD)) * ratio[:, None]
        error, rate = (
            (1.0 - share) * held(own) + share * resample(other, beyond)
            for own, other in (
                (self.error, following.error),
                (self.error_rate, following.error_rate),
            )
        )
        return replace(self, error_onward=error, rate_onward=rate)

    def less(self, error: Array, error_rate: Array, feedback: Array) -> StrideRecord:
        """The record less some errors and rates, and the feedback to them.

        Each has the shape (n, samples, 12).
        """
        error, error_rate = self.error - error, self.error_rate - error_rate
        return replace(
            self,
            error=error,
            error_rate=error_rate,
            feedback=self.feedback - feedback,
            error_onward=held(error),
            rate_onward=held(error_rate),
        )

    def changed(self, change: Callable[[Array], Array]) -> StrideRecord:
        """The record with one linear change of errors, rates and feedback."""
        return replace(
            self,
            error=change(self.error),
            error_rate=change(self.error_rate),
            feedback=change(self.feedback),
            error_onward=change(self.error_onward),
            rate_onward=change(self.rate_onward),
        )

    def take(self, rows: IntArray) -> StrideRecord:
        """The record of some of the robots, copied."""
        return StrideRecord(
            error=self.error[rows],
            error_rate=self.error_rate[rows],
            feedback=self.feedback[rows],
            feedforward=self.feedforward[rows],
            missing=self.missing[rows],
            relative_duration=self.relative_duration[rows],
            error_onward=self.error_onward[rows],
            rate_onward=self.rate_onward[rows],
            upright=self.upright[rows],
            robot=self.robot[rows],
        )

    def put(self, rows: IntArray, other: StrideRecord) -> None:
        """Overwrite the record of some robots by that of others."""
        self.error[rows] = other.error
        self.error_rate[rows] = other.error_rate
        self.feedback[rows] = other.feedback
        self.feedforward[rows] = other.feedforward
        self.missing[rows] = other.missing
        self.relative_duration[rows] = other.relative_duration
        self.error_onward[rows] = other.error_onward
        self.rate_onward[rows] = other.rate_onward
        self.upright[rows] = other.upright
        self.robot[rows] = other.robot


def held(values: Array) -> Array:
    """The last of the values (n, samples, ...), repeated beyond s = 1: (n, ONWARD, ...)."""
    return np.repeat(values[:, -1:], ONWARD, axis=1)


def phase_grid(samples: int = SAMPLES) -> Array:
    """Phases of the grid, evenly from 0 to 1, shape (samples,)."""
    return np.linspace(0.0, 1.0, whole("samples", samples, Interval(2, 100_000)))


def resample(values: Array, position: Array) -> Array:
    """Interpolate linearly along axis 1 at fractional indices.

    Args:
        values: Samples, shape (n, m, ...).
        position: Fractional indices into axis 1, shape (n, k); held at the ends.

    Returns:
        Shape (n, k, ...).
    """
    n, m = values.shape[:2]
    position = np.clip(position, 0.0, m - 1.0)
    lower = position.astype(np.intp)
    weight = (position - lower).reshape(-1, 1)
    # Whole samples are gathered from one long list of them: much faster than two indices.
    samples, begin = values.reshape(n * m, -1), m * np.arange(n)[:, None]
    values_below = samples.take((begin + lower).ravel(), axis=0)
    change = samples.take((begin + np.minimum(lower + 1, m - 1)).ravel(), axis=0)
    with np.errstate(invalid="ignore"):  # what is not finite gives what is not finite
        change -= values_below
        change *= weight
        change += values_below
    return np.asarray(change.reshape(*position.shape, *values.shape[2:]))
