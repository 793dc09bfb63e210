"""The gait library: gaits by speed, interpolated between (eq. 13), saved as one `.npz`."""

from __future__ import annotations

import itertools
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from .._typing import Array
from ..errors import FileProblem, InvalidInput, SpeedOutOfRange, cannot_write
from .gait import ARRAYS, Gait, GaitPhase

SCHEMA = 1
"""Version of the file format."""

_REBUILD = "make it again with 'pronk-pin gaits build'"


@dataclass(frozen=True)
class GaitLibrary:
    """Gaits of one robot, ordered by speed.

    Attributes:
        gaits: The gaits, their speeds increasing.
        metadata: How it was made: robot, SHA-256 of its URDF, problem, solver, versions.
        audit: For each gait (in order) the named checks with their worst values.
    """

    gaits: tuple[Gait, ...]
    metadata: Mapping[str, Any] = field(default_factory=dict)
    audit: tuple[Mapping[str, float], ...] = ()

    def __post_init__(self) -> None:
        speeds = [gait.speed for gait in self.gaits]
        if not speeds or any(b <= a for a, b in itertools.pairwise(speeds)):
            raise InvalidInput(f"a gait library needs gaits of increasing speed, not {speeds}")

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.gaits[0].robot

    @property
    def speeds(self) -> Array:
        """Speeds of the gaits [m/s], shape (n,)."""
        return np.array([gait.speed for gait in self.gaits])

    def at(self, speed: float) -> Gait:
        """The gait at a speed [m/s], interpolated between the two closest ones: eq. (13).

        Raises:
            SpeedOutOfRange: The library does not cover the speed.
        """
        speeds = self.speeds
        nearest = int(np.argmin(np.abs(speeds - speed)))
        if abs(speeds[nearest] - speed) < 1e-9:
            return self.gaits[nearest]
        if not speeds[0] <= speed <= speeds[-1]:
            raise SpeedOutOfRange(speed, float(speeds[0]), float(speeds[-1]))
        b = int(np.searchsorted(speeds, speed))
        lower, upper = self.gaits[b - 1], self.gaits[b]
        return lower.blend(upper, (speed - lower.speed) / (upper.speed - lower.speed))

    def save(self, path: Path | str) -> Path:
        """Write the library to an `.npz` file.

        Raises:
            FileProblem: The file cannot be written.
        """
        path = Path(path)
        arrays: dict[str, Any] = {
            "schema": np.array(SCHEMA),
            "speed": self.speeds,
            "apex": np.array([gait.apex for gait in self.gaits]),
            "phases": np.array([phase.name for phase in self.gaits[0].phases]),
            "feet": np.array([",".join(phase.feet) for phase in self.gaits[0].phases]),
            "metadata": np.array(json.dumps({**self.metadata, "robot": self.robot})),
            "audit": np.array(json.dumps([dict(entry) for entry in self.audit])),
        }
        for i, phase in enumerate(self.gaits[0].phases):
            members = [gait.phases[i] for gait in self.gaits]
            arrays[f"{phase.name}.duration"] = np.array([member.duration for member in members])
            for name in ARRAYS:
                arrays[f"{phase.name}.{name}"] = np.stack([getattr(m, name) for m in members])
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("wb") as file:
                np.savez_compressed(file, **arrays)
        except OSError as error:
            raise cannot_write(path, error, "choose another") from error
        return path

    @classmethod
    def load(cls, path: Path | str) -> GaitLibrary:
        """Read a library.

        Raises:
            FileProblem: The file is missing, damaged, or of another schema.
        """
        path = Path(path)
        if not path.is_file():
            raise FileProblem(path, "no such gait library", _REBUILD)
        try:
            with np.load(path, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
            if int(arrays["schema"]) != SCHEMA:
                raise FileProblem(path, f"schema {arrays['schema']}, not {SCHEMA}", _REBUILD)
            return _from_arrays(arrays)
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise FileProblem(path, f"damaged gait library ({error})", _REBUILD) from error


def _from_arrays(arrays: Mapping[str, Any]) -> GaitLibrary:
    """Put a library together again; a missing or misshapen array raises."""
    metadata = json.loads(str(arrays["metadata"]))
    names = [str(name) for name in arrays["phases"]]
    feet = [tuple(filter(None, str(names).split(","))) for names in arrays["feet"]]
    gaits = []
    for k, speed in enumerate(arrays["speed"]):
        phases = []
        for name, standing in zip(names, feet, strict=True):
            coefficients = {key: np.array(arrays[f"{name}.{key}"][k]) for key in ARRAYS}
            if not all(np.all(np.isfinite(array)) for array in coefficients.values()):
                raise ValueError(f"{name} at {speed:g} m/s is not finite")
            duration = float(arrays[f"{name}.duration"][k])
            phases.append(GaitPhase(name, standing, duration, **coefficients))
        apex = float(arrays["apex"][k])
        gaits.append(Gait(metadata["robot"], float(speed), apex, tuple(phases)))
    return GaitLibrary(tuple(gaits), metadata, tuple(json.loads(str(arrays["audit"]))))


@lru_cache(maxsize=4)
def load_library(robot: str = "a1") -> GaitLibrary:
    """The gait library that is shipped for a robot.

    Raises:
        FileProblem: None is shipped for it.
    """
    with resources.as_file(resources.files(__package__) / "data" / f"{robot}.npz") as path:
        return GaitLibrary.load(path)
