"""The answer in words and as text for a terminal, computed from the numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from ..metrics import (
    CONFIDENCE,
    LEARNER,
    LEAST_UNITS,
    Interval,
    compare_controllers,
    control_arm,
    family,
    in_family,
    sampled,
)
from .cells import number
from .inconclusive import inconclusive, unsaid
from .overview import ControllerOverview, Overview, answer, overview
from .tables import (
    SHOWN,
    sampled_scenarios,
    worst_reduction,
)


def verdict(summary: pd.DataFrame, *, scenario: str, table: Overview | None = None) -> str:
    """The answer for one scenario in words; empty without `pd` and `ilc`.

    Where there is nothing to answer from, it says so, and why.

    Args:
        summary: See `compare.metrics`.
        scenario: The scenario.
        table: Its `overview`, if it is there already.
    """
    table = overview(summary, scenario=scenario) if table is None else table
    if not {"pd", LEARNER} <= set(table):
        return ""
    if reason := inconclusive(summary, scenario=scenario, table=table, against="pd"):
        return _joined(f"Nothing is concluded: {reason}.", _fallen(table), _control_arm(summary))
    learning = table[LEARNER]
    if sampled(scenario):
        return _sampled_verdict(summary, scenario, table)
    less, speeds = _less(learning), in_family(summary, scenario)["speed"].nunique()
    worst = worst_reduction(summary, scenario=scenario, controller=LEARNER)
    settled = (
        f", within {_count(int(learning.settled), 'stride')} at every speed."
        if np.isfinite(learning.settled)
        else "; at some speed it has not settled."
    )
    sentences = [
        f"Learning cuts the mean peak error, from the contact on, by {less} against PD"
        + (
            f" ({worst['calf']:.0%} and {worst['thigh']:.0%} at the worst speed)"
            if speeds > 1
            else ""
        )
        + settled
    ]
    if reason := _no_rival(summary, scenario, table):
        sentences.append(reason)
    elif "model" in table:
        sentences.append(_against_the_model(learning, table["model"]))
    sentences += _with_the_rotors(summary, scenario, table)
    return _joined(*sentences, _growing(table), _fallen(table), _control_arm(summary))


def _less(learning: ControllerOverview) -> str:
    """Reduction of the mean peaks against PD."""
    parts = (f"{_percent(learning.joints[joint].reduction)} in the {joint}" for joint in SHOWN)
    return " and ".join(parts)


def _no_rival(summary: pd.DataFrame, scenario: str, table: Overview) -> str:
    """Why nothing is concluded against the model; empty where something is, or it was not run."""
    if "model" not in table:
        return ""
    reason = inconclusive(summary, scenario=scenario, table=table, against="model")
    return f"Against the model's feedforward nothing is concluded: {reason}." if reason else ""


def _sampled_verdict(summary: pd.DataFrame, scenario: str, table: Overview) -> str:
    """The answer for a family of sampled scenarios, each of which counts once."""
    learning, drawn = table[LEARNER], in_family(summary, scenario)
    scenarios, speeds = drawn["scenario"].nunique(), drawn["speed"].nunique()
    worst = worst_reduction(summary, scenario=scenario, controller=LEARNER)
    less = _less(learning)
    sentences = [
        f"In {scenarios} sampled scenarios, at {_count(speeds, 'speed')} in each, learning cuts "
        f"the mean peak error by {less} against PD ({worst['calf']:.0%} and {worst['thigh']:.0%} "
        "for the worst robot)."
    ]
    if reason := _no_rival(summary, scenario, table):
        sentences.append(reason)
    elif "model" in table:
        sentences += _against_the_model_by_scenario(summary, scenario, table)
    return _joined(*sentences, _fallen(table), _control_arm(summary))


def _against_the_model_by_scenario(
    summary: pd.DataFrame, scenario: str, table: Overview
) -> Iterator[str]:
    learning, model = table[LEARNER], table["model"]
    by_scenario = sampled_scenarios(summary, scenario=scenario)
    better = [learning.joints[joint].better for joint in SHOWN]
    if all(better):
        yield "It beats the model's feedforward in calf and thigh beyond doubt."
    else:
        said = {True: "beats", None: "cannot be told from", False: "does worse than"}
        parts = [
            f"{said[which]} the model's feedforward in the {joint}"
            for joint, which in zip(SHOWN, better, strict=True)
        ]
        yield f"It {' and '.join(parts)}."
    for joint in SHOWN:
        own = learning.joints[joint]
        change, low, high = (1e3 * end for end in own.difference)
        both = by_scenario[joint][[LEARNER, "model"]].dropna()
        ahead = int((both[LEARNER] < both["model"]).sum())
        yield (
            f"The {joint}'s mean peak is {1e3 * own.peak.value:.1f} against "
            f"{1e3 * model.joints[joint].peak.value:.1f} mrad, by paired differences "
            f"{change:+.1f} mrad ({low:+.1f} "
            f"to {high:+.1f}); it is less in {ahead} of {_count(len(both), 'scenario')}, and the "
            f"probability that a robot improves is {_percent(own.wins)}."
        )
    beat = learning.beat
    if beat.robots:
        yield (
            f"{beat.robots} of {beat.learners} robots come to beat the model "
            f"in both joints and stay there, after {beat.strides:.0f} strides in the median."
        )


def _against_the_model(learning: ControllerOverview, model: ControllerOverview) -> str:
    said = {
        "beats the model's feedforward": _where(learning, True),
        "does worse than it": _where(learning, False),
        "cannot be told from it": _where(learning, None),
    }
    numbers = ", ".join(
        f"{learning.joints[joint].peak.value:.4f} against {model.joints[joint].peak.value:.4f} rad "
        f"in the {joint}"
        for joint in SHOWN
    )
    if not any(learning.joints[joint].difference.known for joint in SHOWN):
        text = (
            "Whether it beats the model's feedforward stays open, as an interval of the difference "
            f"takes {LEAST_UNITS} robots: {numbers}."
        )
    else:
        parts = [what + where for what, where in said.items() if where is not None]
        text = f"It {' and '.join(parts)}: {numbers}."
    beat = learning.beat
    if beat.robots:
        text += (
            f" Robot by robot, {beat.robots} of {beat.learners} come to beat it in both joints, "
            f"after {beat.strides:.0f} strides in the median."
        )
    return text


def _where(learning: ControllerOverview, better: bool | None) -> str | None:
    """In which joints practice is better than the model, worse (False), or neither (None)."""
    found = [joint for joint in SHOWN if learning.joints[joint].better is better]
    chance = " (the difference may be chance)" if better is None else ""
    return f" in the {' and '.join(found)}{chance}" if found else None


def _with_the_rotors(summary: pd.DataFrame, scenario: str, table: Overview) -> Iterator[str]:
    """Practice against the model that knows the rotors, on the URDF's gait and on the model's."""
    rival, said = "model+rotors", {True: "beats", None: "cannot be told from", False: "loses to"}
    for learner, what in ((LEARNER, "Practice"), ("ilc+rotors", "On that model's gaits practice")):
        if not {learner, rival} <= set(table):
            continue
        found = {
            joint: compare_controllers(
                summary, scenario=scenario, controller=learner, against=rival, joint=joint
            )
            for joint in SHOWN
        }
        parts = [
            f"{said[found[joint].better]} it in the {joint} "
            f"({number(table[learner].joints[joint].peak.value, '.4f')} against "
            f"{number(table[rival].joints[joint].peak.value, '.4f')} rad)"
            for joint in SHOWN
            if found[joint].pairs
        ]
        if parts and what == "Practice":
            yield (
                "Against the model that knows the rotors, with gaits planned for them: practice "
                f"{' and '.join(parts)}."
            )
        elif parts:
            yield f"{what} {' and '.join(parts)}."


def _growing(table: Overview) -> str:
    """Whose errors grow while they learn; empty where nobody's do."""
    found = [f"{row.diverging} under {name}" for name, row in table.items() if row.diverging]
    return (
        f"Robots whose errors grow again as they learn (diverging): {', '.join(found)}."
        if (found)
        else ""
    )


