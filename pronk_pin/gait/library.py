"""The gait library: gaits by speed and apex, interpolated between (eq. 13), in one `.npz`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from .._checks import instance_of, none_or, real, sequence_of
from .._checks import path as known_path
from .._display import Displayed, spanned
from .._typing import Array
from ..errors import ApexOutOfRange, FileProblem, InvalidInput, SpeedOutOfRange
from ..kinematics import COORDINATES, Contact
from ..robot import ROBOTS, Base, Robot, load_robot
from ..storage import StoredArrays, read_arrays, sha256, write_arrays
from .checks import Audit, StoredAudit
from .gait import ARRAYS, PLANAR, Gait, GaitPhase
from .residual import GaitResidual, gait_residual
from .style import library_name

SCHEMA = 3
"""Version of the file format."""

_REBUILD = "make it again with 'pronk-pin gaits build'"

_SAME = 1e-9
"""Speeds [m/s] or heights [m] closer than this are one."""


@dataclass(frozen=True, eq=False, repr=False)
class GaitLibrary(Displayed):
    """Gaits of one robot, on a grid of speeds and apex heights.

    Attributes:
        gaits: The gaits of the whole grid, ordered by apex and then by speed.
        metadata: How it was made: robot, SHA-256 of its URDF, problem, solver, versions.
        audit: For each gait (in order) what its audit found; empty if there was none.
        apex: The apex of the gaits that are meant where none is asked for [m]; by default the
            lowest.
    """

    gaits: tuple[Gait, ...]
    metadata: Mapping[str, Any] = field(default_factory=dict)
    audit: tuple[Audit, ...] = ()
    apex: float = np.nan

    def __post_init__(self) -> None:
        object.__setattr__(self, "gaits", _known_gaits(self.gaits))
        instance_of("metadata", self.metadata, Mapping, "a mapping")  # type: ignore[type-abstract]
        audits = sequence_of("audit", self.audit, lambda k, one: instance_of(k, one, Audit))
        object.__setattr__(self, "audit", audits)
        apex: Any = self.apex
        if not isinstance(apex, float):  # NaN asks for the lowest
            object.__setattr__(self, "apex", real("apex", apex))
        grid = [(apex, speed) for apex in self.apexes for speed in self.speeds]
        given_grid = [(gait.apex, gait.speed) for gait in self.gaits]
        if (
            not given_grid
            or len(given_grid) != len(grid)
            or not np.allclose(given_grid, grid, rtol=0, atol=_SAME)
        ):
            raise InvalidInput(
                "a gait library needs one gait for each speed at each apex, ordered by apex and "
                f"then by increasing speed, not (apex, speed) = {given_grid}"
            )
        if len(self.audit) not in (0, len(self.gaits)):
            raise InvalidInput(
                f"{len(self.audit)} audits for {len(self.gaits)} gaits; give each one"
            )
        for gait, found in zip(self.gaits, self.audit, strict=bool(self.audit)):
            if gait.sha256 != found.motion:
                raise InvalidInput(
                    f"the gait at {gait.speed:g} m/s is not the one that was audited; "
                    "audit it anew, or leave the audits out"
                )
        if np.isnan(self.apex):
            object.__setattr__(self, "apex", float(self.apexes[0]))
        _index(self.apexes, self.apex, "apex")

    def __eq__(self, other: object) -> bool:
        """Whether the other one moves the same robot in the same way."""
        if not isinstance(other, GaitLibrary):
            return NotImplemented
        return (self.robot, self.sha256) == (other.robot, other.sha256)

    def __hash__(self) -> int:
        return hash((self.robot, self.sha256))

    def _title(self) -> str:
        return f"GaitLibrary of {self.robot}, base {self.base}: {len(self.gaits)} gaits"

    def _facts(self) -> dict[str, str]:
        failed = sum(not audit.passed for audit in self.audit)
        audit = "all passed" if not failed else f"{failed} of {len(self.audit)} failed"
        return {
            "speeds": spanned(self.speeds, "m/s"),
            "apexes": spanned(self.apexes, "m"),
            "default apex": f"{self.apex:g} m" if len(self.apexes) > 1 else "",
            "phases": ", ".join(phase.name for phase in self.gaits[0].phases),
            "audit": audit if self.audit else "none",
            "sha256": self.sha256[:12],
        }

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.gaits[0].robot

    @cached_property
    def speeds(self) -> Array:
        """Speeds of the grid [m/s], increasing, shape (n,)."""
        return _distinct(gait.speed for gait in self.gaits)

    @cached_property
    def apexes(self) -> Array:
        """Apex heights of the grid [m], increasing, shape (m,)."""
        return _distinct(gait.apex for gait in self.gaits)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of everything that moves: the gaits, how the trunk may move, and which apex is
        meant where none is asked for."""
        digests = [gait.sha256 for gait in self.gaits]
        return sha256(json.dumps([*digests, self.base, float(self.apex).hex()]))

    @property
    def base(self) -> Base:
        """Base mode of the gaits: "locked" or "sagittal"."""
        base: Base = self.metadata.get("problem", {}).get("base", "locked")
        return base

    def index(self, speed: float, apex: float | None = None) -> int:
        """Index in `gaits` of a gait of the grid.

        Raises:
            InvalidInput: There is no such gait; the error lists the grid.
        """
        apex = none_or(real, "apex", apex)
        row = _index(self.apexes, self.apex if apex is None else apex, "apex")
        return row * len(self.speeds) + _index(self.speeds, real("speed", speed), "speed")

    def at_apex(self, apex: float | None = None) -> GaitLibrary:
        """The part of the library at one apex of the grid; by default the library's own.

        Raises:
            InvalidInput: There is no such apex; the error lists the grid.
        """
        height = self.apex if apex is None else real("apex", apex)
        between = self.apexes[0] < height < self.apexes[-1]
        single = f"'pronk-pin gaits show SPEED --apex {height:g}' interpolates a single gait"
        row = _index(self.apexes, height, "apex", f"; {single}" if between else "")
        n = len(self.speeds)
        part = slice(row * n, (row + 1) * n)
        metadata = {
            key: value[part] if key in PER_GAIT else value for key, value in self.metadata.items()
        }
        return GaitLibrary(self.gaits[part], metadata, self.audit[part])

    def at(self, speed: float, apex: float | None = None) -> Gait:
        """The gait at a speed [m/s] and apex [m], interpolated in both: eq. (13).

        An interpolated gait obeys the equations of motion only nearly; `residual` tells how nearly.

        Args:
            speed: Speed [m/s].
            apex: Greatest height of the trunk [m]; by default `apex` of the library.

        Raises:
            SpeedOutOfRange: The library does not cover the speed.
            ApexOutOfRange: The library does not cover the apex.
        """
        speeds, apexes = self.speeds, self.apexes
        speed = speed if isinstance(speed, float) else real("speed", speed)
        height = self.apex if apex is None else apex
        height = height if isinstance(height, float) else real("apex", height)
        if not speeds[0] - _SAME <= speed <= speeds[-1] + _SAME:
            raise SpeedOutOfRange(speed, float(speeds[0]), float(speeds[-1]))
        if not apexes[0] - _SAME <= height <= apexes[-1] + _SAME:
            raise ApexOutOfRange(height, float(apexes[0]), float(apexes[-1]))
        rows = []
        for row, row_weight in _neighbours(apexes, height):
            gaits = [
                (self.gaits[row * len(speeds) + column], weight)
                for column, weight in _neighbours(speeds, speed)
            ]
            rows.append((_blend(gaits), row_weight))
        return _blend(rows)

    def residual(
        self, speed: float, apex: float | None = None, *, robot: Robot | None = None
    ) -> GaitResidual:
        """Residual of the gait at a speed and apex in the equations of motion (2).

        Args:
            speed: Speed [m/s].
            apex: Greatest height of the trunk [m]; by default `apex` of the library.
            robot: The robot; by default the one that is known by the library's name.

        Raises:
            SpeedOutOfRange: The library does not cover the speed.
            ApexOutOfRange: The library does not cover the apex.
            UnknownName: The robot is not known by name; pass it.
        """
        robot = load_robot(self.robot) if robot is None else robot
        contact = self.metadata.get("problem", {}).get("contact", "rolling")
        return gait_residual(robot, self.at(speed, apex), contact=contact, base=self.base)

    def save(self, path: Path | str) -> Path:
        """Write the library to an `.npz` file.

        Raises:
            FileProblem: The file cannot be written.
        """
        path = known_path("path", path)
        return write_arrays(path, to_arrays(self), schema=SCHEMA, remedy="choose another")

    @classmethod
    def load(
        cls, path: Path | str, *, robot: Robot | None = None, audited: bool = True
    ) -> GaitLibrary:
        """Read a library, and check that it fits the robot and that its gaits passed their audit.

        Args:
            path: The file.
            robot: The robot that the gaits are for; by default the one that is known by the name
                in the file. For a robot of one's own, without it the URDF is not compared.
            audited: Refuse gaits without an audit, or with one that failed.

        Raises:
            FileProblem: The file is missing, damaged, of another schema or robot, or not audited.
        """
        path = known_path("path", path)
        if robot is not None:
            instance_of("robot", robot, Robot, "a Robot, as load_robot() returns it")
        library = from_arrays(read_arrays(path, _REBUILD, what="gait library", schema=SCHEMA))
        _check_model(path, library, robot)
        if audited:
            _check_audit(path, library)
        return library


