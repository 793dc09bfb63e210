"""The report of a result: the answer, tables, figures, limitations and where the numbers are from.

One document, written as a self-contained report.html and as report.md with its figures beside it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from ...compare import ForeignRobot, Results
from ...compare.metrics import (
    CONFIDENCE,
    LEARNER,
    LEAST_UNITS,
    STEADY_STRIDES,
    VARIABLES,
    PeakHistory,
    family,
    of_papers_robot,
    peak_history,
    sampled,
)
from ...compare.report import (
    SHOWN,
    Overview,
    answer,
    answer_in_words,
    beside_note,
    beside_the_paper,
    families,
    format_between_engines,
    limitations,
    paper_learner,
    sampled_scenarios,
    units_of_intervals,
    verdict,
)
from ...errors import cannot_write
from .. import figures
from ..figure_style import save_figure
from . import report_tables
from .command_report import add_commands, command_figures
from .document import Document

SHOWN_SPEED = 0.3
"""Speed of the tracking figure [m/s]: the paper's."""

REPLAY = "replay.html"
"""File of the replay in a results folder."""

FIGURES = "figures"
"""Folder of the figures of report.md."""

_CAPTIONS = {
    "errors": "Peak stance error by speed; of the paper's robot beside its Table I.",
    "learning": "Peak stance error while learning; dotted: controllers that do not learn.",
    "tracking": "Calf and thigh of the front left leg before and after the learning is switched on "
    "(the paper's Fig. 3).",
    "torques": "Torque library: the learned feedforward, averaged over the last 30 strides "
    "(the paper's Fig. 4).",
    "surface": "The same torques over speed and phase.",
    "by-world": "Mean peak stance error in each sampled scenario, from the one in which learning "
    "leaves the least of the calf's error to the one with the most.",
    "difference": "What learning adds to the model: learned minus the model's feedforward torque.",
}

_READING = (
    "Errors are peaks of the joint angle's error in stance, from the true contact on, means over "
    f"legs, the last strides (at most {STEADY_STRIDES}, none of the first of a short learning) and "
    "the robots that did not fall; felt peaks are those from when the controller felt the contact. "
    f"Intervals hold {CONFIDENCE:.0%} (t-intervals). The unit "
    "is the sampled scenario, or the seed in one that is not sampled, or, where there are fewer "
    f"than {LEAST_UNITS} of them, the speed, which is chosen and not drawn. Fewer than "
    f"{LEAST_UNITS} of any have no interval. A controller is better or worse than the "
    "model where the interval of the paired difference excludes 0, else the matter is open. Wins, "
    "or the probability of improvement, are the share of the robots whose error is smaller than "
    "the same robot's with the model (Wilson interval). The model is beaten at the first stride "
    "below its level from which on the mean over five strides stays below, in calf and thigh."
)


_AGAIN = 'run_experiment(Results.load(folder).experiment, "again")'
"""How Python makes a result again."""


def write_report(results: Results, *, command: str = "") -> Path:
    """Write report.html, report.md and its figures into the results folder.

    Args:
        results: The results.
        command: The command that makes them again; without one the report says how Python does.

    Returns:
        The path of report.html.

    Raises:
        FileProblem: The summary or the strides are missing or damaged, or it cannot be written.
    """
    document = report(results, command=command)
    path = results.write("report.html", document.to_html())
    folder = results.folder / FIGURES
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    for name, picture in document.pictures().items():
        results.write(f"{FIGURES}/{name}", picture)
    results.write("report.md", document.to_markdown(FIGURES))
    return path


def report(results: Results, *, command: str = "") -> Document:
    """The report as a document, see `write_report`."""
    if results.experiment.commands:
        return _of_commands(results, command)
    summary, scenarios = results.summary(), families(results.experiment.scenario_names)
    document = Document(f"Does practice beat the model? {results.experiment.robot_name.upper()}")
    tables = answer(summary)
    document.text(answer_in_words(summary, tables=tables), "verdict")
    _watch(document, results)
    if len(scenarios) > 1:
        _all_scenarios(document, results, tables)
    if engines := format_between_engines(results):
        document.heading("Engines side by side", "engines")
        document.text(engines, "code")
    for scenario in scenarios:
        _world(document, results, summary, tables[scenario], scenario)
    if results.foreign is not None:
        _foreign_robot(document, results.foreign)
    document.heading("How to read the numbers", "statistics")
    document.text(_READING)
    document.heading("Known limitations", "limits")
    document.bullets(limitations(results))
    _provenance(document, results, command)
    return document


def _of_commands(results: Results, command: str) -> Document:
    """The report of commanded speeds."""
    name = results.experiment.robot_name.upper()
    document = Document(f"Does practice hold while the speed changes? {name}")
    add_commands(document, results)
    if results.foreign is not None:
        _foreign_robot(document, results.foreign)
    document.heading("Known limitations", "limits")
    document.bullets(limitations(results))
    _provenance(document, results, command)
    return document


