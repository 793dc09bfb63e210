"""The answer in words and as text for a terminal, computed from the numbers."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from ..metrics import CONFIDENCE, LEARNER, control_arm, family, in_family
from .inconclusive import inconclusive, unsaid
from .tables import SHOWN, answer, beside_the_paper, overview, sampled_scenarios, worst_reduction

_WIDTH = 100


def verdict(summary: pd.DataFrame, *, scenario: str, table: pd.DataFrame | None = None) -> str:
    """The answer for one scenario in words; empty without `pd` and `ilc`.

    Where there is nothing to answer from, it says so, and why.

    Args:
        summary: See `compare.metrics`.
        scenario: The scenario.
        table: Its `overview`, if it is there already.
    """
    table = overview(summary, scenario=scenario) if table is None else table
    if not {"pd", LEARNER} <= set(table.index):
        return ""
    if reason := inconclusive(summary, scenario=scenario, table=table, against="pd"):
        return _joined(f"Nothing is concluded: {reason}.", _fallen(table), _control_arm(summary))
    learning = table.loc[LEARNER]
    if learning["unit"] == "scenario":
        return _sampled_verdict(summary, scenario, table)
    worst = worst_reduction(summary, scenario=scenario, controller=LEARNER)
    less = " and ".join(
        f"{_percent(learning, f'{joint}_reduction')} in the {joint}" for joint in SHOWN
    )
    settled = (
        f", within {_count(int(learning['strides']), 'stride')} at every speed."
        if np.isfinite(learning["strides"])
        else "; at some speed it has not settled."
    )
    sentences = [
        f"Learning cuts the mean peak error by {less} against PD ({worst['calf']:.0%} and "
        f"{worst['thigh']:.0%} at the worst speed){settled}"
    ]
    if reason := _no_rival(summary, scenario, table):
        sentences.append(reason)
    elif "model" in table.index:
        sentences.append(_against_the_model(learning, table.loc["model"]))
    return _joined(*sentences, _fallen(table), _control_arm(summary))


def _no_rival(summary: pd.DataFrame, scenario: str, table: pd.DataFrame) -> str:
    """Why nothing is concluded against the model; empty where something is, or it was not run."""
    if "model" not in table.index:
        return ""
    reason = inconclusive(summary, scenario=scenario, table=table, against="model")
    return f"Against the model's feedforward nothing is concluded: {reason}." if reason else ""


def _sampled_verdict(summary: pd.DataFrame, scenario: str, table: pd.DataFrame) -> str:
    """The answer for a family of sampled scenarios, each of which counts once."""
    learning, drawn = table.loc[LEARNER], in_family(summary, scenario)
    scenarios, speeds = drawn["scenario"].nunique(), drawn["speed"].nunique()
    worst = worst_reduction(summary, scenario=scenario, controller=LEARNER)
    less = " and ".join(
        f"{_percent(learning, f'{joint}_reduction')} in the {joint}" for joint in SHOWN
    )
    sentences = [
        f"In {scenarios} sampled scenarios, at {_count(speeds, 'speed')} in each, learning cuts "
        f"the mean peak error by {less} against PD ({worst['calf']:.0%} and {worst['thigh']:.0%} "
        "for the worst robot)."
    ]
    if reason := _no_rival(summary, scenario, table):
        sentences.append(reason)
    elif "model" in table.index:
        sentences += _against_the_model_by_scenario(summary, scenario, table)
    return _joined(*sentences, _fallen(table), _control_arm(summary))


def _against_the_model_by_scenario(
    summary: pd.DataFrame, scenario: str, table: pd.DataFrame
) -> Iterator[str]:
    learning, model = table.loc[LEARNER], table.loc["model"]
    by_scenario = sampled_scenarios(summary, scenario=scenario)
    signs = [int(learning[f"{joint}_model"]) for joint in SHOWN]
    if set(signs) == {1}:
        yield "It beats the model's feedforward in calf and thigh beyond doubt."
    else:
        said = {1: "beats", 0: "cannot be told from", -1: "does worse than"}
        parts = [
            f"{said[s]} the model's feedforward in the {j}"
            for j, s in zip(SHOWN, signs, strict=True)
        ]
        yield f"It {' and '.join(parts)}."
    for joint in SHOWN:
        change, low, high = (
            1e3 * learning[f"{joint}_difference{end}"] for end in ("", "_low", "_high")
        )
        both = by_scenario[joint][[LEARNER, "model"]].dropna()
        ahead = int((both[LEARNER] < both["model"]).sum())
        yield (
            f"The {joint}'s mean peak is {1e3 * learning[joint]:.1f} against "
            f"{1e3 * model[joint]:.1f} mrad, by paired differences {change:+.1f} mrad ({low:+.1f} "
            f"to {high:+.1f}); it is less in {ahead} of {_count(len(both), 'scenario')}, and the "
            f"probability that a robot improves is {_percent(learning, f'{joint}_wins')}."
        )
    if learning["beat"] > 0:
        yield (
            f"{learning['beat']:.0f} of {learning['learners']:.0f} robots come to beat the model "
            "in both joints and stay there, after "
            f"{learning['beat_strides']:.0f} strides in the median."
        )


def _against_the_model(learning: pd.Series, model: pd.Series) -> str:
    wins = [joint for joint in SHOWN if learning[f"{joint}_model"] > 0]
    open_ = [joint for joint in SHOWN if learning[f"{joint}_model"] == 0]
    beats = "beats" if wins else "does not beat"
    where = f" in the {wins[0]} only" if len(wins) == 1 else ""
    doubt = f" (in the {' and '.join(open_)} the difference may be chance)" if open_ else ""
    numbers = ", ".join(
        f"{learning[joint]:.4f} against {model[joint]:.4f} rad in the {joint}" for joint in SHOWN
    )
    text = f"It {beats} the model's feedforward{where}{doubt}: {numbers}."
    if learning["beat"] > 0:
        text += (
            f" {learning['beat']:.0f} of {learning['learners']:.0f} robots beat it in both joints, "
            f"after {learning['beat_strides']:.0f} strides in the median."
        )
    return text


def _fallen(table: pd.DataFrame) -> str:
    fallen, robots = int(table["fell"].sum()), int(table["robots"].sum())
    idle = robots - fallen - int(table["upright"].sum())
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
        return "The control arm, learning with gain 0, shows nothing: every number is PD's."
    return (
        f"The control arm, learning with gain 0, differs from PD by up to {largest:.2g}: what "
        "learning shows is not to be trusted beyond that."
    )


def suite_verdict(summary: pd.DataFrame, *, table: pd.DataFrame | None = None) -> str:
    """The answer for all scenarios in words; empty without `pd`, `ilc` and `model`.

    Args:
        summary: See `compare.metrics`.
        table: Its `answer`, if it is there already.
    """
    table = answer(summary) if table is None else table
    controllers = set(table.index.get_level_values("controller"))
    if not {"pd", LEARNER, "model"} <= controllers:
        return ""
    learning = table.xs(LEARNER, level="controller")
    reasons = {
        str(world): inconclusive(
            summary, scenario=str(world), table=table.loc[world], against="model"
        )
        for world in learning.index
    }
    told = learning.loc[[world for world, reason in reasons.items() if not reason]]
    sentences = [
        f"Does practice beat the model? In {_count(len(learning), 'scenario')}, against the "
        f"model's feedforward, by {CONFIDENCE:.0%} intervals of the paired difference:"
    ]
    sentences += _where_it_beats_the_model(told) if len(told) else []
    sentences += [
        f"In {world} nothing is concluded: {reason}." for world, reason in reasons.items() if reason
    ]
    sentences += _range_against_pd(told)
    return _joined(*sentences, _where_robots_fell(table), _control_arm(summary))


def _where_it_beats_the_model(learning: pd.DataFrame) -> Iterator[str]:
    """What learning does in those worlds that tell, one a row."""
    for joint in SHOWN:
        better, worse, open_ = (
            list(learning.index[learning[f"{joint}_model"] == sign]) for sign in (1, -1, 0)
        )
        parts = [f"In the {joint} it is better in {len(better)} of {len(learning)}"]
        parts += [f"worse in {', '.join(worse)}"] if worse else []
        parts += [f"open in {', '.join(open_)}"] if open_ else []
        yield "; ".join(parts) + "."
    beat, learners = learning["beat"].sum(), learning["learners"].sum()
    median = learning["beat_strides"].median()
    yield (
        f"{beat:.0f} of {learners:.0f} robots come to beat it in both joints and stay there"
        + (f", the scenarios' median is {median:.0f} strides." if beat else ".")
    )


def _range_against_pd(learning: pd.DataFrame) -> Iterator[str]:
    """The least and the greatest reduction against PD, and in which scenarios."""
    for joint in SHOWN:
        reduced = learning[f"{joint}_reduction"].dropna()
        if reduced.empty:
            continue
        best, least = reduced.idxmax(), reduced.idxmin()
        yield (
            f"Against PD the {joint}'s mean peak is less by "
            f"{_percent(learning.loc[least], f'{joint}_reduction')} in {least}"
            + (
                f" to {_percent(learning.loc[best], f'{joint}_reduction')} in {best}."
                if len(reduced) > 1
                else "."
            )
        )


def _where_robots_fell(table: pd.DataFrame) -> str:
    down = table[table["fell"] > 0]
    places = [
        f"{row['fell']:.0f} of {row['robots']:.0f} in {scenario} under {controller}"
        for (scenario, controller), row in down.iterrows()
    ]
    return f"Robots fell: {', '.join(places)}." if places else "No robot fell."


def _joined(*sentences: str) -> str:
    return " ".join(sentence for sentence in sentences if sentence)


def answer_in_words(summary: pd.DataFrame, *, table: pd.DataFrame | None = None) -> str:
    """The verdict over one scenario or all of them, or why the experiment cannot have one.

    Args:
        summary: See `compare.metrics`.
        table: Its `answer`, if it is there already.
    """
    table = answer(summary) if table is None else table
    worlds = list(dict.fromkeys(table.index.get_level_values("scenario")))
    if len(worlds) > 1:
        said = suite_verdict(summary, table=table)
    else:
        said = verdict(summary, scenario=worlds[0], table=table.loc[worlds[0]])
    return said or _joined(unsaid(table), _where_robots_fell(table))


def format_summary(summary: pd.DataFrame) -> str:
    """Tables and verdict as text for a terminal: `format_tables` of one scenario, `format_suite` of
    many."""
    worlds = families(list(summary["scenario"].unique()))
    return format_suite(summary) if len(worlds) > 1 else format_tables(summary, scenario=worlds[0])


def format_tables(summary: pd.DataFrame, *, scenario: str) -> str:
    """Table I beside the paper's, the overview and the verdict, as text for a terminal."""
    table = answer(in_family(summary, scenario))
    single = bool((summary["scenario"] == scenario).any())
    mine = table.loc[scenario]
    parts = [
        _format_beside(beside_the_paper(summary, scenario=scenario)) if single else "",
        beside_note(mine) if single else "",
        format_overview(mine),
        textwrap.fill(answer_in_words(in_family(summary, scenario), table=table), _WIDTH),
    ]
    return "\n\n".join(part for part in parts if part)


