"""Filters: the zero-phase learning filter (eq. 14) and the first-order filter of the speed."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from scipy import signal

from ..._checks import Interval, real, reals, shown, whole
from ..._typing import Array
from ...errors import InvalidInput, LeakyFilter
from .record import resample

PAPER_B = (0.003, 0.009, 0.009, 0.003)
PAPER_A = (1.00, -2.37, 1.93, -0.53)
"""The coefficients printed in section III of the paper. They are `butter(3, 0.1)` rounded, and the
rounding makes the DC gain 0.8 a pass: 36 % of the torque is lost in each stride."""

_LEAK = 1e-3
"""Largest distance of the DC gain from 1 without a warning."""


@dataclass(frozen=True)
class ZeroPhaseFilter:
    """IIR filter run forward and backward along the phase: eq. (14).

    `B(z) / A(z)` with `a_0 y_k = sum_i b_i x_{k-i} - sum_{i>0} a_i y_{k-i}`, both ways: its
    frequency response is `|B / A|^2`, without phase.

    Attributes:
        b: Feedforward coefficients.
        a: Feedback coefficients.
    """

    b: tuple[float, ...]
    a: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("b", "a"):
            values = reals(f"filter: {name}", getattr(self, name))
            object.__setattr__(self, name, values)
            if not values or (name == "a" and values[0] == 0.0):
                raise InvalidInput(
                    f"filter: {name}={shown(values)}; give one coefficient or more, the first of "
                    "a not 0"
                )
        if np.max(np.abs(np.roots(self.a)), initial=0.0) >= 1.0:
            raise InvalidInput("the filter is unstable; its poles must lie inside the unit circle")

    def warn(self) -> None:
        """Warn with `LeakyFilter` if the DC gain is not 1."""
        if abs(self.dc_gain - 1.0) > _LEAK:
            change = "loses" if self.dc_gain < 1.0 else "adds"
            warnings.warn(
                f"the learning filter has a DC gain of {self.dc_gain:.3g} forward and backward and "
                f"{change} {abs(1.0 - self.dc_gain):.0%} of a constant torque in each stride; use "
                "coefficients that are not rounded, as ZeroPhaseFilter.butterworth gives them",
                LeakyFilter,
                stacklevel=5,  # who makes a controller: beyond `bind`, `bound` and `Controller`
            )

    @classmethod
    def butterworth(cls, order: int, cutoff: float) -> ZeroPhaseFilter:
        """Make a Butterworth low-pass with its cut-off as a fraction of the Nyquist frequency.

        Raises:
            InvalidInput: The order is below 1, or the cut-off not between 0 and 1.
        """
        order = whole("order", order, Interval(high=20))
        cutoff = real("cutoff", cutoff)
        if order < 1 or not 0.0 < cutoff < 1.0:
            raise InvalidInput(
                f"a Butterworth filter of order {order} and cut-off {cutoff:g}; give an order of 1 "
                "or more and a cut-off between 0 and 1, the Nyquist frequency"
            )
        b, a = signal.butter(order, cutoff)
        return cls(tuple(b.tolist()), tuple(a.tolist()))

    @property
    def dc_gain(self) -> float:
        """DC gain `(sum b / sum a)^2` of both passes; below 1 what was learned leaks away."""
        return float((sum(self.b) / sum(self.a)) ** 2)

    def __call__(self, values: Array) -> Array:
        """Filter along axis 1 of (n, samples, ...); the ends are extended by point reflection."""
        padding = min(values.shape[1] - 1, 60)
        return np.asarray(signal.filtfilt(self.b, self.a, values, axis=1, padlen=padding))


def first_order(values: Array, start: Array, *, time_constant: float, timestep: float) -> Array:
    """First-order low-pass along axis 1 of (n, samples), from a start value (n,).

    `y_k = y_{k-1} + alpha (x_k - y_{k-1})` with `alpha = timestep / (time_constant + timestep)`.
    """
    alpha = timestep / (time_constant + timestep)
    initial = (1.0 - alpha) * start[:, None]
    filtered, _ = signal.lfilter([alpha], [1.0, alpha - 1.0], values, axis=1, zi=initial)
    return np.asarray(filtered)


def look_ahead(values: Array, delta: float, onward: Array | None = None) -> Array:
    """Read values (n, samples, ...) on the phase grid at s + delta, the look-ahead from 0 to 1.

    Beyond the end `onward` (n, m, ...) goes on on the same spacing; then the last one is held.
    """
    n, samples = values.shape[:2]
    index = np.arange(samples) + delta * (samples - 1)
    if onward is not None:
        values = np.concatenate([values, onward], axis=1)
    return resample(values, np.broadcast_to(index, (n, samples)))
