"""Gait problems: contact sequence, bounds, weights and demands of an optimisation."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Sequence
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
from ..kinematics import CONTACTS, Contact, mirror, mirror_symmetric
from ..robot import Base, Robot, as_robot

Pair = Literal["front", "rear"]
"""A pair of legs, left and right: in a gait with mirror symmetry they do the same."""

PAIRS: tuple[Pair, ...] = ("front", "rear")

Place = Literal["front left", "front right", "rear left", "rear right"]
"""A single leg, in a gait without mirror symmetry."""

PLACES: tuple[Place, ...] = ("front left", "front right", "rear left", "rear right")


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
        stands: The pairs of legs that stand on the ground; the single legs, on a free trunk.
        duration: How long it may last, shortest and longest [s].
        intervals: Mesh intervals.
        order: Order of the Bezier polynomials that keep it.
    """

    name: str
    stands: tuple[Pair | Place, ...]
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
            known_name("leg or pair of legs", pair, (*PAIRS, *PLACES))
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


TROT = (
    ContactPhase("left stance", ("front left", "rear right"), (0.16, 0.3), intervals=16, order=11),
    ContactPhase("left flight", (), (0.04, 0.1), intervals=6, order=7),
    ContactPhase("right stance", ("front right", "rear left"), (0.16, 0.3), intervals=16, order=11),
    ContactPhase("right flight", (), (0.04, 0.1), intervals=6, order=7),
)
"""Diagonal legs in turn, named for the front leg that stands, with a flight after each."""


WALK = tuple(
    ContactPhase(
        f"{swings} swing",
        tuple(place for place in PLACES if place != swings),
        (0.12, 0.2),
        intervals=8,
        order=9,
    )
    for swings in ("rear left", "front left", "rear right", "front right")
)
"""One leg after another swings, the front one after the rear one of its side, as animals walk."""


@dataclass(frozen=True)
class FreeTrunk:
    """What a gait without mirror symmetry asks of its trunk, which moves along and about all axes.

    Attributes:
        half_stride: The sequence is half a stride: its mirror image is the other half.
        height: Greatest height of the trunk [m]; without it legs are nearly straight.
        roll: Largest roll [rad].
        yaw: Largest yaw [rad].
        side: Largest side step of the trunk [m].
        turn_weight: Weight of the rates of roll, pitch and yaw [1/(rad/s)^2].
        drift_weight: Weight of the rates of y and z [1/(m/s)^2]. Without these two the solver
            wanders in a flat valley.
        tilt_weight: Weight of roll, pitch and yaw [1/rad^2].
        posture_weight: Weight of the joints' distance from the standing posture [1/rad^2]: it keeps
            the gaits of all speeds in one family, so that they can be interpolated.
        impact_weight: Weight of the touchdown impulses [1/(N s)^2]. Free of charge they are used:
            a foot is hurled at the ground as fast as its joints can.
    """

    half_stride: bool = False
    height: float = 0.34
    roll: float = 0.15
    yaw: float = 0.15
    side: float = 0.05
    turn_weight: float = 10.0
    drift_weight: float = 100.0
    tilt_weight: float = 500.0
    posture_weight: float = 50.0
    impact_weight: float = 10.0

    def __post_init__(self) -> None:
        keep_reals(self, _OF_TRUNK)


_OF_TRUNK = {
    "height": Interval(0, 100, "m", above=True),
    "roll": Interval(0, 1.5, "rad", above=True),
    "yaw": Interval(0, 1.5, "rad", above=True),
    "side": Interval(0, 10, "m", above=True),
    "turn_weight": Interval(0, 1e6, "1/(rad/s)^2"),
    "drift_weight": Interval(0, 1e6, "1/(m/s)^2"),
    "tilt_weight": Interval(0, 1e6, "1/rad^2"),
    "posture_weight": Interval(0, 1e6, "1/rad^2"),
    "impact_weight": Interval(0, 1e6, "1/(N s)^2"),
}


