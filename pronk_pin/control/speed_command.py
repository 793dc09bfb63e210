"""Commanded speeds: the gait of each stride, and what was learned for it, by speed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from .._checks import instance_of, known_name, none_or, sequence_of
from .._typing import Array, IntArray
from ..errors import InvalidInput, SpeedOutOfRange
from ..gait import Gait, GaitLibrary
from .learning import InitialFeedforward, TorqueLibrary
from .signals import PARTS, SAMPLES, SpeedProfile

SpeedReference = Literal["commanded", "measured"]
REFERENCES: tuple[SpeedReference, ...] = ("commanded", "measured")
"""Speeds by which the gaits are chosen: the command's, or, as the paper has it, the torso's."""


class GaitChange(NamedTuple):
    """Other gaits for m robots, and what changes with them; see `Controller.liftoff`."""

    gaits: Sequence[Gait]
    """The gait that each lands in."""
    speed: Array
    """Its speed [m/s], shape (m,)."""
    lift_off_speed: Array
    """Speed that the regulation wants at lift-off [m/s], shape (m,)."""


def lift_off_speed(gait: Gait) -> float:
    """Speed of the trunk with which a gait leaves the ground [m/s]."""
    return float(gait.stance.base_reference(np.array([1.0]))[1][0, 0])


class SpeedMemory:
    """Feedforward and timing of n robots over the speed: at knots, and linear between them.

    A stride at a speed v between two knots teaches both by their weights w: with what was learned
    there, d, knot i becomes `m_i + d w_i / sum_j w_j^2`, so that the memory at v becomes `m + d`.

    Args:
        n: Number of robots.
        speeds: Speeds of the knots [m/s], increasing.
        feedforward: Torques there to begin with [N m], shape (knots, 2, samples, 12).
        stretch: Durations of the flights there over the planned ones, shape (knots,).

    Attributes:
        feedforward: Torques of each robot [N m], shape (n, knots, 2, samples, 12).
        stretch: Flights' durations over the planned ones, shape (n, knots).
    """

    def __init__(self, n: int, speeds: Array, feedforward: Array, stretch: Array) -> None:
        self.speeds = speeds
        self.feedforward = np.tile(feedforward, (n, 1, 1, 1, 1))
        self.stretch = np.tile(stretch, (n, 1))

    def _weights(self, speed: Array) -> tuple[IntArray, Array]:
        """Lower knots of speeds (m,) and the weights of the upper ones."""
        place = np.interp(speed, self.speeds, np.arange(len(self.speeds)))
        lower = np.minimum(place.astype(np.intp), max(len(self.speeds) - 2, 0))
        return lower, place - lower

    def at(self, rows: IntArray, speed: Array, part: int) -> Array:
        """Torques of robots in a part of the stride at speeds (m,) [N m], (m, samples, 12)."""
        lower, weight = self._weights(speed)
        upper = np.minimum(lower + 1, len(self.speeds) - 1)
        below, above = self.feedforward[rows, lower, part], self.feedforward[rows, upper, part]
        return np.asarray(below + weight[:, None, None] * (above - below))

    def stretch_at(self, rows: IntArray, speed: Array) -> Array:
        """Flights' durations over the planned ones at speeds, shape (m,)."""
        lower, weight = self._weights(speed)
        upper = np.minimum(lower + 1, len(self.speeds) - 1)
        below, above = self.stretch[rows, lower], self.stretch[rows, upper]
        return np.asarray(below + weight * (above - below))

    def teach(self, rows: IntArray, speed: Array, part: int, learned: Array) -> None:
        """Teach what came on top of the torques at speeds (m,), (m, samples, 12) [N m]."""
        for knots, weight in self._shares(speed):
            self.feedforward[rows, knots, part] += weight[:, None, None] * learned

    def teach_stretch(self, rows: IntArray, speed: Array, learned: Array) -> None:
        """Teach what came on top of the flights' durations over the planned ones, (m,)."""
        for knots, weight in self._shares(speed):
            self.stretch[rows, knots] += weight * learned

    def _shares(self, speed: Array) -> list[tuple[IntArray, Array]]:
        lower, weight = self._weights(speed)
        if len(self.speeds) == 1:
            return [(lower, np.ones(len(speed)))]
        square = weight**2 + (1.0 - weight) ** 2
        return [(lower, (1.0 - weight) / square), (lower + 1, weight / square)]