PER_GAIT = ("cost", "iterations", "solve_time", "work_time")
"""Metadata with one value for each gait."""


def to_arrays(library: GaitLibrary) -> dict[str, Any]:
    """Arrays of a library, as an `.npz` holds them."""
    arrays: dict[str, Any] = {
        "speed": np.array([gait.speed for gait in library.gaits]),
        "apex": np.array([gait.apex for gait in library.gaits]),
        "default_apex": np.array(library.apex),
        "phases": np.array([phase.name for phase in library.gaits[0].phases]),
        "feet": np.array([",".join(phase.feet) for phase in library.gaits[0].phases]),
        "metadata": np.array(json.dumps({**library.metadata, "robot": library.robot})),
        "audit": np.array(json.dumps([audit.as_json() for audit in library.audit])),
    }
    for i, phase in enumerate(library.gaits[0].phases):
        members = [gait.phases[i] for gait in library.gaits]
        arrays[f"{phase.name}.duration"] = np.array([member.duration for member in members])
        for name in ARRAYS:
            arrays[f"{phase.name}.{name}"] = np.stack([getattr(m, name) for m in members])
    return arrays


def from_arrays(arrays: StoredArrays) -> GaitLibrary:
    """Put a library together again.

    Raises:
        FileProblem: An array is missing, or not what it should be.
    """
    metadata = _metadata(arrays)
    audits = arrays.as_type(arrays.document("audit"), list[StoredAudit])
    try:
        gaits = _gaits(arrays, metadata["robot"])
        if len(audits) > len(gaits):
            raise arrays.damaged(f"{len(audits)} audits for {len(gaits)} gaits")
        found = tuple(
            Audit.from_stored(gait.speed, stored)
            for gait, stored in zip(gaits[: len(audits)], audits, strict=True)
        )
        return GaitLibrary(gaits, metadata, found, float(arrays.numbers("default_apex")))
    except InvalidInput as error:
        raise arrays.damaged(error) from error


