from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare import random_scenarios
from pronk_pin.compare.report import format_tables
from pronk_pin.compare.report.overview import answer, overview
from pronk_pin.compare.report.tables import (
    beside_the_paper,
    sampled_scenarios,
    worst_reduction,
)


def test_our_errors_stand_beside_the_papers_at_the_same_speed(summary: pd.DataFrame) -> None:
    table = beside_the_paper(summary, scenario="nominal")
    assert table.index.tolist() == [0.3, 0.35, "mean"]
    assert table.loc[0.3, ("calf", "ours")].tolist() == pytest.approx([0.10, 0.02, 0.8])
    assert table.loc[0.3, ("calf", "paper", "PD")] == 0.089
    assert np.isnan(table.loc[0.35, ("calf", "paper", "PD")])
    assert table.loc["mean", ("thigh", "ours")].tolist() == pytest.approx([0.075, 0.015, 0.8])


def test_nothing_of_another_robot_stands_beside_the_papers(summary: pd.DataFrame) -> None:
    assert "paper, Table I" in format_tables(summary, scenario="nominal")
    hyq = summary.assign(robot="hyq")
    assert beside_the_paper(hyq, scenario="nominal").empty
    text = format_tables(hyq, scenario="nominal")
    assert "peak error [rad]" in text
    assert "paper" not in text


def test_the_overview_has_means_reductions_and_the_slowest_speed(summary: pd.DataFrame) -> None:
    table = overview(summary, scenario="nominal")
    assert list(table) == ["pd", "model", "ilc"]
    ilc = table["ilc"]
    assert ilc.joints["calf"].peak.value == pytest.approx(0.03)
    assert ilc.joints["calf"].reduction.value == pytest.approx(0.8)
    assert ilc.joints["calf"].felt == pytest.approx(0.015)
    assert ilc.settled == 8.0
    assert ilc.speed_error == pytest.approx(0.05)  # magnitudes do not cancel
    assert (ilc.upright, ilc.robots) == (2, 2)


def test_the_worst_reduction_is_that_of_the_worst_speed(summary: pd.DataFrame) -> None:
    worse = (summary["controller"] == "ilc") & (summary["speed"] == 0.35)
    worse &= (summary["metric"] == "peak_error") & (summary["joint"] == "calf")
    summary.loc[worse, "value"] = 0.3
    worst = worst_reduction(summary, scenario="nominal", controller="ilc")
    assert worst["calf"] == pytest.approx(-0.5)
    assert worst["thigh"] == pytest.approx(0.8)


def test_one_speed_that_never_settles_is_not_hidden_by_the_others(summary: pd.DataFrame) -> None:
    settled = summary["metric"] == "strides_to_converge"
    summary.loc[summary[settled].index[0], "value"] = np.nan
    assert np.isnan(overview(summary, scenario="nominal")["ilc"].settled)


def test_means_and_reductions_have_intervals_that_hold_them(eight: pd.DataFrame) -> None:
    learned = (eight["controller"] == "ilc") & (eight["metric"] == "peak_error")
    eight.loc[learned & (eight["speed"] == 0.3), "value"] *= 1.5  # so that reductions scatter
    table = overview(eight, scenario="nominal")
    calf, thigh = (table["ilc"].joints[joint] for joint in ("calf", "thigh"))
    for interval in (calf.peak, thigh.peak, calf.reduction):
        assert interval.low < interval.value < interval.high
    assert np.isnan(table["pd"].joints["calf"].reduction.value)
    assert {row.unit for row in table.values()} == {"speed"}


def test_who_beats_the_model_is_counted_robot_by_robot(eight: pd.DataFrame) -> None:
    ilc = overview(eight, scenario="nominal")["ilc"]
    calf, thigh = ilc.joints["calf"], ilc.joints["thigh"]
    assert (calf.better, thigh.better) == (True, False)
    assert (calf.wins.value, thigh.wins.value) == (1.0, 0.0)
    assert calf.difference.value == pytest.approx(-0.015)
    assert calf.wins.low == pytest.approx(0.676, abs=1e-3)  # Wilson, 8 of 8
    assert ilc.beat == (3.0, 4, 8)


def test_robots_that_fell_are_counted_and_not_averaged(summary: pd.DataFrame) -> None:
    down = (summary["controller"] == "ilc") & (summary["speed"] == 0.35)
    summary.loc[down & (summary["metric"] == "upright"), "value"] = 0.0
    ilc = overview(summary, scenario="nominal")["ilc"]
    assert (ilc.upright, ilc.robots) == (1, 2)
    assert ilc.joints["calf"].peak.value == pytest.approx(0.02)


def test_the_answer_has_every_world_and_sampled_ones_as_one(summary: pd.DataFrame) -> None:
    sampled = [summary.assign(scenario=f"random-4-{k}") for k in range(8)]
    tables = answer(pd.concat([summary, *sampled]))
    assert list(tables) == ["nominal", "random-4"]
    assert tables["random-4"]["ilc"].robots == 16
    assert tables["random-4"]["ilc"].unit == "scenario"


def test_each_sampled_world_stands_beside_what_it_is_like(summary: pd.DataFrame) -> None:
    down = (summary["controller"] == "ilc") & (summary["metric"] == "upright")
    worlds = []
    for k, factor in ((0, 3.0), (1, 1.0)):
        mine = summary.assign(scenario=f"random-4-{k}")
        mine.loc[mine["metric"] == "peak_error", "value"] *= factor
        worlds.append(mine)
    worlds[0].loc[worlds[0][down & (worlds[0]["speed"] == 0.35)].index, "value"] = 0.0
    table = sampled_scenarios(pd.concat(worlds, ignore_index=True), scenario="random-4")
    assert table.index.tolist() == ["random-4-1", "random-4-0"]  # by what learning leaves
    for k, world in enumerate(random_scenarios(2, seed=4)):
        assert table.loc[f"random-4-{k}", ("scenario", "payload")] == world.payload
    assert table.loc["random-4-1", ("calf", "ilc")] == pytest.approx(0.03)
    assert table.loc["random-4-0", ("calf", "ilc")] == pytest.approx(0.06)  # one fell
    assert table.loc["random-4-0", ("thigh", "pd")] == pytest.approx(3 * 0.075)
    assert table["fallen", "ilc"].tolist() == [0, 1]
    assert table["fallen", "pd"].tolist() == [0, 0]
