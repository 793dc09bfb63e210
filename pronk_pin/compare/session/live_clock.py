"""Clock of a live session: simulated time goes as fast as the wall's, at a rate of one's choice."""

from __future__ import annotations

import threading
import time

from ..._checks import Interval, real

RATES = Interval(0.02, 20.0)
"""Simulated seconds for each second of the wall's."""

_LATE = 0.6
"""Lateness from which on the clock goes back to where the robots are, not to race after it [s]."""


class LiveClock:
    """Simulated time that threads wait for; it can be paused, and never runs away from the robots.

    Attributes:
        slipped: Time by which the robots could not follow in all [s], of the wall's.
    """

    def __init__(self, rate: float = 1.0) -> None:
        self._changed = threading.Condition()
        self._rate = real("rate", rate, RATES)
        self._paused = True
        self._ended = False
        self._then, self._at = time.monotonic(), 0.0  # wall's time, and simulated time then
        self.slipped = 0.0

    @property
    def rate(self) -> float:
        """Simulated seconds for each second of the wall's."""
        return self._rate

    @rate.setter
    def rate(self, rate: float) -> None:
        rate = real("rate", rate, RATES)
        with self._changed:
            self._anchor(self.now)
            self._rate = rate

    @property
    def paused(self) -> bool:
        """Whether it stands still."""
        return self._paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        with self._changed:
            self._anchor(self.now)
            self._paused = paused

    @property
    def now(self) -> float:
        """Simulated time [s]."""
        if self._paused:
            return self._at
        return self._at + self._rate * (time.monotonic() - self._then)

    def set(self, now: float) -> None:
        """Go on from another simulated time [s]."""
        with self._changed:
            self._anchor(now)

    def end(self) -> None:
        """Let nobody wait any more."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def wait(self, until: float, wakened: threading.Event) -> None:
        """Wait for a simulated time [s]; less long where somebody is `wakened`.

        Who comes late makes the clock go back, so that what is missed is not made up for.
        """
        with self._changed:
            late = self.now - until
            if late > _LATE * self._rate:
                self.slipped += late / self._rate
                self._anchor(until)
            while not self._ended and not wakened.is_set():
                left = (until - self.now) / self._rate
                if left <= 0.0 and not self._paused:
                    return
                self._changed.wait(None if self._paused else left)

    def wake(self) -> None:
        """Have all who wait look again."""
        with self._changed:
            self._changed.notify_all()

    def _anchor(self, now: float) -> None:
        self._then, self._at = time.monotonic(), now
        self._changed.notify_all()
