"""Commanded speed over time: pieces of constant and of changing speed."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..._checks import Interval, reals, text
from ..._typing import Array
from ...errors import InvalidInput

_TIME = Interval(0, 86_400, "s")
_SPEED = Interval(-100, 100, "m/s")

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_PIECE = re.compile(rf"({_NUMBER})(?:\s*->\s*({_NUMBER}))?\s+({_NUMBER})\s*s")


@dataclass(frozen=True)
class SpeedProfile:
    """A speed that is commanded, piecewise linear in time; before and after it is held.

    Attributes:
        times: Times of its corners [s], not decreasing, from 0 on; two at one time are a step.
        speeds: Speeds there [m/s].
    """

    times: tuple[float, ...]
    speeds: tuple[float, ...]

    def __post_init__(self) -> None:
        keep = object.__setattr__
        keep(self, "times", reals("times of a speed profile", self.times, _TIME))
        keep(self, "speeds", reals("speeds of a speed profile", self.speeds, _SPEED))
        if not self.times or len(self.times) != len(self.speeds) or self.times[0] != 0.0:
            raise InvalidInput(
                f"a speed profile of {len(self.times)} times and {len(self.speeds)} speeds; give "
                "as many of both, the first time 0"
            )
        if any(later < earlier for earlier, later in pairwise(self.times)):
            raise InvalidInput("the times of a speed profile must not decrease; sort its corners")

    @classmethod
    def parse(cls, words: str) -> SpeedProfile:
        """Read a profile as it is written: "0 4s, 0->0.8 2s, 0.8 4s".

        Each piece is a speed [m/s], or two with an arrow between, and how long it lasts [s]. Where
        a piece begins at another speed than the last one ended, the command steps.

        Raises:
            InvalidInput: A piece is neither.
        """
        times: list[float] = []
        speeds: list[float] = []
        now = 0.0
        for piece in text("command", words).split(","):
            found = _PIECE.fullmatch(piece.strip())
            if found is None:
                raise InvalidInput(
                    f"command '{words}': '{piece.strip()}' is no piece of a speed profile; write "
                    "'0.4 3s' for a speed and how long, or '0->0.8 2s' for a ramp, with commas "
                    "between them"
                )
            begin, end, lasts = found[1], found[2] or found[1], float(found[3])
            for time, speed in ((now, float(begin)), (now + lasts, float(end))):
                if not times or (time, speed) != (times[-1], speeds[-1]):
                    times.append(time)
                    speeds.append(speed)
            now += lasts
        return cls(tuple(times), tuple(speeds))

    def __str__(self) -> str:
        """The profile as `parse` reads it."""
        pieces = []
        corners = zip(self.times, self.speeds, strict=True)
        for (begin, first), (end, last) in pairwise(corners):
            if end > begin:
                speeds = f"{first:g}" if first == last else f"{first:g}->{last:g}"
                pieces.append(f"{speeds} {end - begin:g}s")
        return ", ".join(pieces) or f"{self.speeds[0]:g} 0s"

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self.times[-1]

    def at(self, time: Array | float) -> Array:
        """The commanded speed at times [s], of their shape [m/s]; at a step the new one."""
        corners, speeds = np.array(self.times), np.array(self.speeds)
        time = np.asarray(time, dtype=float)
        before = np.clip(np.searchsorted(corners, time, side="right") - 1, 0, len(corners) - 1)
        after = np.minimum(before + 1, len(corners) - 1)
        span = np.maximum(corners[after] - corners[before], 1e-12)
        share = np.clip((time - corners[before]) / span, 0.0, 1.0)
        return np.asarray(speeds[before] + share * (speeds[after] - speeds[before]))