def _watch(document: Document, results: Results) -> None:
    """Links to what else is in the folder, and a still of the replay that leads to it."""
    there = {
        REPLAY: "watch it: the robots side by side, from just before the learning",
        "summary.csv": "all numbers (summary.csv)",
        "strides": "all strides (NetCDF)",
        FIGURES: "the figures (SVG)",
    }
    found = {
        words: name if "." in name else f"{name}/"
        for name, words in there.items()
        if name == FIGURES or (results.folder / name).exists()  # the figures are about to be
    }
    document.links(found)
    if LEARNER not in results.experiment.controller_names or not _replayed(results):
        return
    scenario = results.experiment.scenario_names[0]
    learned = _learned(results.all_strides(controller=LEARNER, scenario=scenario))
    if not learned.sizes["speed"]:
        return
    speed = _nearest_speed(learned)
    document.picture(
        "still",
        figures.still(learned, results.experiment.model, speed=speed),
        f"Watch it: where the calf is farthest off in a stance, at {speed:g} m/s in {scenario}, "
        f"errors of the angles drawn {figures.SPREAD:g} times as large. The picture leads to the "
        "replay, which begins three strides before the learning.",
        address=f"{REPLAY}#{urlencode({'scenario': scenario, 'speed': f'{speed:g}'})}",
    )


def _replayed(results: Results) -> bool:
    """Whether a replay is in the folder."""
    return (results.folder / REPLAY).exists()


def _nearest_speed(strides: xr.Dataset) -> float:
    """The speed of those of some strides that is nearest to the paper's [m/s]."""
    return float(min(strides["speed"].to_numpy(), key=lambda v: abs(v - SHOWN_SPEED)))


def scenario_figures(results: Results, scenario: str) -> dict[str, Figure]:
    """The report's figures about one scenario, by name.

    Those of what was learned only where `ilc` ran, and a robot that it taught something stayed up.
    """
    controllers = dict.fromkeys(cell.controller for cell in reversed(results.experiment.cells()))
    strides = {
        name: results.all_strides(controller=name, scenario=scenario) for name in controllers
    }
    figures_by_name = {
        "errors": figures.errors_by_speed(results.summary(), scenario=scenario),
        "learning": figures.learning_curves(strides),
    }
    learned = _learned(strides[LEARNER]) if LEARNER in strides else None
    if learned is not None and learned.sizes["speed"]:
        speed = _nearest_speed(learned)
        figures_by_name["tracking"] = figures.tracking(learned, speed=speed, seconds=(1.5, 5.0))
        figures_by_name["torques"] = figures.torque_library(learned)
        if learned.sizes["speed"] > 1:
            figures_by_name["surface"] = figures.torque_surface(learned)
        model = figures.upright_strides(strides["model"]) if "model" in strides else None
        if model is not None and set(model["speed"].values) & set(learned["speed"].values):
            figures_by_name["difference"] = figures.learned_minus_model(learned, model)
    return figures_by_name


def _learned(strides: xr.Dataset) -> xr.Dataset:
    """The strides of the robots that stayed up and learned something."""
    taught = (strides["learning"] == 1) & (strides["skipped"] == 0)
    return figures.upright_strides(strides.isel(speed=np.flatnonzero(taught.any("stride"))))


def write_figures(results: Results, folder: Path) -> list[Path]:
    """Write the figures of the first scenario, and those over all, each as SVG and as PDF.

    Raises:
        FileProblem: The folder cannot be written, or the result is damaged.
    """
    if results.experiment.commands:
        return _written(command_figures(results), folder)
    figures_by_name = scenario_figures(results, results.experiment.scenario_names[0])
    if len(families(results.experiment.scenario_names)) > 1:
        figures_by_name |= {name: figure for name, (figure, _) in _suite_figures(results).items()}
    for world in filter(sampled, families(results.experiment.scenario_names)):
        worlds = results.experiment.scenarios
        table = sampled_scenarios(results.summary(), scenario=world, worlds=worlds)
        figures_by_name[f"{world}-by-world"] = figures.by_scenario(table)
    return _written(figures_by_name, folder)


def _written(figures_by_name: Mapping[str, Figure], folder: Path) -> list[Path]:
    return [
        save_figure(figure, folder / f"{name}.{suffix}")
        for name, figure in figures_by_name.items()
        for suffix in ("svg", "pdf")
    ]


def _all_scenarios(document: Document, results: Results, tables: Mapping[str, Overview]) -> None:
    """What comes out over all scenarios: a row a scenario, the heat map, and the learning."""
    document.heading("All scenarios", "scenarios")
    if any(LEARNER in table for table in tables.values()):
        document.table(
            report_tables.by_scenario(tables),
            caption="Peak error under learning (ILC) beside PD and the model, a row a scenario.",
        )
    for name, (figure, caption) in _suite_figures(results, tables).items():
        document.picture(name, figure, caption)


