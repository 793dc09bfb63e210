"""Commanded speeds: the gait of each stride, and the torques that were learned for it, by speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from .._checks import instance_of, known_name, none_or, sequence_of
from .._typing import Array, IntArray
from ..errors import InvalidInput, SpeedOutOfRange
from ..gait import Gait, GaitLibrary
from .controller import GaitChange, lift_off_speed
from .learning import InitialFeedforward, TorqueLibrary
from .signals import SpeedProfile

SpeedReference = Literal["commanded", "measured"]
REFERENCES: tuple[SpeedReference, ...] = ("commanded", "measured")
"""Speeds by which the gaits are chosen: the command's, or, as the paper has it, the torso's."""


class _Skill(NamedTuple):
    """What robots play at a speed beside their gaits."""

    feedforward: Array
    """[N m], shape (m, 2, samples, 12)."""
    flight: Array
    """Durations of their flights over the planned ones, shape (m,)."""


class SpeedCommand:
    """Chooses the gaits of n robots anew at each stride, between those of a library: eq. (13).

    Feedforward that was learned, or computed, at some speeds goes with them, interpolated. What a
    robot learns on the way is kept as the difference to it.

    Args:
        profiles: The commanded speed of each robot.
        library: Gaits at the speeds that are commanded.
        torque: Feedforward by speed; none by default.
        reference: By which speed: "commanded", or "measured", that of the torso at the last
            lift-off, with the commanded one left to the regulation of eq. (12), as in the paper.
        apex: Apex of the gaits [m]; the library's by default.

    Raises:
        SpeedOutOfRange: A command is beyond the library, or the torques.
    """

    def __init__(
        self,
        profiles: Sequence[SpeedProfile],
        library: GaitLibrary,
        *,
        torque: TorqueLibrary | None = None,
        reference: str = "commanded",
        apex: float | None = None,
    ) -> None:
        self.profiles = sequence_of(
            "profiles", profiles, lambda name, each: instance_of(name, each, SpeedProfile)
        )
        if not self.profiles:
            raise InvalidInput("no profiles; give one for each robot")
        instance_of("library", library, GaitLibrary)
        none_or(instance_of, "torque", torque, TorqueLibrary)
        self.reference = known_name("speed of reference", reference, REFERENCES)
        self._library, self._apex, self._torque = library, apex, torque
        self._speed = np.array([float(profile.speeds[0]) for profile in self.profiles])
        speeds = [np.array([part.speeds[0], part.speeds[-1]]) for part in (library, torque) if part]
        self._slowest = max(low for low, _ in speeds)
        self._fastest = min(high for _, high in speeds)
        if torque is not None:
            planned = [gait.flight.duration for gait in self._gaits(torque.speeds)]
            self._ratio = torque.flight / np.array(planned)
        for speed in {speed for profile in self.profiles for speed in profile.speeds}:
            if not self._slowest <= speed <= self._fastest:
                raise SpeedOutOfRange(speed, float(self._slowest), float(self._fastest))

    @property
    def first_gaits(self) -> list[Gait]:
        """The gaits that the robots begin with."""
        return self._gaits(self._speed)

    @property
    def all_gaits(self) -> tuple[Gait, ...]:
        """The library's gaits, which none that is played is longer than."""
        return self._library.gaits

    @property
    def initial_feedforward(self) -> InitialFeedforward:
        """The torques that they begin with, and how long their flights last then."""
        if self._torque is None:
            return InitialFeedforward()
        skill = self._skill(self._speed)
        planned = np.array([gait.flight.duration for gait in self.first_gaits])
        return InitialFeedforward(skill.feedforward, skill.flight * planned)

    def commanded(self, rows: IntArray, time: Array) -> Array:
        """Commanded speeds of some robots at times of their own (m,) [m/s]."""
        pairs = zip(rows, time, strict=True)
        return np.array([float(self.profiles[row].at(now)) for row, now in pairs])

    def change(self, rows: IntArray, commanded: Array, measured: Array) -> GaitChange:
        """What robots that lift off go on with.

        Args:
            rows: Which robots.
            commanded: Their commanded speeds [m/s], shape (m,).
            measured: Speeds of their torsos [m/s], shape (m,).
        """
        speed = commanded if self.reference == "commanded" else measured
        speed = np.where(np.isfinite(speed), speed, commanded)
        speed = np.clip(speed, self._slowest, self._fastest)
        before, after = self._skill(self._speed[rows]), self._skill(speed)
        gaits = self._gaits(speed)
        wanted = gaits if self.reference == "commanded" else self._gaits(commanded)
        self._speed[rows] = speed
        return GaitChange(
            gaits,
            after.feedforward - before.feedforward,
            after.flight / before.flight,
            np.array([lift_off_speed(gait) for gait in wanted]),
        )

    def _gaits(self, speeds: Array) -> list[Gait]:
        return [self._library.at(float(speed), self._apex) for speed in speeds]

    def _skill(self, speeds: Array) -> _Skill:
        if self._torque is None:
            return _Skill(np.zeros(1), np.ones(len(speeds)))
        ratio = np.interp(speeds, self._torque.speeds, self._ratio)
        return _Skill(self._torque.at(speeds), ratio)
