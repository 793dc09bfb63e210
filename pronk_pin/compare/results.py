"""The results folder: what is written, and how it is read again.

=====================  ==================================================================
file                   contents
=====================  ==================================================================
config.json            the experiment and its definition: who has it can make the rest again
manifest.json          SHA-256 of the strides, the summary and parity.json
strides/<cell>.nc      every stride of one simulation (NetCDF-4), see `compare.strides`
summary.csv            one long table, see `compare.metrics`
parity.json            with another robot's MJCF only (`Experiment.world`): what that has otherwise
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
import tempfile
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pandas as pd
import xarray as xr

from .._checks import file_name, instance_of
from .._checks import path as known_path
from ..errors import (
    FileProblem,
    InvalidInput,
    OtherMachine,
    PronkError,
    cannot_write,
)
from ..robot import load_robot
from ..storage import (
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
    sha256,
    write_file,
)
from .definition import (
    Definition,
    cell_definition,
    define,
    differences,
    fingerprint,
)
from .experiment import Cell, Experiment
from .foreign import ForeignRobot, mjcf_sha256
from .metrics import COLUMNS, KEYS, summarize
from .practice import practice, rows_of_beating
from .provenance import machine, versions

SCHEMA = 4
"""Version of the layout of a results folder."""

_CONFIG, _MANIFEST, _PARITY = "config.json", "manifest.json", "parity.json"
_PROVENANCE, _SUMMARY = "provenance.json", "summary.csv"
_AGAIN = "run 'pronk-pin compare' to make one"
_ROOM = "make room, and run the same command again with --folder {folder}"
_COMPLETE = "run 'pronk-pin compare --folder {folder}' to make it"
_ANEW = "run 'pronk-pin compare --folder {folder} --resimulate' to make it anew"
_OTHER = "choose another folder, or add --resimulate to simulate it again"
_LARGEST_STRIDES = 2**33
"""Size beyond which strides are not unpacked [bytes]."""


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
        definition = define(experiment)
        if not resimulate:
            results._check_strides() if stored is None else stored._check_definition(definition)
        foreign = None
        if experiment.world and not results._holds(_PARITY):
            foreign = ForeignRobot.read(load_robot(experiment.robot), experiment.world)
        results._make_folder()
        if foreign is not None:
            results._write_listed(_PARITY, foreign.to_json())
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
            for name in (_CONFIG, _MANIFEST, _PARITY, _PROVENANCE, _SUMMARY):
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
        known = as_type(read_sealed(path, remedy), _Provenance, path, remedy)
        return dataclasses.asdict(known)

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
        if not self.experiment.world:
            return None
        path = self.folder / _PARITY
        remedy = "delete it and run the same 'pronk-pin compare --folder' again"
        text = self._read_listed(_PARITY, remedy)
        with reading(path, remedy):
            return ForeignRobot.from_json(text.decode())

    def check_foreign(self) -> None:
        """Refuse to complete a result with an MJCF that has changed since.

        Raises:
            FileProblem: It, or a file that it names, is another one now, or is gone.
        """
        foreign = self.foreign
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
        listed = self._holds(_strides_name(cell))
        self._open(cell, listed=listed).close()
        return listed  # else the run was killed before it could vouch for the file

    def save(self, cell: Cell, strides: xr.Dataset | bytes) -> None:
        """Write a cell's strides, as a dataset or as `encode` has made them.

        Raises:
            FileProblem: The file cannot be written.
        """
        data = strides if isinstance(strides, bytes) else encode(strides)
        self._write_listed(_strides_name(cell), data)

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
        return _joined([self.strides(cell) for cell in cells])

    def _open(self, cell: Cell, *, listed: bool = True) -> xr.Dataset:
        """A cell's file, checked against the manifest and for what it is of."""
        name, path = _strides_name(cell), self.path(cell)
        data = self._read_listed(name, self._anew) if listed else read_bytes(path, self._anew)
        with reading(path, self._anew):
            store = xr.backends.NetCDF4DataStore(  # type: ignore[no-untyped-call]
                netCDF4.Dataset(path.name, memory=data)
            )
            file = xr.open_dataset(store)
            if file.nbytes > _LARGEST_STRIDES:
                raise ValueError(f"it says that it has {file.nbytes / 1e9:.0f} GB")
        wanted = cell_definition(self._definition, cell)
        if file.attrs.get("fingerprint") != fingerprint(wanted):
            raise FileProblem(path, f"is of another simulation ({_told(file, wanted)})", _OTHER)
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
        self._write_listed(_SUMMARY, summary.to_csv(index=False))
        return summary

    def _computed_summary(self) -> pd.DataFrame:
        tables, practised = [], []
        for cell in self.experiment.cells():
            strides = self.strides(cell)
            tables.append(summarize(strides))
            practised.append(practice(strides))
        tables.append(pd.DataFrame(rows_of_beating(practised), columns=COLUMNS))
        full = [table for table in tables if len(table)]
        return pd.concat(full).sort_values(KEYS, ignore_index=True)[COLUMNS]

    def summary(self) -> pd.DataFrame:
        """Read summary.csv; where it is missing, damaged or incomplete it is made again.

        Raises:
            FileProblem: The strides that it is made of are missing or damaged.
        """
        path = self.folder / _SUMMARY
        try:
            self._read_listed(_SUMMARY, "")
        except FileProblem:
            return self._summary_anew()
        remedy = f"delete it and {_COMPLETE.format(folder=self.folder)}"
        header = read_csv(path, remedy)[0]
        if header != COLUMNS or self._manifest().get("strides") != self._strides_digest():
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
        return write_file(self.folder / name, contents, remedy=_ROOM.format(folder=self.folder))

    def _manifest(self) -> dict[str, str]:
        """SHA-256 of the files that are vouched for, by name; and what the summary was made of."""
        path = self.folder / _MANIFEST
        if not path.exists():
            return {}
        remedy = f"delete it and {_COMPLETE.format(folder=self.folder)}"
        return as_type(read_sealed(path, remedy).get("files"), dict[str, str], path, remedy)

    def _strides_digest(self) -> str:
        """SHA-256 of all strides there are, as the manifest has them."""
        files = self._manifest()
        names = sorted(_strides_name(cell) for cell in self.experiment.cells())
        return sha256("\n".join(files.get(name, "") for name in names))

    def _holds(self, name: str) -> bool:
        return name in self._manifest() and (self.folder / name).is_file()

    def _read_listed(self, name: str, remedy: str) -> bytes:
        """A file that is the one that was written, by the manifest."""
        path = self.folder / name
        data = read_bytes(path, remedy or _COMPLETE.format(folder=self.folder))
        if self._manifest().get(name) != sha256(data):
            raise damaged(path, "it is not the file that was written there", remedy)
        return data

    def _write_listed(self, name: str, contents: str | bytes) -> None:
        """Write a file after its entry in the manifest: one without an entry is nobody's."""
        data = contents.encode() if isinstance(contents, str) else contents
        files = {**self._manifest(), name: sha256(data)}
        if name == _SUMMARY:
            files["strides"] = self._strides_digest()
        self.write(_MANIFEST, sealed({"files": dict(sorted(files.items()))}))
        self.write(name, data)


