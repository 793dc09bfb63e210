"""Gait styles known by name, and the gait problems they stand for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, cast, get_args

import numpy as np

from .._checks import Interval, known_name, real, sequence_of, shown, text
from ..errors import InvalidInput
from ..kinematics import mirror
from ..robot import (
    Base,
    Robot,
    as_robot,
    length_scale,
    scaled_duration,
    scaled_length,
    torque_scale,
)
from .problem import BOUND, PITCHING_PRONK, PRONK, TROT, ContactPhase, FreeTrunk, GaitProblem


@dataclass(frozen=True)
class Style:
    """A kind of gait.

    Attributes:
        name: Short name, as on the command line.
        sequence: The phases of a stride.
        base: How the trunk may move, unless asked otherwise.
        pitching: The phases with a mesh for a trunk that pitches.
        speeds: Speeds of its library [m/s].
        apex: Greatest height of the A1's trunk in its library [m]; of others see `apex_of`.
        stride: Shortest and longest stride [s].
        trunk: What is asked of a free trunk; None for the others.
        start: The speed that a library begins with [m/s]: one that a crude guess leads to.
    """

    name: str
    sequence: tuple[ContactPhase, ...]
    base: Base
    pitching: tuple[ContactPhase, ...]
    speeds: tuple[float, ...]
    apex: float
    stride: tuple[float, float]
    trunk: FreeTrunk | None = None
    start: float = 0.0

    def apex_of(self, robot: Robot) -> float:
        """Greatest height of a robot's trunk in its library [m], scaled from the A1's."""
        return scaled_length(robot, self.apex)


def _speeds(first: float, last: float) -> tuple[float, ...]:
    """Speeds in steps of 0.1 m/s, both ends included."""
    steps = range(round(first * 10), round(last * 10) + 1)
    return tuple(np.round(np.array(steps) * 0.1, 1).tolist())


SPEEDS: tuple[float, ...] = _speeds(-0.5, 0.8)
"""The paper's 14 speeds, -0.5 to 0.8 m/s."""

STYLES: Mapping[str, Style] = {
    style.name: style
    for style in (
        Style("pronk", PRONK, "locked", PITCHING_PRONK, SPEEDS, 0.34, (0.36, 0.6)),
        Style("bound", BOUND, "sagittal", BOUND, _speeds(-0.2, 0.8), 0.3, (0.3, 0.6)),
        Style(
            "trot",
            TROT,
            "free",
            TROT,
            _speeds(-0.4, 1.2),
            0.31,
            (0.4, 0.6),
            FreeTrunk(),
            0.4,
        ),
    )
}
"""Styles known by name."""


def load_style(name: str) -> Style:
    """The style of that name.

    Raises:
        UnknownName: There is none.
    """
    return STYLES[known_name("gait", name, STYLES)]


_HIGHER = "more, and correct the apex of its RobotSpec, or the standing posture there"


def check_robot(robot: Robot) -> None:
    """Check that gaits can be made for a robot.

    Raises:
        InvalidInput: Its legs are not of three joints, in pairs; or it cannot stand as its
            specification says.
    """
    mirror(as_robot(robot))
    angles = robot.standing[-robot.nu :]
    for k in np.flatnonzero((angles < robot.q_min) | (angles > robot.q_max)):
        raise InvalidInput(
            f"{robot.name} cannot stand with {robot.joint_names[k]} at {angles[k]:g} rad: its "
            f"limits are {robot.q_min[k]:g} and {robot.q_max[k]:g} rad; correct the standing "
            "posture of its RobotSpec, which is in radians"
        )
    if not robot.standing[2] > 0.0:
        raise InvalidInput(
            f"{robot.name} stands with its trunk at {robot.standing[2]:.3g} m, below its feet; "
            "correct the standing posture of its RobotSpec"
        )


