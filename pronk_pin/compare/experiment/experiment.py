"""An experiment: speeds x controllers x scenarios x seeds, as one frozen description.

A cell of it is one simulation of all speeds, or of all commands, under one controller, in one
scenario, with one seed. What a cell gives depends on nothing but its description, so cells run in
any order and resume.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..._checks import instance_of, known_name, none_or, path, real, seed, sequence_of, text
from ..._display import Displayed, listed, spanned
from ..._typing import Array
from ...control import (
    CONTROLLERS,
    PARTS,
    REFERENCES,
    ComputedTorque,
    ControllerSpec,
    ExtendedStateObserver,
    SpeedProfile,
    check_follows,
    level_robot,
    load_controller,
)
from ...errors import InvalidInput, SpeedOutOfRange
from ...gait import STYLES, Gait, GaitLibrary, load_library
from ...robot import (
    BASES,
    ROBOTS,
    Base,
    Robot,
    RobotSpec,
    load_robot,
    load_robot_spec,
    with_rotors,
)
from ..metrics import Metric, load_metric
from ..simulation import SHORTEST, Schedule
from ..world import DEFAULT_ENGINE, Scenario, load_scenario, shipped_scenario
from .cell import Cell, depends_on_learning
from .description import describe
from .entries import digest_of, name_of, named, shortest

DEFAULT_CONTROLLERS = (
    *("pd", "ilc-paper", "ilc-stance", "ilc", "ilc+rotors"),
    *("model", "model+rotors", "library"),
)


def default_controllers(robot: Robot) -> tuple[str, ...]:
    """`DEFAULT_CONTROLLERS`, less those that need rotors which are not known of the robot."""
    known = bool(robot.spec.rotors)
    specs = [CONTROLLERS[name] for name in DEFAULT_CONTROLLERS]
    return tuple(spec.name for spec in specs if known or spec.gait_model != "datasheet")


@dataclass(frozen=True, repr=False)
class Experiment(Displayed):
    """A comparison of controllers; the same object in Python, on the command line and on disk.

    Robot, gaits, controllers and scenarios are given by name, or as objects of one's own. What is
    shipped is kept by name, whichever way it came.

    Attributes:
        robot: Robot: one of `robot.ROBOTS`, or a `RobotSpec`.
        gaits: Its gaits: "pronk", as shipped for it; or a `GaitLibrary`, or the file of one, as
            `pronk-pin gaits build` writes it.
        apex: Apex of the gaits [m], one that the library covers; by default the library's own.
        speeds: Desired speeds [m/s]; by default all of the library. With commands, the speeds at
            which is learned, and computed, what controllers begin with; by default those of the
            library that the commands span.
        controllers: Controllers: any of `control.CONTROLLERS`, by name; a `ControllerSpec` of one's
            own, or its address, module:object. By default `DEFAULT_CONTROLLERS`, less those that
            need rotors which are not known of the robot.
        scenarios: Scenarios by name, composed with "+", values with "=": nominal, ideal,
            payload=2+slope, random-0-3; or a `Scenario` of one's own, or its address; see
            `compare.world.scenario`.
        seeds: Seeds of the scatter at the start, of noise, and of rough ground and steps. Where
            nothing is random they hardly differ; `rough` is the scenario for many.
        base: How the trunk may move: "locked" to x and z, "sagittal" with pitch, or "free".
        mjcf: MJCF of the robot, with the same joint names, that stands in for its URDF in the
            simulation; see `mjcf_spec`. The scenarios add to what is in it: "ideal" takes
            it as it is. The file is read when the experiment is run, and not before.
        engine: Engine for all scenarios that name none, see `Scenario.engine`; from then on it
            stands in the scenarios' names, and here it is empty.
        schedule: What happens when.
        metrics: Metrics of one's own, beside ours: `Metric` objects, or their addresses.
        commands: Speeds that change, one robot each, instead of constant ones: speed profiles as
            `control.SpeedProfile.parse` reads them, "0 4s, 0->0.8 2s, 0.8 4s", or their files. The
            schedule is then that of the learning at constant speeds beforehand; robots are driven
            as long as the longest command lasts, and those that learn do so all the time, without
            a guard, whose memory is of one speed.
        reference: With commands, the speed by which gaits are chosen: one of
            `control.REFERENCES`.
        batches: Speeds that are simulated together, in the order in which they were added to a
            results folder; empty for all at once.
    """

    robot: str | RobotSpec = "a1"
    gaits: str | GaitLibrary = "pronk"
    apex: float | None = None
    speeds: tuple[float, ...] = ()
    controllers: tuple[str | ControllerSpec, ...] = ()
    scenarios: tuple[str | Scenario, ...] = ("nominal",)
    seeds: tuple[int, ...] = (0,)
    base: str = "locked"
    mjcf: str = ""
    engine: str = ""
    schedule: Schedule = field(default_factory=Schedule)
    metrics: tuple[str | Metric, ...] = ()
    commands: tuple[str, ...] = ()
    reference: str = "commanded"
    batches: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        keep = object.__setattr__
        self._check_types()
        keep(self, "robot", shortest("robot", load_robot_spec(self.robot), ROBOTS.get))
        keep(self, "gaits", self._known_gaits())
        if not self.speeds:
            speeds = self.library.speeds
            keep(self, "speeds", tuple(speeds[self._spanned(speeds)].tolist()))
        if not self.controllers:
            keep(self, "controllers", default_controllers(self.model))
        specs = [load_controller(value) for value in self.controllers]
        worlds = [load_scenario(value) for value in self.scenarios]
        if self.engine:
            worlds = [
                world.in_engine(self.engine) if world.engine == DEFAULT_ENGINE else world
                for world in worlds
            ]
        keep(self, "engine", "")
        keep_controllers = tuple(shortest("controller", spec, CONTROLLERS.get) for spec in specs)
        keep(self, "controllers", keep_controllers)
        keep(self, "scenarios", tuple(shortest("scenario", w, shipped_scenario) for w in worlds))
        keep(self, "metrics", tuple(load_metric(value) for value in self.metrics))
        if len({metric.name for metric in self.own_metrics}) < len(self.metrics):
            raise InvalidInput("metrics must name none of them twice")
        lists: dict[str, tuple[object, ...]] = {
            "speeds": self.speeds,
            "controllers": self.controller_names,
            "scenarios": self.scenario_names,
            "seeds": self.seeds,
            **({"commands": self.commands} if self.commands else {}),
        }
        for name, values in lists.items():
            if len(values) == 0 or len(set(values)) != len(values):
                files = any(spec.library for spec in specs) and name == "controllers"
                told = (
                    "; of a torque library's file its name counts, not its folder" if files else ""
                )
                raise InvalidInput(f"{name} must name at least one, and none of them twice{told}")
        self._check_controllers()
        for world in worlds:
            world.check_joints(self.model)
        if self.mjcf:
            keep(self, "mjcf", str(Path(self.mjcf).expanduser().resolve()))
        keep(self, "speeds", tuple(sorted(self.speeds)))
        for gait in self.planned:  # there is one of each speed
            names = tuple(phase.name for phase in gait.phases)
            if names != PARTS:
                raise InvalidInput(
                    f"these gaits have the phases {', '.join(names)}, and comparisons play "
                    f"{' and '.join(PARTS)} only; choose gaits 'pronk'"
                )
        self._check_commands()
        self._sort_batches()

    def __hash__(self) -> int:
        # Objects of one's own need not be hashable.
        names = (self.robot_name, self.controller_names, self.scenario_names)
        return hash(
            (names, self.speeds, self.commands, self.seeds, self.base, self.mjcf, self.schedule)
        )

    def _title(self) -> str:
        return "Experiment"

    @property
    def facts(self) -> dict[str, str]:
        """What is asked, in words, by what it is about."""
        gaits, mjcf, schedule = self.gaits, self.mjcf, self.schedule
        apex = "" if self.apex is None else f", apex {self.apex:g} m"
        return {
            "robot": f"{self.robot_name}, base {self.base}",
            "gaits": (gaits if isinstance(gaits, str) else f"a library of {gaits.robot}") + apex,
            "speeds": spanned(self.speeds, "m/s"),
            "commands": "; ".join(self.commands),
            "gaits by": f"the {self.reference} speed" if self.commands else "",
            "controllers": listed(self.controller_names),
            "scenarios": listed(self.scenario_names),
            "seeds": listed(self.seeds),
            "mjcf": mjcf,
            "schedule": f"{schedule.baseline:g} s of baseline, {schedule.learning:g} s of learning",
            "metrics": listed(map(name_of, self.metrics)),
        }

    def _facts(self) -> dict[str, str]:
        return self.facts

    def _check_types(self) -> None:
        known_name("base", self.base, BASES)
        keep = object.__setattr__
        for name, check, most in (
            ("speeds", real, 1000),
            ("controllers", lambda _, value: value, 1000),
            ("scenarios", lambda _, value: value, 1000),
            ("metrics", lambda _, value: value, 1000),
            ("commands", lambda _, words: str(SpeedProfile.parse(words)), 1000),
            ("seeds", seed, 10_000),
        ):
            values: tuple[object, ...] = sequence_of(name, getattr(self, name), check, wanted=name)
            if len(values) > most:
                raise InvalidInput(f"{len(values)} {name}; give {most} or fewer")
            keep(self, name, values)
        keep(self, "apex", none_or(real, "apex", self.apex))
        if not isinstance(self.mjcf, str) or self.mjcf:
            keep(self, "mjcf", str(path("mjcf", self.mjcf)))
        text("engine", self.engine)
        instance_of("schedule", self.schedule, Schedule)
        known_name("speed of reference", self.reference, REFERENCES)

    def _known_gaits(self) -> str | GaitLibrary:
        """The name of gaits that are shipped, or a library of this robot."""
        gaits = self.gaits
        if isinstance(gaits, str) and gaits in STYLES:
            return gaits
        if isinstance(gaits, str | Path):
            if not str(gaits).endswith(".npz"):
                listed = ", ".join(STYLES)
                raise InvalidInput(
                    f"gaits '{gaits}' are not known; give one of: {listed}; or a file of "
                    "'pronk-pin gaits build', which ends in .npz"
                )
            return GaitLibrary.load(Path(gaits).expanduser(), robot=self.model)
        wanted = f"a GaitLibrary, its file, or one of: {', '.join(STYLES)}"
        library = instance_of("gaits", gaits, GaitLibrary, wanted)
        if library.robot != self.robot_name:
            raise InvalidInput(
                f"these are gaits of {library.robot}, and the robot is {self.robot_name}; give the "
                "robot's own"
            )
        return library

    def _check_controllers(self) -> None:
        for spec in map(load_controller, self.controllers):
            if spec.gait_model == "datasheet":
                _ = with_rotors(self.model)  # the datasheet is there
            if isinstance(spec.tick_controller, ComputedTorque | ExtendedStateObserver):
                _ = level_robot(spec.name, self.model, self.base)
            if spec.source == "identified" and self.base != "locked":
                raise InvalidInput(
                    f"controller '{spec.name}' identifies the robot on the locked base; leave it "
                    "out, or use base 'locked'"
                )

    def _spanned(self, speeds: Array) -> slice:
        """Which of increasing speeds the commands need: all without any."""
        if not self.commands:
            return slice(None)
        slowest = min(profile.slowest for profile in self.profiles)
        fastest = max(profile.fastest for profile in self.profiles)
        if not speeds[0] <= slowest <= fastest <= speeds[-1]:
            beyond = slowest if slowest < speeds[0] else fastest
            raise SpeedOutOfRange(beyond, float(speeds[0]), float(speeds[-1]))
        first = int(np.searchsorted(speeds, slowest, side="right")) - 1
        return slice(first, int(np.searchsorted(speeds, fastest)) + 1)

    def _check_commands(self) -> None:
        if not self.commands:
            return
        _ = self._spanned(np.array(self.speeds))  # which all of them are within
        if self.base != "locked":
            raise InvalidInput(
                f"speeds are commanded on base 'locked' only, and this is '{self.base}'; leave the "
                "commands out, or choose base 'locked'"
            )
        for spec in map(load_controller, self.controllers):
            check_follows(spec)
        for name, profile in zip(self.commands, self.profiles, strict=True):
            if profile.duration < SHORTEST:
                raise InvalidInput(
                    f"command '{name}' of {profile.duration:g} s is too short for a stride; make "
                    f"it {SHORTEST:g} s or more"
                )

    def _sort_batches(self) -> None:
        batches = tuple(tuple(sorted(batch)) for batch in self.batches)
        together = tuple(sorted(speed for batch in batches for speed in batch))
        if batches and (together != self.speeds or not all(batches)):
            raise InvalidInput("batches must hold each speed once, and none of them may be empty")
        object.__setattr__(self, "batches", batches if len(batches) > 1 else ())

    @property
    def profiles(self) -> list[SpeedProfile]:
        """The commanded speeds."""
        return [SpeedProfile.parse(words) for words in self.commands]

    @property
    def robot_name(self) -> str:
        """Name of the robot."""
        return name_of(self.robot)

    @property
    def controller_names(self) -> tuple[str, ...]:
        """Names of the controllers."""
        return tuple(map(name_of, self.controllers))

    @property
    def scenario_names(self) -> tuple[str, ...]:
        """Names of the scenarios."""
        return tuple(map(name_of, self.scenarios))

    @property
    def own_metrics(self) -> tuple[Metric, ...]:
        """The metrics of one's own."""
        return tuple(map(load_metric, self.metrics))

    def controller(self, name: str) -> ControllerSpec:
        """The controller of a name: one of the experiment's, or a shipped one."""
        return load_controller(named(self.controllers, name))

    def scenario(self, name: str) -> Scenario:
        """The scenario of a name."""
        return load_scenario(named(self.scenarios, name))

    @property
    def model(self) -> Robot:
        """The robot, as its URDF has it."""
        return load_robot(self.robot)

    @property
    def library(self) -> GaitLibrary:
        """The gait library: of a trunk that may turn that of gaits that let it pitch.

        Raises:
            FileProblem: None is shipped for the robot.
            InvalidInput: That of the experiment is for another base.
        """
        wanted: Base = "locked" if self.base == "locked" else "sagittal"
        if isinstance(self.gaits, str):
            base = None if wanted == "locked" else wanted
            return load_library(self.robot_name, gait=self.gaits, base=base)
        if self.gaits.base != wanted:
            raise InvalidInput(
                f"these gaits are planned for base '{self.gaits.base}', and base '{self.base}' "
                f"needs those for '{wanted}'; build them with --base {wanted}, or choose another "
                "base"
            )
        return self.gaits

    @property
    def planned(self) -> list[Gait]:
        """The gait of each speed, as it is planned.

        Raises:
            SpeedOutOfRange, ApexOutOfRange: The library does not cover it.
        """
        return self.planned_at(self.speeds)

    def planned_at(self, speeds: Sequence[float]) -> list[Gait]:
        """The planned gaits of some speeds."""
        library = self.library
        return [library.at(speed, self.apex) for speed in speeds]

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
        for kind in ("controllers", "scenarios", "metrics"):
            there, here = (
                {name_of(value): describe(value) for value in getattr(each, kind)}
                for each in (self, other)
            )
            changed = [name for name in there if here.get(name, there[name]) != there[name]]
            against += [f"'{name}' of the {kind} is another one there" for name in changed]
        if against:
            raise InvalidInput("; ".join(against))
        more: dict[str, Any] = {
            name: tuple(dict.fromkeys((*getattr(self, name), *getattr(other, name))))
            for name in ("seeds", "speeds")
        }
        for kind in (
            "controllers",
            "scenarios",
            "metrics",
        ):  # live objects in place of those on record
            both = {name_of(v): v for v in (*getattr(self, kind), *getattr(other, kind))}
            more[kind] = tuple(both.values())
        added = tuple(speed for speed in other.speeds if speed not in self.speeds)
        batches = (*(self.batches or (self.speeds,)), added) if added else self.batches
        return dataclasses.replace(self, **more, batches=batches)

    def cells(self) -> tuple[Cell, ...]:
        """The simulations, in an order in which each finds what it depends on done before it."""
        controllers = list(self.controller_names)
        later = [name for name in controllers if depends_on_learning(self.controller(name))]
        if self.commands:
            places = [(scenario, seed) for scenario in self.scenario_names for seed in self.seeds]
            practices = places if later else []
            return (
                *(Cell("ilc", *place, 0, self, practice=True) for place in practices),
                *(Cell(name, *place, 0, self) for name in controllers for place in places),
            )
        if later:
            others = [name for name in controllers if name not in ("ilc", *later)]
            controllers = ["ilc", *others, *later]
        return tuple(
            Cell(controller, scenario, seed, batch, self)
            for batch in range(len(self.batches) or 1)
            for controller in controllers
            for scenario in self.scenario_names
            for seed in self.seeds
        )

    @property
    def compared(self) -> tuple[Cell, ...]:
        """The simulations that are compared: all but those that only others depend on."""
        return tuple(cell for cell in self.cells() if not cell.practice)


def _fixed(one: Experiment, other: Experiment) -> Iterator[tuple[str, object, object]]:
    """What cannot be added to: name, and its value in either of two experiments."""
    yield "robot", describe(one.robot), describe(other.robot)
    yield "gaits", digest_of(one.gaits), digest_of(other.gaits)
    driven = ("commands", "reference", "speeds") if one.commands or other.commands else ()
    for name in ("apex", "base", "mjcf", *driven):
        yield name, getattr(one, name), getattr(other, name)
    for part in dataclasses.fields(Schedule):
        name = part.name
        yield f"schedule.{name}", getattr(one.schedule, name), getattr(other.schedule, name)