def _fallen(table: Overview) -> str:
    fallen, robots = sum(row.fell for row in table.values()), sum(r.robots for r in table.values())
    idle = robots - fallen - sum(row.upright for row in table.values())
    if fallen == robots:
        return f"All {_count(robots, 'robot')} fell."
    counted = {0: "No robot", 1: "One robot"}
    text = f"{counted.get(fallen, f'{fallen} robots')} fell."
    return text + (f" {counted.get(idle, f'{idle} robots')} finished no stride." if idle else "")


def _control_arm(summary: pd.DataFrame) -> str:
    """What learning with gain 0 shows; empty if it was not run."""
    largest = control_arm(summary)
    if largest is None:
        return ""
    if largest == 0.0:
        return "The control arm, learning with gain 0, shows nothing: every peak error is PD's."
    return (
        "The control arm, which learns with gain 0 and times its flights, differs from PD by up to "
        f"{largest:.2g} rad: what learning shows is not to be trusted beyond that."
    )


def suite_verdict(summary: pd.DataFrame, *, tables: Mapping[str, Overview] | None = None) -> str:
    """The answer for all scenarios in words; empty without `pd`, `ilc` and `model`.

    Args:
        summary: See `compare.metrics`.
        tables: Its `answer`, if it is there already.
    """
    tables = answer(summary) if tables is None else tables
    if not {"pd", LEARNER, "model"} <= {name for table in tables.values() for name in table}:
        return ""
    learning = {world: table[LEARNER] for world, table in tables.items() if LEARNER in table}
    reasons = {
        world: inconclusive(summary, scenario=world, table=tables[world], against="model")
        for world in learning
    }
    told = {world: row for world, row in learning.items() if not reasons[world]}
    sentences = [
        f"Does practice beat the model? In {_count(len(learning), 'scenario')}, against the "
        f"model's feedforward, by {CONFIDENCE:.0%} intervals of the paired difference:"
    ]
    sentences += _where_it_beats_the_model(told) if told else []
    sentences += [
        f"In {world} nothing is concluded: {reason}." for world, reason in reasons.items() if reason
    ]
    sentences += _range_against_pd(told)
    growing = {scenario: _growing(table) for scenario, table in tables.items()}
    grown = [f"In {scenario}: {text}" for scenario, text in growing.items() if text]
    return _joined(*sentences, *grown, _where_robots_fell(tables), _control_arm(summary))