@dataclass(frozen=True)
class GaitProblem:
    """A gait to be found: section II.B of the paper, for any contact sequence.

    Attributes:
        robot: The robot.
        speed: Average forward speed of the trunk [m/s].
        apex: Greatest height of the trunk [m]; its height in the middle of each flight, where a
            stride has several, and of its first phase, where it has none.
        base: "locked", the trunk moves along x and z as the paper simulates it, or "sagittal", it
            pitches too; or "free", without mirror symmetry, with single legs in the sequence.
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
        trunk: What is asked of a free trunk; None for the others.
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
    trunk: FreeTrunk | None = None

    def __post_init__(self) -> None:
        as_robot(self.robot)
        known_name("base", self.base, ("locked", "sagittal", "free"))
        _check_trunk(self.base, self.trunk, self.sequence)
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
        if self.trunk is None:
            _check_sequence(self.sequence, PAIRS[: len(mirror(self.robot).pairs)], flies=True)
        else:
            _check_sequence(self.whole_sequence, PLACES, flies=False)
        least, most = (sum(phase.duration[end] for phase in self.whole_sequence) for end in (0, 1))
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

    @property
    def topped(self) -> tuple[ContactPhase, ...]:
        """The phases in which the apex is: the flights, or the first phase where none flies."""
        return tuple(p for p in self.sequence if not p.stands) or self.sequence[:1]

    @property
    def half_stride(self) -> bool:
        """Whether the sequence is half a stride, and its mirror image the other half."""
        return self.trunk is not None and self.trunk.half_stride

    @property
    def moved(self) -> Robot:
        """The robot whose equations of motion the gait obeys: with half a stride mirrored, one
        that is its own mirror image."""
        return mirror_symmetric(self.robot) if self.half_stride else self.robot

    @property
    def whole_sequence(self) -> tuple[ContactPhase, ...]:
        """The phases of a whole stride."""
        if not self.half_stride:
            return self.sequence
        return (*self.sequence, *(mirrored_phase(phase) for phase in self.sequence))

    def standing(self, stands: Iterable[Pair | Place]) -> tuple[int, ...]:
        """Indices of the folded robot's legs, of all the robot's on a free trunk."""
        if self.base != "free":
            return tuple(PAIRS.index(pair) for pair in stands if pair in PAIRS)
        pairs = mirror(self.robot).pairs
        return tuple(pairs[k // 2][k % 2] for k in map(PLACES.index, stands))

    def feet(self, phase: ContactPhase) -> tuple[str, ...]:
        """The robot's legs that stand in a phase, in the order of `robot.legs`."""
        if self.base == "free":
            return tuple(self.robot.legs[leg] for leg in sorted(self.standing(phase.stands)))
        pairs = mirror(self.robot).pairs
        standing = [leg for k in self.standing(phase.stands) for leg in pairs[k]]
        return tuple(self.robot.legs[leg] for leg in sorted(standing))

    def before(self, index: int) -> ContactPhase:
        """The phase before the phase of an index; the last one comes before the first."""
        last = self.sequence[index - 1]
        return mirrored_phase(last) if self.half_stride and index == 0 else last

    def landing(self, index: int) -> tuple[Pair | Place, ...]:
        """The pairs whose feet touch down where the phase of an index begins."""
        before = self.before(index).stands
        return tuple(pair for pair in self.sequence[index].stands if pair not in before)

    def impacts(self, index: int) -> bool:
        """Whether feet touch down with an impact where the phase of an index begins.

        On a free trunk they come to rest first where others stand already: an impact would pull at
        those, and no ground does that.
        """
        landing = self.landing(index)
        alone = set(landing) == set(self.sequence[index].stands)
        return bool(landing) and (alone or self.base != "free")

    def options(self) -> dict[str, Any]:
        """Everything but the robot, speed and apex, as JSON can hold it."""
        # Not `asdict`, which would copy the robot.
        names = [item.name for item in dataclasses.fields(self)]
        kept = {n: getattr(self, n) for n in names if n not in ("robot", "speed", "apex")}
        kept["sequence"] = [dataclasses.asdict(phase) for phase in self.sequence]
        del kept["trunk"]
        if self.trunk is not None:
            kept["trunk"] = dataclasses.asdict(self.trunk)
        return dict(json.loads(json.dumps(kept)))

    def fingerprint(self) -> str:
        """SHA-256 of the robot's URDF and of all options: alike for the gaits of one library."""
        text = json.dumps([self.robot.sha256, self.options()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def _of_robot(robot: Robot, sequence: tuple[ContactPhase, ...]) -> tuple[ContactPhase, ...]:
    """The sequence without pairs of legs that the robot has not: a biped's are the front ones."""
    count = len(mirror(robot).pairs)
    if any(place in PLACES for phase in sequence for place in phase.stands):
        if count != len(PAIRS):
            raise InvalidInput(
                f"{robot.name} has {count} pairs of legs; gaits of single legs need {len(PAIRS)}"
            )
        return sequence
    if count > len(PAIRS):
        raise InvalidInput(
            f"{robot.name} has {count} pairs of legs; gaits are made for {len(PAIRS)} at most"
        )
    kept = []
    for phase in sequence:
        stands = tuple(pair for pair in phase.stands if pair in PAIRS[:count])
        if phase.stands and not stands:
            raise InvalidInput(
                f"{robot.name} has no {' and '.join(phase.stands)} legs, which {phase.name} needs; "
                "choose a gait of the legs that it has, as 'pronk'"
            )
        kept.append(dataclasses.replace(phase, stands=stands))
    return tuple(kept)


def mirrored_phase(phase: ContactPhase) -> ContactPhase:
    """The same phase with left and right exchanged, in its name too."""
    stands = tuple(PLACES[PLACES.index(place) ^ 1] for place in phase.stands)
    left = "left" in phase.name
    name = phase.name.replace(*(("left", "right") if left else ("right", "left")))
    return dataclasses.replace(phase, name=name, stands=stands)


def _check_trunk(base: Base, trunk: FreeTrunk | None, sequence: tuple[ContactPhase, ...]) -> None:
    if trunk is not None:
        instance_of("trunk", trunk, FreeTrunk)
    if (base == "free") != (trunk is not None):
        raise InvalidInput(
            "a gait on a free trunk says what it asks of it, and others do not; choose gait "
            "'trot', or base 'locked' or 'sagittal'"
        )
    legs = PAIRS if trunk is None else PLACES
    for phase in sequence if isinstance(sequence, tuple) else ():
        for place in getattr(phase, "stands", ()):
            if place not in legs:
                raise InvalidInput(
                    f"{place} legs in {phase.name}: on base {base} a sequence says which of "
                    f"{', '.join(legs)} stand"
                )


def _check_sequence(
    sequence: tuple[ContactPhase, ...], legs: Sequence[Pair | Place], *, flies: bool
) -> None:
    names = [phase.name for phase in sequence]
    if len(set(names)) < len(names):
        raise InvalidInput(
            f"two phases of the sequence {', '.join(names)} have the same name; rename one"
        )
    if flies and all(phase.stands for phase in sequence):
        raise InvalidInput(
            "the sequence has no flight, so that no apex exists; add a phase of none"
        )
    for pair in legs:
        if not any(pair in phase.stands for phase in sequence):
            raise InvalidInput(f"the {pair} legs never stand; add them to a phase")
    for before, phase in pairwise((sequence[-1], *sequence)):
        if before.stands == phase.stands:
            raise InvalidInput(f"{before.name} and {phase.name} have the same feet; merge them")
