"""The results folder: what is written, and how it is read again.

=====================  ==================================================================
file                   contents
=====================  ==================================================================
config.json            the experiment and its definition: who has it can make the rest again
gaits.npz              its gaits, where they are not shipped (`Experiment.gaits`)
robot.urdf             its robot, where that is one of your own: for when yours is gone
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
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..._checks import instance_of
from ..._checks import path as known_path
from ..._display import Displayed
from ...errors import FileProblem, InvalidInput
from ...robot import robot_attributes
from ...storage import read_bytes, reading, sealed, sha256, write_file
from ..experiment import Cell, Definition, Experiment, cell_definition, define, describe
from ..metrics import join_summaries, summarize_cell
from ..world import ForeignRobot
from .cell_array import join_cells
from .config_file import CONFIG, read_definition, read_experiment
from .lock import locked
from .manifest import Manifest
from .provenance import PROVENANCE, read_provenance
from .remedies import complete, make_anew, no_room
from .strides_file import check_fingerprint, decode, encode, join_speeds
from .summary_file import SUMMARY, read_summary, write_summary

PARITY = "parity.json"


@dataclass(frozen=True, repr=False)
class Results(Displayed):
    """A results folder.

    Attributes:
        folder: Where it is.
        experiment: What was run.
    """

    folder: Path
    experiment: Experiment
    _summaries: dict[tuple[str, str], pd.DataFrame] = field(
        default_factory=dict, init=False, compare=False
    )
    """The summary that was written or read last, by the digests of the strides and of its file."""

    def _title(self) -> str:
        return f"Results in {self.folder}"

    def _facts(self) -> dict[str, str]:
        cells = self.experiment.cells()
        there = sum(self.path(cell).exists() for cell in cells)
        return {"simulated": f"{there} of {len(cells)} cells", **self.experiment.facts}

    @classmethod
    def load(cls, folder: Path | str) -> Results:
        """Read a results folder.

        Raises:
            FileProblem: It is missing or damaged, or needs what is not there.
        """
        folder = known_path("folder", folder)
        return cls(folder, read_experiment(folder))

    @classmethod
    def of(cls, experiment: Experiment, folder: Path | str) -> Results:
        """The results of an experiment, and of what its folder has already; nothing is written yet.

        Controllers, scenarios, speeds and seeds that the folder does not have are added to those
        that it has.

        Raises:
            FileProblem: It is damaged, or holds an experiment that differs in what cannot be added
                to.
        """
        folder = known_path("folder", folder)
        instance_of("experiment", experiment, Experiment)
        if not (folder / CONFIG).exists():
            return cls(folder, experiment)
        stored = cls.load(folder)
        try:
            return cls(folder, stored.experiment.extended(experiment))
        except InvalidInput as error:
            raise FileProblem(
                folder,
                f"holds another experiment ({error})",
                "leave these options out to go on with it, or choose another folder",
            ) from error

    @property
    def manifest(self) -> Manifest:
        """What vouches for its files."""
        return Manifest(self.folder)

    def write(self, name: str, contents: str | bytes) -> Path:
        """Write a file of the folder, whole or not at all.

        Raises:
            FileProblem: It cannot be written; what was there before is still there.
        """
        return write_file(self.folder / name, contents, remedy=no_room(self.folder))

    @property
    def provenance(self) -> dict[str, Any]:
        """What provenance.json says: whether the run is `finished`, and its `runs`, first to last.

        Raises:
            FileProblem: It is damaged.
        """
        return read_provenance(self.folder)

    @property
    def control_times(self) -> dict[str, float]:
        """Time that each controller computed a robot and tick [us], the median of its cells.

        Of those whose provenance is there.
        """
        times: dict[str, list[float]] = {}
        made = {name: one for run in self.provenance["runs"] for name, one in run["cells"].items()}
        for cell in self.experiment.compared:
            if "control_us_per_tick" in made.get(cell.name, {}):
                found = float(made[cell.name]["control_us_per_tick"])
                times.setdefault(cell.controller, []).append(found)
        return {name: float(np.median(values)) for name, values in times.items()}

    def write_provenance(self, provenance: Mapping[str, Any]) -> None:
        """Write provenance.json."""
        self.write(PROVENANCE, sealed(provenance))

    @property
    def has_foreign(self) -> bool:
        """Whether there is a record of the MJCF that it was made with."""
        return self.manifest.holds(PARITY)

    @property
    def foreign(self) -> ForeignRobot | None:
        """The MJCF that it was made with, as it was when the run began; None with our own robot.

        Raises:
            FileProblem: parity.json is missing or damaged.
        """
        if not self.experiment.mjcf:
            return None
        path = self.folder / PARITY
        remedy = "run the same 'pronk-pin compare --folder' again"
        remedy = f"delete it and {remedy}" if path.exists() else remedy
        text = self.manifest.read(PARITY, remedy)
        with reading(path, remedy):
            return ForeignRobot.from_json(text.decode())

    def find(self, *, controller: str, scenario: str | None = None) -> Cell:
        """The cell of a controller, in the first seed and by default the first scenario.

        Raises:
            InvalidInput: The result does not have them.
        """
        scenario = scenario or self.experiment.scenario_names[0]
        for cell in self.experiment.compared:
            if (cell.controller, cell.scenario) == (controller, scenario):
                return cell
        known = ", ".join(sorted({cell.controller for cell in self.experiment.compared}))
        raise InvalidInput(
            f"no '{controller}' in scenario '{scenario}'; the result has the controllers {known} "
            f"in the scenarios {', '.join(self.experiment.scenario_names)}"
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
        listed = self.manifest.holds(_strides_name(cell))
        self._open(cell, listed=listed).close()
        return listed  # else the run was killed before it could vouch for the file

    def save(self, cell: Cell, strides: xr.Dataset | bytes) -> None:
        """Write a cell's strides, as a dataset or as `encode` has made them.

        Raises:
            FileProblem: The file cannot be written.
        """
        data = strides if isinstance(strides, bytes) else encode(strides)
        self.manifest.write(_strides_name(cell), data)

    def strides(self, cell: Cell, variables: Collection[str] | None = None) -> xr.Dataset:
        """The strides of a cell.

        Args:
            cell: Which simulation.
            variables: Read these only, as far as there are such; by default everything.

        Raises:
            FileProblem: The file is missing or damaged, or of another simulation.
        """
        with self._open(cell) as file, reading(self.path(cell), make_anew(self.folder)):
            wanted = file if variables is None else file[[v for v in variables if v in file]]
            # Its URDF may lie elsewhere than it did.
            wanted.attrs.update(robot_attributes(self.experiment.model.spec))
            return wanted.load()

    def all_strides(self, *, controller: str, scenario: str | None = None) -> xr.Dataset:
        """The strides of a controller at all speeds, in the first seed; args as for `find`."""
        first = self.find(controller=controller, scenario=scenario)
        cells = [
            cell
            for cell in self.experiment.compared
            if (cell.controller, cell.scenario, cell.seed)
            == (first.controller, first.scenario, first.seed)
        ]
        return join_speeds([self.strides(cell) for cell in cells])

    def check_constant(self, what: str) -> None:
        """Refuse a result of commanded speeds for something that needs constant ones.

        Raises:
            InvalidInput: It is one.
        """
        if self.experiment.commands:
            raise InvalidInput(
                f"{what} needs strides at constant speeds, and {self.folder} is of commanded ones; "
                "choose a result without --command"
            )

    def dataset(self) -> xr.Dataset:
        """The strides of all cells as one dataset: `dataset()["peak_error"].sel(controller="ilc")`.

        Dimensions: `controller`, `scenario`, `seed` and `speed`, or `command` where speeds were
        commanded, by name and value and in the experiment's order, then those of the quantity, as
        `strides` has them, with their units.
        What there is not is NaN: strides and ticks after the end of a shorter simulation, and cells
        that are not there yet. Speeds that were added later lie among the others.

        Numbers of strides are read at once. Curves over `phase` and `tick` are read when they are
        asked for, of those cells that are asked for, and kept then, as `xarray.open_dataset` does.
        `dataset().nbytes` is the memory of everything: 0.3 GB for the default comparison, of which
        the numbers are 5 MB. Select before you compute, and `load()` no more than fits.

        Raises:
            FileProblem: No strides are there yet, or a file is damaged or of another simulation.
        """
        manifest = self.manifest
        cells = [c for c in self.experiment.compared if manifest.holds(_strides_name(c))]
        if not cells:
            raise FileProblem(self.folder, "has no strides yet", complete(self.folder))
        return join_cells(self.experiment, cells, self._open)

    def _open(self, cell: Cell, *, listed: bool = True) -> xr.Dataset:
        """A cell's file, checked against the manifest and for what it is of."""
        name, path, remedy = _strides_name(cell), self.path(cell), make_anew(self.folder)
        data = self.manifest.read(name, remedy) if listed else read_bytes(path, remedy)
        file = decode(data, path, remedy)
        check_fingerprint(file, path, cell_definition(self._definition, cell))
        return file

    @property
    def _definition(self) -> Definition:
        """The definition in config.json; while there is none, what the experiment means today."""
        if (self.folder / CONFIG).is_file():
            return read_definition(self.folder)
        return define(self.experiment)

    @property
    def strides_digest(self) -> str:
        """SHA-256 of all strides there are, as the manifest has them."""
        return self.manifest.digest([_strides_name(cell) for cell in self.experiment.cells()])

    @property
    def _summary_source(self) -> str:
        """What the summary is computed from: strides, and metrics of one's own."""
        own = describe(self.experiment.metrics)
        return self.strides_digest if not own else sha256(f"{self.strides_digest}{own}")

    def summary(self) -> pd.DataFrame:
        """The summary: a row a number, see `compare.metrics`.

        summary.csv is read once for each state of the folder, as the manifest tells it; where it is
        missing, damaged or of other strides, it is made again.

        Raises:
            FileProblem: The strides that it is made of are missing or damaged.
        """
        if (kept := self._summaries.get(self._digests)) is not None:
            return kept.copy()
        summary = read_summary(self.manifest, made_of=self._summary_source)
        if summary is None:
            cells = self.experiment.compared
            summary = join_summaries(
                summarize_cell(self.strides(cell), self.experiment.own_metrics) for cell in cells
            )
            with contextlib.suppress(FileProblem), locked(self.folder):
                write_summary(self.manifest, summary, made_of=self._summary_source)
        return self._keep(summary)

    def write_summary(self, summary: pd.DataFrame) -> None:
        """Write the summary of the strides that are there.

        Raises:
            FileProblem: It cannot be written.
        """
        write_summary(self.manifest, summary, made_of=self._summary_source)
        self._keep(summary)

    def _keep(self, summary: pd.DataFrame) -> pd.DataFrame:
        """Keep a summary, with its scenarios in the order of the experiment, as figures have it."""
        place = {name: k for k, name in enumerate(self.experiment.scenario_names)}
        order = summary["scenario"].map(place).argsort(kind="stable")
        summary = summary.iloc[order].reset_index(drop=True)
        self._summaries.clear()
        self._summaries[self._digests] = summary
        return summary.copy()

    @property
    def _digests(self) -> tuple[str, str]:
        """Digests of the strides and of the summary, by which it is known."""
        return self._summary_source, self.manifest.digest([SUMMARY])


def _strides_name(cell: Cell) -> str:
    return f"strides/{cell.name}.nc"
