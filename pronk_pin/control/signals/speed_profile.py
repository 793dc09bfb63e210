"""Commanded speed over time: pieces of constant and of changing speed."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..._checks import Interval, reals, text
from ..._typing import Array
from ...errors import InvalidInput
from ...storage import damaged, read_csv

_TIME = Interval(0, 86_400, "s")
_SPEED = Interval(-100, 100, "m/s")

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_PIECE = re.compile(rf"({_NUMBER})(?:\s*->\s*({_NUMBER}))?\s+({_NUMBER})\s*s")
_SINE = re.compile(rf"({_NUMBER})\s*\+-\s*({_NUMBER})\s*/\s*({_NUMBER})\s*s\s+({_NUMBER})\s*s")

_CORNERS = 32
"""Corners of a sine in each period."""

_MOST = 100_000
"""Most corners of a piece."""

_FILE_REMEDY = "write 'time,speed' and, below, both of each corner [s, m/s], the first time 0"


@dataclass(frozen=True)
class SpeedProfile:
    """A speed that is commanded, piecewise linear in time; before and after it is held.

    Attributes:
        times: Times of its corners [s], not decreasing, from 0 on; two at one time are a step.
        speeds: Speeds there [m/s].
        words: How it was written, if it was, as `parse` reads it.
    """

    times: tuple[float, ...]
    speeds: tuple[float, ...]
    words: str = field(default="", compare=False)

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
        """Read a profile as it is written: "0 4s, 0->0.8 2s, 0.8 4s", or the name of its file.

        Each piece is a speed [m/s], or two with an arrow between, and how long it lasts [s]; or
        "0.3+-0.2/5s 20s": a sine about 0.3 by 0.2 m/s with a period of 5 s, for 20 s. Where
        a piece begins at another speed than the last one ended, the command steps. What ends in
        .csv is a file, see `load`.

        Raises:
            InvalidInput: A piece is none of them.
            FileProblem: See `load`.
        """
        if text("command", words).strip().endswith(".csv"):
            return cls.load(Path(words.strip()).expanduser())
        times: list[float] = []
        speeds: list[float] = []
        now = 0.0
        for piece in words.split(","):
            corners = _corners(piece.strip())
            if corners is None:
                raise InvalidInput(
                    f"command '{words}': '{piece.strip()}' is no piece of a speed profile; write "
                    "'0.4 3s' for a speed and how long, '0->0.8 2s' for a ramp, or "
                    "'0.3+-0.2/5s 20s' for a sine, with commas between them"
                )
            for time, speed in zip(*corners, strict=True):
                if not times or (now + time, speed) != (times[-1], speeds[-1]):
                    times.append(now + time)
                    speeds.append(speed)
            now += corners[0][-1]
        written = ", ".join(" ".join(piece.split()) for piece in words.split(","))
        return cls(tuple(times), tuple(speeds), written)

    @classmethod
    def load(cls, path: Path) -> SpeedProfile:
        """Read a profile from a file: "time,speed", then a row for each corner.

        Raises:
            FileProblem: The file is missing, or is no such table.
        """
        rows = read_csv(path, _FILE_REMEDY)[1:]
        try:
            times, speeds = np.array(rows, dtype=float).T.tolist()
            return cls(tuple(times), tuple(speeds))
        except (ValueError, InvalidInput) as error:
            raise damaged(path, error, _FILE_REMEDY, what="speed profile") from error

    def __str__(self) -> str:
        """The profile as `parse` reads it."""
        if self.words:
            return self.words
        pieces = []
        corners = zip(self.times, self.speeds, strict=True)
        for (begin, first), (end, last) in pairwise(corners):
            if end > begin:
                speeds = f"{first:g}" if first == last else f"{first:g}->{last:g}"
                pieces.append(f"{speeds} {end - begin:g}s")
        return ", ".join(pieces) or f"{self.speeds[0]:g} 0s"

    @property
    def slowest(self) -> float:
        """Least speed [m/s]."""
        return min(self.speeds)

    @property
    def fastest(self) -> float:
        """Greatest speed [m/s]."""
        return max(self.speeds)

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


def _corners(piece: str) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Times from the beginning of a piece [s], and speeds [m/s]; None if it is no piece."""
    if found := _PIECE.fullmatch(piece):
        begin, end, lasts = found[1], found[2] or found[1], float(found[3])
        return (0.0, lasts), (float(begin), float(end))
    if found := _SINE.fullmatch(piece):
        mean, swing, period, lasts = map(float, found.groups())
        if period > 0.0:
            count = max(int(np.ceil(_CORNERS * lasts / period)), 1)
            times = np.linspace(0.0, lasts, min(count, _MOST) + 1)
            speeds = mean + swing * np.sin(2.0 * np.pi * times / period)
            return tuple(times.tolist()), tuple(speeds.tolist())
    return None