def _suite_figures(
    results: Results, tables: Mapping[str, Overview] | None = None
) -> dict[str, tuple[Figure, str]]:
    """Figures over all scenarios with their captions."""
    tables = answer(results.summary()) if tables is None else tables
    return {
        "heat-map": (
            figures.heat_map(tables),
            "Mean peak stance error by scenario and controller, in milliradians.",
        ),
        **_knowledge_figure(tables),
        **_learning_figures(results),
        **_condition_figure(results),
    }


def _condition_figure(results: Results) -> dict[str, tuple[Figure, str]]:
    """The conditions that robots estimate, scenario by scenario, with its caption."""
    experiment, found = results.experiment, {}
    for scenario in experiment.scenario_names:
        strides = {
            name: results.all_strides(controller=name, scenario=scenario)
            for name in experiment.controller_names
            if experiment.controller(name).library
        }
        estimating = {name: those for name, those in strides.items() if "conditions" in those}
        if estimating:
            found[scenario] = estimating
    if not found:
        return {}
    caption = (
        "Where robots that begin with a torque library over conditions take themselves to be, from "
        "the torques they need; mean and range over the robots, dashed: where they are."
    )
    return {"conditions": (figures.estimated_conditions(found), caption)}


def _knowledge_figure(tables: Mapping[str, Overview]) -> dict[str, tuple[Figure, str]]:
    """What a model must know to be as good as practice, with its caption."""
    if not figures.shows_knowledge(tables):
        return {}
    caption = (
        "Mean peak error from the contact on over what the model knows, scenario by scenario; "
        "lines: practice, which knows nothing, and practice on gaits planned with the rotors."
    )
    return {"knowledge": (figures.knowledge_ladder(tables), caption)}


def _learning_figures(results: Results) -> dict[str, tuple[Figure, str]]:
    """Learning over its strides in every scenario, with captions."""
    histories: dict[str, list[PeakHistory]] = {}
    for cell in results.experiment.cells():
        history = peak_history(results.strides(cell, VARIABLES))
        histories.setdefault(family(cell.scenario), []).append(history)
    ordered = {name: histories[name] for name in families(results.experiment.scenario_names)}
    return {
        f"learning-{joint}": (
            figures.peak_curves(ordered, joint=joint),
            f"The {joint}'s peak error over the strides of learning, with the levels of PD "
            "and of the model's feedforward; bands from the first to the third quartile.",
        )
        for joint in SHOWN
    }


def _world(
    document: Document, results: Results, summary: pd.DataFrame, table: Overview, scenario: str
) -> None:
    """The section about one scenario; the first one has all figures."""
    scenarios = families(results.experiment.scenario_names)
    drawn = [name for name in results.experiment.scenario_names if family(name) == scenario]
    where = f"{len(drawn)} sampled scenarios" if sampled(scenario) else "scenario"
    document.heading(f'Controllers in the {where} "{scenario}"', scenario)
    if len(scenarios) > 1:
        document.text(verdict(summary, scenario=scenario, table=table))
    if _replayed(results) and len(scenarios) > 1:
        address = f"{REPLAY}#{urlencode({'scenario': drawn[0]})}"
        document.links({f"watch it in {drawn[0]}": address})
    document.table(
        report_tables.errors(table), caption=f"Peak errors in {scenario}, a row a controller."
    )
    document.table(
        report_tables.motion(table, results.experiment),
        caption=f"What else is to be known of the controllers in {scenario}.",
    )
    units = units_of_intervals(table)
    document.text(f"Intervals are drawn over the {units}." if units else "", "note")
    if sampled(scenario):
        _sampled(document, results, summary, scenario)
    if scenario != scenarios[0] or scenario not in results.experiment.scenario_names:
        return
    found = scenario_figures(results, scenario)
    document.picture("errors", found["errors"], _CAPTIONS["errors"])
    document.picture("learning", found["learning"], _CAPTIONS["learning"])
    if len(scenarios) == 1:
        for name, (figure, caption) in _condition_figure(results).items():
            document.picture(name, figure, caption)
    learns = {"pd", LEARNER} <= set(results.experiment.controller_names)
    if learns and of_papers_robot(summary):
        document.heading("Table I, beside the paper's", f"{scenario}-table", level=3)
        _beside(document, beside_the_paper(summary, scenario=scenario), table)
    if LEARNER in results.experiment.controller_names:
        document.heading("Before and after, and what was learned", f"{scenario}-learned", level=3)
        if "tracking" not in found:
            document.text("Nothing to show: no robot stayed up that learning taught something.")
        for name in ("tracking", "torques", "surface", "difference"):
            if name in found:
                document.picture(name, found[name], _CAPTIONS[name])


