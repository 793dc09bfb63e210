"""The command line: `pronk-pin compare | gaits | ilc | view | report | explain | parity`."""

from __future__ import annotations

import dataclasses
import sys
import warnings
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Protocol, TextIO, Union

import numpy as np
import tyro
from tyro.conf import OmitSubcommandPrefixes, Positional, arg, subcommand

from ._state import known_name
from ._urdf import mujoco_spec
from .compare import (
    Experiment,
    Results,
    default_folder,
    describe,
    explain,
    run_experiment,
)
from .compare.changes import format_changes
from .compare.closing import close_loop, format_loop
from .compare.gains import describe_gains, sweep_gains
from .compare.prediction import (
    compare_prediction,
    describe_prediction,
    practise,
    stored_practice,
)
from .compare.reproduce import format_reproduction
from .compare.scenario import load_scenario
from .compare.seeding import describe_seeding, measure_seeding
from .compare.suites import SUITES, load_suite
from .compare.transfer import describe_transfers, measure_transfers
from .compare.words import families, format_suite, format_tables
from .control import load_controller
from .errors import InvalidInput, LeakyFilter, PronkError
from .gait import (
    GaitLibrary,
    build_library,
    describe_gait,
    describe_library,
    known_base,
    load_library,
    number_range,
)
from .model_files import write_mjcf, write_urdf
from .parity import compare_models
from .robot import load_robot
from .viz import Film, Programme, library_programme, serve, write_film, write_png, write_replay
from .viz.explanation_figure import write_explanation_figure
from .viz.gait_figures import write_gait_figures
from .viz.learning_figures import errors_by_seed, predicted_and_measured
from .viz.practice import practice_programme
from .viz.report import write_figures, write_report
from .viz.skill_figures import gains_figure, transfers_figure
from .viz.style import save_figure


@dataclass(frozen=True)
class Compare:
    """Run the comparison: simulate, print the table, write report and replay.

    Run it again with the same --folder and it completes what is missing.
    """

    experiment: Annotated[Experiment, arg(name="")] = field(default_factory=Experiment)
    """What to compare."""
    suite: str = "default"
    """A named experiment, which the other options change: default, mismatch, sampled, control,
    paper."""
    folder: Path | None = None
    """Results folder; by default results/<time>-comparison."""
    workers: int | None = None
    """Processes; by default one for each core."""
    executor: str | None = None
    """Who simulates instead of these processes: dask://HOST:PORT of a dask scheduler."""

    def run(self) -> None:
        """Do it."""
        name = "comparison" if self.suite == "default" else self.suite
        folder = self.folder or default_folder(name)
        foreign = Results.create(self.experiment, folder).foreign
        if foreign is not None:
            print(foreign.parity.table())
        results = run_experiment(
            self.experiment, folder, workers=self.workers, executor=self.executor
        )
        print(f"robot {self.experiment.robot}, base {self.experiment.base}\n")
        _print_tables(results)
        _write_pages(results)


@dataclass(frozen=True)
class Reproduce:
    """Print the paper's Table I row by row beside ours, and which of its metrics could be meant.

    Runs the suite "paper": PD, ILC and the paper's own law at its speeds, with several seeds.
    """

    folder: Path | None = None
    """Results folder; by default results/<time>-paper. One that is there is completed."""
    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    """Seeds of the scatter at the start; intervals need five."""
    workers: int | None = None
    """Processes; by default one for each core."""

    def run(self) -> None:
        """Do it."""
        experiment = dataclasses.replace(load_suite("paper"), seeds=self.seeds)
        folder = self.folder or default_folder("paper")
        results = run_experiment(experiment, folder, workers=self.workers)
        learners = tuple(name for name in experiment.controllers if name != "pd")
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
        _print_tables(results)
        _write_pages(results)
        if self.figures is not None:
            for path in write_figures(results, self.figures):
                print(f"figure   {path}")


