"""A cell of an experiment: one simulation, what it depends on, and its strides."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from ..._checks import instance_of
from ...control import ControllerSpec, ControlTime, SpeedCommand, TorqueLibrary
from ...gait import Gait, GaitLibrary, replan
from ...robot import robot_attributes, with_rotors
from ..identification import explain
from ..simulation import Progress, Schedule, simulate
from ..world import Scenario, load_scenario
from .definition import cell_definition, define, fingerprint, to_text
from .entries import named
from .initial_feedforward import (
    check_library,
    feedforward_by_speed,
    initial_feedforward,
    known_library,
    learned_strides,
)

if TYPE_CHECKING:
    from .experiment import Experiment

LEARNED = ("library", "identified")
"""Sources of feedforward that need the strides of a cell in which `ilc` has learned, unless they
are in a file."""


def depends_on_learning(spec: ControllerSpec) -> bool:
    """Whether a controller begins with what `ilc` learns in the same scenario."""
    return spec.source in LEARNED and not spec.library


@dataclass(frozen=True)
class Cell:
    """One simulation of an experiment: all commands, or all speeds of a batch, one controller,
    scenario and seed.

    Attributes:
        controller: Name of the controller.
        scenario: Name of the scenario.
        seed: Seed of all that is random.
        batch: Index of the speeds among the experiment's batches.
        experiment: The experiment, with the objects of these names.
        practice: Whether it is the learning at constant speeds before speeds are commanded.
    """

    controller: str
    scenario: str
    seed: int
    batch: int
    experiment: Experiment = field(compare=False, repr=False)
    practice: bool = False

    @property
    def name(self) -> str:
        """Name of the cell's file."""
        later = f".{self.batch + 1}" if self.batch else ".practice" if self.practice else ""
        return f"{self.controller}_{self.scenario}_{self.seed}{later}"

    @property
    def commands(self) -> tuple[str, ...]:
        """Its commanded speeds; none where its speeds are constant."""
        return () if self.practice else self.experiment.commands

    @property
    def robots(self) -> int:
        """How many robots it simulates."""
        return len(self.commands or self.speeds)

    @property
    def schedule(self) -> Schedule:
        """What happens when; where speeds are commanded, as long as the longest command lasts."""
        schedule = self.experiment.schedule
        if not self.commands:
            return schedule
        longest = max(profile.duration for profile in self.experiment.profiles)
        return dataclasses.replace(schedule, baseline=0.0, learning=longest)

    @property
    def speeds(self) -> tuple[float, ...]:
        """Its speeds [m/s]."""
        return (self.experiment.batches or (self.experiment.speeds,))[self.batch]

    @property
    def spec(self) -> ControllerSpec:
        """Its controller."""
        return self.experiment.controller(self.controller)

    @property
    def world(self) -> Scenario:
        """Its scenario, in the experiment's MJCF if it has one, on ground of its own seed."""
        world = load_scenario(self.experiment.scenario(self.scenario), mjcf=self.experiment.mjcf)
        return dataclasses.replace(world, seed=world.seed + self.seed)

    @property
    def alone(self) -> Experiment:
        """The experiment of this cell alone, and of the one that it depends on."""
        experiment = self.experiment
        return dataclasses.replace(
            experiment,
            speeds=self.speeds,
            controllers=(named(experiment.controllers, self.controller),),
            scenarios=(named(experiment.scenarios, self.scenario),),
            seeds=(self.seed,),
            batches=(),
        )

    @property
    def depends_on(self) -> Cell | None:
        """The cell that learns what this one uses: the torque library, or the identified model."""
        if self.practice or not depends_on_learning(self.spec):
            return None
        practice = bool(self.experiment.commands)
        return dataclasses.replace(self, controller="ilc", practice=practice)

    @property
    def steps(self) -> int:
        """Time steps of the simulation."""
        schedule = self.schedule
        return round((schedule.baseline + schedule.learning) / self.world.timestep)


def check_stored_library(cell: Cell) -> None:
    """Check that the torque library of a cell's controller, if it is in a file, is there and fits.

    Raises:
        FileProblem: The file is missing, damaged, or another one than it was.
        InvalidInput: It is of another robot, or other gaits.
    """
    experiment, spec = cell.experiment, cell.spec
    if spec.library:
        library = known_library(spec, experiment.model, None)
        check_library(library, experiment.model, experiment.planned_at)


def run_cell(
    cell: Cell,
    dependency: xr.Dataset | None = None,
    progress: Progress | None = None,
    control_time: ControlTime | None = None,
) -> xr.Dataset:
    """Simulate a cell.

    Args:
        cell: Its description.
        dependency: The strides of `cell.depends_on`, where there is such a cell.
        progress: Called with the number of time steps done since the last call.
        control_time: Takes how long the controller computed.

    Returns:
        The strides: see `compare.simulation.dataset`.
    """
    instance_of("cell", cell, Cell, "a Cell, one of Experiment.cells()")
    experiment, spec = cell.experiment, cell.spec
    check_stored_library(cell)
    gaits, robot, base = experiment.planned_at(cell.speeds), experiment.model, experiment.base
    model = robot
    if spec.source == "identified":
        model = explain(learned_strides(spec, dependency), gaits=gaits).identified
    elif spec.gait_model == "datasheet":
        model = with_rotors(robot)
    if spec.gait_model != "urdf":
        gaits = replan(model, gaits, base="locked" if base == "locked" else "sagittal")
    command = None
    if cell.commands:
        command = _command(
            cell, gaits, feedforward_by_speed(spec, gaits, model=model, learned=dependency)
        )
        gaits, initial = command.first_gaits, command.initial_feedforward
        spec = dataclasses.replace(spec, guard=None)  # whose memory is of one speed
    else:
        initial = initial_feedforward(spec, gaits, model=model, learned=dependency, base=base)
    return simulate(
        robot,
        gaits,
        spec,
        cell.world,
        schedule=cell.schedule,
        # One stream a seed, the same for every controller: they start from the same postures.
        rng=np.random.default_rng(np.random.SeedSequence(cell.seed)),
        initial=initial,
        base=base,
        attributes=strides_attributes(cell),
        progress=progress,
        control_time=control_time,
        command=command,
    )


def _command(cell: Cell, gaits: Sequence[Gait], torque: TorqueLibrary | None) -> SpeedCommand:
    """The commands of a cell: gaits of its speeds take the library's place if they are others."""
    experiment = cell.experiment
    library, apex = experiment.library, experiment.apex
    if cell.spec.gait_model != "urdf":
        library, apex = GaitLibrary(tuple(gaits), library.metadata), None
    return SpeedCommand(
        experiment.profiles, library, torque=torque, reference=experiment.reference, apex=apex
    )


def strides_attributes(cell: Cell) -> dict[str, str | int | float]:
    """Attributes of a cell's strides: what they are of, and its fingerprint."""
    experiment, scenario = cell.experiment, cell.world
    definition = cell_definition(define(cell.alone), cell)
    return {
        **robot_attributes(experiment.model.spec),
        "base": experiment.base,
        "scenario": cell.scenario,
        "controller": cell.controller,
        "seed": cell.seed,
        "scenario_parameters": scenario.to_json(),
        "mjcf": experiment.mjcf,
        "mjcf_sha256": definition["mjcf_sha256"],
        "timestep": scenario.timestep,
        "switch": cell.schedule.baseline,
        "definition": to_text(definition),
        "fingerprint": fingerprint(definition),
    }
