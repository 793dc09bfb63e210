"""The results folder: what is written, and how it is read again.

=====================  ==================================================================
file                   contents
=====================  ==================================================================
config.json            the experiment and its definition: who has it can make the rest again
manifest.json          SHA-256 of the strides, the summary and parity.json
strides/<cell>.nc      every stride of one simulation (NetCDF-4), see `compare.simulation.dataset`
summary.csv            one long table, see `compare.metrics`
parity.json            with another robot's MJCF only (`Experiment.mjcf`): what that has otherwise
provenance.json        versions, machine, state of the source, times: not the same twice
report.html, .md       tables and figures
replay.html            the robot beside the reference, in one file
=====================  ==================================================================

A file appears under its name only when it is whole (`pronk_pin.storage`), and is read only if it is
the one that was written, and of the simulation that is asked for: else it is refused by name.
"""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import json
import os
import warnings
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ..._checks import file_name, instance_of
from ..._checks import path as known_path
from ...errors import FileProblem, InvalidInput, OtherMachine, PronkError, cannot_write
from ...robot import load_robot
from ...storage import (
    as_type,
    clear_partial_files,
    damaged,
    read_bytes,
    read_csv,
    read_json,
    read_sealed,
    read_text,
    reading,
    sealed,
    write_file,
)
from ..metrics import COLUMNS, KEYS, beat_rows, peak_history, summarize
from ..world import ForeignRobot, mjcf_sha256
from .definition import Definition, cell_definition, define, differences, fingerprint
from .experiment import Cell, Experiment
from .manifest import MANIFEST, Manifest, complete, no_room
from .provenance import machine, versions
from .strides_file import decode, encode, join_speeds

SCHEMA = 4
"""Version of the layout of a results folder."""

_CONFIG, _PARITY = "config.json", "parity.json"
_PROVENANCE, _SUMMARY = "provenance.json", "summary.csv"
_AGAIN = "run 'pronk-pin compare' to make one"
_ANEW = "run 'pronk-pin compare --folder {folder} --resimulate' to make it anew"
_OTHER = "choose another folder, or add --resimulate to simulate it again"