def _gaits(arrays: StoredArrays, robot: str) -> tuple[Gait, ...]:
    speeds = arrays.numbers("speed", None)
    n = len(speeds)
    apexes = arrays.numbers("apex", n)
    names = arrays.texts("phases")
    feet = [tuple(filter(None, text.split(","))) for text in arrays.texts("feet")]
    if not n or not names or len(set(names)) < len(names) or len(feet) != len(names):
        raise arrays.damaged(f"{n} gaits of phases {names} on feet {feet}")
    phases: list[list[GaitPhase]] = [[] for _ in speeds]
    for name, standing in zip(names, feet, strict=True):
        durations = arrays.numbers(f"{name}.duration", n)
        if np.any(durations <= 0.0):
            raise arrays.damaged(f"{name} without duration")
        joints = arrays.numbers(f"{name}.joints", n, None, None)
        order = joints.shape[-1]
        parts = [
            joints,
            _base(arrays, name, n, order),
            arrays.numbers(f"{name}.tau", n, joints.shape[1], order),
            arrays.numbers(f"{name}.lam", n, None, 3, order),
        ]
        if not order:
            raise arrays.damaged(f"{name} without coefficients")
        for k, duration in enumerate(durations):
            coefficients = (part[k].copy() for part in parts)
            phases[k].append(GaitPhase(name, standing, float(duration), *coefficients))
    return tuple(
        Gait(robot, float(speed), float(apex), tuple(of_gait))
        for speed, apex, of_gait in zip(speeds, apexes, phases, strict=True)
    )


def _base(arrays: StoredArrays, name: str, n: int, order: int) -> Array:
    """The trunk's coefficients: of x, z and pitch, or of all six coordinates of a free one."""
    base = arrays.numbers(f"{name}.base", n, None, order)
    if base.shape[1] not in (PLANAR, len(COORDINATES)):
        raise arrays.damaged(f"{name} with {base.shape[1]} coordinates of the trunk")
    return base


class _Problem(TypedDict, total=False):
    """What is read of the problem that the gaits solve."""

    base: Base
    contact: Contact
    friction: float


class _OfRobot(TypedDict):
    robot: str


class _Metadata(_OfRobot, total=False):
    """What is read of the metadata."""

    urdf_sha256: str
    gait: str
    problem: _Problem
    bezier_orders: dict[str, list[tuple[float, float, float]]]
    cost: list[float]
    iterations: list[int]
    solve_time: list[float]
    work_time: list[float]


def _metadata(arrays: StoredArrays) -> dict[str, Any]:
    metadata: dict[str, Any] = arrays.document("metadata")
    arrays.as_type(metadata, _Metadata)
    n = len(arrays.numbers("speed", None))
    for name in PER_GAIT:
        if len(metadata.get(name, [0.0] * n)) != n:
            raise arrays.damaged(f"{len(metadata[name])} values of {name} for {n} gaits")
    return metadata