def _where_it_beats_the_model(learning: Overview) -> Iterator[str]:
    """What learning does in those worlds that tell, by world."""
    for joint in SHOWN:
        better, worse, open_ = (
            [world for world, row in learning.items() if row.joints[joint].better is which]
            for which in (True, False, None)
        )
        parts = [f"In the {joint} it is better in {len(better)} of {len(learning)}"]
        parts += [f"worse in {', '.join(worse)}"] if worse else []
        parts += [f"open in {', '.join(open_)}"] if open_ else []
        yield "; ".join(parts) + "."
    beat = sum(row.beat.robots for row in learning.values())
    learners = sum(row.beat.learners for row in learning.values())
    strides = [row.beat.strides for row in learning.values() if row.beat.robots]
    yield (
        f"{beat} of {learners} robots come to beat it in both joints and stay there"
        + (f", the scenarios' median is {np.median(strides):.0f} strides." if beat else ".")
    )


def _range_against_pd(learning: Overview) -> Iterator[str]:
    """The least and the greatest reduction against PD, and in which scenarios."""
    for joint in SHOWN:
        found = {world: row.joints[joint].reduction for world, row in learning.items()}
        found = {world: less for world, less in found.items() if np.isfinite(less.value)}
        if not found:
            continue
        best, least = (end(found, key=lambda world: found[world].value) for end in (max, min))
        yield (
            f"Against PD the {joint}'s mean peak is less by {_percent(found[least])} in {least}"
            + (f" to {_percent(found[best])} in {best}." if len(found) > 1 else ".")
        )


def _where_robots_fell(tables: Mapping[str, Overview]) -> str:
    places = [
        f"{row.fell} of {row.robots} in {scenario} under {controller}"
        for scenario, table in tables.items()
        for controller, row in table.items()
        if row.fell
    ]
    return f"Robots fell: {', '.join(places)}." if places else "No robot fell."


def _joined(*sentences: str) -> str:
    return " ".join(sentence for sentence in sentences if sentence)


def answer_in_words(summary: pd.DataFrame, *, tables: Mapping[str, Overview] | None = None) -> str:
    """The verdict over one scenario or all of them, or why the experiment cannot have one.

    Args:
        summary: See `compare.metrics`.
        tables: Its `answer`, if it is there already.
    """
    tables = answer(summary) if tables is None else tables
    if len(tables) > 1:
        said = suite_verdict(summary, tables=tables)
    else:
        ((scenario, table),) = tables.items()
        said = verdict(summary, scenario=scenario, table=table)
    return said or _joined(unsaid(tables), _where_robots_fell(tables))


def _percent(share: Interval) -> str:
    ends = f" ({100 * share.low:.0f} to {share.high:.0%})" if share.known else ""
    return f"{share.value:.0%}{ends}"


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}" + ("s" if n != 1 else "")


def families(scenarios: Sequence[str]) -> list[str]:
    """The worlds of an experiment, sampled ones as one family each."""
    return list(dict.fromkeys(map(family, scenarios)))
