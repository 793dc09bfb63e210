"""A results folder is made, or one that is there is taken up: extended, completed."""

from __future__ import annotations

import contextlib
import warnings
from datetime import datetime
from pathlib import Path

from ..._checks import file_name, instance_of
from ..._checks import path as known_path
from ...errors import FileProblem, InvalidInput, OtherMachine, cannot_write
from ...robot import load_robot
from ...storage import read_text
from ..experiment import Definition, Experiment, define, differences
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


def create_results(
    experiment: Experiment, folder: Path | str, *, resimulate: bool = False
) -> Results:
    """Make a results folder, or take up one that is there, and extend it by what is new.

    Args:
        experiment: What to run. Controllers, scenarios, speeds and seeds that the folder does
            not have yet are added to those that it has.
        folder: The folder.
        resimulate: Let strides in the folder that are of something else be simulated again;
            otherwise they are refused.

    Raises:
        FileProblem: It cannot be written, or holds an experiment that differs in what cannot be
            added to; or the experiment's MJCF cannot be read.
        InvalidInput: The MJCF is not of this robot.
    """
    folder = known_path("folder", folder)
    instance_of("experiment", experiment, Experiment)
    stored = Results.load(folder) if (folder / CONFIG).exists() else None
    if stored is not None:
        experiment = _extended(stored, experiment)
    results = Results(folder, experiment)
    known = results.foreign if results.has_foreign else None
    definition = define(experiment, mjcf_sha256=known.sha256 if known else None)
    if not resimulate:
        _check_strides(results) if stored is None else _check_definition(stored, definition)
    foreign = None
    if experiment.mjcf and known is None:
        foreign = ForeignRobot.read(load_robot(experiment.robot), experiment.mjcf)
    _make_folder(folder)
    if foreign is not None:
        results.manifest.write(PARITY, foreign.to_json())
    config = config_text(experiment, definition)
    if stored is None or read_text(folder / CONFIG, MAKE_ONE) != config:
        results.write(CONFIG, config)
    return results


def _extended(stored: Results, experiment: Experiment) -> Experiment:
    """A folder's experiment with what is new in another one."""
    try:
        return stored.experiment.extended(experiment)
    except InvalidInput as error:
        raise FileProblem(
            stored.folder,
            f"holds another experiment ({error})",
            "leave these options out to go on with it, or choose another folder",
        ) from error


def _check_strides(results: Results) -> None:
    """What lies where strides are to be written is of this experiment."""
    for cell in results.experiment.cells():
        results.has(cell)


def _check_definition(stored: Results, now: Definition) -> None:
    """What the folder was begun with is what it means today."""
    before = read_definition(stored.folder)
    kept = {key: part for key, part in now.items() if key in before}
    for key in ("gaits", "controllers", "scenarios"):
        kept[key] = {name: part for name, part in now[key].items() if name in before[key]}
    if kept != before:
        raise FileProblem(
            stored.folder, f"was begun with another {differences(before, kept)}", SIMULATE_AGAIN
        )


def _make_folder(folder: Path) -> None:
    try:
        (folder / "strides").mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise cannot_write(folder, error, "choose a folder of yours with --folder") from error


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
        for name in (CONFIG, MANIFEST, PARITY, PROVENANCE, SUMMARY):
            (folder / name).unlink(missing_ok=True)
        (folder / "strides").rmdir()
        folder.rmdir()
        if folder.parent == Path(DEFAULT_PARENT):
            folder.parent.rmdir()
