"""Two results side by side: what is different in the second beyond noise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from ...errors import InvalidInput
from ..experiment import differences, to_document
from ..metrics import LEAST_UNITS, Interval, compare_pairs, family, robots
from ..results import Results
from .cells import between, number
from .overview import own_metrics
from .tables import SHOWN

LEVEL = 0.05
"""Share of false alarms among the changes that are named."""

_FLIPS = 9999
"""Random sign flips where there are too many for all of them."""


def changes(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    """Mean peak errors of two summaries, scenario by scenario and controller by controller.

    Robots are matched by world, controller, speed and, if both have the same ones, seed; otherwise
    each speed's mean over its seeds. The p-values are those of the paired permutation test (signs
    of the differences flipped), adjusted for the number of rows by Benjamini and Hochberg, so that
    at most `LEVEL` of the changes named are false alarms. Fewer than `LEAST_UNITS` pairs are not
    tested: the smallest p of n pairs is 2 / 2^n. A fall for which there was none counts too,
    whatever the errors do.

    Returns:
        A row each scenario, controller and joint, or metric of one's own: `before`, `after` [rad],
        `difference` and its interval from `low` to `high`, `p` (adjusted), `robots` compared,
        `fallen_before`, `fallen_after`, and `change`: "better", "worse" or "".

    Raises:
        InvalidInput: Nothing is in both.
    """
    keys = [
        (world, controller)
        for world, controller in _cells(before)
        if (world, controller) in set(_cells(after))
    ]
    own = dict.fromkeys(name for name, _ in own_metrics(before) if name in set(after["metric"]))
    compared = [*(("peak_error", joint) for joint in SHOWN), *((name, "-") for name in own)]
    rows = [
        _row(before, after, world, controller, metric, joint)
        for world, controller in keys
        for metric, joint in compared
    ]
    if not rows:
        raise InvalidInput(
            "the two results have no scenario and controller in common; give two of "
            "the same --scenarios and --controllers"
        )
    table = pd.DataFrame(rows)
    tested = table["p"].notna().to_numpy()
    if tested.any():
        adjusted = stats.false_discovery_control(table.loc[tested, "p"].to_numpy())
        table.loc[tested, "p"] = adjusted
    beyond = table["p"] < LEVEL
    worse = (table["difference"] > 0) & beyond | (table["fallen_after"] > table["fallen_before"])
    table["change"] = np.select([worse, beyond], ["worse", "better"], default="")
    return table.set_index(["scenario", "controller", "joint"])


def format_changes(first: Results, second: Results) -> str:
    """The changes from a result to another, as text for a terminal."""
    for results in (first, second):
        results.check_constant("the comparison of two results")
    before, after = first.summary(), second.summary()
    table = changes(before, after)
    lines = [f"before  {first.folder}", f"after   {second.folder}"]
    lines += _differences(first, second)
    lines.append("")
    lines += [
        f"{'scenario':>14} {'controller':>12} {'joint':>6}  {'before':>7} {'after':>7} "
        f"{'difference':>10} {'95 % interval':>18} {'pairs':>5}  {'p':>7}  change",
        *(_line(key, row) for key, row in table.iterrows()),
    ]
    named = table["change"] != ""
    silent = ~named & (table["robots"] == 0)
    identical = ~named & ~silent & (table["difference"] == 0.0)
    few = ~named & ~silent & ~identical & (table["robots"] < LEAST_UNITS)
    same = ~named & ~silent & ~identical & ~few
    lines.append(
        f"{named.sum()} of {len(table)} means changed beyond noise (at most {LEVEL:.0%} "
        f"of those named are false alarms)."
        + (f" Of {same.sum()} no change is shown." if same.any() else "")
        + (f" {identical.sum()} are the same to the bit." if identical.any() else "")
        + (
            f" Of {few.sum()} nothing can be told: {_counted(table['robots'][few])}, and it takes "
            f"{LEAST_UNITS}; compare results with more speeds, seeds or sampled scenarios."
            if few.any()
            else ""
        )
        + (
            f" Of {silent.sum()} nothing is concluded: no robot stayed up in both."
            if silent.any()
            else ""
        )
    )
    return "\n".join(lines)


def _counted(pairs: pd.Series) -> str:
    """How many pairs there are in the rows: "4 pairs", "2 to 4 pairs"."""
    least, most = int(pairs.min()), int(pairs.max())
    number_of = f"{most}" if least == most else f"{least} to {most}"
    return f"{number_of} pair" + ("s" if most != 1 else "")


def _cells(summary: pd.DataFrame) -> list[tuple[str, str]]:
    worlds = summary["scenario"].map(family)
    return list(dict.fromkeys(zip(worlds, summary["controller"], strict=True)))


def _row(
    before: pd.DataFrame,
    after: pd.DataFrame,
    world: str,
    controller: str,
    metric: str,
    joint: str,
) -> dict[str, Any]:
    mine: dict[str, Any] = {"scenario": world, "controller": controller}
    one, other = (
        robots(summary, **mine, metric=metric, joint=joint) for summary in (after, before)
    )
    fallen = [int(part.isna().to_numpy().sum()) for part in (one, other)]
    if not one.index.equals(other.index):  # other seeds or sampled scenarios: speed by speed
        one, other = one.mean().to_frame().T, other.mean().to_frame().T
    one, other = one.align(other, join="inner")
    found = compare_pairs(one, other)
    pairs = (one - other).to_numpy(dtype=float).ravel()
    pairs = pairs[np.isfinite(pairs)]
    return {
        **mine,
        "joint": metric if joint == "-" else joint,
        "before": float(np.nanmean(other.to_numpy())) if pairs.size else np.nan,
        "after": float(np.nanmean(one.to_numpy())) if pairs.size else np.nan,
        "difference": found.difference.value,
        "low": found.difference.low,
        "high": found.difference.high,
        "p": _sign_flips(pairs),
        "robots": pairs.size,
        "fallen_before": fallen[1],
        "fallen_after": fallen[0],
    }


def _sign_flips(pairs: np.ndarray[Any, Any]) -> float:
    """p-value of a mean difference of 0; NaN where there is nothing to test, or too little."""
    if pairs.size < LEAST_UNITS or not pairs.any():
        return float("nan")
    done = stats.permutation_test(
        (pairs,),
        np.mean,
        permutation_type="samples",
        vectorized=True,
        n_resamples=_FLIPS,
        rng=np.random.default_rng(0),
    )
    return float(done.pvalue)


def _differences(first: Results, second: Results) -> list[str]:
    """What is different in how the two were made."""
    lines = []
    one, other = to_document(first.experiment), to_document(second.experiment)
    for name in one:
        if one[name] != other[name]:
            lines.append(f"{name}: {_short(one[name])} -> {_short(other[name])}")
    for name in ("controllers", "scenarios"):
        old, new = (
            {each["name"]: each for each in part[name] if isinstance(each, dict)}
            for part in (one, other)
        )
        for own in sorted(old.keys() & new.keys()):
            if old[own] != new[own]:
                lines.append(f"{own}: {differences(old[own], new[own])}")
    last = [results.provenance["runs"][-1:] for results in (first, second)]
    if all(last):
        (old,), (new,) = last
        for name, version in old["versions"].items():
            if new["versions"].get(name) != version:
                lines.append(f"{name}: {version} -> {new['versions'].get(name)}")
        for name in ("git", "cpu"):
            if old.get(name) != new.get(name):
                lines.append(f"{name}: {old.get(name)} -> {new.get(name)}")
    return lines


def _short(value: object) -> str:
    """A setting as text; of an object its name."""
    if isinstance(value, list | tuple):
        return " ".join(map(_short, value))
    return str(value.get("name", value)) if isinstance(value, dict) else str(value)


def _line(key: Any, row: pd.Series) -> str:
    world, controller, joint = key
    interval = between(Interval(row["difference"], row["low"], row["high"]), "+.4f")
    fell = row["fallen_after"] - row["fallen_before"]
    falls = f" ({fell:+d} fell)" if fell else ""
    return (
        f"{world:>14} {controller:>12} {joint:>6}  {number(row['before'], '.4f'):>7} "
        f"{number(row['after'], '.4f'):>7} {number(row['difference'], '+.4f'):>10} "
        f"{interval:>18} {row['robots']:>5d}  {number(row['p'], '.1g'):>7}  {row['change']}{falls}"
    )
