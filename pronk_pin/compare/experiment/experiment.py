"""An experiment: speeds x controllers x scenarios x seeds, as one frozen description.

A cell of it is one simulation of all speeds under one controller, in one scenario, with one seed.
What a cell gives depends on nothing but its description, so cells run in any order and resume.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from tyro.conf import Suppress

from ..._checks import instance_of, known_name, path, real, seed, sequence_of, text
from ...control import load_controller
from ...errors import InvalidInput
from ...gait import SPEEDS, Gait, load_library, replan
from ...robot import BASES, ROBOTS, load_robot, with_rotors
from ..identification import explain
from ..simulation import Progress, Schedule, simulate
from ..world import load_scenario
from .definition import cell_definition, define, fingerprint, to_text
from .initial_feedforward import initial_feedforward, learned_strides

LEARNED = ("library", "identified")
"""Sources of feedforward that need the strides of a cell in which `ilc` has learned."""

DEFAULT_CONTROLLERS = (
    *("pd", "ilc-paper", "ilc-stance", "ilc", "ilc+rotors"),
    *("model", "model+rotors", "library"),
)


@dataclass(frozen=True)
class Experiment:
    """A comparison of controllers; the same object in Python, on the command line and on disk.

    Attributes:
        robot: Short name of the robot.
        speeds: Desired speeds [m/s].
        controllers: Short names of the controllers: any of `control.CONTROLLERS`.
        scenarios: Names of the scenarios, composed with "+", values with "=": nominal, ideal,
            payload=2+slope, random-0-3; see `compare.world.scenario`.
        seeds: Seeds of the scatter at the start.
        base: How the trunk may move: "locked" to x and z, "sagittal" with pitch, or "free".
        mjcf: MJCF of the robot, with the same joint names, that stands in for its URDF in the
            simulation; see `compare.world.mjcf`. The scenarios add to what is in it: "ideal" takes
            it
            as it is. The file is read when the experiment is run, and not before.
        schedule: What happens when.
        batches: Speeds that are simulated together, in the order in which they were added to a
            results folder; empty for all at once.
    """

    robot: str = "a1"
    speeds: tuple[float, ...] = SPEEDS
    controllers: tuple[str, ...] = DEFAULT_CONTROLLERS
    scenarios: tuple[str, ...] = ("nominal",)
    seeds: tuple[int, ...] = (0,)
    base: str = "locked"
    mjcf: str = ""
    schedule: Schedule = field(default_factory=Schedule)
    batches: Annotated[tuple[tuple[float, ...], ...], Suppress] = ()

    def __post_init__(self) -> None:
        self._check_types()
        names = tuple(load_scenario(name).name for name in self.scenarios)  # in one spelling
        object.__setattr__(self, "scenarios", names)
        for name in ("speeds", "controllers", "scenarios", "seeds"):
            values = tuple(getattr(self, name))
            object.__setattr__(self, name, values)  # a list would not equal what is read back
            if len(values) == 0 or len(set(values)) != len(values):
                raise InvalidInput(f"{name} must name at least one, and none of them twice")
        _ = self.gaits  # there is one of each speed
        for controller in self.controllers:
            if load_controller(controller).gait_model == "datasheet":
                _ = with_rotors(load_robot(self.robot))  # the datasheet is there
            if load_controller(controller).source == "identified" and self.base != "locked":
                raise InvalidInput(
                    f"controller '{controller}' identifies the robot on the locked base; leave it "
                    "out, or use base 'locked'"
                )
        if self.mjcf:
            object.__setattr__(self, "mjcf", str(Path(self.mjcf).expanduser().resolve()))
        object.__setattr__(self, "speeds", tuple(sorted(self.speeds)))
        self._sort_batches()

    def _sort_batches(self) -> None:
        batches = tuple(tuple(sorted(batch)) for batch in self.batches)
        together = tuple(sorted(speed for batch in batches for speed in batch))
        if batches and (together != self.speeds or not all(batches)):
            raise InvalidInput("batches must hold each speed once, and none of them may be empty")
        object.__setattr__(self, "batches", batches if len(batches) > 1 else ())

    @property
    def gaits(self) -> list[Gait]:
        """The gait of each speed."""
        return _gaits(self.robot, self.base, self.speeds)

    def extended(self, other: Experiment) -> Experiment:
        """This experiment with the controllers, scenarios, speeds and seeds of another one, too.

        What is here stays as it is: speeds that come in are simulated by themselves.

        Raises:
            InvalidInput: The other one is otherwise in something that cannot be added to.
        """
        against = [
            f"{name} is {mine!r} there, and {theirs!r} here"
            for name, mine, theirs in _fixed(self, other)
            if mine != theirs
        ]
        if against:
            raise InvalidInput("; ".join(against))
        more: dict[str, Any] = {
            name: tuple(dict.fromkeys((*getattr(self, name), *getattr(other, name))))
            for name in ("controllers", "scenarios", "seeds", "speeds")
        }
        added = tuple(speed for speed in other.speeds if speed not in self.speeds)
        batches = (*(self.batches or (self.speeds,)), added) if added else self.batches
        return dataclasses.replace(self, **more, batches=batches)

    def _check_types(self) -> None:
        known_name("robot", self.robot, ROBOTS)
        known_name("base", self.base, BASES)
        keep = object.__setattr__
        for name, check, most in (
            ("speeds", real, 1000),
            ("controllers", text, 1000),
            ("scenarios", text, 1000),
            ("seeds", seed, 10_000),
        ):
            values: tuple[object, ...] = sequence_of(name, getattr(self, name), check, wanted=name)
            if len(values) > most:
                raise InvalidInput(f"{len(values)} {name}; give {most} or fewer")
            keep(self, name, values)
        if not isinstance(self.mjcf, str) or self.mjcf:
            keep(self, "mjcf", str(path("mjcf", self.mjcf)))
        instance_of("schedule", self.schedule, Schedule)

    def cells(self) -> tuple[Cell, ...]:
        """The simulations, in an order in which each finds what it depends on done before it."""
        controllers = list(self.controllers)
        later = [name for name in controllers if load_controller(name).source in LEARNED]
        if later:
            others = [name for name in controllers if name not in ("ilc", *later)]
            controllers = ["ilc", *others, *later]
        return tuple(
            Cell(
                self.robot,
                speeds,
                controller,
                scenario,
                seed,
                self.base,
                self.mjcf,
                self.schedule,
                batch,
            )
            for batch, speeds in enumerate(self.batches or (self.speeds,))
            for controller in controllers
            for scenario in self.scenarios
            for seed in self.seeds
        )


def _fixed(one: Experiment, other: Experiment) -> Iterator[tuple[str, object, object]]:
    """What cannot be added to: name, and its value in either of two experiments."""
    for name in ("robot", "base", "mjcf"):
        yield name, getattr(one, name), getattr(other, name)
    for part in dataclasses.fields(Schedule):
        name = part.name
        yield f"schedule.{name}", getattr(one.schedule, name), getattr(other.schedule, name)


@dataclass(frozen=True)
class Cell:
    """One simulation of an experiment; see `Experiment` for the attributes.

    Its `speeds` are those of one batch.
    """

    robot: str
    speeds: tuple[float, ...]
    controller: str
    scenario: str
    seed: int
    base: str
    mjcf: str
    schedule: Schedule
    batch: int = 0

    @property
    def name(self) -> str:
        """Name of the cell's file."""
        later = f".{self.batch + 1}" if self.batch else ""
        return f"{self.controller}_{self.scenario}_{self.seed}{later}"

    @property
    def experiment(self) -> Experiment:
        """The experiment of this cell alone, and of the one that it depends on."""
        return Experiment(
            robot=self.robot,
            speeds=self.speeds,
            controllers=(self.controller,),
            scenarios=(self.scenario,),
            seeds=(self.seed,),
            base=self.base,
            mjcf=self.mjcf,
            schedule=self.schedule,
        )

    @property
    def depends_on(self) -> Cell | None:
        """The cell that learns what this one uses: the torque library, or the identified model."""
        if load_controller(self.controller).source not in LEARNED:
            return None
        return dataclasses.replace(self, controller="ilc")

    @property
    def steps(self) -> int:
        """Time steps of the simulation."""
        seconds = self.schedule.baseline + self.schedule.learning
        return round(seconds / load_scenario(self.scenario).timestep)


