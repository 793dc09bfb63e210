"""Commands about comparisons and their results: `compare | reproduce | report | explain`."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

from tyro.conf import Positional, arg

from .._display import show
from .progress import progress

if TYPE_CHECKING:
    from ..compare import Experiment, Results


class ScheduleOptions(TypedDict, total=False):
    """What happens when: the paper's procedure."""

    startup: float
    """Standing in the posture of the first stride [s]; by default 0.5."""
    baseline: float
    """Pronking without learning [s]; by default 20."""
    learning: float
    """Pronking with the learning law switched on [s]; by default 20."""
    scatter: float
    """Standard deviation of the joint angles at the start [rad]; by default 0.01."""


class ExperimentOptions(TypedDict, total=False):
    """Fields of an `Experiment`, by name: what its documentation says, for the command line."""

    robot: Annotated[str, arg(metavar="NAME|FILE|MODULE:OBJECT")]
    """Robot: a name of `pronk-pin list robots`, a TOML file, or an address; by default a1."""
    gaits: Annotated[str, arg(metavar="NAME|FILE")]
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`; by default
    pronk."""
    apex: float | None
    """Apex of the gaits [m], one that the library covers; by default the library's own."""
    speeds: tuple[float, ...]
    """Desired speeds [m/s]; by default all of the gait library, the A1's -0.5 to 0.8."""
    controllers: Annotated[tuple[str, ...], arg(metavar="[NAME|MODULE:OBJECT [...]]")]
    """Controllers: names of `pronk-pin list controllers`, or addresses; library=FILE begins with
    the torques of `pronk-pin ilc build-library`; by default pd, ilc-paper, ilc-stance, ilc,
    ilc+rotors, model, model+rotors and library, less those that need rotors which are not known of
    the robot."""
    scenarios: Annotated[tuple[str, ...], arg(metavar="[NAME|MODULE:OBJECT [...]]")]
    """Scenarios: names of `pronk-pin list scenarios`, composed with "+", values with "=", as
    payload=2+slope; or addresses; by default nominal."""
    seeds: tuple[int, ...]
    """Seeds of the scatter at the start, of noise, and of rough ground and steps; by default 0.
    Where nothing is random they hardly differ; rough is the scenario for many."""
    base: str
    """How the trunk may move: locked to x and z, sagittal with pitch, or free; by default
    locked."""
    mjcf: str
    """MJCF of the robot, with the same joint names, that stands in for its URDF in the simulation;
    by default the URDF is simulated. Scenarios add to what is in it: ideal takes it as it is."""
    engine: Annotated[str, arg(metavar="NAME|MODULE:OBJECT")]
    """Engine that simulates the scenarios that name none: a name of `pronk-pin list engines`, or an
    address; by default mujoco. Scenarios may name it themselves, as nominal+drake."""
    schedule: ScheduleOptions
    """What happens when."""
    metrics: Annotated[tuple[str, ...], arg(metavar="[MODULE:OBJECT [...]]")]
    """Metrics of your own, beside those of `pronk-pin list metrics`; by default none."""
    commands: Annotated[tuple[str, ...], arg(name="command", metavar="[PROFILE|FILE [...]]")]
    """Speeds that change, instead of constant ones, each in quotes: "0 4s, 0->0.8 2s, 0.8 4s", a
    speed [m/s] and how long, or two with an arrow; "0.3+-0.2/5s 20s", a sine; or a csv file of time
    and speed. What was learned, or computed, at the speeds is used in between; speeds are by
    default those of the gait library that the commands span. By default none."""
    reference: str
    """With commands, speed by which gaits are chosen: commanded, or measured, that of the torso; by
    default commanded."""


@dataclass(frozen=True)
class Compare:
    """Run the comparison: simulate, print the table, write report and replay.

    Run it again with the same --folder alone and it goes on where it was; with more controllers,
    scenarios, speeds or seeds it adds them to what is there.
    """

    options: Annotated[ExperimentOptions, arg(name="")] = field(default_factory=ExperimentOptions)
    """The experiment."""
    config: Path | None = None
    """Experiment in a YAML file, or the config.json of a result, which the other options change; by
    default that of the folder, if it has one, or else of the suite."""
    suite: str | None = None
    """A named experiment, which the other options change, of `pronk-pin list suites`; by default
    the one called default. With --help its values are shown."""
    folder: Path | None = None
    """Results folder; by default results/<time>-comparison, or -<suite>."""
    workers: int | None = None
    """Processes; by default one for each core."""
    executor: str | None = None
    """Who simulates instead of these processes, as dask://HOST:PORT of a dask scheduler; by default
    nobody."""
    resimulate: bool = False
    """Simulate again what the folder has damaged, or of something else, instead of refusing it."""

    @cached_property
    def experiment(self) -> Experiment:
        """The experiment of the file, folder or suite that is asked for, with all that is given."""
        from ..compare import Results, Schedule
        from ..compare.experiment import load_suite, read_config

        given: dict[str, Any] = {**self.options}
        # Speeds and controllers begin with those of the robot and its gaits.
        first = {name: given[name] for name in ("robot", "gaits", "base") if name in given}
        if given.get("commands"):
            given.setdefault("speeds", ())  # those that the commands span
        begun = load_suite(self.suite or "default", **first)
        if self.config is not None:
            begun = read_config(self.config)
        elif self.suite is None and self.folder and (self.folder / "config.json").is_file():
            begun = dataclasses.replace(Results.load(self.folder).experiment, batches=())
        schedule: dict[str, float] = given.pop("schedule", {})
        if schedule:
            given["schedule"] = Schedule(**{**dataclasses.asdict(begun.schedule), **schedule})
        return dataclasses.replace(begun, **given) if given else begun

    def with_values(self) -> Compare:
        """The same with every option of the experiment given, as the help is to show them."""
        from ..compare.experiment import name_of

        experiment = self.experiment
        schedule: Any = dataclasses.asdict(experiment.schedule)
        return dataclasses.replace(
            self,
            options=ExperimentOptions(
                robot=experiment.robot_name,
                gaits=name_of(experiment.gaits),
                apex=experiment.apex,
                speeds=experiment.speeds,
                controllers=experiment.controller_names,
                scenarios=experiment.scenario_names,
                seeds=experiment.seeds,
                base=experiment.base,
                mjcf=experiment.mjcf,
                schedule=schedule,
                metrics=tuple(map(name_of, experiment.metrics)),
                commands=experiment.commands,
                reference=experiment.reference,
            ),
        )

    def run(self) -> None:
        """Do it."""
        from ..compare import default_folder, mjcf_parity, run_experiment
        from ..compare.report import format_between_engines, format_summary

        name = "comparison" if self.suite in (None, "default") else self.suite
        folder, world = self.folder or default_folder(name), self.experiment.mjcf
        if world:
            show(mjcf_parity(self.experiment.model, world).table())
        results = run_experiment(
            self.experiment,
            folder,
            workers=self.workers,
            executor=self.executor,
            resimulate=self.resimulate,
        )
        print(f"robot {results.experiment.robot_name}, base {results.experiment.base}\n")
        show(format_summary(results.summary()))
        if engines := format_between_engines(results):
            show(f"\n{engines}")
        times = ", ".join(f"{name} {time:.3g}" for name, time in results.control_times.items())
        if times:
            show(f"\ntime that controllers took on this machine, a robot and tick [us]: {times}")
        _print_pages(results, lambda: _made(lambda: _report(results)))


@dataclass(frozen=True)
class Reproduce:
    """Print the paper's Table I row by row beside ours, and which of its metrics could be meant.

    Runs the suite "paper": PD, ILC and the paper's own law at its speeds.
    """

    folder: Path | None = None
    """Results folder; by default results/<time>-paper. One that is there is completed."""
    speeds: tuple[float, ...] = ()
    """Desired speeds [m/s]; by default all of the paper's."""
    seeds: tuple[int, ...] = (0,)
    """Seeds of the scatter at the start, of which little is left after a second."""
    workers: int | None = None
    """Processes; by default one for each core."""

    def run(self) -> None:
        """Do it."""
        from ..compare import default_folder, run_experiment
        from ..compare.experiment import load_suite
        from ..compare.studies import format_reproduction

        asked: dict[str, Any] = {"speeds": self.speeds} if self.speeds else {}
        experiment = load_suite("paper", seeds=self.seeds, **asked)
        folder = self.folder or default_folder("paper")
        results = run_experiment(experiment, folder, workers=self.workers)
        learners = tuple(name for name in experiment.controller_names if name != "pd")
        show(format_reproduction(results, learners=learners))
        print(f"\nresults  {results.folder}")


@dataclass(frozen=True)
class Report:
    """Write the report and the replay of a result again, and print its tables.

    With two results, say what is different in the second beyond noise.
    """

    result: Positional[Path]
    """Results folder."""
    other: Positional[Path | None] = None
    """Results folder to compare it with; by default none."""
    figures: Path | None = None
    """Write the figures into this folder too, as SVG and PDF; by default into the report alone."""

    def run(self) -> None:
        """Do it."""
        from ..compare import Results
        from ..compare.report import format_between_engines, format_changes, format_summary
        from ..viz.report import write_figures

        results = Results.load(self.result)
        if self.other is not None:
            show(format_changes(results, Results.load(self.other)))
            return
        show(format_summary(results.summary()))
        if engines := format_between_engines(results):
            show(f"\n{engines}")
        _print_pages(results, lambda: str(_report(results)))
        if self.figures is not None:
            for path in write_figures(results, self.figures):
                print(f"figure   {path}")


@dataclass(frozen=True)
class Explain:
    """Take the learned torque of a result apart: rotors, friction, load, motors, and the rest.

    Prints what the model lacks, with intervals, how much of the learned torque each cause explains,
    and what cannot be told apart. The identified model can be written to a file, and tried out.
    """

    result: Positional[Path]
    """Results folder."""
    controller: str = "ilc"
    """Controller whose learned torque is explained."""
    scenario: str | None = None
    """Scenario of its strides; by default the first."""
    figure: Path | None = None
    """Draw the learned torque by cause into this file: png, svg or pdf; by default it is not
    drawn."""
    speed: float | None = None
    """Speed that the figure shows [m/s]; by default the one nearest to 0.5."""
    write_urdf: Path | None = None
    """Write the identified model to this URDF; by default it is not written."""
    write_mjcf: Path | None = None
    """Write the identified model to this MJCF; by default it is not written."""
    close_loop: bool = False
    """Try the identified model, with its gaits optimised again, beside the model, the torque
    library and learning, at speeds halfway between those of the result, and with 3 kg more
    on the A1 (others: the same share of their mass)."""
    imu_noise: float = 0.0
    """Standard deviation of noise added to the trunk's acceleration [m/s^2]."""
    draws: int = 300
    """Number of bootstrap draws of the strides for the intervals."""
    seed: int = 0
    """Seed of the draws and the noise."""

    def run(self) -> None:
        """Do it."""
        import numpy as np

        from ..compare import Results, describe, explain
        from ..compare.studies import close_loop, format_loop
        from ..robot.formats import write_mjcf, write_urdf
        from ..viz.figures import write_explanation_figure
        from ..viz.scenes import nearest

        self._check()
        results = Results.load(self.result)
        results.check_constant("explain")
        if self.speed is not None:
            nearest(results.experiment.speeds, self.speed, "speed")
        cell = results.find(controller=self.controller, scenario=self.scenario)
        strides = results.all_strides(controller=self.controller, scenario=self.scenario)
        rng = np.random.default_rng(self.seed)
        gaits = results.experiment.planned_at(strides["speed"].to_numpy().tolist())
        with progress("explaining", counted=False):
            explanation = explain(
                strides, gaits=gaits, imu_noise=self.imu_noise, draws=self.draws, rng=rng
            )
        text = describe(explanation)
        show(f"{cell.controller} in scenario {cell.scenario}\n\n{text}")
        if self.figure is not None:
            print(
                f"\nfigure  {write_explanation_figure(explanation, self.figure, speed=self.speed)}"
            )
        notes = [f"{explanation.robot.name}, identified by what learning found", "", text]
        if self.write_urdf is not None:
            print(f"\nurdf    {write_urdf(explanation.identified, self.write_urdf, notes)}")
        if self.write_mjcf is not None:
            print(f"\nmjcf    {write_mjcf(explanation.identified, self.write_mjcf, notes)}")
        if self.close_loop:
            planned_at = results.experiment.planned_at
            table = close_loop(explanation, strides, planned_at=planned_at, rng=rng)
            show(f"\n{format_loop(table)}")

    def _check(self) -> None:
        """What can be told to be wrong before anything is read."""
        from .._checks import none_or, real, seed, whole
        from ..compare.identification import DRAWS, IMU_NOISE, check_learner
        from ..viz import known_figure

        seed("seed", self.seed)
        real("imu-noise", self.imu_noise, IMU_NOISE)
        whole("draws", self.draws, DRAWS)
        none_or(real, "speed", self.speed)
        check_learner(self.controller)
        known_figure(self.figure)


def command_line(experiment: Experiment) -> str:
    """The command that runs an experiment; objects of one's own are read from its config.json."""
    from ..compare.experiment import SUITES, load_suite

    for name in SUITES:
        if load_suite(name) == experiment:
            return f"pronk-pin compare --suite {name}"
    words = ["pronk-pin compare"]
    own = (experiment.robot, experiment.gaits, *experiment.controllers, *experiment.scenarios)
    if experiment.metrics or not all(isinstance(value, str) for value in own):
        return "pronk-pin compare --config config.json"
    driven = bool(experiment.commands)
    words += [f"--robot {experiment.robot_name}"]
    words += [f"--gaits {experiment.gaits}"] if experiment.gaits != "pronk" else []
    words += [f"--apex {experiment.apex:g}"] if experiment.apex is not None else []
    words += ["--speeds " + " ".join(f"{speed:g}" for speed in experiment.speeds)]
    words += ["--controllers " + " ".join(experiment.controller_names)]
    words += ["--scenarios " + " ".join(experiment.scenario_names)]
    words += ["--seeds " + " ".join(map(str, experiment.seeds))]
    words += [f"--base {experiment.base}"]
    words += [f"--mjcf {shlex.quote(experiment.mjcf)}"] if experiment.mjcf else []
    words += ["--command " + " ".join(map(shlex.quote, experiment.commands))] * driven
    words += [f"--reference {experiment.reference}"] * driven
    schedule = experiment.schedule
    words += [
        f"--schedule.{name} {getattr(schedule, name):g}"
        for name in ("startup", "baseline", "learning", "scatter")
    ]
    return " ".join(words)


def _report(results: Results) -> Path:
    from ..viz.report import write_report

    return write_report(results, command=command_line(results.experiment))


def _print_pages(results: Results, report: Callable[[], str]) -> None:
    """Write the replay, and then the report, which links to it, and print where they are."""
    from ..viz import write_replay
    from ..viz.scenes import result_menu

    page = results.folder / "replay.html"
    print(f"\nresults  {results.folder}")
    replay = _made(lambda: write_replay(result_menu(results), page))
    print(f"report   {report()}")
    print(f"replay   {replay}")


def _made(write: Callable[[], Path]) -> str:
    """The path of a page, or why there is none: what is finished is not undone by its pictures."""
    from ..errors import PronkError

    try:
        return str(write())
    except Exception as error:  # of any library that draws
        kind = "" if isinstance(error, PronkError) else f"{type(error).__name__}: "
        return f"none: {kind}{' '.join(str(error).split())}"