class SpeedCommand:
    """Chooses the gaits of n robots anew at each stride, between those of a library: eq. (13).

    Feedforward that was learned, or computed, at some speeds goes with them, interpolated; and what
    a robot learns on the way is stored by speed.

    Args:
        profiles: The commanded speed of each robot.
        library: Gaits at the speeds that are commanded.
        torque: Feedforward by speed; none by default. That of a library of conditions is as at its
            `home`, until the robots estimate where they are.
        reference: By which speed: "commanded", or "measured", that of the torso at the last
            lift-off, with the commanded one left to the regulation of eq. (12), as in the paper.
        apex: Apex of the gaits [m]; the library's by default.

    Attributes:
        memory: What the robots play, by speed.
        speed: Speed of the gait that each robot lands in, or stands in [m/s], shape (n,).

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
        self._library, self._apex = library, apex
        self._learned = torque if torque is not None and torque.conditions else None
        torque = torque if torque is None else torque.in_conditions()
        speeds = library.speeds if torque is None else torque.speeds
        self._slowest = float(max(speeds[0], library.speeds[0]))
        self._fastest = float(min(speeds[-1], library.speeds[-1]))
        for profile in self.profiles:
            self._check_covers(profile)
        self.speed = np.array([float(profile.speeds[0]) for profile in self.profiles])
        self.memory = self._memory(speeds, torque)

    def _check_covers(self, profile: SpeedProfile) -> None:
        for speed in (profile.slowest, profile.fastest):
            if not self._slowest <= speed <= self._fastest:
                raise SpeedOutOfRange(speed, self._slowest, self._fastest)

    def follow(self, profiles: Sequence[SpeedProfile]) -> None:
        """Command other profiles from now on, one for each robot, on the same clock.

        Raises:
            SpeedOutOfRange: One is beyond the library, or the torques.
        """
        for profile in profiles:
            self._check_covers(profile)
        self.profiles = tuple(profiles)

    def learned(self, row: int) -> TorqueLibrary:
        """What a robot's memory holds, by speed; its spread is not known, and stands as none."""
        torque, planned = self.memory.feedforward[row].copy(), self._planned(self.memory.speeds)
        stretch = self.memory.stretch[row]
        return TorqueLibrary(self.memory.speeds, torque, np.zeros_like(torque), stretch * planned)

    def remember(self, torque: TorqueLibrary | None) -> None:
        """Have the robots play other torques from their next touchdown on; None for none.

        Beyond the speeds of the torques they are held as they are at the nearest of them; where
        they are of conditions, too, those of `TorqueLibrary.home` are played.

        Raises:
            InvalidInput: The torques are of another number of joints, or samples.
        """
        memory = self.memory
        if torque is None:
            memory.feedforward[:], memory.stretch[:] = 0.0, 1.0
            return
        if torque.torque.shape[-3:] != memory.feedforward.shape[2:]:
            raise InvalidInput(
                f"torques of shape {torque.torque.shape[-3:]} at each speed, and these robots take "
                f"{memory.feedforward.shape[2:]}; give a library that was learned by this robot"
            )
        torque = torque.in_conditions()
        near = np.clip(memory.speeds, torque.speeds[0], torque.speeds[-1])
        near = np.clip(near, self._library.speeds[0], self._library.speeds[-1])
        flight = np.interp(near, torque.speeds, torque.flight)
        memory.feedforward[:], memory.stretch[:] = torque.at(near), flight / self._planned(near)

    def _planned(self, speeds: Array) -> Array:
        """How long flights are planned to last at speeds [s]."""
        return np.array([gait.flight.duration for gait in self.gaits_at(speeds)])

    def _memory(self, speeds: Array, torque: TorqueLibrary | None) -> SpeedMemory:
        n, gaits = len(self.profiles), self.gaits_at(speeds)
        if torque is None:
            joints = gaits[0].stance.joints.shape[0]
            none = np.zeros((len(gaits), len(PARTS), SAMPLES, joints))
            return SpeedMemory(n, speeds, none, np.ones(len(gaits)))
        planned = np.array([gait.flight.duration for gait in gaits])
        return SpeedMemory(n, speeds, torque.torque, torque.flight / planned)

    @property
    def first_gaits(self) -> list[Gait]:
        """The gaits that the robots begin with."""
        return self.gaits_at(self.speed)

    @property
    def speeds(self) -> Array:
        """Speeds of the library [m/s]."""
        return self._library.speeds

    @property
    def all_gaits(self) -> tuple[Gait, ...]:
        """The library's gaits, than which none that is played is longer."""
        return self._library.gaits

    @property
    def initial_feedforward(self) -> InitialFeedforward:
        """The torques that they begin with, and how long their flights last then."""
        rows = np.arange(len(self.speed))
        torque = [self.memory.at(rows, self.speed, part) for part in range(len(PARTS))]
        planned = np.array([gait.flight.duration for gait in self.first_gaits])
        stretch = self.memory.stretch_at(rows, self.speed)
        return InitialFeedforward(np.stack(torque, axis=1), stretch * planned, self._learned)

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
        gaits = self.gaits_at(speed)
        wanted = gaits if self.reference == "commanded" else self.gaits_at(commanded)
        self.speed[rows] = speed
        return GaitChange(gaits, speed, np.array([lift_off_speed(gait) for gait in wanted]))

    def gaits_at(self, speeds: Array) -> list[Gait]:
        """The gaits of some speeds [m/s]."""
        return [self._library.at(float(speed), self._apex) for speed in speeds]