@dataclass(frozen=True)
class _Provenance:
    """What provenance.json holds."""

    finished: bool
    runs: list[dict[str, Any]]


def _strides_name(cell: Cell) -> str:
    return f"strides/{cell.name}.nc"


def _told(file: xr.Dataset, wanted: Definition) -> str:
    """What a file of strides is of, as far as that is not what is wanted."""
    text = file.attrs.get("definition")
    if not isinstance(text, str):
        return "it does not say of which"
    try:
        return differences(json.loads(text), wanted) or "its fingerprint is not its own"
    except ValueError:
        return "it does not say of which"


def _joined(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """The strides of several batches of speeds as one dataset, with NaN where one has fewer."""
    if len(parts) == 1:
        return parts[0]
    numbered = [part.assign_coords(tick=np.arange(part.sizes["tick"])) for part in parts]
    joined = xr.concat(
        numbered, dim="speed", data_vars="all", join="outer", combine_attrs="drop_conflicts"
    )
    return joined.drop_vars("tick").sortby("speed")


def encode(strides: xr.Dataset) -> bytes:
    """A dataset as a NetCDF-4 file with checksums (Fletcher-32), the same bytes each time."""
    packed = {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
    encoding = {
        name: packed if variable.ndim > 2 else {"fletcher32": True}
        for name, variable in strides.variables.items()
        if variable.ndim and variable.dtype.kind in "fiub"
    }
    with _scratch_file() as path:
        strides.to_netcdf(path, engine="netcdf4", encoding=encoding)
        return path.read_bytes()


@contextlib.contextmanager
def _scratch_file() -> Iterator[Path]:
    """A temporary file for a library that writes by name.

    Raises:
        FileProblem: There is no room for it.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="pronk_pin-") as folder:
            yield Path(folder) / "strides.nc"
    except (OSError, RuntimeError) as error:
        remedy = "make room for temporary files, or set TMPDIR"
        raise cannot_write(tempfile.gettempdir(), error, remedy) from error


DEFAULT_PARENT = "results"
"""Folder below the current one in which results folders are made."""


def default_folder(name: str = "comparison") -> Path:
    """results/<time>-<name> below the current folder."""
    file_name("name", name)
    return Path(DEFAULT_PARENT) / f"{datetime.now():%Y%m%d-%H%M%S}-{name}"
