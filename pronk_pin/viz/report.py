"""The report: tables, figures and provenance in one self-contained HTML file."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Template
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from ..compare import Results
from ..compare.tables import SHOWN, beside_the_paper, overview
from ..compare.words import verdict
from ..errors import cannot_write
from . import figures
from .style import figure_bytes, save_figure

SHOWN_SPEED = 0.3
"""Speed of the tracking figure [m/s]: the paper's."""

LEARNER = "ilc"
"""Controller whose learning the figures show."""

_CAPTIONS = {
    "errors": "Peak stance error by speed, beside the paper's Table I.",
    "learning": "Peak stance error while learning; dotted: controllers that do not learn.",
    "tracking": "Calf and thigh of the front left leg before and after the learning is switched on "
    "(the paper's Fig. 3).",
    "torques": "Torque library: the learned feedforward, averaged over the last 30 strides "
    "(the paper's Fig. 4).",
    "surface": "The same torques over speed and phase.",
    "difference": "What practice adds to the model: learned minus the model's feedforward torque.",
}

_LIMITS = (
    "The trunk is locked to the sagittal plane without rotation, as in the paper.",
    "Learning acts in stance only; what is left of the error is the touchdown transient, which "
    "comes from tracking in flight.",
    "Peaks are against the unmodified reference, as means over the legs and the last 30 strides; "
    "the paper does not say how its peaks are taken.",
    "Errors count from when the touchdown is felt; the metric contact_error in summary.csv counts "
    "from the contact itself, one to two ticks earlier.",
    "One seed stands for one scatter of the starting posture; there are no intervals.",
)

_PAGE = Template("""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>$title</title><style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem;
  color: #222; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13px; }
th, td { padding: .15rem .6rem; text-align: right; } thead th { border-bottom: 1px solid #888; }
tr:last-child td, tr:last-child th { border-bottom: 1px solid #888; }
.verdict { background: #eef4fa; border-left: 4px solid #0072B2; padding: .6rem 1rem; }
figure { margin: 1rem 0; } img { max-width: 100%; }
figcaption, .note { color: #555; font-size: 13px; }
code { background: #f2f2f2; padding: 0 .25rem; }
</style></head><body>
<h1>$title</h1>
<p class="verdict">$verdict</p>
$body
<h2 id="limits">Known limitations</h2><ul>$limits</ul>
<h2 id="provenance">Where these numbers come from</h2>
<p>Made again by <code>$command</code>. Every number stands in <code>summary.csv</code>,
every stride in <code>strides/</code>.</p>
$provenance
</body></html>
""")


def write_report(results: Results) -> Path:
    """Write report.html into the results folder.

    Raises:
        FileProblem: The summary or the strides are missing or damaged, or it cannot be written.
    """
    path = results.folder / "report.html"
    text = report_html(results)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise cannot_write(path, error) from error
    return path


def report_html(results: Results) -> str:
    """The report as one HTML page without references to anything outside it."""
    summary = results.summary()
    sections = [
        section
        for scenario in results.experiment.scenarios
        for section in _scenario(results, summary, scenario)
    ]
    first = results.experiment.scenarios[0]
    return _PAGE.substitute(
        title=f"Does practice beat the model? {results.experiment.robot.upper()}, pronking",
        verdict=html.escape(verdict(summary, scenario=first)),
        body="\n".join(sections),
        limits="".join(f"<li>{html.escape(text)}</li>" for text in _LIMITS),
        command=html.escape(command(results)),
        provenance=_provenance(results.provenance),
    )


def command(results: Results) -> str:
    """The command that makes this result again."""
    experiment = results.experiment
    words = ["pronk-pin compare", f"--robot {experiment.robot}"]
    words += ["--speeds " + " ".join(f"{speed:g}" for speed in experiment.speeds)]
    words += ["--controllers " + " ".join(experiment.controllers)]
    words += ["--scenarios " + " ".join(experiment.scenarios)]
    words += ["--seeds " + " ".join(map(str, experiment.seeds))]
    schedule = experiment.schedule
    words += [
        f"--schedule.practice {schedule.practice:g} --schedule.learning {schedule.learning:g}"
    ]
    return " ".join(words)


def scenario_figures(results: Results, scenario: str) -> dict[str, Figure]:
    """The report's figures about one scenario, by name; those of learning only where `ilc` ran."""
    cells = [cell for cell in results.experiment.cells() if cell.scenario == scenario]
    strides = {cell.controller: results.strides(cell) for cell in reversed(cells)}
    found = {
        "errors": figures.errors_by_speed(results.summary(), scenario=scenario),
        "learning": figures.learning_curves(strides),
    }
    if LEARNER in strides:
        speed = min(results.experiment.speeds, key=lambda v: abs(v - SHOWN_SPEED))
        learned = strides[LEARNER]
        found["tracking"] = figures.tracking(learned, speed=speed, seconds=(1.5, 5.0))
        found["torques"] = figures.torque_library(learned)
        found["surface"] = figures.torque_surface(learned)
        if "model" in strides:
            found["difference"] = figures.learned_minus_model(learned, strides["model"])
    return found


