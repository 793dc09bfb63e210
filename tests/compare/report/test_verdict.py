from __future__ import annotations

import numpy as np
import pandas as pd

from pronk_pin.compare import Results
from pronk_pin.compare.report.verdict import format_suite, format_tables, suite_verdict, verdict


def test_the_verdict_says_in_words_what_the_numbers_say(summary: pd.DataFrame) -> None:
    words = verdict(summary, scenario="nominal")
    assert "by 80% (80 to 80%) in the calf and 80% (80 to 80%) in the thigh against PD" in words
    assert "within 8 strides at every speed" in words
    assert "It beats the model's feedforward in the calf only: 0.0300 against 0.0450 rad" in words
    assert "1 of 2 robots beat it in both joints, after 3 strides in the median." in words
    assert words.endswith("No robot fell.")


def test_the_verdict_does_not_hide_a_fall_or_a_speed_that_never_settles(
    summary: pd.DataFrame,
) -> None:
    summary.loc[summary[summary["metric"] == "upright"].index[0], "value"] = 0.0
    summary.loc[summary["metric"] == "strides_to_converge", "value"] = np.nan
    words = verdict(summary, scenario="nominal")
    assert "at some speed it has not settled" in words
    assert "No robot fell" not in words


def test_there_is_no_verdict_without_pd(summary: pd.DataFrame) -> None:
    assert verdict(summary[summary["controller"] != "pd"], scenario="nominal") == ""


def test_the_tables_of_a_comparison_can_be_printed(comparison: Results) -> None:
    text = format_tables(comparison.summary(), scenario="nominal")
    assert "nan" not in text
    assert max(map(len, text.splitlines())) <= 120
    assert "library" in text


def test_a_difference_that_may_be_chance_is_called_so(summary: pd.DataFrame) -> None:
    model = (summary["controller"] == "model") & (summary["joint"] == "calf")
    summary.loc[model & (summary["metric"] == "peak_error"), "value"] = [0.019, 0.042]
    assert "(in the calf the difference may be chance)" in verdict(summary, scenario="nominal")


def test_the_control_arm_is_named_for_what_it_shows(summary: pd.DataFrame) -> None:
    arm = summary[summary["controller"] == "pd"].assign(controller="ilc-zero")
    both = pd.concat([summary, arm])
    assert "shows nothing: every number is PD's" in verdict(both, scenario="nominal")
    arm.loc[arm["metric"] == "peak_error", "value"] *= 1.1
    both = pd.concat([summary, arm])
    assert "differs from PD by up to 0.02" in verdict(both, scenario="nominal")


def test_the_verdict_over_all_worlds_counts_them_and_names_the_exceptions(
    summary: pd.DataFrame,
) -> None:
    other = summary.assign(scenario="slope")
    down = other.index[(other["metric"] == "upright") & (other["controller"] == "pd")][0]
    other.loc[down, "value"] = 0.0
    words = suite_verdict(pd.concat([summary, other], ignore_index=True))
    assert "In 2 scenarios" in words
    assert "In the calf it is better in 2 of 2." in words
    assert "In the thigh it is better in 0 of 2; worse in nominal, slope." in words
    assert "2 of 4 robots come to beat it in both joints" in words
    assert "Robots fell: 1 of 2 in slope under pd." in words


def test_worlds_stand_one_below_the_other_in_a_terminal(summary: pd.DataFrame) -> None:
    text = format_suite(pd.concat([summary, summary.assign(scenario="slope")]))
    assert text.count("intervals over the speeds") == 2
    assert "yes/no" in text
    assert "3 (1/2)" in text
    assert "nan" not in text
    assert max(map(len, text.splitlines())) <= 120


def test_one_world_alone_needs_no_verdict_over_all_without_the_model(
    summary: pd.DataFrame,
) -> None:
    assert suite_verdict(summary[summary["controller"] != "model"]) == ""
    assert np.isfinite(summary["value"].dropna()).all()


def test_of_sampled_worlds_each_counts_once(summary: pd.DataFrame) -> None:
    worlds = [summary.assign(scenario=f"random-4-{k}") for k in range(6)]
    odd = (worlds[0]["controller"] == "ilc") & (worlds[0]["joint"] == "calf")
    worlds[0].loc[odd & (worlds[0]["metric"] == "peak_error"), "value"] = 0.2
    words = verdict(pd.concat(worlds, ignore_index=True), scenario="random-4")
    assert words.startswith(
        "In 6 sampled scenarios, at 2 speeds in each, learning cuts the mean peak"
    )
    assert "for the worst robot)" in words
    # calf: better but for the odd world, so open; thigh: worse everywhere
    assert "It cannot be told from the model's feedforward in the calf and does worse than" in words
    assert "less in 5 of 6 scenarios, and the probability that a robot improves is 83% (" in words
    assert "by paired differences +7.5 mrad (+7.5 to +7.5); it is less in 0 of 6 scenarios" in words
    assert "6 of 12 robots come to beat the model in both joints and stay there" in words


def test_practice_that_wins_in_every_sampled_world_does_so_beyond_doubt(
    summary: pd.DataFrame,
) -> None:
    thigh = (summary["controller"] == "model") & (summary["joint"] == "thigh")
    summary.loc[thigh, "value"] *= 10.0
    worlds = pd.concat([summary.assign(scenario=f"random-4-{k}") for k in range(6)])
    words = verdict(worlds.reset_index(drop=True), scenario="random-4")
    assert "It beats the model's feedforward in calf and thigh beyond doubt." in words
    text = format_tables(worlds.reset_index(drop=True), scenario="random-4")
    assert "intervals over the scenarios" in text
    assert "nan" not in text