def _beside(document: Document, beside: pd.DataFrame, table: Overview) -> None:
    """Our errors beside the paper's Table I, and who is missing there."""
    document.text(beside_note(table), "note")
    if beside.empty:
        return
    document.table(
        report_tables.table_1(beside),
        caption="Peak errors of this run beside those of the paper's Table I, a row a speed.",
    )
    document.text(
        f"ILC of this run: `{paper_learner(table)}`. The last row holds means of the peaks, and "
        "the reduction of the mean (the paper prints the mean of its reductions: 75.8 % and "
        "30.8 %).",
        "note",
    )


def _foreign_robot(document: Document, foreign: ForeignRobot) -> None:
    """The parity table: our model beside the robot of the MJCF that was simulated."""
    parity, name = foreign.parity, Path(foreign.path).name
    document.heading(f"The model beside the robot of {name}", "parity")
    judged = [row for row in parity.rows if row.agrees is not None]
    document.text(
        f"Simulated is the robot of `{foreign.path}`, to which the scenarios add. The model, of "
        f"which the gaits and the feedforward torques are made, is {parity.a}. "
        f"{len(parity.differences)} of {len(judged)} values differ by more than "
        f"{parity.tolerance:g} of their size."
    )
    masses = [row for row in parity.rows if row.what == "mass"]
    total = {
        name: f"{sum(m for m in values if isinstance(m, float)):.4f}"
        for name, values in (
            ("model", [row.a for row in masses]),
            ("simulated", [row.b for row in masses]),
        )
    }
    document.table(pd.DataFrame([total], index=["total mass [kg]"]), caption="The masses.")
    if parity.reason:
        document.text(f"M, h and J are not compared: {parity.reason}.")
    else:
        document.table(report_tables.dynamics(parity), caption="The equations of motion.")
    if parity.differences:
        document.text(
            "Links and joints go by the joint that moves them. An inertia is (xx, yy, zz, xy, xz, "
            "yz) about the centre of mass, in the trunk's axes at zero joint angles.",
            "note",
        )
        document.table(
            report_tables.differing(parity.differences), caption="What differs.", wrap=True
        )
    actuators = sorted({str(row.b) for row in parity.rows if row.what == "actuator"} - {"motor"})
    if actuators:
        document.text(
            f"Its actuators ({'; '.join(actuators)}) are played as torque motors.", "note"
        )


def _sampled(document: Document, results: Results, summary: pd.DataFrame, scenario: str) -> None:
    """What the worlds of a family are like, and what comes out in each."""
    table = sampled_scenarios(summary, scenario=scenario, worlds=results.experiment.scenarios)
    document.heading("Scenario by scenario", f"{scenario}-each", level=3)
    document.picture(f"{scenario}-by-world", figures.by_scenario(table), _CAPTIONS["by-world"])
    document.text(
        "What is drawn of each scenario, and the mean peaks in it in milliradians, over the robots "
        "that did not fall; in the order of the figure."
    )
    document.table(report_tables.each_scenario(table), caption="A row a scenario.")
    if len(families(results.experiment.scenario_names)) > 1:
        return  # learning has its figures for all scenarios
    for name, (figure, caption) in _learning_figures(results).items():
        document.picture(name, figure, caption)


def _provenance(document: Document, results: Results, command: str) -> None:
    document.heading("Where these numbers come from", "provenance")
    document.text(
        f"Made again by this {'command' if command else 'code'}, to the bit with the same "
        "versions, the same BLAS kernel and a processor of the same family:"
    )
    lines = [_AGAIN]
    if command:
        lines = textwrap.wrap(command, 96, break_long_words=False, break_on_hyphens=False)
    document.text(" \\\n    ".join(lines), "code")
    document.text(
        "Every number stands in `summary.csv`, every stride in `strides/`, when they were made and "
        "how long it took in `provenance.json`."
    )
    # However often the run was interrupted: each machine, commit and set of versions once.
    made: list[dict[str, str]] = []
    for run in results.provenance["runs"]:
        found = report_tables.provenance(run)
        made += [found] if found not in made else []
    for k, found in enumerate(made, start=1):
        if len(made) > 1:
            document.heading(f"Made with, {k} of {len(made)}", f"run-{k}", level=3)
        document.table(
            pd.DataFrame.from_dict(found, orient="index", columns=[""]),
            caption="What these numbers were made with.",
            left=True,
        )
    seeds = ", ".join(map(str, results.experiment.seeds))
    if results.foreign is not None:
        document.text(
            f"The MJCF is not in this folder; with the files it names it has the SHA-256 "
            f"`{results.foreign.sha256}`."
        )
    document.text(f"Seeds: {seeds}. One stream a seed, the same for every controller.")