def write_figures(results: Results, folder: Path) -> list[Path]:
    """Write the figures of the first scenario into a folder, each as SVG and as PDF.

    Raises:
        FileProblem: The folder cannot be written, or the result is damaged.
    """
    found = scenario_figures(results, results.experiment.scenarios[0])
    return [
        save_figure(figure, folder / f"{name}.{suffix}")
        for name, figure in found.items()
        for suffix in ("svg", "pdf")
    ]


def _scenario(results: Results, summary: pd.DataFrame, scenario: str) -> Iterator[str]:
    """The sections about one scenario."""
    found = scenario_figures(results, scenario)
    yield f'<h2 id="{scenario}">Controllers in the scenario "{html.escape(scenario)}"</h2>'
    yield _overview(overview(summary, scenario=scenario))
    yield _figure(found, "errors")
    yield _figure(found, "learning")
    if {"pd", LEARNER} <= set(results.experiment.controllers):
        yield f'<h2 id="{scenario}-table">Table I, beside the paper\'s</h2>'
        yield _table_1(beside_the_paper(summary, scenario=scenario))
    if "tracking" in found:
        yield f'<h2 id="{scenario}-learned">Before and after, and what was learned</h2>'
        yield _figure(found, "tracking")
        for name in ("torques", "surface", "difference"):
            if name in found:
                yield _figure(found, name)


def _overview(table: pd.DataFrame) -> str:
    shown = pd.DataFrame(index=[figures.LABELS.get(name, name) for name in table.index])
    for joint in SHOWN:
        shown[f"{joint} peak [rad]"] = [f"{value:.4f}" for value in table[joint]]
        if f"{joint}_reduction" in table:
            shown[f"{joint} less than PD"] = [f"{x:.0%}" for x in table[f"{joint}_reduction"]]
        shown[f"{joint} RMS [rad]"] = [f"{value:.4f}" for value in table[f"{joint}_rms"]]
    shown["strides to converge"] = [_count(value) for value in table["strides"]]
    shown["feedback's share"] = [f"{value:.0%}" for value in table["feedback"]]
    shown["speed error [m/s]"] = [f"{value:.3f}" for value in table["speed_error"]]
    shown["apex error [mm]"] = [f"{1e3 * value:.1f}" for value in table["apex_error"]]
    counts = zip(table["upright"], table["robots"], strict=True)
    shown["upright"] = [f"{up:.0f} of {robots:.0f}" for up, robots in counts]
    return str(shown.to_html(border=0))


def _table_1(table: pd.DataFrame) -> str:
    shown = table.copy().astype(object)
    for column in table.columns:
        form = "{:.0%}" if column[2] == "reduction" else "{:.3f}"
        shown[column] = [form.format(v) if pd.notna(v) else "" for v in table[column]]
    names = {"ours": "this run", "paper": "paper"}
    shown.columns = pd.MultiIndex.from_tuples(
        [(f"{joint} [rad]", names[source], name) for joint, source, name in shown.columns]
    )
    shown.index = pd.Index([s if isinstance(s, str) else f"{s:g}" for s in table.index])
    note = (
        '<p class="note">The last row holds the means of the peaks, and the reduction of the mean '
        "(the paper prints the mean of its reductions: 75.8 % and 30.8 %).</p>"
    )
    return str(shown.to_html(border=0)) + note


def _provenance(provenance: Any) -> str:
    rows = {}
    for run in provenance["runs"]:
        rows = {
            "versions": ", ".join(f"{k} {v}" for k, v in run["versions"].items()),
            "Python": run["python"],
            "system": run["platform"],
            "CPU": f"{run['cpu']} ({run['cores']} cores)",
            "wall time": f"{run.get('wall_time_s', float('nan')):g} s",
        }
    cells = "".join(
        f"<tr><th>{html.escape(k)}</th><td style='text-align:left'>{html.escape(str(v))}</td></tr>"
        for k, v in rows.items()
    )
    return f"<table>{cells}</table>"


def _figure(found: Mapping[str, Figure], name: str) -> str:
    """A figure as an inline SVG picture with its caption."""
    data, text = (
        base64.b64encode(figure_bytes(found[name], "svg")).decode(),
        html.escape(_CAPTIONS[name]),
    )
    return (
        f'<figure><img alt="{text}" src="data:image/svg+xml;base64,{data}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def _count(value: float) -> str:
    return f"{value:.0f}" if pd.notna(value) else "-"
