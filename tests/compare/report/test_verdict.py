from __future__ import annotations

import numpy as np
import pandas as pd

from pronk_pin.compare import Results
from pronk_pin.compare.report.terminal import format_suite, format_tables
from pronk_pin.compare.report.verdict import suite_verdict, verdict


def test_the_verdict_says_in_words_what_the_numbers_say(eight: pd.DataFrame) -> None:
    words = verdict(eight, scenario="nominal")
    # Every robot has the same reduction: nothing scatters, and an interval of width 0 is none.
    assert "by 80% in the calf and 80% in the thigh against PD (80% and 80% at the worst" in words
    assert "within 8 strides at every speed" in words
    said = (
        "It beats the model's feedforward in the calf and does worse than it in the thigh: 0.0300"
    )
    assert f"{said} against 0.0450 rad in the calf" in words
    assert "Robot by robot, 4 of 8 come to beat it in both joints, after 3 strides" in words
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


def test_a_difference_that_may_be_chance_is_called_so(eight: pd.DataFrame) -> None:
    model = (eight["controller"] == "model") & (eight["joint"] == "calf")
    eight.loc[model & (eight["metric"] == "peak_error"), "value"] = [0.019, 0.042] * 4
    said = "cannot be told from it in the calf (the difference may be chance)"
    assert said in verdict(eight, scenario="nominal")


def test_two_robots_prove_nothing_and_one_speed_is_not_the_worst(summary: pd.DataFrame) -> None:
    words = verdict(summary, scenario="nominal")
    assert (
        "beats the model's feedforward stays open, as an interval of the difference takes 8"
        in words
    )
    alone = verdict(summary[summary["speed"] == 0.3], scenario="nominal")
    assert "worst" not in alone
    assert "by 80% in the calf and 80% in the thigh against PD, within 4 strides" in alone


def test_the_control_arm_is_named_for_what_it_shows(summary: pd.DataFrame) -> None:
    arm = summary[summary["controller"] == "pd"].assign(controller="ilc-zero")
    both = pd.concat([summary, arm])
    assert "shows nothing: every peak error is PD's" in verdict(both, scenario="nominal")
    arm.loc[arm["metric"] == "peak_error", "value"] *= 1.1
    both = pd.concat([summary, arm])
    assert "differs from PD by up to 0.02" in verdict(both, scenario="nominal")


def test_the_verdict_over_all_worlds_counts_them_and_names_the_exceptions(
    eight: pd.DataFrame,
) -> None:
    other = eight.assign(scenario="slope")
    down = other.index[(other["metric"] == "upright") & (other["controller"] == "pd")][0]
    other.loc[down, "value"] = 0.0
    words = suite_verdict(pd.concat([eight, other], ignore_index=True))
    assert "In 2 scenarios" in words
    assert "In the calf it is better in 2 of 2." in words
    assert "In the thigh it is better in 0 of 2; worse in nominal, slope." in words
    assert "8 of 16 robots come to beat it in both joints" in words
    assert "Robots fell: 1 of 8 in slope under pd." in words


def test_worlds_stand_one_below_the_other_in_a_terminal(eight: pd.DataFrame) -> None:
    text = format_suite(pd.concat([eight, eight.assign(scenario="slope")]))
    assert text.count("intervals over the speeds") == 2
    assert "yes/no" in text
    assert "3 (4/8)" in text
    assert "nan" not in text
    assert max(map(len, text.splitlines())) <= 120


def test_one_world_alone_needs_no_verdict_over_all_without_the_model(
    summary: pd.DataFrame,
) -> None:
    assert suite_verdict(summary[summary["controller"] != "model"]) == ""
    assert np.isfinite(summary["value"].dropna()).all()


def scattered(summary: pd.DataFrame, k: int) -> pd.DataFrame:
    """The summary with errors that are a little larger in each of eight worlds, one in the mean."""
    errors = summary["metric"].str.endswith("error") & (summary["joint"] != "-")
    factor = 1.0 + 0.01 * (k - 3.5)
    return summary.assign(value=summary["value"].where(~errors, factor * summary["value"]))


def test_of_sampled_worlds_each_counts_once(summary: pd.DataFrame) -> None:
    worlds = [scattered(summary, k).assign(scenario=f"random-4-{k}") for k in range(8)]
    odd = (worlds[0]["controller"] == "ilc") & (worlds[0]["joint"] == "calf")
    worlds[0].loc[odd & (worlds[0]["metric"] == "peak_error"), "value"] = 0.2
    words = verdict(pd.concat(worlds, ignore_index=True), scenario="random-4")
    assert words.startswith(
        "In 8 sampled scenarios, at 2 speeds in each, learning cuts the mean peak"
    )
    assert "for the worst robot)" in words
    # calf: better but for the odd world, so open; thigh: worse everywhere
    assert "It cannot be told from the model's feedforward in the calf and does worse than" in words
    assert "less in 7 of 8 scenarios, and the probability that a robot improves is 88% (" in words
    assert "by paired differences +7.5 mrad (+7.3 to +7.7); it is less in 0 of 8 scenarios" in words
    assert "8 of 16 robots come to beat the model in both joints and stay there" in words


def test_practice_that_wins_in_every_sampled_world_does_so_beyond_doubt(
    summary: pd.DataFrame,
) -> None:
    thigh = (summary["controller"] == "model") & (summary["joint"] == "thigh")
    summary.loc[thigh, "value"] *= 10.0
    worlds = pd.concat([scattered(summary, k).assign(scenario=f"random-4-{k}") for k in range(8)])
    words = verdict(worlds.reset_index(drop=True), scenario="random-4")
    assert "It beats the model's feedforward in calf and thigh beyond doubt." in words
    text = format_tables(worlds.reset_index(drop=True), scenario="random-4")
    assert "intervals over the scenarios" in text
    assert "nan" not in text
