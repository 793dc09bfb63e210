"""Guard of a learner: keeps the best of what was learned, and goes back to it when errors grow.

Learning that has converged in one world may grow without bound in another, where the model of none
of its laws holds: slowly, so that no single stride shows it. The guard looks at means over a window
of strides, and needs no model. It acts on the steps of the laws, never on their fixed point:

    ff <- ff + step (law(ff) - ff),   T <- T + step (timing(T) - T)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..._checks import SHARE, Interval, keep_reals, whole
from ..._typing import Array, BoolArray, IntArray


@dataclass(frozen=True)
class LearningGuard:
    """Settings of the guard of a learner.

    With m the root mean square of a robot's errors over the last `window` strides that it learned
    from, and best the smallest m so far: where m is smaller than best, the means of feedforward and
    flight duration over that window are kept. Where `m > max(growth best, best + margin)` in
    `patience` strides running, or so many strides running could not be learned from, the robot
    goes back to what was kept, and its steps are multiplied by `shrink` from then on.

    Attributes:
        window: Strides of a mean.
        growth: Factor on the best error above which learning has become worse.
        margin: Error above the best one that is always granted [rad].
        patience: Strides running that are worse, or not learned from, until the robot goes back.
        shrink: Factor on the steps each time that it does.
        least: Smallest step.
    """

    window: int = 6
    growth: float = 1.3
    margin: float = 0.003
    patience: int = 3
    shrink: float = 0.6
    least: float = 0.15

    def __post_init__(self) -> None:
        prefix = "a learning guard: "
        for name in ("window", "patience"):
            whole(prefix + name, getattr(self, name), Interval(1, 1000))
        checks = {
            "growth": Interval(1, 100),
            "margin": Interval(0, 10, "rad"),
            "shrink": SHARE,
            "least": SHARE,
        }
        keep_reals(self, checks, prefix)


class Memory(NamedTuple):
    """Learned memory of n robots: what the next stride is played with."""

    feedforward: Array
    """On the phase grids of stance and flight [N m], shape (n, 2, samples, 12)."""
    flight: Array
    """Durations of the flights' references [s], shape (n,)."""


@dataclass
class GuardState:
    """The guard of n robots, stride by stride.

    Attributes:
        settings: Its settings.
        best: What is kept: that of the best window, or of the beginning.
        step: Factor on the laws' steps, shape (n,).
        rollbacks: How often each robot went back, shape (n,).
    """

    settings: LearningGuard
    best: Memory
    step: Array = field(init=False)
    rollbacks: IntArray = field(init=False)

    def __post_init__(self) -> None:
        n, window = len(self.best.flight), self.settings.window
        self.best = Memory(*(part.copy() for part in self.best))
        self.step, self.rollbacks = np.ones(n), np.zeros(n, dtype=np.intp)
        self._least_error = np.full(n, np.inf)
        self._squares, self._flight = np.zeros((2, n, window))
        self._feedforward = np.zeros((n, window, *self.best.feedforward.shape[1:]))
        self._filled, self._worse, self._skipped = np.zeros((3, n), dtype=np.intp)

    def judge(self, rows: IntArray, usable: BoolArray, error: Array, played: Memory) -> BoolArray:
        """Judge the last strides of some robots that are learning.

        Args:
            rows: Which robots.
            usable: Whether their strides can be learned from, shape (m,).
            error: Root mean square of the joints' errors over the stride [rad], shape (m,).
            played: What the strides were played with, of these robots.

        Returns:
            Which of them go back to `best` instead of learning, shape (m,).
        """
        settings = self.settings
        self._skipped[rows] = np.where(usable, 0, self._skipped[rows] + 1)
        self._remember(rows[usable], error[usable], Memory(*(part[usable] for part in played)))
        back = (self._worse[rows] >= settings.patience) & usable
        back |= self._skipped[rows] >= settings.patience
        who = rows[back]
        self.step[who] = np.maximum(settings.least, settings.shrink * self.step[who])
        self.rollbacks[who] += 1
        for count in (self._filled, self._worse, self._skipped):
            count[who] = 0
        return back

    def _remember(self, rows: IntArray, error: Array, played: Memory) -> None:
        """Take usable strides into the windows, and keep those that are the best so far."""
        slot = self._filled[rows] % self.settings.window
        self._squares[rows, slot] = error**2
        self._feedforward[rows, slot] = played.feedforward
        self._flight[rows, slot] = played.flight
        self._filled[rows] += 1
        rows = rows[self._filled[rows] >= self.settings.window]
        mean, best = np.sqrt(self._squares[rows].mean(axis=1)), self._least_error[rows]
        better = rows[mean < best]
        self._least_error[better] = mean[mean < best]
        self.best.feedforward[better] = self._feedforward[better].mean(axis=1)
        self.best.flight[better] = self._flight[better].mean(axis=1)
        limit = np.maximum(self.settings.growth * best, best + self.settings.margin)
        self._worse[rows] = np.where(mean > limit, self._worse[rows] + 1, 0)