@dataclass(frozen=True)
class Explain:
    """Take the learned torque of a result apart: rotors, friction, load, motors, and the rest.

    Prints what the model lacks, with intervals, how much of the learned torque each cause explains,
    and what cannot be told apart. The mended model can be written to a file, and tried out.
    """

    result: Positional[Path]
    """Results folder."""
    controller: str = "ilc"
    """Whose strides."""
    scenario: str | None = None
    """In which scenario; by default the first."""
    figure: Path | None = None
    """Draw the learned torque by cause into this file: png, svg or pdf."""
    speed: float | None = None
    """Speed that the figure shows [m/s]; by default the one nearest to 0.5."""
    write_urdf: Path | None = None
    """Write the mended model to this URDF."""
    write_mjcf: Path | None = None
    """Write the mended model to this MJCF."""
    close_loop: bool = False
    """Try the mended model, with its gaits optimised again, beside the model, the torque library
    and practice, at speeds halfway between those of the result and with 3 kg more."""
    imu_noise: float = 0.0
    """Standard deviation of noise added to the trunk's acceleration [m/s^2]."""
    draws: int = 300
    """How often strides are drawn anew for the intervals."""
    seed: int = 0
    """Seed of the draws and the noise."""

    def run(self) -> None:
        """Do it."""
        if self.seed < 0:
            raise InvalidInput(f"seed={self.seed}; give a number from 0 on")
        results = Results.load(self.result)
        cell = results.find(controller=self.controller, scenario=self.scenario)
        strides, rng = results.strides(cell), np.random.default_rng(self.seed)
        found = explain(strides, imu_noise=self.imu_noise, draws=self.draws, rng=rng)
        print(f"{cell.controller} in scenario {cell.scenario}\n\n{describe(found)}")
        if self.figure is not None:
            print(f"\nfigure  {write_explanation_figure(found, self.figure, speed=self.speed)}")
        notes = [f"{found.robot.name}, mended by what practice found", "", describe(found)]
        if self.write_urdf is not None:
            print(f"\nurdf    {write_urdf(found.mended, self.write_urdf, notes)}")
        if self.write_mjcf is not None:
            print(f"\nmjcf    {write_mjcf(found.mended, self.write_mjcf, notes)}")
        if self.close_loop:
            print(f"\n{format_loop(close_loop(found, strides, rng=rng))}")


@dataclass(frozen=True)
class View:
    """Show a motion: a result's robots beside their references, or a library's gaits.

    Without --html, --png, --gif or --mp4, on a live page with controls.
    """

    what: Positional[Path | None] = None
    """Results folder or gait library; by default the shipped gaits."""
    speed: float | None = None
    """Which speed [m/s]; by default the one nearest to 0.5."""
    apex: float | None = None
    """Which apex of a gait library [m]; by default the library's own."""
    controller: str | None = None
    """Which controller of a result; by default ilc."""
    scenario: str | None = None
    """Which scenario of a result; by default the first."""
    beside: str | None = None
    """What to show beside it: another controller of the result, or 'before learning'."""
    stride: int | None = None
    """Show the dozen strides of a result with this one; by default those around the start of
    learning."""
    robot: str = "a1"
    """Robot whose shipped gaits are shown."""
    gait: str = "pronk"
    """Which of its shipped gaits: pronk or bound."""
    base: str | None = None
    """How the trunk may move in it, locked or sagittal; by default the gait's own."""
    port: int | None = None
    """Port of the page; by default a free one."""
    host: str = "127.0.0.1"
    """Address that the page listens on; the default can be reached from this machine only."""
    open: bool = True
    """Open the page in the browser."""
    duration: float | None = None
    """End the page after so many seconds; by default on Ctrl-C."""
    html: Path | None = None
    """Write the page to this file instead: it opens offline."""
    png: Path | None = None
    """Write a picture to this file instead."""
    gif: Path | None = None
    """Write an animation to this file instead."""
    mp4: Path | None = None
    """Write a video to this file instead."""
    film: Annotated[Film, arg(name="")] = field(default_factory=Film)
    """What pictures and films are like."""

    def run(self) -> None:
        """Do it."""
        programme = self._programme()
        if self.html is not None:
            print(f"replay  {write_replay(programme, self.html)}")
        if self.png is not None:
            print(f"picture {write_png(programme.scene(), self.png, self.film)}")
        for path in (self.gif, self.mp4):
            if path is not None:
                print(f"film    {write_film(programme.scene(), path, self.film)}")
        if all(path is None for path in (self.html, self.png, self.gif, self.mp4)):
            serve(
                programme,
                port=self.port,
                host=self.host,
                open_browser=self.open,
                duration=self.duration,
            )

    def _programme(self) -> Programme:
        if self.what is not None and self.what.is_dir():
            return practice_programme(
                Results.load(self.what),
                speed=self.speed,
                controller=self.controller,
                scenario=self.scenario,
                beside=self.beside,
                stride=self.stride,
            )
        return library_programme(
            _library(self.what, self.robot, self.gait, self.base), speed=self.speed, apex=self.apex
        )


