"""What a simulation is, as data: everything that its numbers depend on, and the fingerprint of it.

A name alone does not say what was simulated: a law may have been changed behind it, a URDF edited,
a gait optimised again. A definition holds the parts whole, as JSON has them, so that stored strides
can be compared with what is asked for, and what differs be named.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ... import __name__ as _OURS
from ...control import load_controller
from ...robot import load_robot
from ...storage import sha256
from ..world import load_scenario
from ..world import mjcf_sha256 as mjcf_digest

if TYPE_CHECKING:
    from .experiment import Cell, Experiment

Definition: TypeAlias = dict[str, Any]
"""Nested dictionaries, lists, strings and numbers."""


def define(experiment: Experiment, *, mjcf_sha256: str | None = None) -> Definition:
    """Everything that an experiment's numbers depend on.

    Args:
        experiment: The experiment.
        mjcf_sha256: SHA-256 of its MJCF, where that is known; by default the file is read.

    Raises:
        FileProblem: The experiment's MJCF cannot be read.
    """
    cells = experiment.cells()
    if mjcf_sha256 is None:
        mjcf_sha256 = mjcf_digest(experiment.mjcf) if experiment.mjcf else ""
    return {
        "robot": _robot(experiment.robot),
        "base": experiment.base,
        "mjcf_sha256": mjcf_sha256,
        "schedule": describe(experiment.schedule),
        "gaits": {
            repr(speed): gait.sha256
            for speed, gait in zip(experiment.speeds, experiment.gaits, strict=True)
        },
        "controllers": {
            name: describe(load_controller(name)) for name in sorted({c.controller for c in cells})
        },
        "scenarios": {name: describe(load_scenario(name)) for name in experiment.scenarios},
    }


def _robot(name: str) -> Definition:
    robot = load_robot(name)
    spec = describe(robot.spec)
    spec.pop("urdf")  # where it lies changes nothing; what it says does
    return {**spec, "urdf_sha256": robot.sha256}


def cell_definition(definition: Definition, cell: Cell) -> Definition:
    """What one simulation of an experiment depends on, out of the experiment's definition."""
    source = cell.depends_on
    return {
        **{key: definition[key] for key in ("robot", "base", "mjcf_sha256", "schedule")},
        "gaits": {repr(speed): definition["gaits"][repr(speed)] for speed in cell.speeds},
        "controller": definition["controllers"][cell.controller],
        "scenario": definition["scenarios"][cell.scenario],
        "seed": cell.seed,
        "depends_on": "" if source is None else fingerprint(cell_definition(definition, source)),
    }


def fingerprint(definition: Definition) -> str:
    """SHA-256 of a definition."""
    return sha256(to_text(definition))


def to_text(definition: Definition) -> str:
    """A definition in one line, the same each time."""
    return json.dumps(definition, sort_keys=True, separators=(",", ":"))


def describe(value: object) -> Any:
    """An object as JSON has it: class and fields, and the source of a class from outside."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): describe(part) for key, part in value.items()}
    if isinstance(value, Iterable):
        return [describe(part) for part in value]
    if inspect.isroutine(value) or isinstance(value, type):
        return _origin(value)
    if dataclasses.is_dataclass(value):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    else:
        fields = dict(getattr(value, "__dict__", {}))
    return {**_origin(type(value)), **{key: describe(part) for key, part in fields.items()}}


def _origin(thing: Any) -> Definition:
    """Where a class or function comes from; of one from outside, the SHA-256 of its module too."""
    module, name = str(thing.__module__), str(thing.__qualname__)
    if module.partition(".")[0] == _OURS:
        return {"class": name}
    try:
        source = sha256(Path(inspect.getfile(thing)).read_bytes())
    except (OSError, TypeError):
        source = "unknown"  # typed in by hand, or compiled
    return {"class": f"{module}:{name}", "source_sha256": source}


def differences(before: object, now: object, *, most: int = 3) -> str:
    """What differs between two definitions, in words: "schedule.learning 20.0 there, 3.0 here"."""
    found = list(_differences(before, now, ""))
    more = f", and {len(found) - most} more" if len(found) > most else ""
    return "; ".join(found[:most]) + more


def _differences(before: object, now: object, path: str) -> Iterator[str]:
    if isinstance(before, Mapping) and isinstance(now, Mapping):
        for key in sorted({*before, *now}, key=lambda key: (key != "name", key)):
            there, here = before.get(key, "nothing"), now.get(key, "nothing")
            yield from _differences(there, here, f"{path}.{key}" if path else str(key))
    elif before != now:
        yield f"{path} {_short(before)} there, {_short(now)} here"


def _short(value: object) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 40 else f"{text[:12]}..."
