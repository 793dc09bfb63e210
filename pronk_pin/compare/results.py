"""The results folder: what is written, and how it is read again.

=====================  ==================================================================
file                   contents
=====================  ==================================================================
config.json            the experiment, versions, CPU, how long it took
strides/<cell>.nc      every stride of one simulation (NetCDF-4), see `compare.strides`
summary.csv            one long table, see `compare.metrics`
report.html            tables and figures, in one file
replay.html            the robot beside the reference, in one file
=====================  ==================================================================
"""

from __future__ import annotations

import contextlib
import dataclasses
import importlib.metadata
import json
import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import pandas as pd
import xarray as xr

from ..errors import FileProblem, InvalidInput, SpeedOutOfRange, UnknownName, cannot_write
from .experiment import Cell, Experiment
from .metrics import COLUMNS, KEYS, summarize
from .simulate import Schedule

SCHEMA = 2
"""Version of the layout of a results folder."""

_PACKAGES = ("pronk-pin", "pin", "example-robot-data", "mujoco", "proxsuite", "numpy", "scipy")
_AGAIN = "run 'pronk-pin compare' to make one"
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
    def create(cls, experiment: Experiment, folder: Path) -> Results:
        """Make the folder, or take up one that holds the same experiment.

        Raises:
            FileProblem: It cannot be written, or belongs to another experiment.
        """
        results = cls(folder, experiment)
        taken = (folder / "config.json").exists()
        if taken and cls.load(folder).experiment != experiment:
            raise FileProblem(folder, "holds another experiment", "choose another folder")
        try:
            (folder / "strides").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(folder, error, "choose a folder of yours with --folder") from error
        if not taken:
            results.write_config({"finished": False})
        return results

    @classmethod
    def load(cls, folder: Path | str) -> Results:
        """Read a results folder.

        Raises:
            FileProblem: It is missing or damaged.
        """
        folder = Path(folder)
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

    @property
    def config(self) -> Mapping[str, Any]:
        """Everything in config.json."""
        config: dict[str, Any] = json.loads((self.folder / "config.json").read_text())
        return config

    def write_config(self, provenance: Mapping[str, Any]) -> None:
        """Write config.json: the experiment, the machine, and what else is to be known."""
        config = {
            "schema": SCHEMA,
            "experiment": dataclasses.asdict(self.experiment),
            "versions": {name: importlib.metadata.version(name) for name in _PACKAGES},
            "python": platform.python_version(),
            "platform": platform.platform(),
            "cpu": cpu_name(),
            "cores": os.cpu_count(),
            **provenance,
        }
        _write(self.folder / "config.json", json.dumps(config, indent=2) + "\n")

    def path(self, cell: Cell) -> Path:
        """The file of a cell's strides."""
        return self.folder / "strides" / f"{cell.name}.nc"

    def has(self, cell: Cell) -> bool:
        """Whether the cell was simulated already; files appear only when they are whole."""
        return self.path(cell).exists()

    def save(self, cell: Cell, strides: xr.Dataset) -> None:
        """Write a cell's strides.

        Raises:
            FileProblem: The file cannot be written.
        """
        path = self.path(cell)
        partial = path.with_suffix(".partial")
        packed = {"zlib": True, "complevel": 1, "shuffle": True}
        encoding = {name: packed for name, v in strides.data_vars.items() if v.ndim > 2}
        try:
            strides.to_netcdf(partial, engine="netcdf4", encoding=encoding)
            partial.replace(path)
        except (OSError, RuntimeError) as error:
            with contextlib.suppress(OSError):
                partial.unlink()
            raise cannot_write(path, error, "make room, and run the same command again") from error

    def strides(self, cell: Cell) -> xr.Dataset:
        """The strides of a cell.

        Raises:
            FileProblem: The file is missing or damaged.
        """
        path = self.path(cell)
        if not path.is_file():
            raise FileProblem(path, "missing", "run the same 'pronk-pin compare --folder' again")
        try:
            return xr.load_dataset(path, engine="netcdf4")
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
        raise InvalidInput(f"no '{controller}' in scenario '{scenario}'; the result has {known}")

    def summarize(self) -> pd.DataFrame:
        """Compute the summary from the strides, and write summary.csv."""
        tables = [summarize(self.strides(cell)) for cell in self.experiment.cells()]
        summary = pd.concat(tables).sort_values(KEYS, ignore_index=True)[COLUMNS]
        _write(self.folder / "summary.csv", summary.to_csv(index=False))
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


def default_folder(name: str = "comparison") -> Path:
    """results/<time>-<name> below the current folder."""
    return Path("results") / f"{datetime.now():%Y%m%d-%H%M%S}-{name}"


def cpu_name() -> str:
    """The processor's name, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _experiment(settings: Mapping[str, Any]) -> Experiment:
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in settings.items()
    }
    return Experiment(**{**values, "schedule": Schedule(**values["schedule"])})


def _write(path: Path, text: str) -> None:
    """Write a small file whole or not at all."""
    partial = path.with_name(path.name + ".partial")
    try:
        partial.write_text(text)
        partial.replace(path)
    except OSError as error:
        raise cannot_write(path, error, "choose another folder") from error