@dataclass(frozen=True)
class Build:
    """Optimise a gait library anew, from one gait outward.

    Each gait is kept in a folder as soon as it is solved: run the same command again, and it
    completes what is missing.
    """

    robot: str = "a1"
    """Robot."""
    gait: str = "pronk"
    """Which gait: pronk or bound."""
    base: str | None = None
    """How the trunk may move: locked (x and z only) or sagittal (pitching too); by default the
    gait's own."""
    speeds: tuple[str, ...] = ()
    """Speeds [m/s], each a number or a range A:B:STEP; by default the gait's own."""
    apex: tuple[str, ...] = ()
    """Greatest heights of the trunk [m], each a number or a range A:B:STEP; by default the
    gait's own."""
    output: Path = Path("gaits.npz")
    """File to write."""
    folder: Path | None = None
    """Where each gait is kept; by default beside the output, with '.build' to its name."""
    workers: int | None = None
    """Processes; by default one for each core."""

    def run(self) -> None:
        """Do it."""
        folder = self.folder or self.output.with_name(self.output.name + ".build")
        base = None if self.base is None else known_base(self.base)
        library = build_library(
            load_robot(self.robot),
            number_range("speeds", self.speeds) or None,
            apexes=number_range("apex", self.apex) or None,
            gait=self.gait,
            base=base,
            path=self.output,
            folder=folder,
            workers=self.workers,
        )
        print(describe_library(library))
        print(f"\ngaits   {self.output}\nfolder  {folder}  (each gait; no longer needed)")


@dataclass(frozen=True)
class _OfLibrary:
    """Which gaits of which library a command looks at."""

    apex: float | None = None
    """Greatest height of the trunk [m]; by default the library's own."""
    library: Path | None = None
    """Library file; by default the shipped one."""
    robot: str = "a1"
    """Robot whose shipped library it is."""
    gait: str = "pronk"
    """Which of its gaits: pronk or bound."""
    base: str | None = None
    """How the trunk may move in it; by default the gait's own."""

    def load(self) -> GaitLibrary:
        """The library, even one that failed its audit."""
        return _library(self.library, self.robot, self.gait, self.base, audited=False)


@dataclass(frozen=True)
class Show(_OfLibrary):
    """Print the proof of a gait library: violations, residuals, drift, limits."""

    speed: Positional[float | None] = None
    """One gait in detail [m/s]; by default a line for each."""

    def run(self) -> None:
        """Do it."""
        library = self.load()
        if self.speed is None:
            print(describe_library(library))
        else:
            print(describe_gait(library, self.speed, self.apex))


@dataclass(frozen=True)
class Plot(_OfLibrary):
    """Draw a gait library: joints, torques, forces and trunk over the stride, and a side view."""

    speed: Positional[float | None] = None
    """Speed of the side view [m/s]; by default the one nearest to 0.5."""
    folder: Path = Path("figures")
    """Where to write the figures."""
    format: str = "png"
    """Format of the figures: png, svg or pdf."""

    def run(self) -> None:
        """Do it."""
        paths = write_gait_figures(
            self.load(), self.folder, speed=self.speed, apex=self.apex, suffix=self.format
        )
        for path in paths:
            print(f"figure  {path}")


@dataclass(frozen=True)
class Gaits:
    """Build, show or plot the gait library."""

    action: (
        Annotated[Build, subcommand("build")]
        | Annotated[Show, subcommand("show")]
        | Annotated[Plot, subcommand("plot")]
    )

    def run(self) -> None:
        """Do it."""
        self.action.run()


