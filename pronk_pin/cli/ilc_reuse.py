"""Commands about stored torques: `ilc transfer | seeding | engines | build-library` and others."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tyro.conf import Positional

from .._display import show
from .progress import progress

_FINE = (-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
"""Speeds [m/s] of studies that need neighbours."""


def covered_speeds(robot: str, gaits: str, speeds: tuple[float, ...]) -> tuple[float, ...]:
    """Those of some speeds [m/s] that the gaits of a robot cover."""
    from ..compare.studies import machine_and_gaits

    covered = machine_and_gaits(robot, gaits)[1].speeds
    return tuple(speed for speed in speeds if covered[0] <= speed <= covered[-1])


@dataclass(frozen=True)
class Transfer:
    """Tell where stored feedforward may be reused, and where it has to be learned again.

    Learns at home, replays the torque library at home, at speeds that were left out, and in other
    worlds, and compares with learning there.
    """

    controller: Positional[str] = "ilc"
    """Controller that learns."""
    speed: tuple[float, ...] = ()
    """Speeds [m/s], increasing; by default -0.4 to 0.8 in steps of 0.2, as far as the robot's
    gaits go."""
    scenario: str = "nominal"
    """Scenario of the learning."""
    scenarios: tuple[str, ...] = ("payload", "weak-motors", "soft-ground", "slope", "gravity")
    """Scenarios in which the stored feedforward is tried."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""
    figure: Path | None = None
    """Draw the result into this file: png, svg or pdf; by default it is not drawn."""

    def run(self) -> None:
        """Do it."""
        from ..compare import load_scenario
        from ..compare.studies import describe_transfers, measure_transfers
        from ..control import load_controller
        from ..viz import known_figure, save_figure
        from ..viz.figures import transfers_figure

        known_figure(self.figure)
        with progress("learning"):
            table = measure_transfers(
                load_controller(self.controller),
                self.speed or covered_speeds(self.robot, self.gaits, _FINE),
                load_scenario(self.scenario),
                [load_scenario(name) for name in self.scenarios],
                robot=self.robot,
                gaits=self.gaits,
            )
        show(describe_transfers(table))
        if self.figure is not None:
            print(f"\nfigure  {save_figure(transfers_figure(table), self.figure)}")