def beside_note(table: pd.DataFrame) -> str:
    """Who is missing beside the paper's Table I, from an `overview`; empty if nobody is."""
    mine = table.loc[[name for name in ("pd", LEARNER) if name in table.index]]
    robots, missing = int(mine["robots"].sum()), int((mine["robots"] - mine["upright"]).sum())
    if not missing:
        return ""
    if missing == robots:
        return "Nothing stands beside the paper's Table I: no robot stayed up."
    return (
        f"Beside the paper's Table I are the robots that stayed up: {missing} of {robots} did not."
    )


def format_suite(summary: pd.DataFrame) -> str:
    """The overviews of all scenarios and the verdict over them, as text for a terminal."""
    table = answer(summary)
    parts = []
    for scenario in dict.fromkeys(table.index.get_level_values("scenario")):
        parts.append(f"{scenario}\n{format_overview(table.loc[scenario])}")
    return "\n\n".join([*parts, textwrap.fill(answer_in_words(summary, table=table), _WIDTH)])


def _format_beside(table: pd.DataFrame) -> str:
    if table.empty:
        return ""
    lines = [
        " " * 8 + "".join(f"{f'{joint}: peak stance error [rad]':^44}" for joint in SHOWN),
        f"{'speed':>6}  " + f"{'this run':^22}{'paper, Table I':^22}" * len(SHOWN),
        f"{'[m/s]':>6}" + f"{'PD':>8}{'ILC':>7}{'less':>7}" * 2 * len(SHOWN),
    ]
    for speed, row in table.iterrows():
        cells = ""
        for joint, source in itertools.product(SHOWN, ("ours", "paper")):
            pd_, ilc, less = (
                row.get((joint, source, name), np.nan) for name in ("PD", "ILC", "reduction")
            )
            cells += f"{number(pd_, '.3f'):>8}{number(ilc, '.3f'):>7}{number(less, '.0%'):>7}"
        lines.append(f"{speed if isinstance(speed, str) else f'{speed:.2g}':>6}{cells}")
    return "\n".join(line.rstrip() for line in lines)