@dataclass(frozen=True)
class Analyze:
    """Say what a learning law will do along a gait, and lay what it did beside it.

    Prints stability, transient growth, what is left of the error, and robustness, all from the
    lifted model; then the predicted error of each stride beside the measured one.
    """

    controller: Positional[str] = "ilc"
    """Controller whose law of the stance is analysed."""
    speed: tuple[float, ...] = (0.0,)
    """Speeds [m/s]."""
    scenario: str = "nominal"
    """World of the practice."""
    result: Path | None = None
    """Results folder with a practice of a law of the stance only, as ilc-stance; by default a short
    one is simulated."""
    strides: int = 20
    """Strides of learning to compare."""
    robot: str = "a1"
    """Robot."""
    figure: Path = Path("analysis.png")
    """Figure to write: png, svg or pdf."""

    def run(self) -> None:
        """Do it."""
        if self.strides < 1:
            raise InvalidInput(f"strides={self.strides}; give 1 or more")
        spec, scenario = load_controller(self.controller), load_scenario(self.scenario)
        if self.result is None:
            made = practise(spec, self.speed, scenario, robot=self.robot, strides=self.strides)
        else:
            made = stored_practice(Results.load(self.result), spec, self.speed, scenario)
        predictions = []
        for speed in self.speed:
            predictions.append(compare_prediction(spec, made, speed, scenario, number=self.strides))
            print(describe_prediction(predictions[-1]), end="\n\n")
        print(f"figure  {save_figure(predicted_and_measured(predictions), self.figure)}")


@dataclass(frozen=True)
class Gains:
    """Tell whether learning permits smaller feedback gains, as the paper claims.

    Practises once, then replays what was learned with smaller gains, beside the same gains alone.
    """

    controller: Positional[str] = "ilc"
    """Controller that practises."""
    speed: tuple[float, ...] = (-0.4, 0.0, 0.4, 0.8)
    """Speeds [m/s]."""
    scenario: str = "nominal"
    """World of the practice."""
    robot: str = "a1"
    """Robot."""
    figure: Path = Path("gains.png")
    """Figure to write: png, svg or pdf."""

    def run(self) -> None:
        """Do it."""
        spec, scenario = load_controller(self.controller), load_scenario(self.scenario)
        table = sweep_gains(spec, self.speed, scenario, robot=self.robot)
        print(describe_gains(table))
        print(f"\nfigure  {save_figure(gains_figure(table), self.figure)}")


