"""What a result does not show: its known limitations, computed from what was run."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from ...control import SKIPPED
from ..metrics import (
    CONFIDENCE,
    LEAST_UNITS,
    family,
    of_papers_robot,
    robots,
    sampled,
    table_1,
    unit_of,
)
from ..results import Results
from ..world import Sensors
from .tables import SHOWN

_STEADY_APEX = 0.004
"""Standard deviation of the apex from which on a motion is not called steady [m]."""


def limitations(results: Results) -> list[str]:
    """Sentences, each about one limitation."""
    summary = results.summary()
    if results.experiment.commands:
        about = (_of_the_robot(results), _of_the_driving(results), _of_the_record(results))
        return [text for sentences in about for text in sentences if text]
    sentences = [
        *_of_the_robot(results),
        *_of_the_sample(results, summary),
        *_of_the_metrics(summary),
        *_of_the_learning(results, summary),
        *_of_the_motion(summary),
        *_of_the_record(results),
    ]
    return [text for text in sentences if text]


def _of_the_robot(results: Results) -> Iterator[str]:
    experiment, names = results.experiment, results.experiment.controller_names
    if experiment.base == "locked":
        yield "The trunk is locked to the sagittal plane without rotation, as in the paper."
    else:
        with_true_attitude = [name for name in names if not experiment.controller(name).imu]
        if with_true_attitude:
            listed = _listed(with_true_attitude)
            yield f"Under {listed} the robots know the true attitude of their trunks."
    learners = [name for name in names if any(experiment.controller(name).laws)]
    stance_only = [name for name in learners if experiment.controller(name).flight_law is None]
    if stance_only:
        yield (
            f"{_listed(stance_only)} learn{'s' if len(stance_only) == 1 else ''} in stance only: "
            "what is left of the error is mostly the touchdown transient, which comes from flight."
        )
    if results.experiment.mjcf:
        yield (
            f"The simulated robot is that of {Path(results.experiment.mjcf).name}, and the gaits "
            "are planned with our model: errors hold what the two have otherwise."
        )
    yield (
        "Simulation only. The true world is MuJoCo's, with a compliant ground; its contacts are "
        "not those of a laboratory floor."
    )


def _of_the_driving(results: Results) -> Iterator[str]:
    experiment = results.experiment
    yield (
        "Strides of the first two seconds, at most half of a command, do not count. Gaits between "
        "those of the library obey the equations of motion only nearly."
    )
    if any(cell.practice for cell in experiment.cells()):
        speeds = ", ".join(f"{speed:g}" for speed in experiment.speeds)
        yield f"What the library holds was learned at {speeds} m/s, and is linear in between."
    learners = [
        name for name in experiment.controller_names if any(experiment.controller(name).laws)
    ]
    if learners:
        yield f"{_listed(learners)} learned on all the time, without a guard."


def _of_the_sample(results: Results, summary: pd.DataFrame) -> Iterator[str]:
    scenarios, seeds = results.experiment.scenario_names, results.experiment.seeds
    first = summary["controller"].iloc[0]
    families = {family(scenario) for scenario in scenarios}
    cells = itertools.product(sorted(families), summary["controller"].unique(), SHOWN)
    means = sum(np.isfinite(_mean_of(summary, *cell)) for cell in cells)
    if not means:
        yield "No robot stayed up: there is no mean error, and no interval, in this result."
        return
    units = {unit_of(robots(summary, scenario=name, controller=first)) for name in families}
    if units == {"speed"} and len(results.experiment.speeds) > 1:
        count = "One seed" if len(seeds) == 1 else f"{len(seeds)} seeds"
        yield (
            f"{count}: fewer than {LEAST_UNITS} are no sample, so intervals are over the "
            f"{len(results.experiment.speeds)} speeds, which are chosen and not drawn"
            + (
                ". They say how the mean would scatter over speeds and starting postures like "
                "these, not over other scenarios."
                if len(results.experiment.speeds) >= LEAST_UNITS
                else f"; and there are none, since fewer than {LEAST_UNITS} make no interval."
            )
        )
    if any(map(sampled, scenarios)):
        yield (
            "The sampled scenarios are drawn from ranges that we have chosen (docs/worlds.md has "
            "them): intervals over them speak of worlds like these, at the speeds "
            f"{', '.join(f'{speed:g}' for speed in results.experiment.speeds)} m/s."
        )
    if len(seeds) > 1 and (silent := [name for name in scenarios if not _random(results, name)]):
        yield (
            f"In {_listed(silent)} seeds differ in the starting posture alone, which a steady gait "
            "forgets: they are one run, not a sample. The scenario `rough` is for seeds."
        )
    yield (
        f"Each interval holds its value with {CONFIDENCE:.0%}; of the {means} mean errors here, "
        f"about {(1 - CONFIDENCE) * means:.0f} intervals miss theirs by chance."
    )


def _random(results: Results, scenario: str) -> bool:
    """Whether anything in a scenario depends on the seed, but for the start."""
    world = results.experiment.scenario(scenario)
    uneven = world.ground_roughness > 0.0 or world.step_height > 0.0
    return uneven or world.touchdown_jitter > 0.0 or world.sensors != Sensors()


def _mean_of(
    summary: pd.DataFrame, scenario: str, controller: str, joint: str, metric: str = "peak_error"
) -> float:
    """Mean over the robots that did not fall; NaN without one."""
    found = robots(summary, scenario=scenario, controller=controller, metric=metric, joint=joint)
    return float(found.stack().mean())


def _of_the_metrics(summary: pd.DataFrame) -> Iterator[str]:
    def mean(metric: str, controller: str, joint: str) -> float:
        first = family(summary["scenario"].iloc[0])
        return _mean_of(summary, first, controller, joint, metric)

    shown = {
        name
        for name in summary["controller"].unique()
        if all(np.isfinite(mean("felt_peak_error", name, joint)) for joint in SHOWN)
    }
    yield (
        "Peaks are against the unmodified reference, means over the legs and the last 30 strides; "
        "the paper does not say how its peaks are taken (`pronk-pin reproduce` tries them)."
    )
    later = [name for name in ("pd", "model", "ilc") if name in shown]
    if later:
        numbers = "; ".join(
            f"{name} "
            + ", ".join(
                f"{mean('felt_peak_error', name, joint):.4f} rad {joint}" for joint in SHOWN
            )
            for name in later
        )
        yield (
            "Errors count from the true contact on, which no controller knows. Counted from when "
            f"it is felt, as a controller sees it, the mean peaks are: {numbers}."
        )
    if "pd" in shown and of_papers_robot(summary):
        printed = table_1()
        printed = printed[(printed["controller"] == "pd") & (printed["joint"] == "thigh")]
        ratio = mean("peak_error", "pd", "thigh") / float(printed["value"].mean())
        yield (
            f"Thigh errors under PD are {ratio:.1f} times the paper's: its gaits and its simulator "
            "are not published."
        )
    if (summary["metric"] == "cost_of_transport").any():
        yield (
            "Cost of transport is mechanical: positive work of the motors over the weight of the "
            "robot without its load; losses in the windings are not in it."
        )


def _of_the_learning(results: Results, summary: pd.DataFrame) -> Iterator[str]:
    settled = summary[(summary["metric"] == "strides_to_converge") & (summary["joint"] == "-")]
    for controller, rows in settled[settled["value"].isna()].groupby("controller"):
        of = int((settled["controller"] == controller).sum())
        places = ", ".join(f"{n} in {name}" for name, n in rows["scenario"].value_counts().items())
        yield f"{len(rows)} of {of} robots under {controller} have not settled: {places}."
    for cell in results.experiment.cells():
        if not any(cell.spec.laws):
            continue
        strides = results.strides(cell, ["skipped", "learning"])
        reasons = strides["skipped"].to_numpy()[strides["learning"].to_numpy() == 1]
        skipped = reasons[reasons > 0].astype(int)
        if skipped.size:
            counts = ", ".join(
                f"{np.count_nonzero(skipped == k)} {SKIPPED[k]}" for k in np.unique(skipped)
            )
            yield (
                f"{cell.controller} in {cell.scenario}, seed {cell.seed}: nothing was learned from "
                f"{skipped.size} of {reasons.size} strides ({counts})."
            )


def _of_the_motion(summary: pd.DataFrame) -> Iterator[str]:
    fallen = summary[(summary["metric"] == "upright") & (summary["value"] == 0.0)]
    for (scenario, controller), rows in fallen.groupby(["scenario", "controller"]):
        speeds = ", ".join(f"{speed:g}" for speed in sorted(set(rows["speed"])))
        yield (
            f"In {scenario} under {controller} {_robots(len(rows))} fell ({speeds} m/s): the "
            "errors of those that fell are not in the means."
        )
    idle = summary[(summary["metric"] == "upright") & summary["value"].isna()]
    for (scenario, controller), rows in idle.groupby(["scenario", "controller"]):
        yield f"In {scenario} under {controller} {_robots(len(rows))} finished no stride."
    keys = ["scenario", "controller", "speed", "seed"]
    fell = pd.MultiIndex.from_frame(fallen[keys])
    apex = summary[(summary["metric"] == "apex_deviation") & (summary["value"] > _STEADY_APEX)]
    apex = apex[~pd.MultiIndex.from_frame(apex[keys]).isin(fell)]
    for (scenario, controller), rows in apex.groupby(["scenario", "controller"]):
        yield (
            f"In {scenario} under {controller} the apex of {_robots(len(rows))} still varies by "
            f"more than {1e3 * _STEADY_APEX:.0f} mm (s.d.) from stride to stride."
        )


def _of_the_record(results: Results) -> Iterator[str]:
    runs = results.provenance["runs"]
    if not results.provenance["finished"]:
        yield "The run is not on record as finished."
    if any((run.get("git") or "").endswith("changed") for run in runs):
        yield "It was made from a source that differs from the commit named below."


def _robots(count: int) -> str:
    return f"{count} robot" + ("s" if count != 1 else "")


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
