"""An experiment: speeds x controllers x scenarios x seeds, as one frozen description.

A cell of it is one simulation of all speeds under one controller, in one scenario, with one seed.
What a cell gives depends on nothing but its description, so cells run in any order and resume.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from .._typing import Array
from ..control import ControllerSpec, TorqueLibrary, load_controller, phase_grid
from ..control.feedforward import model_feedforward
from ..errors import InvalidInput
from ..gait import SPEEDS, load_library
from ..robot import load_robot
from .metrics import steady
from .scenario import load_scenario
from .simulate import Progress, Schedule, Simulation
from .strides import to_dataset

DEFAULT_CONTROLLERS = ("pd", "ilc", "model", "library", "model+ilc")


@dataclass(frozen=True)
class Experiment:
    """A comparison of controllers; the same object in Python, on the command line and on disk.

    Attributes:
        robot: Short name of the robot.
        speeds: Desired speeds [m/s].
        controllers: Short names of the controllers: any of `control.CONTROLLERS`.
        scenarios: Short names of the worlds: ideal, nominal, payload, weak-motors, soft-ground.
        seeds: Seeds of the scatter at the start.
        base: How the trunk moves: "locked" to x and z.
        schedule: What happens when.
    """

    robot: str = "a1"
    speeds: tuple[float, ...] = SPEEDS
    controllers: tuple[str, ...] = DEFAULT_CONTROLLERS
    scenarios: tuple[str, ...] = ("nominal",)
    seeds: tuple[int, ...] = (0,)
    base: str = "locked"
    schedule: Schedule = field(default_factory=Schedule)

    def __post_init__(self) -> None:
        load_robot(self.robot)
        library = load_library(self.robot)
        for name in ("speeds", "controllers", "scenarios", "seeds"):
            values = tuple(getattr(self, name))
            object.__setattr__(self, name, values)  # a list would not equal what is read back
            if len(values) == 0 or len(set(values)) != len(values):
                raise InvalidInput(f"{name} must name at least one, and none of them twice")
        for speed in self.speeds:
            library.at(speed)
        for controller in self.controllers:
            load_controller(controller)
        for scenario in self.scenarios:
            load_scenario(scenario)
        if min(self.seeds) < 0:
            raise InvalidInput("seeds must not be negative")
        if self.base != "locked":
            raise InvalidInput(f"base '{self.base}' is not available; the base can be: locked")
        object.__setattr__(self, "speeds", tuple(sorted(self.speeds)))

    def cells(self) -> tuple[Cell, ...]:
        """The simulations, in an order in which each finds what it depends on done before it."""
        controllers = list(self.controllers)
        if "library" in controllers:
            controllers = ["ilc", *(c for c in controllers if c not in ("ilc", "library"))]
            controllers.append("library")
        return tuple(
            Cell(self.robot, self.speeds, controller, scenario, seed, self.base, self.schedule)
            for controller in controllers
            for scenario in self.scenarios
            for seed in self.seeds
        )


@dataclass(frozen=True)
class Cell:
    """One simulation of an experiment; see `Experiment` for the attributes."""

    robot: str
    speeds: tuple[float, ...]
    controller: str
    scenario: str
    seed: int
    base: str
    schedule: Schedule

    @property
    def name(self) -> str:
        """Name of the cell's file."""
        return f"{self.controller}_{self.scenario}_{self.seed}"

    @property
    def practised(self) -> Cell | None:
        """The cell in which the torque library is learned, for a cell that replays it."""
        if load_controller(self.controller).source != "library":
            return None
        return dataclasses.replace(self, controller="ilc")

    @property
    def steps(self) -> int:
        """Time steps of the simulation."""
        seconds = self.schedule.practice + self.schedule.learning
        return round(seconds / load_scenario(self.scenario).timestep)


def run_cell(
    cell: Cell, practised: xr.Dataset | None = None, progress: Progress | None = None
) -> xr.Dataset:
    """Simulate a cell.

    Args:
        cell: Its description.
        practised: The strides of `cell.practised`, where there is such a cell.
        progress: Called with the number of time steps done since the last call.

    Returns:
        The strides: see `compare.strides`.
    """
    robot, scenario = load_robot(cell.robot), load_scenario(cell.scenario)
    library, spec = load_library(cell.robot), load_controller(cell.controller)
    gaits = [library.at(speed) for speed in cell.speeds]
    # One stream a seed, the same for every controller: they start from the same postures.
    rng = np.random.default_rng(np.random.SeedSequence(cell.seed))
    simulation = Simulation(
        robot,
        gaits,
        spec,
        scenario,
        schedule=cell.schedule,
        rng=rng,
        feedforward=_feedforward(spec, cell, practised),
    )
    log = simulation.run(progress)
    return to_dataset(log, robot, gaits, attributes=_attributes(cell))


def torque_library(strides: xr.Dataset) -> TorqueLibrary:
    """The torque library learned in a simulation: means over its steady strides (section III.B)."""
    torque = steady(strides)["feedforward"].interp(phase=phase_grid())
    torque = torque.transpose("speed", "stride", "part", "phase", "joint")
    return TorqueLibrary.from_strides(strides["speed"].to_numpy(), torque.to_numpy())


def _feedforward(spec: ControllerSpec, cell: Cell, practised: xr.Dataset | None) -> Array | None:
    """The feedforward that a controller begins with [N m], (n, 2, samples, 12)."""
    if spec.source == "model":
        library = load_library(cell.robot)
        return model_feedforward(load_robot(cell.robot), [library.at(v) for v in cell.speeds])
    if spec.source == "library":
        if practised is None:
            raise InvalidInput(f"controller '{spec.name}' replays what 'ilc' has learned; run it")
        return torque_library(practised).at(np.asarray(cell.speeds))
    return None


def _attributes(cell: Cell) -> dict[str, str | int | float]:
    scenario = dataclasses.asdict(load_scenario(cell.scenario))
    return {
        "robot": cell.robot,
        "base": cell.base,
        "scenario": cell.scenario,
        "controller": cell.controller,
        "seed": cell.seed,
        "scenario_parameters": repr(scenario),
        "timestep": scenario["timestep"],
    }