@dataclass(frozen=True)
class Transfer:
    """Tell where a stored skill may be reused, and where it has to be practised again.

    Learns at home, replays the torque library at home, at speeds that were left out, and in other
    worlds, and compares with practice there.
    """

    controller: Positional[str] = "ilc"
    """Controller that practises."""
    speed: tuple[float, ...] = (-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
    """Speeds [m/s], increasing."""
    scenario: str = "nominal"
    """World of the practice."""
    worlds: tuple[str, ...] = ("payload", "weak-motors", "soft-ground", "slope", "gravity")
    """Worlds in which the skill is tried."""
    robot: str = "a1"
    """Robot."""
    figure: Path = Path("transfer.png")
    """Figure to write: png, svg or pdf."""

    def run(self) -> None:
        """Do it."""
        table = measure_transfers(
            load_controller(self.controller),
            self.speed,
            load_scenario(self.scenario),
            [load_scenario(name) for name in self.worlds],
            robot=self.robot,
        )
        print(describe_transfers(table))
        print(f"\nfigure  {save_figure(transfers_figure(table), self.figure)}")


@dataclass(frozen=True)
class Seeding:
    """Tell what a seed saves: learning from nothing, from the model, and from neighbouring speeds.

    The torque library practises at all speeds; each inner one begins with its neighbours' torques.
    """

    speed: tuple[float, ...] = (-0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
    """Speeds [m/s], increasing."""
    scenario: str = "nominal"
    """World of the practice."""
    robot: str = "a1"
    """Robot."""
    figure: Path = Path("seeding.png")
    """Figure to write: png, svg or pdf."""

    def run(self) -> None:
        """Do it."""
        table = measure_seeding(self.speed, load_scenario(self.scenario), robot=self.robot)
        print(describe_seeding(table))
        print(f"figure  {save_figure(errors_by_seed(table), self.figure)}")


@dataclass(frozen=True)
class Ilc:
    """Analyse learning laws, and what learning is good for."""

    action: (
        Annotated[Analyze, subcommand("analyze")]
        | Annotated[Gains, subcommand("gains")]
        | Annotated[Transfer, subcommand("transfer")]
        | Annotated[Seeding, subcommand("seeding")]
    )

    def run(self) -> None:
        """Do it."""
        self.action.run()


@dataclass(frozen=True)
class Parity:
    """Tell whether an MJCF or a URDF is the same robot as ours; exit with 1 where it is not.

    Prints what differs of masses, joints and motors, and the largest differences of M, h and J on
    random states. Without a model, our robot in Pinocchio is compared with MuJoCo's reading of
    the same URDF.
    """

    model: Positional[Path | None] = None
    """MJCF or URDF to compare with."""
    robot: str = "a1"
    """Robot it should be."""
    states: int = 200
    """Number of random states."""
    seed: int = 0
    """Seed of the random states."""
    tolerance: float | None = None
    """Relative difference up to which values agree; by default 1e-9, or 1e-5 for an MJCF whose
    numbers have six digits, as MuJoCo writes them."""
    full: bool = False
    """Print every row of the table, not only those that differ."""

    def run(self) -> int:
        """Do it; the exit code is 0 where the two are the same."""
        if self.seed < 0:
            raise InvalidInput(f"seed={self.seed}; give a number from 0 on")
        robot = load_robot(self.robot)
        parity = compare_models(
            robot,
            mujoco_spec(robot).compile() if self.model is None else self.model,
            states=self.states,
            rng=np.random.default_rng(self.seed),
            tolerance=self.tolerance,
        )
        print(parity.table(full=self.full))
        return 0 if parity.agrees else 1


class _Runs(Protocol):
    """A command: does it, and says with which code to exit if not with 0."""

    def run(self) -> int | None: ...


def _commands(arguments: list[str]) -> Any:
    """All commands; the defaults of `compare` are those of the suite that is asked for."""
    words = [word for argument in arguments for word in argument.split("=", 1)]
    following = dict(pairwise(words))
    suite = following.get("--suite", "default")
    known_name("suite", suite, SUITES)
    default = Compare(experiment=load_suite(suite), suite=suite)
    return Union[  # noqa: UP007 -- its first member is made here
        Annotated[Compare, subcommand("compare", default=default)], Command
    ]


Command = (
    Annotated[Gaits, subcommand("gaits")]
    | Annotated[Ilc, subcommand("ilc")]
    | Annotated[View, subcommand("view")]
    | Annotated[Report, subcommand("report")]
    | Annotated[Reproduce, subcommand("reproduce")]
    | Annotated[Explain, subcommand("explain")]
    | Annotated[Parity, subcommand("parity")]
)


def main(arguments: list[str] | None = None) -> int:
    """Entry point; the exit code is 0, 1 for an error of ours or models that differ, 2 for wrong
    usage, 130 on Ctrl-C."""
    try:
        command: _Runs = tyro.cli(
            _commands(sys.argv[1:] if arguments is None else arguments),
            prog="pronk-pin",
            description="When a legged robot repeats a motion, does practice beat the model?",
            args=arguments,
            config=(OmitSubcommandPrefixes,),
        )
        with warnings.catch_warnings():
            warnings.simplefilter("once", LeakyFilter)
            warnings.showwarning = _show_warning
            return command.run() or 0
    except PronkError as error:
        print(f"pronk-pin: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("pronk-pin: interrupted", file=sys.stderr)
        return 130


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """A warning in one line, as errors are shown."""
    print(f"pronk-pin: warning: {message}", file=sys.stderr)


def _print_tables(results: Results) -> None:
    """Table I, overview and verdict of one world; the overviews of many and one verdict."""
    summary, worlds = results.summary(), families(results.experiment.scenarios)
    if len(worlds) > 1:
        print(format_suite(summary))
    else:
        print(format_tables(summary, scenario=worlds[0]))


def _write_pages(results: Results) -> None:
    """The report and the replay of a result, with their names printed."""
    print(f"\nresults  {results.folder}")
    print(f"report   {write_report(results)}")
    print(f"replay   {write_replay(practice_programme(results), results.folder / 'replay.html')}")


def _library(
    path: Path | None, robot: str, gait: str, base: str | None, *, audited: bool = True
) -> GaitLibrary:
    """A library from a file, or one that is shipped."""
    if path is not None:
        return GaitLibrary.load(path, audited=audited)
    load_robot(robot)
    return load_library(robot, gait=gait, base=None if base is None else known_base(base))


if __name__ == "__main__":
    sys.exit(main())