def format_overview(table: pd.DataFrame) -> str:
    """An `overview` as text: peaks with their intervals, and against the model."""
    lines = [
        f"{'':>10}  {'calf: peak [rad]':^23} {'thigh: peak [rad]':^23}  beats model  strides to"
        "  feedb.  cost of  stayed",
        f"{'controller':>10}  {'mean':>6} {'95 % interval':>16} {'mean':>6} {'95 % interval':>16}  "
        f"{'calf/thigh':>11}  {'beat it':>10}  {'share':>6}  {'transp.':>7}  upright",
    ]
    for name, row in table.iterrows():
        cells = " ".join(
            f"{number(row[joint], '.4f'):>6} {between(row, joint, '.4f'):>16}" for joint in SHOWN
        )
        lines.append(
            f"{name:>10}  {cells}  {against_model(row):>11}  {beat_text(row):>10}  "
            f"{number(row['feedback'], '.0%'):>6}  {number(row['cost'], '.2f'):>7}  "
            f"{row['upright']:.0f} of {row['robots']:.0f}"
        )
    if units := units_of_intervals(table):
        lines.append(f"{'':>10}  intervals over the {units}")
    return "\n".join(lines)


def units_of_intervals(table: pd.DataFrame) -> str:
    """What the intervals of an `overview` are drawn over, in words; empty where there are none."""
    ends = table[[f"{joint}_low" for joint in SHOWN]]
    units = sorted(set(table["unit"][ends.notna().any(axis="columns")]))
    return " and ".join(f"{unit}s" for unit in units)


