"""Commands about comparisons and their results: `compare | reproduce | report | explain`."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from tyro.conf import Positional, arg

from .._checks import none_or, real, seed, whole
from ..compare import (
    Experiment,
    Results,
    default_folder,
    describe,
    explain,
    mjcf_parity,
    run_experiment,
)
from ..compare.experiment import SUITES, load_suite
from ..compare.identification import DRAWS, IMU_NOISE, check_learner
from ..compare.report import format_changes, format_summary
from ..compare.studies import close_loop, format_loop, format_reproduction
from ..errors import PronkError
from ..robot.formats import write_mjcf, write_urdf
from ..viz import known_figure, write_replay
from ..viz.figures import write_explanation_figure
from ..viz.report import write_figures, write_report
from ..viz.scenes import nearest, result_menu


@dataclass(frozen=True)
class Compare:
    """Run the comparison: simulate, print the table, write report and replay.

    Run it again with the same --folder alone and it goes on where it was; with more controllers,
    scenarios, speeds or seeds it adds them to what is there.
    """

    experiment: Annotated[Experiment, arg(name="")] = field(default_factory=Experiment)
    """The experiment."""
    config: Path | None = None
    """Experiment in a YAML file, or the config.json of a result, which the other options change."""
    suite: str = "default"
    """A named experiment, which the other options change: see `pronk-pin list
    suites`."""
    folder: Path | None = None
    """Results folder; by default results/<time>-comparison."""
    workers: int | None = None
    """Processes; by default one for each core."""
    executor: str | None = None
    """Who simulates instead of these processes: dask://HOST:PORT of a dask scheduler."""
    resimulate: bool = False
    """Simulate again what the folder has damaged, or of something else, instead of refusing it."""

    def run(self) -> None:
        """Do it."""
        name = "comparison" if self.suite == "default" else self.suite
        folder, world = self.folder or default_folder(name), self.experiment.mjcf
        if world:
            print(mjcf_parity(self.experiment.model, world).table())
        results = run_experiment(
            self.experiment,
            folder,
            workers=self.workers,
            executor=self.executor,
            resimulate=self.resimulate,
        )
        print(f"robot {results.experiment.robot_name}, base {results.experiment.base}\n")
        print(format_summary(results.summary()))
        times = ", ".join(f"{name} {time:.3g}" for name, time in results.control_times.items())
        if times:
            print(f"\ntime that controllers took on this machine, a robot and tick [us]: {times}")
        _print_pages(results, _made(lambda: _report(results)))


@dataclass(frozen=True)
class Reproduce:
    """Print the paper's Table I row by row beside ours, and which of its metrics could be meant.

    Runs the suite "paper": PD, ILC and the paper's own law at its speeds.
    """

    folder: Path | None = None
    """Results folder; by default results/<time>-paper. One that is there is completed."""
    seeds: tuple[int, ...] = (0,)
    """Seeds of the scatter at the start, of which little is left after a second."""
    workers: int | None = None
    """Processes; by default one for each core."""

    def run(self) -> None:
        """Do it."""
        experiment = dataclasses.replace(load_suite("paper"), seeds=self.seeds)
        folder = self.folder or default_folder("paper")
        results = run_experiment(experiment, folder, workers=self.workers)
        learners = tuple(name for name in experiment.controller_names if name != "pd")
        print(format_reproduction(results, learners=learners))
        print(f"\nresults  {results.folder}")


@dataclass(frozen=True)
class Report:
    """Write the report and the replay of a result again, and print its tables.

    With two results, say what is different in the second beyond noise.
    """

    result: Positional[Path]
    """Results folder."""
    other: Positional[Path | None] = None
    """Results folder to compare it with."""
    figures: Path | None = None
    """Write the figures into this folder too, as SVG."""

    def run(self) -> None:
        """Do it."""
        results = Results.load(self.result)
        if self.other is not None:
            print(format_changes(results, Results.load(self.other)))
            return
        print(format_summary(results.summary()))
        _print_pages(results, str(_report(results)))
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
    """Draw the learned torque by cause into this file: png, svg or pdf."""
    speed: float | None = None
    """Speed that the figure shows [m/s]; by default the one nearest to 0.5."""
    write_urdf: Path | None = None
    """Write the identified model to this URDF."""
    write_mjcf: Path | None = None
    """Write the identified model to this MJCF."""
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
        self._check()
        results = Results.load(self.result)
        if self.speed is not None:
            nearest(results.experiment.speeds, self.speed, "speed")
        cell = results.find(controller=self.controller, scenario=self.scenario)
        strides = results.all_strides(controller=self.controller, scenario=self.scenario)
        rng = np.random.default_rng(self.seed)
        gaits = results.experiment.planned_at(strides["speed"].to_numpy().tolist())
        explanation = explain(
            strides, gaits=gaits, imu_noise=self.imu_noise, draws=self.draws, rng=rng
        )
        text = describe(explanation)
        print(f"{cell.controller} in scenario {cell.scenario}\n\n{text}")
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
            print(f"\n{format_loop(table)}")

    def _check(self) -> None:
        """What can be told to be wrong before anything is read."""
        seed("seed", self.seed)
        real("imu-noise", self.imu_noise, IMU_NOISE)
        whole("draws", self.draws, DRAWS)
        none_or(real, "speed", self.speed)
        check_learner(self.controller)
        if self.figure is not None:
            known_figure(self.figure)


def command_line(experiment: Experiment) -> str:
    """The command that runs an experiment; objects of one's own are read from its config.json."""
    for name in SUITES:
        if load_suite(name) == experiment:
            return f"pronk-pin compare --suite {name}"
    words = ["pronk-pin compare"]
    own = (experiment.robot, experiment.gaits, *experiment.controllers, *experiment.scenarios)
    if experiment.metrics or not all(isinstance(value, str) for value in own):
        return "pronk-pin compare --config config.json"
    words += [f"--robot {experiment.robot_name}"]
    words += [f"--gaits {experiment.gaits}"] if experiment.gaits != "pronk" else []
    words += [f"--apex {experiment.apex:g}"] if experiment.apex is not None else []
    words += ["--speeds " + " ".join(f"{speed:g}" for speed in experiment.speeds)]
    words += ["--controllers " + " ".join(experiment.controller_names)]
    words += ["--scenarios " + " ".join(experiment.scenario_names)]
    words += ["--seeds " + " ".join(map(str, experiment.seeds))]
    words += [f"--base {experiment.base}"]
    words += [f"--mjcf {shlex.quote(experiment.mjcf)}"] if experiment.mjcf else []
    schedule = experiment.schedule
    words += [
        f"--schedule.{name} {getattr(schedule, name):g}"
        for name in ("startup", "baseline", "learning", "scatter")
    ]
    return " ".join(words)


def _report(results: Results) -> Path:
    return write_report(results, command=command_line(results.experiment))


def _print_pages(results: Results, report: str) -> None:
    """Where result, report and replay are; the replay is written here."""
    page = results.folder / "replay.html"
    print(f"\nresults  {results.folder}")
    print(f"report   {report}")
    print(f"replay   {_made(lambda: write_replay(result_menu(results), page))}")


def _made(write: Callable[[], Path]) -> str:
    """The path of a page, or why there is none: what is finished is not undone by its pictures."""
    try:
        return str(write())
    except Exception as error:  # of any library that draws
        kind = "" if isinstance(error, PronkError) else f"{type(error).__name__}: "
        return f"none: {kind}{' '.join(str(error).split())}"
