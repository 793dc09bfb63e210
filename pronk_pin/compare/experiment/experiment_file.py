"""An experiment as a document: what config.json holds, and what a user writes in YAML.

Robot, controllers and scenarios stand there by name, or as a mapping of the fields of a
`RobotSpec`, `ControllerSpec` or `Scenario`; parts of these whose class is not known from the field
name it (`law: {class: PDTypeILC, gain: 0.3}`), one from outside by its address.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..._checks import path as known_path
from ...control import ControllerSpec
from ...errors import FileProblem, PronkError
from ...robot import RobotSpec
from ...storage import as_type, damaged, read_yaml
from ..metrics import Metric
from ..simulation import Schedule
from ..world import Scenario
from .description import describe, restore
from .experiment import Experiment

GAITS, URDF = "gaits.npz", "robot.urdf"
"""Files of gaits that are not shipped, and of a robot that is not, beside a document."""


@dataclass(frozen=True)
class _Document:
    """What stands in it, mappings in place of objects; what is left out is as by default."""

    robot: str | dict[str, Any] | None = None
    gaits: str | None = None
    apex: float | None = None
    speeds: tuple[float, ...] | None = None
    controllers: tuple[str | dict[str, Any], ...] | None = None
    scenarios: tuple[str | dict[str, Any], ...] | None = None
    seeds: tuple[int, ...] | None = None
    base: str | None = None
    mjcf: str | None = None
    engine: str | None = None
    schedule: Schedule | None = None
    metrics: tuple[str | dict[str, Any], ...] | None = None
    commands: tuple[str, ...] | None = None
    reference: str | None = None
    batches: tuple[tuple[float, ...], ...] | None = None


def to_document(experiment: Experiment) -> dict[str, Any]:
    """The experiment as JSON has it; gaits of one's own are the file `GAITS` beside it."""
    whole = {part.name: getattr(experiment, part.name) for part in dataclasses.fields(experiment)}
    del whole["engine"]  # it stands in the scenarios
    own = not isinstance(experiment.gaits, str)
    constant = () if experiment.commands else ("commands", "reference")
    return {
        **{name: value for name, value in whole.items() if name not in constant},
        "robot": describe(experiment.robot),
        "gaits": GAITS if own else experiment.gaits,
        "controllers": describe(experiment.controllers),
        "scenarios": describe(experiment.scenarios),
        "metrics": describe(experiment.metrics),
        "schedule": dataclasses.asdict(experiment.schedule),
    }


def from_document(document: object, path: Path, remedy: str) -> Experiment:
    """The experiment of a document; files that it names lie where it does.

    Args:
        document: What stands in it.
        path: Where it comes from.
        remedy: What to do where it is damaged.

    Raises:
        FileProblem: It is something else than an experiment.
        PronkError: What `Experiment` raises for values that are out of range.
    """
    known = as_type(document, _Document, path, remedy, what="experiment")
    parts = {part.name: getattr(known, part.name) for part in dataclasses.fields(known)}
    fields: dict[str, Any] = {name: part for name, part in parts.items() if part is not None}
    kinds = {"controllers": ControllerSpec, "scenarios": Scenario, "metrics": Metric}
    for name, kind in kinds.items():
        if name in fields:
            fields[name] = tuple(
                value if isinstance(value, str) else restore(value, kind, f"{name}[{k}]")
                for k, value in enumerate(fields[name])
            )
    if isinstance(known.robot, dict):
        fields["robot"] = _kept_robot(restore(known.robot, RobotSpec, "robot"), path.parent)
    for name in ("robot", "gaits", "mjcf"):
        value = fields.get(name)
        if isinstance(value, str) and value and (path.parent / value).is_file():
            fields[name] = str(path.parent / value)
    if known.commands is not None:
        fields["commands"] = tuple(
            str(path.parent / words) if words.endswith(".csv") else words
            for words in known.commands
        )
    return Experiment(**fields)


def _kept_robot(spec: RobotSpec, folder: Path) -> RobotSpec:
    """A robot of one's own; where its URDF is gone, with the copy in a results folder."""
    kept = folder / URDF
    gone = Path(spec.urdf).is_absolute() and not Path(spec.urdf).is_file()
    return dataclasses.replace(spec, urdf=str(kept.resolve())) if gone and kept.is_file() else spec


def read_config(path: Path | str) -> Experiment:
    """Read an experiment from YAML, JSON, or the config.json of a results folder.

    Raises:
        FileProblem: The file is missing, or is something else.
    """
    path = known_path("config", path).expanduser()
    remedy = "correct it: its keys are the fields of Experiment"
    document = read_yaml(path, remedy)
    if isinstance(document, dict) and isinstance(document.get("experiment"), dict):
        document = document["experiment"]
    try:
        return from_document({} if document is None else document, path, remedy)
    except FileProblem:
        raise
    except PronkError as error:
        raise damaged(path, error, remedy, what="experiment") from error
