"""The results folder: what is written, and how it is read again.

=====================  ==================================================================
file                   contents
=====================  ==================================================================
config.json            the experiment: who has it can make the rest again, to the bit
strides/<cell>.nc      every stride of one simulation (NetCDF-4), see `compare.strides`
summary.csv            one long table, see `compare.metrics`
parity.json            with another robot's MJCF only (`Experiment.world`): what that has otherwise
provenance.json        versions, machine, state of the source, times: not the same twice
report.html, .md       tables and figures
replay.html            the robot beside the reference, in one file
=====================  ==================================================================

A file appears under its name only when it is whole; what a killed run leaves half written ends in
`.partial`, and the next run clears it away.
"""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import json
import os
import tempfile
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from .._checks import file_name, instance_of
from .._checks import path as known_path
from ..errors import FileProblem, InvalidInput, SpeedOutOfRange, UnknownName, cannot_write
from ..robot import load_robot
from .experiment import Cell, Experiment
from .foreign import ForeignRobot, mjcf_sha256
from .metrics import COLUMNS, KEYS, summarize
from .practice import practice, rows_of_beating
from .provenance import versions
from .schedule import Schedule

SCHEMA = 3
"""Version of the layout of a results folder."""

_PARITY = "parity.json"
_AGAIN = "run 'pronk-pin compare' to make one"
_ROOM = "make room, and run the same command again with --folder {folder}"
_DAMAGE = (
    *(ValueError, KeyError, TypeError, AttributeError),
    *(InvalidInput, UnknownName, SpeedOutOfRange),
)


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
    def create(cls, experiment: Experiment, folder: Path | str) -> Results:
        """Make the folder, or take up one that holds the same experiment.

        Raises:
            FileProblem: It cannot be written, or belongs to another experiment; or the experiment's
                MJCF cannot be read.
            InvalidInput: The MJCF is not of this robot.
        """
        folder = known_path("folder", folder)
        results = cls(folder, instance_of("experiment", experiment, Experiment))
        taken = (folder / "config.json").exists()
        if taken and cls.load(folder).experiment != experiment:
            raise FileProblem(folder, "holds another experiment", "choose another folder")
        foreign = None
        if experiment.world and not (folder / _PARITY).exists():
            foreign = ForeignRobot.read(load_robot(experiment.robot), experiment.world)
        try:
            (folder / "strides").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error, "choose a folder of yours with --folder") from error
        if foreign is not None:
            results.write(_PARITY, foreign.to_json())
        if not taken:
            config = {"schema": SCHEMA, "experiment": dataclasses.asdict(experiment)}
            results.write("config.json", json.dumps(config, indent=2) + "\n")
        return results

    @classmethod
    def load(cls, folder: Path | str) -> Results:
        """Read a results folder.

        Raises:
            FileProblem: It is missing or damaged.
        """
        folder = known_path("folder", folder)
        path = folder / "config.json"
        if not path.is_file():
            raise FileProblem(folder, "not a results folder (no config.json)", _AGAIN)
        try:
            config = json.loads(path.read_text())
            if config["schema"] != SCHEMA:
                raise FileProblem(path, f"schema {config['schema']}, not {SCHEMA}", _AGAIN)
            return cls(folder, _experiment(config["experiment"]))
        except _DAMAGE as error:
            raise FileProblem(path, f"damaged ({error})", _AGAIN) from error

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
            self._clear_away()
            yield
        except BlockingIOError as error:
            raise FileProblem(
                self.folder, "another run is writing there", "wait for it, or end it first"
            ) from error
        finally:
            os.close(handle)

    def _clear_away(self) -> None:
        for partial in [*self.folder.glob("*.partial"), *self.folder.glob("*/*.partial")]:
            try:
                partial.unlink()
            except OSError as error:
                raise FileProblem(
                    partial,
                    f"cannot be removed ({error.strerror})",
                    "make the folder writable, or choose another one",
                ) from error

    @property
    def provenance(self) -> dict[str, Any]:
        """What provenance.json says: whether the run is `finished`, and its `runs`, first to last.

        Raises:
            FileProblem: It is damaged.
        """
        path = self.folder / "provenance.json"
        if not path.is_file():
            return {"finished": False, "runs": []}
        try:
            known = json.loads(path.read_text())
            return {"finished": bool(known["finished"]), "runs": list(known["runs"])}
        except _DAMAGE as error:
            raise FileProblem(
                path, f"damaged ({error})", "delete it: only the record of who made it is lost"
            ) from error

    def write_provenance(self, provenance: Mapping[str, Any]) -> None:
        """Write provenance.json."""
        self.write("provenance.json", json.dumps(provenance, indent=2) + "\n")

    def check_versions(self) -> None:
        """Refuse to complete a result that other versions have begun.

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

    @property
    def foreign(self) -> ForeignRobot | None:
        """The MJCF that it was made with, as it was when the run began; None with our own robot.

        Raises:
            FileProblem: parity.json is missing or damaged.
        """
        if not self.experiment.world:
            return None
        path = self.folder / _PARITY
        if not path.is_file():
            raise FileProblem(path, "missing", "run the same 'pronk-pin compare --folder' again")
        try:
            return ForeignRobot.from_json(path.read_text())
        except _DAMAGE as error:
            raise FileProblem(
                path,
                f"damaged ({error})",
                "delete it and run the same 'pronk-pin compare --folder' again",
            ) from error

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
        return self.folder / "strides" / f"{cell.name}.nc"

    def has(self, cell: Cell) -> bool:
        """Whether the cell was simulated already; files appear only when they are whole."""
        return self.path(cell).exists()

    def save(self, cell: Cell, strides: xr.Dataset | bytes) -> None:
        """Write a cell's strides, as a dataset or as `encode` has made them.

        Raises:
            FileProblem: The file cannot be written.
        """
        self.write(
            f"strides/{cell.name}.nc",
            strides if isinstance(strides, bytes) else encode(strides),
        )

    def strides(self, cell: Cell, variables: Collection[str] | None = None) -> xr.Dataset:
        """The strides of a cell.

        Args:
            cell: Which simulation.
            variables: Read these only, as far as there are such; by default everything.

        Raises:
            FileProblem: The file is missing or damaged.
        """
        path = self.path(cell)
        if not path.is_file():
            raise FileProblem(path, "missing", "run the same 'pronk-pin compare --folder' again")
        try:
            with xr.open_dataset(path, engine="netcdf4") as file:
                wanted = file if variables is None else file[[v for v in variables if v in file]]
                return wanted.load()
        except (OSError, ValueError, KeyError, RuntimeError) as error:
            raise FileProblem(
                path, f"damaged ({error})", "delete it and run 'pronk-pin compare --folder' again"
            ) from error

    def find(self, *, controller: str, scenario: str | None = None) -> Cell:
        """The cell of a controller, in the first seed and by default the first scenario."""
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
        tables, practised = [], []
        for cell in self.experiment.cells():
            strides = self.strides(cell)
            tables.append(summarize(strides))
            practised.append(practice(strides))
        tables.append(pd.DataFrame(rows_of_beating(practised), columns=COLUMNS))
        full = [table for table in tables if len(table)]
        summary = pd.concat(full).sort_values(KEYS, ignore_index=True)[COLUMNS]
        self.write("summary.csv", summary.to_csv(index=False))
        return summary

    def summary(self) -> pd.DataFrame:
        """Read summary.csv.

        Raises:
            FileProblem: It is missing or damaged.
        """
        path = self.folder / "summary.csv"
        remedy = f"run 'pronk-pin compare --folder {self.folder}' to make it"
        if not path.is_file():
            raise FileProblem(path, "missing", remedy)
        try:
            summary = pd.read_csv(path)
        except (ValueError, OSError) as error:
            raise FileProblem(path, f"damaged ({error})", remedy) from error
        if list(summary.columns) != COLUMNS:
            raise FileProblem(path, "damaged (other columns)", remedy)
        return summary

    def write(self, name: str, contents: str | bytes) -> Path:
        """Write a file of the folder, whole or not at all.

        Raises:
            FileProblem: It cannot be written; what was there before is still there.
        """
        path = self.folder / name
        partial = path.with_name(path.name + ".partial")
        data = contents.encode() if isinstance(contents, str) else contents
        try:
            partial.write_bytes(data)
            partial.replace(path)
        except OSError as error:
            with contextlib.suppress(OSError):
                partial.unlink()
            raise cannot_write(path, error, _ROOM.format(folder=self.folder)) from error
        return path


def encode(strides: xr.Dataset) -> bytes:
    """A dataset as a NetCDF-4 file, the same bytes each time.

    Raises:
        FileProblem: There is no room for temporary files.
    """
    packed = {"zlib": True, "complevel": 1, "shuffle": True}
    encoding = {name: packed for name, v in strides.data_vars.items() if v.ndim > 2}
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "strides.nc"
            strides.to_netcdf(path, engine="netcdf4", encoding=encoding)
            return path.read_bytes()
    except (OSError, RuntimeError) as error:
        raise cannot_write(
            tempfile.gettempdir(), error, "make room for temporary files, or set TMPDIR"
        ) from error


def default_folder(name: str = "comparison") -> Path:
    """results/<time>-<name> below the current folder."""
    file_name("name", name)
    return Path("results") / f"{datetime.now():%Y%m%d-%H%M%S}-{name}"


def _experiment(settings: Mapping[str, Any]) -> Experiment:
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()
    }
    return Experiment(**{**values, "schedule": Schedule(**values["schedule"])})
