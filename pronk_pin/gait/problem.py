"""Gait problems: contact sequence, bounds, weights and demands of an optimisation."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal

from .._checks import (
    Interval,
    instance_of,
    keep_reals,
    known_name,
    reals,
    sequence_of,
    text,
    whole,
)
from ..errors import InvalidInput
from ..kinematics import CONTACTS, Contact, mirror
from ..robot import Base, Robot, as_robot

Pair = Literal["front", "rear"]
"""A pair of legs, left and right: in a gait with mirror symmetry they do the same."""

PAIRS: tuple[Pair, ...] = ("front", "rear")


_DURATION = Interval(high=10.0, unit="s")

_NUMBERS = {
    "speed": Interval(-100, 100, "m/s"),
    "apex": Interval(0, 100, "m", above=True),
    "friction": Interval(0, 10, above=True),
    "torque_weight": Interval(0, 1e6, "1/(N m)^2", above=True),
    "velocity_weight": Interval(0, 1e6, "1/(rad/s)^2"),
    "torque_use": Interval(0, 10, above=True),
    "velocity_use": Interval(0, 10, above=True),
    "hip_limit": Interval(0, 3.2, "rad", above=True),
    "pitch_limit": Interval(0, 1.5, "rad", above=True),
    "trunk_height": Interval(0, 10, "m"),
    "clearance": Interval(0, 1, "m"),
}
"""What the numbers of a problem can be; `gait.optimisation.ballistics` knows more of speed and
apex."""


def _duration_range(name: str, limits: tuple[float, float]) -> tuple[float, float]:
    shortest, longest = reals(f"{name} (shortest, longest)", limits, _DURATION, length=2)
    if not 0.0 < shortest <= longest:
        raise InvalidInput(
            f"{name} lasts from {shortest:g} to {longest:g} s; "
            "give two positive durations, the shorter one first"
        )
    return shortest, longest


@dataclass(frozen=True)
class ContactPhase:
    """One phase of a contact sequence.

    Attributes:
        name: Its name, "stance" or "flight" in pronking.
        stands: The pairs of legs that stand on the ground.
        duration: How long it may last, shortest and longest [s].
        intervals: Mesh intervals.
        order: Order of the Bezier polynomials that keep it.
    """

    name: str
    stands: tuple[Pair, ...]
    duration: tuple[float, float]
    intervals: int
    order: int

    def __post_init__(self) -> None:
        if not text("name of a phase", self.name):
            raise InvalidInput("a phase needs a name; give one, as 'stance'")
        keep = object.__setattr__
        keep(self, "duration", _duration_range(self.name, self.duration))
        keep(self, "stands", sequence_of(f"{self.name}: stands", self.stands, text))
        for pair in self.stands:
            known_name("pair of legs", pair, PAIRS)
        for name, most in (("intervals", 1000), ("order", 60)):
            keep(
                self, name, whole(f"{self.name}: {name}", getattr(self, name), Interval(high=most))
            )
        if self.intervals < 4 or self.intervals % 2:
            raise InvalidInput(
                f"{self.intervals} mesh intervals in {self.name}; give an even number, 4 or more, "
                "so that the middle of a phase is a node with neighbours"
            )
        if self.order < 3:
            raise InvalidInput(
                f"Bezier order {self.order} in {self.name}; give 3 or more, so that both ends can "
                "meet the motion in value and rate"
            )


PRONK = (
    ContactPhase("stance", ("front", "rear"), (0.1, 0.3), intervals=12, order=8),
    ContactPhase("flight", (), (0.2, 0.35), intervals=16, order=11),
)
"""All four feet at once, as in the paper."""

PITCHING_PRONK = (
    dataclasses.replace(PRONK[0], intervals=20, order=9),
    dataclasses.replace(PRONK[1], intervals=20, order=15),
)
"""The same on a finer mesh: when the trunk may pitch, the legs move more."""

BOUND = (
    ContactPhase("front stance", ("front",), (0.1, 0.2), intervals=16, order=9),
    ContactPhase("gathered flight", (), (0.05, 0.2), intervals=16, order=8),
    ContactPhase("rear stance", ("rear",), (0.1, 0.2), intervals=16, order=9),
    ContactPhase("extended flight", (), (0.05, 0.2), intervals=16, order=8),
)
"""Front and rear legs in turn, with a flight after each."""


@dataclass(frozen=True)
class GaitProblem:
    """A gait to be found: section II.B of the paper, for any contact sequence.

    Attributes:
        robot: The robot.
        speed: Average forward speed of the trunk [m/s].
        apex: Greatest height of the trunk [m]; its height in the middle of each flight, where a
            stride has several.
        base: "locked", the trunk moves along x and z as the paper simulates it, or "sagittal", it
            pitches too.
        sequence: The phases of a stride and the feet that stand in each; the last one ends in the
            first. Their durations are free within bounds.
        contact: A foot is a sphere that rolls without slip, or a point at the sphere's centre.
            The A1's spheres roll 7 to 10 mm a stance: 10 % of the speed.
        friction: Coefficient of friction of the ground.
        torque_weight: W_tau of eq. (6) [1/(N m)^2].
        velocity_weight: W_q of eq. (6) [1/(rad/s)^2].
        stride: Shortest and longest stride [s]. The cost always takes the shortest; the paper's
            17 strides in 7 s are about 0.41 s each.
        torque_use: Share of the motors' torque that the gait may use.
        velocity_use: Share of the joints' velocity limits that the gait may use.
        hip_limit: Largest hip angle [rad]; it keeps the solver off a second, splay-legged family.
        pitch_limit: Largest pitch of a trunk that may pitch [rad].
        trunk_height: Least height of the trunk [m].
        clearance: Height of the feet above the ground in the middle of their swing [m].
    """

    robot: Robot = field(repr=False)
    speed: float
    apex: float = 0.34
    base: Base = "locked"
    sequence: tuple[ContactPhase, ...] = field(default=PRONK, repr=False)
    contact: Contact = "rolling"
    friction: float = 0.6
    torque_weight: float = 1.0
    velocity_weight: float = 0.15
    stride: tuple[float, float] = (0.36, 0.6)
    torque_use: float = 1.0
    velocity_use: float = 1.0
    hip_limit: float = 0.1
    pitch_limit: float = 0.2
    trunk_height: float = 0.2
    clearance: float = 0.03

    def __post_init__(self) -> None:
        as_robot(self.robot)
        known_name("base", self.base, ("locked", "sagittal"))
        known_name("contact", self.contact, CONTACTS)
        keep_reals(self, _NUMBERS)
        keep = object.__setattr__
        keep(self, "stride", _duration_range("stride", self.stride))
        phases = sequence_of(
            "sequence", self.sequence, lambda name, phase: instance_of(name, phase, ContactPhase)
        )
        keep(self, "sequence", _of_robot(self.robot, phases))
        if not self.apex > self.trunk_height:
            raise InvalidInput(
                f"the apex, {self.apex:g} m, is not above the least trunk height, "
                f"{self.trunk_height:g} m; raise the one or lower the other"
            )
        _check_sequence(self.sequence, len(mirror(self.robot).pairs))
        least, most = (sum(phase.duration[end] for phase in phases) for end in (0, 1))
        if most < self.stride[0] or least > self.stride[1]:
            raise InvalidInput(
                f"the phases last {least:g} to {most:g} s together, and the stride "
                f"{self.stride[0]:g} to {self.stride[1]:g} s; widen the one or the other"
            )

    @property
    def intervals(self) -> tuple[int, ...]:
        """Mesh intervals of the phases."""
        return tuple(phase.intervals for phase in self.sequence)

    def remeshed(self, intervals: Sequence[int]) -> GaitProblem:
        """The same problem with other numbers of mesh intervals, one for each phase."""
        phases = zip(self.sequence, intervals, strict=True)
        sequence = tuple(dataclasses.replace(phase, intervals=int(n)) for phase, n in phases)
        return dataclasses.replace(self, sequence=sequence)

    def feet(self, phase: ContactPhase) -> tuple[str, ...]:
        """The robot's legs that stand in a phase, in the order of `robot.legs`."""
        pairs = mirror(self.robot).pairs
        standing = [leg for pair in phase.stands for leg in pairs[PAIRS.index(pair)]]
        return tuple(self.robot.legs[leg] for leg in sorted(standing))

    def before(self, index: int) -> ContactPhase:
        """The phase before the phase of an index; the last one comes before the first."""
        return self.sequence[index - 1]

    def landing(self, index: int) -> tuple[Pair, ...]:
        """The pairs whose feet touch down where the phase of an index begins."""
        before = self.before(index).stands
        return tuple(pair for pair in self.sequence[index].stands if pair not in before)

    def options(self) -> dict[str, Any]:
        """Everything but the robot, speed and apex, as JSON can hold it."""
        # Not `asdict`, which would copy the robot.
        names = [item.name for item in dataclasses.fields(self)]
        kept = {n: getattr(self, n) for n in names if n not in ("robot", "speed", "apex")}
        kept["sequence"] = [dataclasses.asdict(phase) for phase in self.sequence]
        return dict(json.loads(json.dumps(kept)))

    def fingerprint(self) -> str:
        """SHA-256 of the robot's URDF and of all options: alike for the gaits of one library."""
        text = json.dumps([self.robot.sha256, self.options()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _of_robot(robot: Robot, sequence: tuple[ContactPhase, ...]) -> tuple[ContactPhase, ...]:
    """The sequence without pairs of legs that the robot has not: a biped's are the front ones."""
    count = len(mirror(robot).pairs)
    if count > len(PAIRS):
        raise InvalidInput(
            f"{robot.name} has {count} pairs of legs; gaits are made for {len(PAIRS)} at most"
        )
    kept = []
    for phase in sequence:
        stands = tuple(pair for pair in phase.stands if PAIRS.index(pair) < count)
        if phase.stands and not stands:
            raise InvalidInput(
                f"{robot.name} has no {' and '.join(phase.stands)} legs, which {phase.name} needs; "
                "choose a gait of the legs that it has, as 'pronk'"
            )
        kept.append(dataclasses.replace(phase, stands=stands))
    return tuple(kept)


def _check_sequence(sequence: tuple[ContactPhase, ...], pairs: int) -> None:
    names = [phase.name for phase in sequence]
    if len(set(names)) < len(names):
        raise InvalidInput(
            f"two phases of the sequence {', '.join(names)} have the same name; rename one"
        )
    if all(phase.stands for phase in sequence):
        raise InvalidInput(
            "the sequence has no flight, so that no apex exists; add a phase of none"
        )
    for pair in PAIRS[:pairs]:
        if not any(pair in phase.stands for phase in sequence):
            raise InvalidInput(f"the {pair} legs never stand; add them to a phase")
    for before, phase in pairwise((sequence[-1], *sequence)):
        if before.stands == phase.stands:
            raise InvalidInput(f"{before.name} and {phase.name} have the same feet; merge them")
