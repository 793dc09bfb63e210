"""Commands of `ilc`: analysis of learning laws, and what learning is good for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, subcommand

from .._display import show
from .ilc_reuse import BuildLibrary, Engines, Seeding, Transfer, TryLibrary, covered_speeds
from .progress import progress

if TYPE_CHECKING:
    from ..gait import Gait


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
    """Scenario of the learning."""
    result: Path | None = None
    """Results folder with a learning run of a law of the stance only, as ilc-stance; by default a
    short one is simulated."""
    strides: int = 20
    """Strides of learning to compare."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""
    figure: Path | None = None
    """Draw the result into this file: png, svg or pdf; by default it is not drawn."""

    def run(self) -> None:
        """Do it."""
        from .._checks import whole
        from ..compare import Results, load_scenario
        from ..compare.studies import (
            STRIDES,
            compare_prediction,
            describe_prediction,
            machine_and_gaits,
            simulate_learning,
            stored_learning,
        )
        from ..control import load_controller
        from ..viz import known_figure, save_figure
        from ..viz.figures import predicted_and_measured

        whole("strides", self.strides, STRIDES)
        known_figure(self.figure)
        gaits: list[Gait]
        if self.result is None:
            spec, scenario = load_controller(self.controller), load_scenario(self.scenario)
            with progress("learning"):
                strides = simulate_learning(
                    spec,
                    self.speed,
                    scenario,
                    robot=self.robot,
                    gaits=self.gaits,
                    strides=self.strides,
                )
            _, library = machine_and_gaits(self.robot, self.gaits)
            gaits = [library.at(speed) for speed in self.speed]
        else:
            results = Results.load(self.result)
            experiment = results.experiment
            spec = experiment.controller(self.controller)
            scenario = experiment.scenario(self.scenario)
            strides = stored_learning(results, spec, self.speed, scenario)
            gaits = experiment.planned_at(self.speed)
        predictions = []
        for k, speed in enumerate(self.speed):
            with progress("predicting", counted=False):
                compared = compare_prediction(
                    spec, strides, speed, scenario, number=self.strides, gait=gaits[k]
                )
            predictions.append(compared)
            show(describe_prediction(predictions[-1]) + "\n")
        if self.figure is not None:
            print(f"figure  {save_figure(predicted_and_measured(predictions), self.figure)}")


@dataclass(frozen=True)
class Stability:
    """Say whether learning oscillates, and grows, over the strides: predicted, and measured.

    The laws of stance and flight and the flight's timing correct the same errors; how much of the
    stance's the law of the flight is shown (coupling) decides whether the three settle.
    """

    controller: Positional[str] = "ilc"
    """Controller whose learning is analysed."""
    speed: tuple[float, ...] = ()
    """Speeds [m/s]; by default 0.6 and 0.8, if the robot's gaits cover them."""
    scenario: str = "payload+delay"
    """Scenario of the learning."""
    couplings: tuple[float, ...] = (1.0, 0.8, 0.6, 0.5, 0.0)
    """Shares of the stance's errors that the flight's law is shown."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""

    def run(self) -> None:
        """Do it."""
        from ..compare import load_scenario
        from ..compare.studies import describe_stability, measure_stability
        from ..control import load_controller

        spec, scenario = load_controller(self.controller), load_scenario(self.scenario)
        speeds = self.speed or covered_speeds(self.robot, self.gaits, (0.6, 0.8))
        with progress("learning"):
            table = measure_stability(
                spec,
                speeds,
                scenario,
                couplings=self.couplings,
                robot=self.robot,
                gaits=self.gaits,
            )
        show(describe_stability(table))


@dataclass(frozen=True)
class Drive:
    """Drive by commanded speeds with what was learned at constant ones, and with rivals.

    Gaits are chosen anew at each stride, between those of the library: eq. (13) of the paper.
    """

    command: tuple[str, ...] = ()
    """Speed profiles, each in quotes: "0 4s, 0->0.8 2s, 0.8 4s", a speed [m/s] and how long, or two
    with an arrow. Where a piece begins at another speed than the last ended, the command steps. By
    default ramps and steps up and down. A csv file of time and speed is one, too."""
    controllers: tuple[str, ...] = ("pd", "model", "library", "library+ilc")
    """Controllers."""
    scenario: str = "nominal"
    """Scenario, of the learning and of the driving."""
    reference: tuple[str, ...] = ("commanded",)
    """Speeds by which gaits are chosen: commanded, or measured, that of the torso; or both."""
    push: float = 0.0
    """Impulse of a push forward, once, after three fifths of the longest command [N s]; with one
    the default commands are constant speeds."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""
    figure: Path | None = None
    """Draw the result into this file: png, svg or pdf; by default it is not drawn."""

    def run(self) -> None:
        """Do it."""
        from .._checks import Interval, real
        from ..compare import load_scenario
        from ..compare.report import format_commands
        from ..compare.studies import PUSHED, RAMPS, measure_driving
        from ..viz import known_figure, save_figure
        from ..viz.figures import driving_figure

        known_figure(self.figure)
        real("push", self.push, Interval(-200, 200, "N s"))
        with progress("learning and driving"):
            driving = measure_driving(
                self.command or (PUSHED if self.push else RAMPS),
                load_scenario(self.scenario),
                controllers=self.controllers,
                robot=self.robot,
                gaits=self.gaits,
                references=self.reference,
                push=self.push,
            )
        show(format_commands(driving.summary))
        if self.figure is not None:
            print(f"\nfigure  {save_figure(driving_figure(driving.strides), self.figure)}")


