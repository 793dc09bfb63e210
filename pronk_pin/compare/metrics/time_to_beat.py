"""Strides of learning until the error is below that of the model's feedforward."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from ..._typing import Array
from ...control import SKIPPED

RIVAL = "model"
"""The controller that learning has to beat."""

LEARNER = "ilc"
"""Learning, when it is asked whether it beats the model."""

JUDGED = ("calf", "thigh")
"""Joints whose error counts."""

WINDOW = 5
"""Strides whose mean error is compared, so that one lucky or unlucky stride decides nothing."""


class PeakHistory(NamedTuple):
    """Peak errors of a simulation, by which it is compared with another."""

    settings: Mapping[str, object]
    """robot, base, scenario, controller and seed."""
    speeds: Array
    """Desired speeds [m/s], shape (n,)."""
    learning: tuple[Array, ...]
    """Peak errors of calf and thigh in the strides of learning [rad], (strides, 2) a robot."""
    level: Array
    """Their means in steady state [rad], shape (n, 2)."""
    upright: Array
    """1 for robots that never fell, NaN for those that finished no stride, shape (n,)."""


def strides_to_beat(peaks: Array, level: float) -> float:
    """Count the strides of learning until the error is below a level for good.

    The first stride below the level from which on every mean over `WINDOW` strides is, too.

    Args:
        peaks: Peak errors by stride of learning [rad], shape (strides,).
        level: The level to beat [rad].

    Returns:
        The number of the stride, 1 for the first; NaN if it never is, or does not stay.
    """
    if peaks.size < WINDOW:
        return float("nan")
    below = np.convolve(peaks, np.full(WINDOW, 1.0 / WINDOW), "valid") < level
    above = np.flatnonzero(~below)
    first = int(above[-1]) + 1 if above.size else 0
    if first >= below.size:
        return float("nan")
    return float(first + np.argmax(peaks[first:] < level) + 1)


def beat_rows(histories: Sequence[PeakHistory]) -> Iterator[dict[str, object]]:
    """Rows of the summary: `strides_to_beat_model` of every robot that learned.

    For calf and thigh, and `-` for the later of the two; only where the model's feedforward was
    run in the same scenario with the same seed.
    """
    rivals = {
        _place(history): history for history in histories if history.settings["controller"] == RIVAL
    }
    for history in histories:
        rival = rivals.get(_place(history))
        if rival is None or not any(len(peaks) for peaks in history.learning):
            continue
        for k, speed in enumerate(history.speeds):
            counts = [
                strides_to_beat(history.learning[k][:, j], float(rival.level[k, j]))
                for j in range(len(JUDGED))
            ]
            if history.upright[k] != 1:
                counts = [float("nan")] * len(JUDGED)  # who fell has beaten nobody
            for joint, value in zip((*JUDGED, "-"), (*counts, np.max(counts)), strict=True):
                yield {
                    **history.settings,
                    "speed": float(speed),
                    "joint": joint,
                    "metric": "strides_to_beat_model",
                    "value": float(value),
                    "unit": "1",
                }


class Lessons(NamedTuple):
    """What strides of learning were worth."""

    strides: int
    """Strides of all robots that were made with the learning law on."""
    skipped: Mapping[str, int]
    """How many of them taught nothing, by the reason."""

    @property
    def taught(self) -> int:
        """How many strides something was learned from."""
        return self.strides - sum(self.skipped.values())


def lessons(summary: pd.DataFrame, *, controller: str) -> Lessons | None:
    """What the strides of learning were worth to a controller; None without such strides."""
    mine = summary[(summary["controller"] == controller) & (summary["joint"] == "-")]
    counts = mine.groupby("metric")["value"].sum()
    if "strides_of_learning" not in counts:
        return None
    skipped = {
        reason: int(counts[name])
        for reason in SKIPPED
        if (name := f"skipped_{reason.replace(' ', '_')}") in counts
    }
    return Lessons(int(counts["strides_of_learning"]), skipped)


def _place(history: PeakHistory) -> tuple[object, ...]:
    return history.settings["scenario"], history.settings["seed"], *history.speeds


def beaten(summary: pd.DataFrame, *, controller: str) -> tuple[float, int, int]:
    """Count the strides that it took a controller to beat the model, in calf and thigh.

    Returns:
        Median over the robots that did (NaN without one), how many did, and how many there are.
    """
    rows = (summary["metric"] == "strides_to_beat_model") & (summary["joint"] == "-")
    counts = summary[rows & (summary["controller"] == controller)]["value"].to_numpy()
    did = counts[~np.isnan(counts)]
    return float(np.median(did)) if did.size else float("nan"), int(did.size), int(counts.size)