def gait_problem(
    robot: Robot, speed: float, *, gait: str = "pronk", base: Base | None = None, **changes: Any
) -> GaitProblem:
    """A gait problem of a style, with its heights and durations scaled from the A1 to the robot.

    Args:
        robot: The robot.
        speed: Average forward speed of the trunk [m/s].
        gait: Name of the style.
        base: How the trunk may move; None for the style's own.
        changes: Other attributes of `GaitProblem`.

    Raises:
        UnknownName: There is no such gait or base.
        InvalidInput: The problem makes no sense, or the robot's legs are not of three joints, in
            pairs.
    """
    style = load_style(gait)
    base = style.base if base is None else known_base(base)
    check_robot(robot)
    apex = style.apex_of(robot)
    sequence = style.pitching if base == "sagittal" else style.sequence
    defaults: dict[str, Any] = {
        "apex": apex,
        "base": base,
        "sequence": tuple(
            replace(phase, duration=_scaled(robot, phase.duration)) for phase in sequence
        ),
        "stride": _scaled(robot, style.stride),
        **_of_size(robot),
    }
    _check_changes(changes)
    if style.trunk is not None:
        height = scaled_length(robot, style.trunk.height)
        side = scaled_length(robot, style.trunk.side)
        defaults["trunk"] = replace(style.trunk, height=height, side=side)
        defaults |= _PLAYABLE
        defaults["velocity_weight"] *= _CALM
    options, stands = defaults | changes, float(robot.standing[2])
    if not real("apex", options["apex"], Interval(0, 100, "m", above=True)) > stands:
        raise InvalidInput(
            f"apex {options['apex']:g} m: the {robot.name} stands at {stands:.3g} m already; give "
            + (f"more, as {apex:g} m, or none for that" if apex > stands else _HIGHER)
        )
    return GaitProblem(robot, speed, **options)


_PLAYABLE = {"hip_limit": 0.15, "pitch_limit": 0.1, "torque_use": 0.8, "velocity_use": 0.8}
"""What a gait on a free trunk may use: its hips balance it sideways, its trunk stays level, and
feedback finds room within the limits of the motors."""

_CALM = 2.0
"""Weight of the joints' velocities on a free trunk, over that in other gaits."""


def _of_size(robot: Robot) -> dict[str, float]:
    """Heights and weights of a problem, so that its cost means for a robot what it does for the A1.

    Torques weigh against joint velocities as they do there: both by their size.
    """
    return {
        "trunk_height": scaled_length(robot, GaitProblem.trunk_height),
        "clearance": scaled_length(robot, GaitProblem.clearance),
        "torque_weight": GaitProblem.torque_weight / torque_scale(robot) ** 2,
        "velocity_weight": GaitProblem.velocity_weight * length_scale(robot),
    }


def _scaled(robot: Robot, durations: tuple[float, float]) -> tuple[float, float]:
    shortest, longest = (scaled_duration(robot, each) for each in durations)
    return shortest, longest


def _check_changes(changes: Mapping[str, Any]) -> None:
    """What may be changed of a problem; the rest has an argument of its own.

    Raises:
        UnknownName: A problem has no such attribute.
    """
    own = ("robot", "speed", "base")
    known = [item.name for item in fields(GaitProblem) if item.name not in own]
    for name in changes:
        known_name("attribute of a gait problem", name, known)


def known_base(base: str) -> Base:
    """A base mode by its name, of those to choose from: a free trunk is what a style has.

    Raises:
        UnknownName: There is none.
    """
    return cast(Base, known_name("base", base, [name for name in get_args(Base) if name != "free"]))


_MOST = 1000
"""Values that a range may have."""


def number_range(name: str, words: Iterable[str]) -> tuple[float, ...]:
    """Parse texts, each a number or a range A:B:STEP with both ends, into increasing numbers.

    Raises:
        InvalidInput: A word is neither.
    """
    numbers: set[float] = set()
    for word in sequence_of(name, words, text, wanted="numbers and ranges as texts"):
        try:
            parts = [float(part) for part in word.split(":")]
        except ValueError:
            parts = []
        if len(parts) == 1 and np.isfinite(parts[0]):
            numbers.add(parts[0])
            continue
        if (
            len(parts) != 3
            or not np.all(np.isfinite(parts))
            or not parts[2] > 0
            or parts[1] < parts[0]
        ):
            raise InvalidInput(
                f"{name} {shown(word)} is neither a number nor a range A:B:STEP with A <= B and "
                "STEP > 0"
            )
        first, last, step = parts
        count = (last - first) / step + 1.0
        if count > _MOST:
            raise InvalidInput(
                f"{name} {shown(word)} has {count:.3g} values; give {_MOST} or fewer, in larger "
                "steps"
            )
        count = int(np.floor((last - first) / step + 1e-9)) + 1
        numbers.update(np.round(first + step * np.arange(count), 9).tolist())
    return tuple(sorted(numbers))


def library_name(robot: str, gait: str = "pronk", base: Base | None = None) -> str:
    """Name of a shipped library: the robot's, and what is not the default: "a1-bound", say."""
    text("robot", robot)
    style = load_style(gait)
    if base is not None:
        known_base(base)
    extra = [] if gait == "pronk" else [gait]
    extra += [] if base in (None, style.base) else [str(base)]
    return "-".join([robot, *extra])
