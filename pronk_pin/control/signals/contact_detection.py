"""Contact detection from the load on the feet, with hysteresis, and from the joints' rates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..._checks import SHARE, Interval, instance_of, keep_reals, whole
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
class ImpactDetector:
    """Detects a touchdown by the impact that the joint encoders measure.

    With the joints' rates v at the ticks t,

        J(t) = sum_j |v_j(t) - 2 v_j(t-1) + v_j(t-2)|,

    the change of their accelerations over a tick. An A1 that pronks on the nominal ground has J
    below 1.2 rad/s in flight, and 92 to 155 at touchdown; on soft ground (10 ms) 17 to 36. Where
    the flight's reference ends its rate steps to zero, and J is 24 to 27. White noise of 0.05 rad/s
    in each rate makes a J of 1.2 +- 0.3.

    Attributes:
        threshold: J above which it is an impact [rad/s].
        reference_end: The same once the flight's reference has ended [rad/s]. Motors that are late
            step later than it does.
        window: Ticks before a touchdown was felt in which its impact is looked for afterwards.
    """

    threshold: float = 12.0
    reference_end: float = 40.0
    window: int = 12

    def __post_init__(self) -> None:
        jump = Interval(0, 10_000, "rad/s", above=True)
        keep_reals(self, {"threshold": jump, "reference_end": jump}, "impact detection: ")
        whole("impact detection: window", self.window, Interval(0, 1000, "ticks"))

    def impact(self, rates: Array, ticks: IntArray, reference_end: IntArray) -> BoolArray:
        """Whether rates change as in an impact, shape (m, k); not where a sensor failed.

        Args:
            rates: Measured joint rates [rad/s], from two ticks before on, shape (m, k + 2, 12).
            ticks: The ticks of the flight, shape (k,) or (m, k).
            reference_end: Ticks from which on the flights' references are constant, shape (m,).
        """
        with np.errstate(invalid="ignore"):
            jump = np.abs(np.diff(rates, n=2, axis=1)).sum(axis=-1)
        ended = ticks > reference_end[:, None]
        return np.asarray(jump > np.where(ended, self.reference_end, self.threshold))


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
        impact: Detection of touchdowns by the joint encoders, beside the load; None without.
    """

    touchdown: float = 0.3
    liftoff: float = 0.1
    longest: float = 0.45
    least: float = 0.5
    impact: ImpactDetector | None = field(default_factory=ImpactDetector)

    def __post_init__(self) -> None:
        load = Interval(0, 100, above=True)
        checks = {"touchdown": load, "liftoff": load, "longest": SHARE, "least": SHARE}
        keep_reals(self, checks, "contact detection: ")
        if self.impact is not None:
            what = "an ImpactDetector, or None"
            instance_of("contact detection: impact", self.impact, ImpactDetector, what)
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
    """Touchdowns of n robots: load on their feet, or an impact, late enough in a flight.

    What comes first counts. Where nothing is late that is the load: of an impact between two ticks
    the feet tell at the next one, and the joints' rates one later.

    Args:
        spec: The load and the impact that are a touchdown.
        robot: The robot.
        flight: How long their flights last [s], shape (n,).
        timestep: Length of a tick [s].
        lateness: Ticks by which the load tells of a touchdown late, where no sensor is.
    """

    def __init__(
        self,
        spec: ContactDetector,
        robot: Robot,
        flight: Array,
        *,
        timestep: float,
        lateness: int,
    ) -> None:
        self._load = spec.touchdown * robot.mass * robot.gravity
        self._earliest = np.round(_EARLIEST_TOUCHDOWN * flight / timestep).astype(np.intp)
        self._impact, self._lateness = spec.impact, lateness

    def load(self, rows: IntArray, force: Array, ticks: IntArray) -> BoolArray:
        """Whether a touchdown is felt by its load, shape (m, k).

        Args:
            rows: Which robots.
            force: What their feet feel at each tick [N], shape (m, k, 4, 3).
            ticks: How many ticks of the flight have passed then, shape (k,) or (m, k).
        """
        load = force[..., 2].sum(axis=-1) > self._load
        return np.asarray(load & (ticks > self._earliest[rows, None]))

    def impact(
        self, rows: IntArray, rates: Array, ticks: slice, reference_end: IntArray
    ) -> BoolArray:
        """Whether a touchdown is felt by its impact, shape (m, k).

        Args:
            rows: Which robots.
            rates: All robots' measured joint rates in their flights [rad/s], shape (n, ticks, 12).
            ticks: The k ticks at which to look.
            reference_end: Ticks from which on the flights' references are constant, shape (m,).
        """
        felt = np.zeros((len(rows), ticks.stop - ticks.start), dtype=bool)
        first = max(ticks.start, 2, int(self._earliest[rows].min()))
        if self._impact is not None and first < ticks.stop:
            at, recent = np.arange(first, ticks.stop), rates[rows, first - 2 : ticks.stop]
            felt[:, first - ticks.start :] = self._impact.impact(recent, at, reference_end)
            felt[:, first - ticks.start :] &= at >= self._earliest[rows, None]
        return felt

    def lateness(
        self, rows: IntArray, rates: Array, felt: IntArray, reference_end: IntArray
    ) -> IntArray:
        """Find by how many ticks touchdowns were felt late, from their impacts, shape (m,).

        The load would have told at the tick of the first impact in the last ones before.

        Args:
            rows, rates, reference_end: As above.
            felt: How many ticks of the flights had passed when they were felt, shape (m,).
        """
        late = np.full(len(rows), self._lateness, dtype=np.intp)
        if self._impact is None:
            return late
        before = np.arange(-self._impact.window, 0)
        ticks = felt[:, None] + before  # (m, window)
        read = np.maximum(felt[:, None] + np.arange(before[0] - 2, 0), 0)
        impact = self._impact.impact(rates[rows[:, None], read], ticks, reference_end)
        impact &= ticks >= np.maximum(self._earliest[rows, None], 2)
        return np.asarray(np.where(impact.any(axis=1), late - before[impact.argmax(axis=1)], late))
