"""Schedule of a simulation: start-up, baseline and learning."""

from __future__ import annotations

from dataclasses import dataclass

from ..._checks import Interval, keep_reals
from ...errors import InvalidInput

SHORTEST = 1.0
"""Shortest baseline and learning together [s]: even a robot on the ground finishes a stride."""

_LIMITS = {
    "startup": Interval(0, 600, "s"),
    "baseline": Interval(0, 86_400, "s"),
    "learning": Interval(0, 86_400, "s"),
    "scatter": Interval(0, 0.5, "rad"),  # beyond, robots fall before they begin
}


@dataclass(frozen=True)
class Schedule:
    """Durations of a simulation's parts: the paper's procedure (section III.A).

    Attributes:
        startup: Standing in the posture of the first stride [s].
        baseline: Pronking without learning [s].
        learning: Pronking with the law switched on [s].
        scatter: Standard deviation of the joint angles at the start [rad].
    """

    startup: float = 0.5
    baseline: float = 20.0
    learning: float = 20.0
    scatter: float = 0.01

    def __post_init__(self) -> None:
        keep_reals(self, _LIMITS, "schedule: ")
        if self.baseline + self.learning < SHORTEST:
            raise InvalidInput(
                f"baseline and learning of {self.baseline:g} + {self.learning:g} s are too short "
                f"for a stride; make them {SHORTEST:g} s or more together"
            )

    @property
    def duration(self) -> float:
        """Duration of the whole simulation [s]."""
        return self.startup + self.baseline + self.learning