def run_cell(
    cell: Cell, dependency: xr.Dataset | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Simulate a cell.

    Args:
        cell: Its description.
        dependency: The strides of `cell.depends_on`, where there is such a cell.
        progress: Called with the number of time steps done since the last call.

    Returns:
        The strides: see `compare.simulation.dataset`.
    """
    instance_of("cell", cell, Cell, "a Cell, one of Experiment.cells()")
    robot, scenario = load_robot(cell.robot), load_scenario(cell.scenario, mjcf=cell.mjcf)
    gaits = _gaits(cell.robot, cell.base, cell.speeds)
    spec, model = load_controller(cell.controller), robot
    if spec.source == "identified":
        model = explain(learned_strides(spec, dependency)).identified
    elif spec.gait_model == "datasheet":
        model = with_rotors(robot)
    if spec.gait_model != "urdf":
        gaits = replan(model, gaits, base="locked" if cell.base == "locked" else "sagittal")
    return simulate(
        robot,
        gaits,
        spec,
        scenario,
        schedule=cell.schedule,
        # One stream a seed, the same for every controller: they start from the same postures.
        rng=np.random.default_rng(np.random.SeedSequence(cell.seed)),
        initial=initial_feedforward(spec, gaits, model=model, learned=dependency, base=cell.base),
        base=cell.base,
        attributes=_attributes(cell),
        progress=progress,
    )


def _gaits(robot: str, base: str, speeds: tuple[float, ...]) -> list[Gait]:
    """The gaits of a base at some speeds: of a trunk that may turn those that let it pitch."""
    library = load_library(robot) if base == "locked" else load_library(robot, base="sagittal")
    return [library.at(speed) for speed in speeds]


def _attributes(cell: Cell) -> dict[str, str | int | float]:
    scenario = load_scenario(cell.scenario, mjcf=cell.mjcf)
    definition = cell_definition(define(cell.experiment), cell)
    return {
        "robot": cell.robot,
        "base": cell.base,
        "scenario": cell.scenario,
        "controller": cell.controller,
        "seed": cell.seed,
        "scenario_parameters": scenario.to_json(),
        "mjcf": cell.mjcf,
        "mjcf_sha256": definition["mjcf_sha256"],
        "timestep": scenario.timestep,
        "switch": cell.schedule.baseline,
        "definition": to_text(definition),
        "fingerprint": fingerprint(definition),
    }