@dataclass(frozen=True)
class Wander:
    """Learn from nothing while the speed changes, and say what that is worth at constant speeds."""

    command: str = ""
    """Speed profile of the learning, as in `pronk-pin ilc drive`; by default a minute that sweeps
    twice over all speeds."""
    scenario: str = "nominal"
    """Scenario."""
    robot: str = "a1"
    """Robot."""
    gaits: str = "pronk"
    """Its gaits: pronk, as shipped for it, or a file of `pronk-pin gaits build`."""

    def run(self) -> None:
        """Do it."""
        from ..compare import load_scenario
        from ..compare.studies import SWEEPS, describe_wandering, measure_wandering

        command, scenario = self.command or SWEEPS, load_scenario(self.scenario)
        with progress("learning"):
            table = measure_wandering(command, scenario, robot=self.robot, gaits=self.gaits)
        show(describe_wandering(table))


@dataclass(frozen=True)
class Gains:
    """Tell whether learning permits smaller feedback gains, as the paper claims.

    Learns once, then replays what was learned with smaller gains, beside the same gains alone.
    """

    controller: Positional[str] = "ilc"
    """Controller that learns."""
    speed: tuple[float, ...] = ()
    """Speeds [m/s]; by default -0.4 to 0.8 in steps of 0.4, as far as the robot's gaits go."""
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
        from ..compare.studies import describe_gains, sweep_gains
        from ..control import load_controller
        from ..viz import known_figure, save_figure
        from ..viz.figures import gains_figure

        known_figure(self.figure)
        spec, scenario = load_controller(self.controller), load_scenario(self.scenario)
        speeds = self.speed or covered_speeds(self.robot, self.gaits, (-0.4, 0.0, 0.4, 0.8))
        with progress("learning"):
            table = sweep_gains(spec, speeds, scenario, robot=self.robot, gaits=self.gaits)
        show(describe_gains(table))
        if self.figure is not None:
            print(f"\nfigure  {save_figure(gains_figure(table), self.figure)}")


@dataclass(frozen=True)
class Ilc:
    """Analyse learning laws, and what learning is good for."""

    action: (
        Annotated[Analyze, subcommand("analyze")]
        | Annotated[Stability, subcommand("stability")]
        | Annotated[Gains, subcommand("gains")]
        | Annotated[Drive, subcommand("drive")]
        | Annotated[Wander, subcommand("wander")]
        | Annotated[Transfer, subcommand("transfer")]
        | Annotated[Seeding, subcommand("seeding")]
        | Annotated[BuildLibrary, subcommand("build-library")]
        | Annotated[TryLibrary, subcommand("try-library")]
        | Annotated[Engines, subcommand("engines")]
    )

    def run(self) -> None:
        """Do it."""
        self.action.run()
