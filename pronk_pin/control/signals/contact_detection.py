"""Contact detection from the load on the feet, with hysteresis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..._checks import SHARE, Interval, keep_reals
from ..._typing import Array, BoolArray, IntArray
from ...errors import InvalidInput
from ...robot import Robot

_EARLIEST_TOUCHDOWN = 0.5
"""Phase of flight before which contact is the lift-off's, not a touchdown."""


class StanceContact(NamedTuple):
    """Contacts of n robots over one stance, as the load on their feet tells."""

    gap: IntArray
    """Ticks of the longest time without contact, shape (n,)."""
    share: Array
    """Share of the stance in which there was contact, shape (n,)."""


@dataclass(frozen=True)
class ContactDetector:
    """Detects contact by a threshold with hysteresis on the load of all feet over the weight.

    A contact begins where the load exceeds `touchdown`, and ends where it falls below `liftoff`;
    in between it stays what it was, so that noise does not make many contacts of one. On an A1 with
    force sensors of 3 N noise in each foot, 0.3 of the weight is seven standard deviations.

    In its first strides, or with heavy rotors, a robot commonly bounces off the ground again after
    two milliseconds, for up to 65 ms of a stance of 160, and learns to do without: a second contact
    is no reason not to learn. A robot that is in the air for longer than that has begun its stance
    on a touchdown that was none. (One that was felt less than those 65 ms too early looks like a
    bounce, and is learned from.)

    Attributes:
        touchdown: Load above which a contact begins, over the weight.
        liftoff: Load below which it ends, over the weight.
        longest: Share of the stance that a bounce takes at most.
        least: Share of the stance that has to be contact.
    """

    touchdown: float = 0.3
    liftoff: float = 0.1
    longest: float = 0.45
    least: float = 0.5

    def __post_init__(self) -> None:
        load = Interval(0, 100, above=True)
        checks = {"touchdown": load, "liftoff": load, "longest": SHARE, "least": SHARE}
        keep_reals(self, checks, "contact detection: ")
        if not self.liftoff <= self.touchdown:
            raise InvalidInput(
                f"contact detection needs liftoff <= touchdown, as shares of the weight; got "
                f"{self.liftoff:g} and {self.touchdown:g}"
            )

    def contact(self, load: Array) -> BoolArray:
        """Detect contact at each tick; none before the first load above `touchdown`.

        Args:
            load: Load on all feet over the weight, shape (n, ticks). NaN, of a sensor that fails,
                changes nothing.

        Returns:
            Shape (n, ticks).
        """
        decided = np.where(load > self.touchdown, 1, np.where(load < self.liftoff, 0, -1))
        ticks = np.where(decided >= 0, np.arange(load.shape[1]), -1)
        latest = np.maximum.accumulate(ticks, axis=1)  # the last tick that decided
        state = np.take_along_axis(decided, np.maximum(latest, 0), axis=1)
        return np.asarray((latest >= 0) & (state == 1))

    def stance(self, load: Array, length: IntArray) -> StanceContact:
        """Measure contact and gaps of stances of so many ticks (n,) by their loads (n, ticks)."""
        ticks = np.arange(load.shape[1])
        contact = self.contact(load) & (ticks < length[:, None])
        last = np.maximum.accumulate(np.where(contact, ticks, -1), axis=1)  # tick of contact
        gap = np.where(ticks < length[:, None], ticks - last, 0).max(axis=1)
        return StanceContact(gap, contact.sum(axis=1) / length)

    def false_touchdown(self, stance: StanceContact, length: IntArray) -> BoolArray:
        """Whether stances began without ground contact: their touchdown was false, shape (n,)."""
        return np.asarray(stance.gap > self.longest * length)

    def contact_lost(self, stance: StanceContact) -> BoolArray:
        """Whether stances were spent in the air for the most part, shape (n,)."""
        return np.asarray(stance.share < self.least)


class TouchdownDetector:
    """Touchdowns of n robots: the load on their feet at a tick that is late enough in a flight.

    Args:
        spec: The load that is a contact.
        robot: The robot.
        flight: How long their flights last [s], shape (n,).
        timestep: Length of a tick [s].
    """

    def __init__(
        self, spec: ContactDetector, robot: Robot, flight: Array, *, timestep: float
    ) -> None:
        self._load = spec.touchdown * robot.mass * robot.gravity
        self._earliest = np.round(_EARLIEST_TOUCHDOWN * flight / timestep).astype(np.intp)

    def felt(self, rows: IntArray, force: Array, ticks: IntArray) -> BoolArray:
        """Whether a touchdown is felt, shape (m, ticks).

        Args:
            rows: Which robots.
            force: What their feet feel at each tick [N], shape (m, ticks, 4, 3).
            ticks: How many ticks of the flight have passed then, shape (ticks,).
        """
        load = force[..., 2].sum(axis=-1) > self._load
        return np.asarray(load & (ticks > self._earliest[rows, None]))