def against_model(row: pd.Series) -> str:
    """Whether calf and thigh are better than with the model's feedforward: yes, no, or open.

    A dash where no robot stayed up under both, and of learning that nothing taught.
    """
    signs = [row.get(f"{joint}_model", np.nan) for joint in SHOWN]
    if row.get("taught", np.nan) == 0 or np.isnan(signs).any():
        return "-"
    return "/".join({1: "yes", 0: "open", -1: "no"}[int(row[f"{joint}_model"])] for joint in SHOWN)


def beat_text(row: pd.Series) -> str:
    """Strides until the model is beaten, and by how many robots; "never" where by none."""
    if not row["learners"] or row.get("taught", np.nan) == 0:
        return "-"
    if not row["beat"]:
        return "never"
    everyone = row["beat"] == row["learners"]
    few = "" if everyone else f" ({row['beat']:.0f}/{row['learners']:.0f})"
    return f"{row['beat_strides']:.0f}{few}"


def between(row: pd.Series, name: str, form: str) -> str:
    """An interval, as "0.0210 to 0.0232"; a dash without one."""
    ends = row.get(f"{name}_low", np.nan), row.get(f"{name}_high", np.nan)
    return f"{ends[0]:{form}} to {ends[1]:{form}}" if np.isfinite(ends).all() else "-"


def number(value: float, form: str) -> str:
    """A number, or a dash where there is none."""
    return format(value, form) if np.isfinite(value) else "-"


def _percent(row: pd.Series, name: str) -> str:
    ends = row[f"{name}_low"], row[f"{name}_high"]
    interval = f" ({100 * ends[0]:.0f} to {ends[1]:.0%})" if np.isfinite(ends).all() else ""
    return f"{row[name]:.0%}{interval}"


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}" + ("s" if n != 1 else "")


def families(scenarios: Sequence[str]) -> list[str]:
    """The worlds of an experiment, sampled ones as one family each."""
    return list(dict.fromkeys(map(family, scenarios)))
