"""config.json: the experiment of a results folder, and everything that its numbers depend on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import FileProblem, PronkError
from ...storage import as_type, damaged, read_json, read_sealed, sealed
from ..experiment import Definition, Experiment, from_document, to_document
from .remedies import MAKE_ONE

CONFIG = "config.json"
"""Its name."""

SCHEMA = 5
"""Version of the layout of a results folder."""


def config_text(experiment: Experiment, definition: Definition) -> str:
    """What is written into it."""
    return sealed(
        {
            "schema": SCHEMA,
            "experiment": to_document(experiment),
            "definition": definition,
        }
    )


def read_experiment(folder: Path) -> Experiment:
    """The experiment.

    Raises:
        FileProblem: It is missing or damaged, or needs what is not there.
    """
    path = folder / CONFIG
    if not path.is_file():
        raise FileProblem(folder, "not a results folder (no config.json)", MAKE_ONE)
    document = read_json(path, MAKE_ONE)
    schema = document.get("schema") if isinstance(document, dict) else None
    if isinstance(schema, int) and schema != SCHEMA:
        raise FileProblem(path, f"schema {schema}, not {SCHEMA}", MAKE_ONE)
    config = read_sealed(path, MAKE_ONE)
    try:
        return from_document(config.get("experiment"), path, MAKE_ONE)
    except FileProblem:
        raise
    except PronkError as error:
        raise damaged(path, error, MAKE_ONE) from error


def read_definition(folder: Path) -> Definition:
    """Everything that the numbers depended on when the run began.

    Raises:
        FileProblem: It is missing or damaged.
    """
    path = folder / CONFIG
    definition = read_sealed(path, MAKE_ONE).get("definition")
    return as_type(definition, dict[str, Any], path, MAKE_ONE)
