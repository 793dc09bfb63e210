"""A results folder is made, or one that is there is taken up: extended, completed."""

from __future__ import annotations

import contextlib
import warnings
from datetime import datetime
from pathlib import Path

from ..._checks import file_name
from ...errors import FileProblem, OtherMachine, cannot_write
from ...storage import read_text
from ..experiment import GAITS, URDF, Definition, define, differences
from ..world import ForeignRobot, mjcf_sha256
from .config_file import CONFIG, config_text, read_definition
from .manifest import MANIFEST
from .provenance import PROVENANCE, machine, versions
from .remedies import MAKE_ONE, SIMULATE_AGAIN
from .results import PARITY, Results
from .summary_file import SUMMARY

DEFAULT_PARENT = "results"
"""Folder below the current one in which results folders are made."""


def default_folder(name: str = "comparison") -> Path:
    """results/<time>-<name> below the current folder."""
    file_name("name", name)
    return Path(DEFAULT_PARENT) / f"{datetime.now():%Y%m%d-%H%M%S}-{name}"


def make_folder(results: Results, *, resimulate: bool = False) -> None:
    """Make the folder of results that are to be completed, or take up one that is there.

    Args:
        results: What is to be in it, by `Results.of`.
        resimulate: Let strides in the folder that are of something else be simulated again;
            otherwise they are refused.

    Raises:
        FileProblem: It cannot be written, or what it holds was begun with something else; or the
            experiment's MJCF cannot be read.
        InvalidInput: The MJCF is not of this robot.
    """
    folder, experiment = results.folder, results.experiment
    stored = (folder / CONFIG).exists()
    known = results.foreign if results.has_foreign else None
    definition = define(experiment, mjcf_sha256=known.sha256 if known else None)
    if not resimulate:
        _check_definition(folder, definition) if stored else _check_strides(results)
    foreign = None
    if experiment.mjcf and known is None:
        foreign = ForeignRobot.read(experiment.model, experiment.mjcf)
    try:
        (folder / "strides").mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise cannot_write(folder, error, "choose a folder of yours with --folder") from error
    if not isinstance(experiment.gaits, str):
        experiment.gaits.save(folder / GAITS)
    if not isinstance(experiment.robot, str):
        results.write(URDF, experiment.model.urdf)
    if foreign is not None:
        results.manifest.write(PARITY, foreign.to_json())
    config = config_text(experiment, definition)
    if not stored or read_text(folder / CONFIG, MAKE_ONE) != config:
        results.write(CONFIG, config)


def _check_strides(results: Results) -> None:
    """What lies where strides are to be written is of this experiment."""
    for cell in results.experiment.cells():
        results.has(cell)


def _check_definition(folder: Path, now: Definition) -> None:
    """What the folder was begun with is what it means today."""
    before = read_definition(folder)
    kept = {key: part for key, part in now.items() if key in before}
    for key in ("gaits", "controllers", "scenarios"):
        kept[key] = {name: part for name, part in now[key].items() if name in before[key]}
    if kept != before:
        raise FileProblem(
            folder, f"was begun with another {differences(before, kept)}", SIMULATE_AGAIN
        )


def check_completion(results: Results) -> None:
    """Refuse to complete a result that is not as it was begun; warn of another machine.

    Raises:
        FileProblem: A package that makes the numbers has another version than before, or the MJCF,
            or a file that it names, is another one now, or is gone.
    """
    _check_versions(results)
    foreign = results.foreign if results.has_foreign else None
    if foreign is not None and mjcf_sha256(foreign.path) != foreign.sha256:
        raise FileProblem(
            foreign.path,
            f"is not what {results.folder} was begun with",
            "put the old file back, or choose another folder",
        )


def _check_versions(results: Results) -> None:
    for run in results.provenance["runs"][-1:]:
        before, now = run.get("versions", {}), versions()
        for name in sorted(before):
            if before[name] != now.get(name):
                raise FileProblem(
                    results.folder,
                    f"was begun with {name} {before[name]}, and this is {now.get(name)}",
                    "install that version again, or choose another folder",
                )
        there = {key: run[key] for key in machine() if key in run}
        here = {key: value for key, value in machine().items() if key in there}
        if there != here:
            warnings.warn(OtherMachine(results.folder, differences(there, here)), stacklevel=3)


def remove_if_empty(folder: Path) -> None:
    """Remove a folder without strides, and what a run that came to nothing wrote into it."""
    with contextlib.suppress(OSError):
        if any((folder / "strides").iterdir()):
            return
        for name in (CONFIG, GAITS, URDF, MANIFEST, PARITY, PROVENANCE, SUMMARY):
            (folder / name).unlink(missing_ok=True)
        (folder / "strides").rmdir()
        folder.rmdir()
        if folder.parent == Path(DEFAULT_PARENT):
            folder.parent.rmdir()