def _check_model(path: Path, library: GaitLibrary, robot: Robot | None) -> None:
    """Check that the gaits were made for the URDF that is installed."""
    if robot is None and library.robot not in ROBOTS:
        return
    robot = load_robot(library.robot) if robot is None else robot
    if library.robot != robot.name:
        raise FileProblem(
            path, f"gaits of {library.robot}, not of {robot.name}", "choose the robot's own library"
        )
    made_for = library.metadata.get("urdf_sha256", "unknown")
    if made_for != robot.sha256:
        raise FileProblem(
            path,
            f"made for another model of {robot.name}: SHA-256 of its URDF {made_for[:12]}, "
            f"of {robot.urdf_path} {robot.sha256[:12]}",
            _REBUILD,
        )


def _check_audit(path: Path, library: GaitLibrary) -> None:
    if not library.audit:
        raise FileProblem(path, "gaits without an audit", _REBUILD)
    for gait, result in zip(library.gaits, library.audit, strict=True):
        if not result.passed:
            failed = ", ".join(check.name for check in result.failures)
            raise FileProblem(
                path,
                f"the gait at {gait.speed:g} m/s, apex {gait.apex:g} m, fails its audit ({failed})",
                f"see it with 'pronk-pin gaits show --library {path}', and build it anew",
            )


def known_library(library: GaitLibrary) -> GaitLibrary:
    """The library itself, if it is one.

    Raises:
        InvalidInput: It is something else.
    """
    wanted = "a GaitLibrary, as load_library() returns it"
    return instance_of("library", library, GaitLibrary, wanted)


def _known_gaits(gaits: Any) -> tuple[Gait, ...]:
    wanted = "gaits"
    found = sequence_of("gaits", gaits, lambda k, gait: instance_of(k, gait, Gait), wanted=wanted)
    if not found:
        raise InvalidInput("gaits is empty; a gait library needs one gait or more")
    return found


def _distinct(values: Iterable[float]) -> Array:
    """Values in increasing order, those that are one but for round-off once."""
    ordered = np.array(sorted(values))
    if ordered.size:
        ordered = ordered[np.concatenate([[True], np.diff(ordered) > _SAME])]
    ordered.flags.writeable = False
    return ordered


def _index(grid: Array, value: float, name: str, else_: str = "") -> int:
    nearest = int(np.argmin(np.abs(grid - value)))
    if not abs(grid[nearest] - value) < _SAME:
        listed = ", ".join(f"{v:g}" for v in grid)
        raise InvalidInput(f"the library has no {name} {value:g}; choose one of: {listed}{else_}")
    return nearest


def _neighbours(grid: Array, value: float) -> list[tuple[int, float]]:
    """Points of a grid around a value, with their weights: two, or one where it hits."""
    nearest = int(np.argmin(np.abs(grid - value)))
    if abs(grid[nearest] - value) < _SAME:
        return [(nearest, 1.0)]
    b = int(np.searchsorted(grid, value))
    weight = float((value - grid[b - 1]) / (grid[b] - grid[b - 1]))
    return [(b - 1, 1.0 - weight), (b, weight)]


def _blend(weighted: list[tuple[Gait, float]]) -> Gait:
    if len(weighted) == 1:
        return weighted[0][0]
    (lower, _), (upper, weight) = weighted
    return lower.blend(upper, weight)


def load_library(
    robot: str = "a1", *, gait: str = "pronk", base: Base | None = None
) -> GaitLibrary:
    """The gait library that is shipped for a robot.

    Args:
        robot: Name of the robot.
        gait: "pronk" or "bound".
        base: How the trunk may move: "locked" or "sagittal"; None for the gait's own.

    Raises:
        UnknownName: There is no such gait.
        FileProblem: None is shipped for it.
    """
    name = library_name(robot, gait, base)
    if not (resources.files(__package__) / "data" / f"{name}.npz").is_file():
        named = robot if robot in ROBOTS else "FILE.toml"  # what that command takes
        options = "".join(
            f" --{option} {value}"
            for option, value in (("robot", named), ("gait", gait), ("base", base))
            if value is not None
        )
        raise FileProblem(
            f"{name}.npz",
            "no such gait library is shipped",
            f"build one with 'pronk-pin gaits build{options}', and give its file to compare with "
            "--gaits, to gaits with --library, or to view",
        )
    return _shipped(name)


def shipped_libraries() -> Iterator[GaitLibrary]:
    """The gait libraries that are shipped."""
    for file in (resources.files(__package__) / "data").iterdir():
        if file.name.endswith(".npz"):
            yield _shipped(file.name.removesuffix(".npz"))


@lru_cache(maxsize=8)
def _shipped(name: str) -> GaitLibrary:
    with resources.as_file(resources.files(__package__) / "data" / f"{name}.npz") as path:
        return GaitLibrary.load(path)