@dataclass(frozen=True)
class Seeding:
    """Tell what a seed saves: learning from nothing, from the model, and from neighbouring speeds.

    The torque library learns at all speeds; each inner one begins with its neighbours' torques.
    """

    controller: str = "ilc"
    """Controller whose laws learn."""
    speed: tuple[float, ...] = ()
    """Speeds [m/s], increasing; by default -0.4 to 0.8 in steps of 0.2, as far as the robot's
    gaits go."""
    scenario: str = "nominal"
    """Scenario of the learning."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""
    figure: Path | None = None
    """Draw the result into this file: png, svg or pdf; by default it is not drawn."""

    def run(self) -> None:
        """Do it."""
        from ..compare import load_scenario
        from ..compare.studies import describe_seeding, measure_seeding
        from ..control import load_controller
        from ..viz import known_figure, save_figure
        from ..viz.figures import errors_by_seed

        known_figure(self.figure)
        speeds = self.speed or covered_speeds(self.robot, self.gaits, _FINE)
        with progress("learning"):
            table = measure_seeding(
                speeds,
                load_scenario(self.scenario),
                spec=load_controller(self.controller),
                robot=self.robot,
                gaits=self.gaits,
            )
        show(describe_seeding(table))
        if self.figure is not None:
            print(f"figure  {save_figure(errors_by_seed(table), self.figure)}")


@dataclass(frozen=True)
class BuildLibrary:
    """Practise over a grid of speeds and conditions, and keep what is learned in one file.

    A controller begins with it as library=FILE, or library+ilc=FILE: where it is on the slope, or
    how much it carries, a robot estimates from its first strides. Run again after it was broken
    off it goes on where it was.
    """

    file: Positional[Path]
    """File of the library, which ends in .npz."""
    condition: tuple[str, ...] = ("slope=-0.1,0,0.1",)
    """Conditions with their values, one or more: mismatches of `pronk-pin list scenarios`, as
    slope=-0.1,0,0.1 or payload=0,1.5,3."""
    speed: tuple[float, ...] = ()
    """Speeds [m/s], increasing; by default five from -0.4 to 0.8, or from end to end of the robot's
    gaits where they do not go so far."""
    scenario: str = "nominal"
    """What is the same in all conditions."""
    controller: str = "ilc"
    """Controller that learns."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""
    folder: Path | None = None
    """Results folder of the practice, which `report` and `view` open; by default <file>-practice,
    beside it."""
    workers: int | None = None
    """Processes; by default one for each core."""

    def run(self) -> None:
        """Do it."""
        from ..compare.studies import (
            build_library,
            describe_library,
            machine_and_gaits,
            parse_conditions,
        )
        from ..control import load_controller
        from ..errors import InvalidInput

        if self.file.suffix != ".npz":
            raise InvalidInput(f"file '{self.file}' does not end in .npz; let it")
        conditions = parse_conditions(self.condition)
        covered = machine_and_gaits(self.robot, self.gaits)[1].speeds
        first, last = max(covered[0], -0.4), min(covered[-1], 0.8)
        evenly = (round(first + k * (last - first) / 4, 9) for k in range(5))
        library = build_library(
            self.speed or tuple(map(float, evenly)),
            conditions,
            self.scenario,
            self.folder or self.file.with_name(f"{self.file.stem}-practice"),
            spec=load_controller(self.controller),
            robot=self.robot,
            gaits=self.gaits,
            workers=self.workers,
        )
        library.save(self.file)
        show(f"{describe_library(library)}\n\nlibrary  {self.file}")


@dataclass(frozen=True)
class TryLibrary:
    """Play a library of `build-library` at places in between, beside practice there.

    The places are drawn at random. At each the robot is told of the conditions, then it has to
    estimate them; beside that PD alone, the model's torques, and learning from nothing.
    """

    file: Positional[Path]
    """File of the library."""
    points: int = 20
    """Number of places."""
    seed: int = 0
    """Seed of the places."""
    scenario: str = "nominal"
    """What is the same in all conditions."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""

    def run(self) -> None:
        """Do it."""
        import numpy as np

        from .._checks import seed
        from ..compare import load_scenario
        from ..compare.studies import describe_library_trial, measure_library
        from ..control import TorqueLibrary

        table = measure_library(
            TorqueLibrary.load(self.file),
            load_scenario(self.scenario),
            points=self.points,
            rng=np.random.default_rng(seed("seed", self.seed)),
            robot=self.robot,
            gaits=self.gaits,
            progress=True,
        )
        show(describe_library_trial(table))


@dataclass(frozen=True)
class Engines:
    """Tell whether what was learned in one engine holds in another, and how far to learn on.

    Each engine's torque library is replayed in the others, beside nothing and the model, and then
    learned on from.
    """

    engines: Positional[tuple[str, ...]] = ("mujoco", "drake")
    """Engines: names of `pronk-pin list engines`, or addresses."""
    speed: tuple[float, ...] = ()
    """Speeds [m/s]; by default -0.4 to 0.8 in steps of 0.4, as far as the robot's gaits go."""
    scenario: str = "nominal"
    """Scenario."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""

    def run(self) -> None:
        """Do it."""
        from ..compare import load_scenario
        from ..compare.studies import (
            describe_engine_transfer,
            machine_and_gaits,
            measure_engine_transfer,
        )

        speeds = self.speed or covered_speeds(self.robot, self.gaits, (-0.4, 0.0, 0.4, 0.8))
        robot, library = machine_and_gaits(self.robot, self.gaits)
        gaits = [library.at(speed) for speed in speeds]
        with progress("learning"):
            table = measure_engine_transfer(
                robot, gaits, load_scenario(self.scenario), self.engines
            )
        show(describe_engine_transfer(table))