@dataclass(frozen=True)
class Results:
    """A results folder.

    Attributes:
        folder: Where it is.
        experiment: What was run.
    """

    folder: Path
    experiment: Experiment

    @classmethod
    def create(
        cls, experiment: Experiment, folder: Path | str, *, resimulate: bool = False
    ) -> Results:
        """Make the folder, or take up one that is there, and extend it by what is new.

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
        stored = cls.load(folder) if (folder / _CONFIG).exists() else None
        if stored is not None:
            experiment = stored._extended(experiment)
        results = cls(folder, experiment)
        known = results.foreign if results._manifest.holds(_PARITY) else None
        definition = define(experiment, mjcf_sha256=known.sha256 if known else None)
        if not resimulate:
            results._check_strides() if stored is None else stored._check_definition(definition)
        foreign = None
        if experiment.mjcf and known is None:
            foreign = ForeignRobot.read(load_robot(experiment.robot), experiment.mjcf)
        results._make_folder()
        if foreign is not None:
            results._manifest.write(_PARITY, foreign.to_json())
        config = sealed(
            {
                "schema": SCHEMA,
                "experiment": dataclasses.asdict(experiment),
                "definition": definition,
            }
        )
        if stored is None or read_text(folder / _CONFIG, _AGAIN) != config:
            results.write(_CONFIG, config)
        return results

    def _check_strides(self) -> None:
        """What lies where strides are to be written is of this experiment."""
        for cell in self.experiment.cells():
            self.has(cell)

    def _make_folder(self) -> None:
        try:
            (self.folder / "strides").mkdir(parents=True, exist_ok=True)
        except (OSError, ValueError) as error:
            remedy = "choose a folder of yours with --folder"
            raise cannot_write(self.folder, error, remedy) from error

    def _extended(self, experiment: Experiment) -> Experiment:
        """This folder's experiment with what is new in another one."""
        try:
            return self.experiment.extended(experiment)
        except InvalidInput as error:
            raise FileProblem(
                self.folder,
                f"holds another experiment ({error})",
                "leave these options out to go on with it, or choose another folder",
            ) from error

    def _check_definition(self, now: Definition) -> None:
        """What the folder was begun with is what it means today."""
        before = self._stored_definition()
        kept = {key: part for key, part in now.items() if key in before}
        for key in ("gaits", "controllers", "scenarios"):
            kept[key] = {name: part for name, part in now[key].items() if name in before[key]}
        if kept != before:
            raise FileProblem(
                self.folder, f"was begun with another {differences(before, kept)}", _OTHER
            )

    @classmethod
    def load(cls, folder: Path | str) -> Results:
        """Read a results folder.

        Raises:
            FileProblem: It is missing or damaged, or needs what is not there.
        """
        folder = known_path("folder", folder)
        path = folder / _CONFIG
        if not path.is_file():
            raise FileProblem(folder, "not a results folder (no config.json)", _AGAIN)
        document = read_json(path, _AGAIN)
        schema = document.get("schema") if isinstance(document, dict) else None
        if isinstance(schema, int) and schema != SCHEMA:
            raise FileProblem(path, f"schema {schema}, not {SCHEMA}", _AGAIN)
        config = read_sealed(path, _AGAIN)
        try:
            return cls(folder, as_type(config.get("experiment"), Experiment, path, _AGAIN))
        except FileProblem:
            raise
        except PronkError as error:
            raise damaged(path, error, _AGAIN) from error

    def _stored_definition(self) -> Definition:
        """What config.json says of everything that the numbers depend on."""
        path = self.folder / _CONFIG
        definition = read_sealed(path, _AGAIN).get("definition")
        return as_type(definition, dict[str, Any], path, _AGAIN)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other runs out of the folder, and clear away what a killed one left half written.

        The lock ends with the process, however it ends.

        Raises:
            FileProblem: Another run is at it, or it is not ours to write in.
        """
        handle = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            clear_partial_files(self.folder)
            yield
        except BlockingIOError as error:
            raise FileProblem(
                self.folder, "another run is writing there", "wait for it, or end it first"
            ) from error
        finally:
            os.close(handle)

    def remove_if_empty(self) -> None:
        """Remove a folder without strides, and what a run that came to nothing wrote into it."""
        with contextlib.suppress(OSError):
            if any((self.folder / "strides").iterdir()):
                return
            for name in (_CONFIG, MANIFEST, _PARITY, _PROVENANCE, _SUMMARY):
                (self.folder / name).unlink(missing_ok=True)
            (self.folder / "strides").rmdir()
            self.folder.rmdir()
            if self.folder.parent == Path(DEFAULT_PARENT):
                self.folder.parent.rmdir()

    @property
    def provenance(self) -> dict[str, Any]:
        """What provenance.json says: whether the run is `finished`, and its `runs`, first to last.

        Raises:
            FileProblem: It is damaged.
        """
        path = self.folder / _PROVENANCE
        if not path.is_file():
            return {"finished": False, "runs": []}
        remedy = "delete it: only the record of who made it is lost"
        stored = as_type(read_sealed(path, remedy), _Provenance, path, remedy)
        return dataclasses.asdict(stored)

    def write_provenance(self, provenance: Mapping[str, Any]) -> None:
        """Write provenance.json."""
        self.write(_PROVENANCE, sealed(provenance))

    def check_versions(self) -> None:
        """Refuse to complete a result that other versions have begun; warn of another machine.

        Raises:
            FileProblem: A package that makes the numbers has another version than before.
        """
        for run in self.provenance["runs"][-1:]:
            before, now = run.get("versions", {}), versions()
            for name in sorted(before):
                if before[name] != now.get(name):
                    raise FileProblem(
                        self.folder,
                        f"was begun with {name} {before[name]}, and this is {now.get(name)}",
                        "install that version again, or choose another folder",
                    )
            there = {key: run[key] for key in machine() if key in run}
            here = {key: value for key, value in machine().items() if key in there}
            if there != here:
                warnings.warn(OtherMachine(self.folder, differences(there, here)), stacklevel=2)

    @property
    def foreign(self) -> ForeignRobot | None:
        """The MJCF that it was made with, as it was when the run began; None with our own robot.

        Raises:
            FileProblem: parity.json is missing or damaged.
        """
        if not self.experiment.mjcf:
            return None
        path = self.folder / _PARITY
        remedy = "run the same 'pronk-pin compare --folder' again"
        remedy = f"delete it and {remedy}" if path.exists() else remedy
        text = self._manifest.read(_PARITY, remedy)
        with reading(path, remedy):
            return ForeignRobot.from_json(text.decode())

    def check_foreign(self) -> None:
        """Refuse to complete a result with an MJCF that has changed since.

        Raises:
            FileProblem: It, or a file that it names, is another one now, or is gone.
        """
        foreign = self.foreign if self._manifest.holds(_PARITY) else None
        if foreign is not None and mjcf_sha256(foreign.path) != foreign.sha256:
            raise FileProblem(
                foreign.path,
                f"is not what {self.folder} was begun with",
                "put the old file back, or choose another folder",
            )

    def path(self, cell: Cell) -> Path:
        """The file of a cell's strides."""
        return self.folder / _strides_name(cell)

    def has(self, cell: Cell) -> bool:
        """Whether the cell was simulated already: its strides are there, whole and its own.

        Raises:
            FileProblem: There is a file of its name that is damaged, or of something else.
        """
        path = self.path(cell)
        if not path.exists():
            return False
        listed = self._manifest.holds(_strides_name(cell))
        self._open(cell, listed=listed).close()
        return listed  # else the run was killed before it could vouch for the file

    def save(self, cell: Cell, strides: xr.Dataset | bytes) -> None:
        """Write a cell's strides, as a dataset or as `encode` has made them.

        Raises:
            FileProblem: The file cannot be written.
        """
        data = strides if isinstance(strides, bytes) else encode(strides)
        self._manifest.write(_strides_name(cell), data)

    def strides(self, cell: Cell, variables: Collection[str] | None = None) -> xr.Dataset:
        """The strides of a cell.

        Args:
            cell: Which simulation.
            variables: Read these only, as far as there are such; by default everything.

        Raises:
            FileProblem: The file is missing or damaged, or of another simulation.
        """
        with self._open(cell) as file, reading(self.path(cell), self._anew):
            wanted = file if variables is None else file[[v for v in variables if v in file]]
            return wanted.load()

    def all_strides(self, *, controller: str, scenario: str | None = None) -> xr.Dataset:
        """The strides of a controller at all speeds, in the first seed; args as for `find`."""
        first = self.find(controller=controller, scenario=scenario)
        cells = [
            cell
            for cell in self.experiment.cells()
            if (cell.controller, cell.scenario, cell.seed)
            == (first.controller, first.scenario, first.seed)
        ]
        return join_speeds([self.strides(cell) for cell in cells])

    def _open(self, cell: Cell, *, listed: bool = True) -> xr.Dataset:
        """A cell's file, checked against the manifest and for what it is of."""
        name, path = _strides_name(cell), self.path(cell)
        data = self._manifest.read(name, self._anew) if listed else read_bytes(path, self._anew)
        file = decode(data, path, self._anew)
        wanted = cell_definition(self._definition, cell)
        if file.attrs.get("fingerprint") != fingerprint(wanted):
            raise FileProblem(path, f"is of another simulation ({_mismatch(file, wanted)})", _OTHER)
        return file

    @property
    def _definition(self) -> Definition:
        """The definition in config.json; while there is none, what the experiment means today."""
        if (self.folder / _CONFIG).is_file():
            return self._stored_definition()
        return define(self.experiment)

    @property
    def _anew(self) -> str:
        return _ANEW.format(folder=self.folder)

    def find(self, *, controller: str, scenario: str | None = None) -> Cell:
        """The cell of a controller, in the first seed and by default the first scenario.

        Raises:
            InvalidInput: The result does not have them.
        """
        scenario = scenario or self.experiment.scenarios[0]
        for cell in self.experiment.cells():
            if (cell.controller, cell.scenario) == (controller, scenario):
                return cell
        known = ", ".join(sorted({cell.controller for cell in self.experiment.cells()}))
        raise InvalidInput(
            f"no '{controller}' in scenario '{scenario}'; the result has the controllers {known} "
            f"in the scenarios {', '.join(self.experiment.scenarios)}"
        )

    def summarize(self) -> pd.DataFrame:
        """Compute the summary from the strides, and write summary.csv."""
        summary = self._computed_summary()
        self._manifest.write(_SUMMARY, summary.to_csv(index=False), made_of=self.strides_digest)
        return summary

    def _computed_summary(self) -> pd.DataFrame:
        tables, histories = [], []
        for cell in self.experiment.cells():
            strides = self.strides(cell)
            tables.append(summarize(strides))
            histories.append(peak_history(strides))
        tables.append(pd.DataFrame(beat_rows(histories), columns=COLUMNS))
        full = [table for table in tables if len(table)]
        return pd.concat(full).sort_values(KEYS, ignore_index=True)[COLUMNS]

    def summary(self) -> pd.DataFrame:
        """Read summary.csv; where it is missing, damaged or incomplete it is made again.

        It is read once for each state of the folder, as the manifest tells it.

        Raises:
            FileProblem: The strides that it is made of are missing or damaged.
        """
        return _summary(self, self.strides_digest, self._manifest.digest([_SUMMARY])).copy()

    def _read_summary(self) -> pd.DataFrame:
        path = self.folder / _SUMMARY
        try:
            self._manifest.read(_SUMMARY, "")
        except FileProblem:
            return self._summary_anew()
        remedy = f"delete it and {complete(self.folder)}"
        stale = self._manifest.made_of(_SUMMARY) != self.strides_digest
        if stale or read_csv(path, remedy)[0] != COLUMNS:
            return self._summary_anew()
        with reading(path, remedy):
            return pd.read_csv(path)

    def _summary_anew(self) -> pd.DataFrame:
        """The summary from the strides, and into its file if that can be written."""
        with contextlib.suppress(FileProblem), self.locked():
            return self.summarize()
        return self._computed_summary()

    def write(self, name: str, contents: str | bytes) -> Path:
        """Write a file of the folder, whole or not at all.

        Raises:
            FileProblem: It cannot be written; what was there before is still there.
        """
        return write_file(self.folder / name, contents, remedy=no_room(self.folder))

    @property
    def _manifest(self) -> Manifest:
        return Manifest(self.folder)

    @property
    def strides_digest(self) -> str:
        """SHA-256 of all strides there are, as the manifest has them."""
        return self._manifest.digest([_strides_name(cell) for cell in self.experiment.cells()])


@lru_cache(maxsize=4)
def _summary(results: Results, strides: str, summary: str) -> pd.DataFrame:
    """The summary of a result, as long as its files, by their digests, are the same."""
    return results._read_summary()


@dataclass(frozen=True)
class _Provenance:
    """What provenance.json holds."""

    finished: bool
    runs: list[dict[str, Any]]


def _strides_name(cell: Cell) -> str:
    return f"strides/{cell.name}.nc"


def _mismatch(file: xr.Dataset, wanted: Definition) -> str:
    """What a file of strides is of, as far as that is not what is wanted."""
    text = file.attrs.get("definition")
    if not isinstance(text, str):
        return "it does not say of which"
    try:
        return differences(json.loads(text), wanted) or "its fingerprint is not its own"
    except ValueError:
        return "it does not say of which"


DEFAULT_PARENT = "results"
"""Folder below the current one in which results folders are made."""


def default_folder(name: str = "comparison") -> Path:
    """results/<time>-<name> below the current folder."""
    file_name("name", name)
    return Path(DEFAULT_PARENT) / f"{datetime.now():%Y%m%d-%H%M%S}-{name}"
