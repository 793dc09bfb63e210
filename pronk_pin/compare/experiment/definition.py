"""What a simulation is, as data: everything that its numbers depend on, and the fingerprint of it.

A name alone does not say what was simulated: a law may have been changed behind it, a URDF edited,
a gait optimised again. A definition holds the parts whole, as JSON has them, so that stored strides
can be compared with what is asked for, and what differs be named.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, TypeAlias

from ...control import ControllerSpec
from ...robot import Robot, feedback_gains, motor_constants
from ...storage import sha256
from ..world import mjcf_sha256 as mjcf_digest
from .description import Description, describe

if TYPE_CHECKING:
    from .cell import Cell
    from .experiment import Experiment

Definition: TypeAlias = Description
"""Everything that the numbers of an experiment, or of a cell, depend on."""


def define(experiment: Experiment, *, mjcf_sha256: str | None = None) -> Definition:
    """Everything that an experiment's numbers depend on.

    Args:
        experiment: The experiment.
        mjcf_sha256: SHA-256 of its MJCF, where that is known; by default the file is read.

    Raises:
        FileProblem: The experiment's MJCF cannot be read.
    """
    if mjcf_sha256 is None:
        mjcf_sha256 = mjcf_digest(experiment.mjcf) if experiment.mjcf else ""
    return {
        "robot": _robot(experiment.model),
        "base": experiment.base,
        "mjcf_sha256": mjcf_sha256,
        "schedule": describe(experiment.schedule),
        "gaits": {
            repr(speed): gait.sha256
            for speed, gait in zip(experiment.speeds, experiment.planned, strict=True)
        },
        "controllers": {
            name: _controller(experiment.controller(name))
            for name in sorted({cell.controller for cell in experiment.cells()})
        },
        "scenarios": {
            name: describe(experiment.scenario(name)) for name in experiment.scenario_names
        },
        **(_driving(experiment) if experiment.commands else {}),
    }


def _controller(spec: ControllerSpec) -> Definition:
    described: Definition = describe(spec)
    described.pop("library", None)  # where it lies changes nothing; what it says does
    return described


def _driving(experiment: Experiment) -> Definition:
    """What the numbers depend on where speeds are commanded: any gait may be played."""
    return {
        "commands": list(experiment.commands),
        "reference": experiment.reference,
        "apex": experiment.apex,
        "library": experiment.library.sha256,
    }


def _robot(robot: Robot) -> Definition:
    spec = describe(robot.spec)
    spec.pop("urdf")  # where it lies changes nothing; what it says does
    kp, kd = feedback_gains(robot)  # these and the motors may be scaled from another robot's
    motors = describe(motor_constants(robot)._asdict())
    return {**spec, **motors, "kp": list(kp), "kd": list(kd), "urdf_sha256": robot.sha256}


def cell_definition(definition: Definition, cell: Cell) -> Definition:
    """What one simulation of an experiment depends on, out of the experiment's definition."""
    source = cell.depends_on
    driving = ("commands", "reference", "apex", "library") if cell.commands else ()
    return {
        **{key: definition[key] for key in ("robot", "base", "mjcf_sha256", "schedule")},
        "gaits": {repr(speed): definition["gaits"][repr(speed)] for speed in cell.speeds},
        "controller": definition["controllers"][cell.controller],
        "scenario": definition["scenarios"][cell.scenario],
        "seed": cell.seed,
        **{key: definition[key] for key in driving},
        "depends_on": "" if source is None else fingerprint(cell_definition(definition, source)),
    }


def fingerprint(definition: Definition) -> str:
    """SHA-256 of a definition."""
    return sha256(to_text(definition))


def to_text(definition: Definition) -> str:
    """A definition in one line, the same each time."""
    return json.dumps(definition, sort_keys=True, separators=(",", ":"))


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
