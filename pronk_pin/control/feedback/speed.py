"""Speed regulation by the leg angle at touchdown: eq. (12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._checks import Interval, keep_reals
from ..._typing import Array


@dataclass(frozen=True)
class LegAngleRegulator:
    """Regulates the speed by turning the legs in flight: `dtheta = K_theta (v - v_d)`, eq. (12).

    The leg angle theta = q_thigh + q_calf / 2 grows backwards, so a robot that is too fast needs a
    smaller one: the gain is negative.

    Attributes:
        gain: K_theta [rad s/m].
        limit: Largest change of the leg angle [rad].
        settled: Phase of flight at which the legs have reached the new angle.
    """

    gain: float = -0.1
    limit: float = 0.15
    settled: float = 0.7

    def __post_init__(self) -> None:
        checks = {
            "gain": Interval(-10, 10, "rad s/m"),
            "limit": Interval(0, 1.5, "rad"),
            "settled": Interval(0, 1, above=True),
        }
        keep_reals(self, checks, "leg-angle regulation: ")

    def turn(self, speed_error: Array) -> Array:
        """Change of the leg angle [rad] for speed minus desired speed [m/s], shape (n,)."""
        return np.clip(self.gain * speed_error, -self.limit, self.limit)

    def profile(self, s: Array) -> tuple[Array, Array]:
        """Smooth step `x^2 (3 - 2 x)`, x = s / settled, of the change; and its derivative by s."""
        x = np.clip(s / self.settled, 0.0, 1.0)
        return x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / self.settled

    def profile_curvature(self, s: Array) -> Array:
        """Second derivative of `profile` by s; zero beyond the step."""
        x = s / self.settled
        return np.asarray(np.where(x < 1.0, 6.0 * (1.0 - 2.0 * x) / self.settled**2, 0.0))
