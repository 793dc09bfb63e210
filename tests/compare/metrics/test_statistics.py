"""Intervals that hold what they promise, on samples whose truth is known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from pronk_pin._typing import Array
from pronk_pin.compare.metrics import (
    COLUMNS,
    CONFIDENCE,
    compare_controllers,
    compare_pairs,
    control_arm,
    family,
    mean_interval,
    robots,
    sampled,
)


def table(values: Array, *, scenario: str = "nominal") -> pd.DataFrame:
    """Robots by unit and speed, of shape (units, speeds)."""
    units = pd.MultiIndex.from_product([[scenario], range(len(values))], names=["scenario", "seed"])
    speeds = pd.Index(np.round(0.1 * np.arange(values.shape[1]), 3), name="speed")
    return pd.DataFrame(values, units, speeds)


def summary(peaks: dict[str, Array], *, fallen: dict[str, Array] | None = None) -> pd.DataFrame:
    """A summary of calf peaks by controller, each of shape (units, speeds)."""
    rows: list[dict[str, object]] = []
    for controller, values in peaks.items():
        for (seed, k), value in np.ndenumerate(values):
            key: dict[str, object] = {"robot": "a1", "base": "locked", "scenario": "nominal"}
            key |= {"speed": 0.1 * k, "controller": controller, "seed": seed, "unit": "1"}
            down = bool(fallen and controller in fallen and fallen[controller][seed, k])
            rows.append({**key, "joint": "calf", "metric": "peak_error", "value": value})
            rows.append({**key, "joint": "-", "metric": "upright", "value": float(not down)})
    return pd.DataFrame(rows)[COLUMNS]


@pytest.mark.parametrize("trials", [250, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("n", [8, 14, 20])
@pytest.mark.parametrize("skewed", [False, True])
def test_intervals_hold_the_truth_about_as_often_as_they_say(
    n: int, skewed: bool, trials: int
) -> None:
    """Means, paired differences and reductions of n units, over and over again."""
    rng = np.random.default_rng(7)
    hits = np.zeros(3)
    for _ in range(trials):
        factor = rng.gamma(4.0, 0.25, (n, 2)) if skewed else rng.normal(1.0, 0.3, (n, 2))
        before = table(factor[:, :1])
        after = table(0.2 * factor[:, :1] + 0.1 * factor[:, 1:])
        found = compare_pairs(after, before)
        hits += (
            mean_interval(before).holds(1.0),
            found.difference.holds(-0.7),
            found.reduction.holds(0.7),
        )
    # 95 % where they are normal; a skewed sample of eight loses three of a hundred.
    least = CONFIDENCE - (0.04 if skewed else 0.02)
    assert np.all((hits / trials >= least) & (hits / trials <= 0.98))


def test_robots_of_one_sampled_world_do_not_make_it_sure() -> None:
    """Worlds scatter, the robots in them hardly: the interval must be that of 20 scenarios."""
    rng, hits, trials = np.random.default_rng(8), 0, 200
    for _ in range(trials):
        worlds = rng.normal(1.0, 0.5, (20, 1)) + 0.01 * rng.normal(size=(20, 14))
        hits += mean_interval(table(worlds)).holds(1.0)
    assert hits / trials >= 0.87


def test_pairs_see_a_small_difference_that_the_scatter_of_speeds_would_hide() -> None:
    rng = np.random.default_rng(1)
    base = rng.uniform(0.05, 0.15, (1, 14))
    better = base - 0.002 + 1e-4 * rng.normal(size=base.shape)
    found = compare_pairs(table(better), table(base))
    assert found.better is True
    assert found.difference.value == pytest.approx(-0.002, abs=1e-4)
    assert found.improvement.value == 1.0
    assert found.improvement.low == pytest.approx(0.785, abs=0.001)  # Wilson, 14 of 14
    alone = mean_interval(table(base))
    assert alone.high - alone.low > 10 * (found.difference.high - found.difference.low)


def test_the_reduction_is_that_of_the_means_and_lies_in_its_interval() -> None:
    rng = np.random.default_rng(2)
    before = rng.uniform(0.08, 0.12, (8, 14))
    after = 0.25 * before + rng.normal(0.0, 1e-3, before.shape)
    found = compare_pairs(table(after), table(before))
    assert found.unit == "seed"
    assert found.reduction.value == pytest.approx(1.0 - after.mean() / before.mean())
    assert found.reduction.holds(0.75)
    assert found.reduction.high - found.reduction.low < 0.02


def test_what_does_not_scatter_has_no_interval() -> None:
    """Ten seeds of a world without chance give one number: an interval of width 0 is none."""
    same = mean_interval(table(np.tile([0.1, 0.2], (10, 1))))
    assert same.value == pytest.approx(0.15)
    assert not same.known


@pytest.mark.parametrize("n", [2, 4, 7])
def test_fewer_than_eight_units_have_no_interval_and_prove_nothing(n: int) -> None:
    rng = np.random.default_rng(11)
    before = table(rng.uniform(0.08, 0.12, (1, n)))
    found = compare_pairs(0.1 * before, before)
    assert found.reduction.value == pytest.approx(0.9)
    for interval in (found.difference, found.reduction, found.improvement, mean_interval(before)):
        assert not interval.known
    assert found.better is None


def test_no_difference_is_found_where_there_is_none() -> None:
    rng, false_alarms = np.random.default_rng(3), 0
    for _ in range(100):
        one, other = rng.normal(1.0, 0.2, (2, 1, 14))
        false_alarms += compare_pairs(table(one), table(other)).better is not None
    assert false_alarms <= 9  # 5 % are promised


def test_wins_agree_with_the_test_that_counts_them() -> None:
    rng = np.random.default_rng(4)
    one, other = rng.normal(1.0, 0.2, (2, 1, 14))
    wins = int((one < other).sum())
    exact = stats.binomtest(wins, 14).proportion_ci(method="wilson")
    found = compare_pairs(table(one), table(other)).improvement
    assert found == pytest.approx((wins / 14, exact.low, exact.high))


def test_ties_and_one_robot_alone_are_no_reason_to_be_sure() -> None:
    same = table(np.full((1, 14), 0.1))
    found = compare_pairs(same, same)
    assert found.better is None
    assert found.improvement.value == 0.5
    lone = mean_interval(table(np.array([[0.1]])))
    assert lone.value == 0.1
    assert np.isnan(lone.low)
    assert np.isnan(lone.high)


def test_the_fallen_lose_and_their_errors_are_not_averaged() -> None:
    good, bad = np.full((1, 4), 0.1), np.full((1, 4), 0.2)
    good[0, 0] = 0.001  # small, but it lies on the ground
    down = np.array([[True, False, False, False]])
    data = summary({"ilc": good, "pd": bad}, fallen={"ilc": down})
    found = compare_controllers(data, scenario="nominal", controller="ilc", against="pd")
    assert found.pairs == 3
    assert found.difference.value == pytest.approx(-0.1)
    assert found.improvement.value == pytest.approx(0.75)
    ilc = robots(data, scenario="nominal", controller="ilc")
    assert ilc.isna().to_numpy().tolist() == [[True, False, False, False]]


def test_few_seeds_are_no_sample_and_the_speeds_are_drawn_instead() -> None:
    rng = np.random.default_rng(5)
    for units, unit in ((1, "speed"), (7, "speed"), (8, "seed")):
        values = table(rng.normal(1.0, 0.1, (units, 14)))
        assert compare_pairs(values, values + 0.1).unit == unit


def test_more_seeds_in_a_sampled_world_are_no_more_worlds() -> None:
    """The world scatters, its seeds do not: more of them must not make it sure."""
    rng = np.random.default_rng(9)
    worlds = [f"random-0-{k}" for k in range(8)]
    drawn = np.repeat(rng.normal(1.0, 0.5, (8, 1)), 3, axis=1)
    once = pd.concat(
        [table(row[None], scenario=name) for name, row in zip(worlds, drawn, strict=True)]
    )
    often = pd.concat(
        [
            table(np.tile(row, (10, 1)), scenario=name)
            for name, row in zip(worlds, drawn, strict=True)
        ]
    )
    assert tuple(mean_interval(often)) == pytest.approx(tuple(mean_interval(once)))
    assert compare_pairs(often, often + 1.0).unit == "scenario"
    four = often.loc[worlds[:4]]
    assert compare_pairs(four, four + 1.0).unit == "speed"  # too few worlds, however many seeds


def test_sampled_worlds_are_one_family() -> None:
    assert family("random-3-0") == family("random-3-12") == "random-3"
    assert family("random-3-0+delay") == "random-3+delay"
    assert family("payload=2+slope") == "payload=2+slope"
    assert sampled("random-3-0")
    assert sampled(family("random-3-0+delay"))
    assert not sampled("payload=2+slope")


def test_the_same_numbers_come_out_each_time() -> None:
    values = table(np.random.default_rng(6).normal(1.0, 0.1, (1, 14)))
    assert mean_interval(values) == mean_interval(values)


def test_without_the_control_arm_there_is_nothing_to_say() -> None:
    assert control_arm(summary({"pd": np.ones((1, 3)), "ilc": np.ones((1, 3))})) is None


def test_a_control_arm_that_shows_something_is_seen() -> None:
    """Its peaks, that is: watts and metres cannot be compared with radians."""
    data = summary({"pd": np.ones((1, 3)), "ilc-zero": np.full((1, 3), 1.5)})
    data.loc[data["metric"] == "upright", "value"] *= 7.0
    assert control_arm(data) == 0.5


def test_one_pair_alone_has_a_difference_and_a_reduction_but_no_interval() -> None:
    found = compare_pairs(table(np.array([[0.02]])), table(np.array([[0.1]])))
    assert found.difference.value == pytest.approx(-0.08)
    assert found.reduction.value == pytest.approx(0.8)
    assert found.improvement.value == 1.0
    assert found.pairs == 1
    assert not found.reduction.known
    none = compare_pairs(table(np.array([[np.nan]])), table(np.array([[0.1]])))
    assert none.pairs == 0
    assert np.isnan(none.reduction.value)
