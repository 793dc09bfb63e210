"""Where there is nothing to conclude from, words say so: no number, no verdict, no warning."""

from __future__ import annotations

import re
import shutil
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin.compare import Results, summarize
from pronk_pin.compare.metrics.metrics import peak_history
from pronk_pin.compare.metrics.statistics import compare_controllers
from pronk_pin.compare.metrics.time_to_beat import lessons
from pronk_pin.compare.report.difference import format_changes
from pronk_pin.compare.report.limitations import limitations
from pronk_pin.compare.report.overview import overview
from pronk_pin.compare.report.tables import (
    beside_the_paper,
    sampled_scenarios,
    worst_reduction,
)
from pronk_pin.compare.report.terminal import format_suite, format_tables
from pronk_pin.compare.report.verdict import suite_verdict, verdict
from pronk_pin.compare.studies.gain_reduction import describe_gains
from pronk_pin.compare.studies.learning_runs import mean_peaks
from pronk_pin.compare.studies.reproduce import format_reproduction
from pronk_pin.compare.studies.reuse.seeding import LEARNERS, describe_seeding
from pronk_pin.compare.studies.reuse.transfer import describe_transfers
from pronk_pin.control import SKIPPED
from pronk_pin.viz.figures.learning_figures import errors_by_seed
from pronk_pin.viz.figures.suite_figures import by_scenario


@pytest.fixture(autouse=True)
def _no_warnings() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def let_fall(summary: pd.DataFrame, *controllers: str, speed: float | None = None) -> pd.DataFrame:
    """The summary with the robots of some controllers, by default of all, on the ground."""
    down = summary["metric"] == "upright"
    down &= summary["controller"].isin(controllers or summary["controller"].unique())
    down &= (summary["speed"] == speed) if speed is not None else True
    return summary.assign(value=summary["value"].where(~down, 0.0))


def lesson_rows(summary: pd.DataFrame, **counts: float) -> pd.DataFrame:
    """The summary with what each robot's strides of learning were worth to `ilc`."""
    one = summary[(summary["controller"] == "ilc") & (summary["metric"] == "upright")]
    rows = [one.assign(metric=metric, value=value) for metric, value in counts.items()]
    return pd.concat([summary, *rows], ignore_index=True)


def check_words(text: str) -> None:
    assert not re.search(r"\b(nan|inf)\b|nan%|inf%", text, re.IGNORECASE)
    assert max(map(len, text.splitlines())) <= 120


def test_where_all_fell_the_terminal_says_so_and_shows_no_number(summary: pd.DataFrame) -> None:
    text = format_tables(let_fall(summary), scenario="nominal")
    check_words(text)
    flat = " ".join(text.split())
    assert "no robot stayed up under learning and under PD. All 6 robots fell." in flat
    assert "Nothing stands beside the paper's Table I: no robot stayed up." in flat
    assert "wins" not in text
    assert "intervals over" not in text
    assert "%" not in text.split("upright")[-1]


@pytest.mark.parametrize(
    ("controller", "clause"),
    [
        ("ilc", "Nothing is concluded: no robot stayed up under learning. 2 robots fell."),
        ("pd", "Nothing is concluded: no robot stayed up under PD. 2 robots fell."),
        ("model", "nothing is concluded: no robot stayed up under the model's feedforward."),
    ],
)
def test_who_fell_altogether_is_named(summary: pd.DataFrame, controller: str, clause: str) -> None:
    fallen = let_fall(summary, controller)
    words = verdict(fallen, scenario="nominal")
    assert clause in words
    check_words(format_tables(fallen, scenario="nominal"))
    assert ("cuts the mean peak" in words) == (controller == "model")
    assert "beats the model" not in words


def test_robots_that_stand_at_other_speeds_only_cannot_be_compared(summary: pd.DataFrame) -> None:
    fallen = let_fall(let_fall(summary, "ilc", speed=0.3), "pd", speed=0.35)
    words = verdict(fallen, scenario="nominal")
    assert "no robot has an error to compare under both learning and PD" in words
    assert np.isnan(worst_reduction(fallen, scenario="nominal", controller="ilc")["calf"])
    check_words(format_tables(fallen, scenario="nominal"))


def test_errors_that_are_missing_are_not_compared(summary: pd.DataFrame) -> None:
    lost = summary["metric"].isin(["peak_error", "rms_error"]) & (summary["controller"] == "ilc")
    summary.loc[lost, "value"] = np.nan
    text = format_tables(summary, scenario="nominal")
    check_words(text)
    assert "no robot has an error to compare under both learning and PD" in " ".join(text.split())


def test_two_falls_are_no_win_and_no_tie(summary: pd.DataFrame) -> None:
    mine = {"scenario": "nominal", "controller": "ilc", "against": "model"}
    nobody = compare_controllers(let_fall(summary, "ilc", "model"), **mine)
    assert nobody.pairs == 0
    assert np.isnan(nobody.improvement.value)
    assert nobody.better is None
    one = compare_controllers(let_fall(summary, "ilc", "model", speed=0.35), **mine)
    assert (one.pairs, one.improvement.value) == (1, 1.0)  # of the one pair that tells
    calf = overview(let_fall(summary), scenario="nominal")["ilc"].joints["calf"]
    assert (calf.better, calf.pairs) == (None, 0)


def test_the_papers_table_has_no_errors_of_the_fallen(summary: pd.DataFrame) -> None:
    fallen = let_fall(summary, "ilc", speed=0.35)
    table = beside_the_paper(fallen, scenario="nominal")
    assert table.loc[0.3, ("calf", "ours", "ILC")] == pytest.approx(0.02)
    assert np.isnan(table.loc[0.35, ("calf", "ours", "ILC")])
    assert table.loc[0.35, ("calf", "ours", "PD")] == pytest.approx(0.2)
    # means of the same speeds, not of 0.3 and 0.35 m/s against 0.3 m/s alone
    assert table.loc["mean", ("calf", "ours")].tolist() == pytest.approx([0.1, 0.02, 0.8])
    text = " ".join(format_tables(fallen, scenario="nominal").split())
    assert "robots that stayed up: 1 of 4 did not." in text
    everywhere = let_fall(summary, "pd", "ilc", speed=0.35)
    assert beside_the_paper(everywhere, scenario="nominal").index.tolist() == [0.3, "mean"]
    assert beside_the_paper(let_fall(summary), scenario="nominal").empty


def test_the_worst_speed_is_one_at_which_the_robot_stood(summary: pd.DataFrame) -> None:
    worse = (summary["controller"] == "ilc") & (summary["speed"] == 0.35)
    summary.loc[worse & (summary["metric"] == "peak_error"), "value"] = 3.0
    fallen = let_fall(summary, "ilc", speed=0.35)
    worst = worst_reduction(fallen, scenario="nominal", controller="ilc")
    assert worst["calf"] == pytest.approx(0.8)
    assert "at some speed it has not settled" in verdict(fallen, scenario="nominal")


def test_practice_that_nothing_taught_has_no_verdict_but_its_reasons(summary: pd.DataFrame) -> None:
    taught = {"strides_of_learning": 7.0, "skipped_false_touchdown": 4.0, "skipped_too_long": 3.0}
    idle = lesson_rows(summary, **taught)
    found = lessons(idle, controller="ilc")
    assert found is not None
    assert (found.strides, found.taught) == (14, 0)
    words = verdict(idle, scenario="nominal")
    assert words == (
        "Nothing is concluded: learning learned from none of its 14 strides of learning "
        "(6 too long, 8 false touchdown). No robot fell."
    )
    row = next(
        line for line in format_tables(idle, scenario="nominal").splitlines() if "ilc" in line
    )
    assert "yes" not in row  # it is PD that does better or worse there
    once = lesson_rows(summary, **{**taught, "skipped_too_long": 2.0})
    assert "cuts the mean peak error" in verdict(once, scenario="nominal")


def test_learning_that_was_never_switched_on_is_no_practice(summary: pd.DataFrame) -> None:
    learned = ["strides_to_converge", "strides_to_beat_model"]
    never = summary[~summary["metric"].isin(learned)]
    words = verdict(never, scenario="nominal")
    assert words.startswith("Nothing is concluded: learning was never switched on")
    check_words(format_tables(never, scenario="nominal"))


def test_a_robot_without_a_finished_stride_neither_stands_nor_fell(summary: pd.DataFrame) -> None:
    summary.loc[(summary["speed"] == 0.35) & (summary["controller"] == "ilc"), "value"] = np.nan
    row = overview(summary, scenario="nominal")["ilc"]
    assert (row.upright, row.fell, row.robots) == (1, 0, 2)
    text = format_tables(summary, scenario="nominal")
    check_words(text)
    assert "No robot fell. One robot finished no stride." in " ".join(text.split())


def test_a_world_of_the_fallen_does_not_spoil_the_others(eight: pd.DataFrame) -> None:
    both = pd.concat([eight, let_fall(eight).assign(scenario="slope")], ignore_index=True)
    words = suite_verdict(both)
    assert "In the calf it is better in 1 of 1." in words
    assert "In slope nothing is concluded: no robot stayed up under learning and under the" in words
    assert "less by 80% in nominal. " in words
    check_words(format_suite(both))


def test_worlds_that_all_fell_tell_nothing_together(summary: pd.DataFrame) -> None:
    fallen = let_fall(summary)
    both = pd.concat([fallen, fallen.assign(scenario="slope")], ignore_index=True)
    words = suite_verdict(both)
    assert "In nominal nothing is concluded" in words
    assert "In slope nothing is concluded" in words
    assert "better" not in words
    assert "Against PD" not in words
    check_words(format_suite(both))


def test_sampled_worlds_of_the_fallen_are_not_counted_as_lost(summary: pd.DataFrame) -> None:
    worlds = [summary.assign(scenario=f"random-4-{k}") for k in range(9)]
    for k, world in enumerate(worlds):
        world.loc[world["metric"] == "peak_error", "value"] *= 1.0 + 0.01 * k
    worlds[2] = let_fall(worlds[2])
    some = pd.concat(worlds, ignore_index=True)
    words = verdict(some, scenario="random-4")
    assert "it is less in 8 of 8 scenarios" in words
    assert "6 robots fell." in words
    check_words(format_tables(some, scenario="random-4"))
    nobody = pd.concat(map(let_fall, worlds), ignore_index=True)
    assert verdict(nobody, scenario="random-4").startswith("Nothing is concluded: no robot stayed")
    drawn = sampled_scenarios(nobody, scenario="random-4")
    assert drawn["calf"].isna().to_numpy().all()
    panels = by_scenario(drawn).axes
    assert [axes.texts[0].get_text() for axes in panels] == ["no robot stayed up"] * 2
    check_words(format_tables(nobody, scenario="random-4"))


@pytest.mark.parametrize("missing", [["pd"], ["ilc"], ["model"], ["pd", "ilc"], ["pd", "model"]])
@pytest.mark.parametrize("speeds", [1, 2])
def test_what_was_not_run_is_named(summary: pd.DataFrame, missing: list[str], speeds: int) -> None:
    some = summary[~summary["controller"].isin(missing)]
    some = some[some["speed"].isin([0.3, 0.35][:speeds])]
    text = format_tables(some, scenario="nominal")
    check_words(text)
    needed = [name for name in missing if name != "model"]
    said = f"There is no verdict: it takes {' and '.join(needed)}, which did not run."
    assert (said in " ".join(text.split())) == bool(needed)
    remedy = f"Run again with '--controllers {' '.join(needed)}' and the same --folder"
    assert (remedy in " ".join(text.split())) == bool(needed)
    check_words(format_suite(pd.concat([some, some.assign(scenario="slope")])))


@pytest.fixture
def copy(comparison: Results, tmp_path: Path) -> Results:
    """A copy of the small comparison, to be spoiled."""
    return Results(shutil.copytree(comparison.folder, tmp_path / "copy"), comparison.experiment)


def spoil(results: Results, controller: str, **changed: float) -> None:
    """Give variables of a controller's strides a value, and make the summary again."""
    for cell in results.experiment.cells():
        if cell.controller == controller:
            strides = results.strides(cell)
            finished = strides["stride"] < strides["count"]
            values = {name: xr.where(finished, value, np.nan) for name, value in changed.items()}
            results.save(cell, strides.assign(values).assign_attrs(strides.attrs))


def test_the_summary_counts_what_taught_nothing_and_why(copy: Results) -> None:
    before = lessons(copy.summary(), controller="ilc")
    assert before is not None
    assert 0 < before.taught == before.strides - sum(before.skipped.values())
    assert lessons(copy.summary(), controller="pd") is None
    spoil(copy, "ilc", skipped=float(SKIPPED.index("tilted")))
    after = lessons(copy.summary(), controller="ilc")
    assert after == (before.strides, {"tilted": before.strides})


def test_limitations_of_the_fallen_hold_no_mean(copy: Results) -> None:
    for controller in copy.experiment.controllers:
        spoil(copy, controller, upright=0.0)
    text = "\n".join(limitations(copy))
    assert not re.search(r"\b(nan|inf)\b", text)
    assert "No robot stayed up: there is no mean error" in text
    assert "times the paper's" not in text


def test_the_reproduction_leaves_the_fallen_out_and_says_so(copy: Results) -> None:
    spoil(copy, "ilc", upright=0.0)
    text = format_reproduction(copy, learners=("ilc",))
    assert not re.search(r"\b(nan|inf)\b|nan%", text)
    assert "Robots that did not stay up are in no number: 2 under ilc." in text
    assert "nothing to compare" in text
    spoil(copy, "pd", upright=0.0)
    text = format_reproduction(copy, learners=("ilc",))
    assert not re.search(r"\b(nan|inf)\b|nan%", text)


def test_changes_between_the_fallen_are_none(copy: Results, comparison: Results) -> None:
    for controller in copy.experiment.controllers:
        spoil(copy, controller, upright=0.0)
    text = format_changes(comparison, copy)
    assert text.count("worse (+2 fell)") == 6
    assert not re.search(r"\b(nan|inf)\b", text)
    text = format_changes(copy, copy)
    assert "0 of 6 means changed" in text
    assert "Of 6 nothing is concluded: no robot stayed up in both." in text


def unfinished(strides: xr.Dataset, count: list[int]) -> xr.Dataset:
    """The strides as if each robot had finished only so many."""
    cut = strides.isel(stride=slice(max(count))).assign(count=("speed", count))
    finished = cut["stride"] < cut["count"]
    per_stride = [name for name in cut.data_vars if "stride" in cut[name].dims]
    cut = cut.assign({name: cut[name].where(finished) for name in per_stride})
    return cut.assign_attrs(strides.attrs)


def test_a_robot_without_a_finished_stride_can_be_summarised(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="ilc"))
    table = summarize(unfinished(strides, [20, 0]))
    slow = table["speed"] == strides["speed"].to_numpy()[0]
    upright, peak = table["metric"] == "upright", table["metric"] == "peak_error"
    assert table[slow & upright]["value"].tolist() == [1.0]
    assert table[~slow & upright]["value"].isna().all()
    assert table[slow & peak]["value"].notna().all()
    assert table[~slow & peak]["value"].isna().all()
    assert np.isnan(peak_history(unfinished(strides, [20, 0])).upright[1])


def test_a_simulation_without_a_finished_stride_can_be_summarised(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="ilc"))
    none = unfinished(strides, [0, 0])
    table = summarize(none)
    assert table[table["metric"] == "upright"]["value"].isna().tolist() == [True, True]
    assert np.isnan(peak_history(none).upright).all()


def sweep(**changed: tuple[float, ...]) -> pd.DataFrame:
    """A sweep of gains of two robots: all and half the gains, without and with what was learned."""
    columns = {"thigh": (0.1, 0.02, 0.2, 0.03), "calf": (0.1, 0.02, 0.2, 0.03)}
    columns |= {"upright": (2, 2, 2, 2), **changed}
    table = pd.DataFrame({"share": (1.0, 1.0, 0.5, 0.5), "learned": (False, True) * 2, **columns})
    return table.assign(robots=2)


def test_gains_at_which_all_fall_answer_nothing() -> None:
    lost = (np.nan, 0.02, 0.2, 0.03)
    text = describe_gains(sweep(thigh=lost, calf=lost, upright=(0, 2, 2, 2)))
    assert "Nothing is concluded: no robot stayed up with full gains" in text
    assert "nan" not in text
    lost = (0.1, 0.02, np.nan, 0.03)
    text = describe_gains(sweep(thigh=lost, calf=lost, upright=(2, 2, 0, 2)))
    assert "Yes: down to 50% of the gains" in text
    assert "all fell with those gains alone" in text
    assert "nan" not in text


def test_a_transfer_to_where_practice_falls_is_open() -> None:
    columns = ["task", "thigh", "calf", "thigh_relearned", "calf_relearned", "reuse", "right"]
    rows = [
        ("at home", 0.02, 0.02, 0.02, 0.02, True, True),
        ("left out +0.30 m/s", 0.03, 0.03, 0.02, 0.02, True, False),
        ("slope", np.nan, np.nan, np.nan, np.nan, False, True),
    ]
    text = describe_transfers(pd.DataFrame(rows, columns=columns))
    assert "learn again: open, as no robot stayed up that learned there" in text
    assert "Of 2 answers of the rule 1 let stored feedforward be reused" in text
    assert "nan" not in text
    text = describe_transfers(pd.DataFrame(rows[2:], columns=columns))
    assert "Nothing is concluded: no robot stayed up that learned." in text


def test_peaks_of_a_sweep_are_those_of_the_robots_that_stayed_up() -> None:
    peaks = np.ones((2, 5, 12)) * np.array([0.1, 7.0])[:, None, None]

    def found(upright: list[bool]) -> dict[str, float | int]:
        variables = {
            "count": ("speed", [5, 5]),
            "peak_error": (("speed", "stride", "joint"), peaks),
            "upright": (("speed", "stride"), np.outer(upright, np.ones(5))),
        }
        return mean_peaks(xr.Dataset(variables))

    assert found([True, False])["calf"] == pytest.approx(0.1)
    assert found([True, False])["upright"] == 1
    assert np.isnan(found([False, False])["calf"])


def seeded(fallen: tuple[str, ...]) -> pd.DataFrame:
    """Two speeds under each of the learners; some controllers' robots fall at 0.2 m/s."""
    rows = [
        {"controller": name, "speed": speed, "stride": k, "thigh": error, "calf": error}
        | {"upright": not (name in fallen and speed == 0.2 and k > 5)}
        for name in LEARNERS
        for speed, scale in ((0.2, 10.0), (0.3, 1.0))
        for k, error in enumerate(scale * 0.01 * (1.0 + 9.0 * 0.5 ** np.arange(20)))
    ]
    return pd.DataFrame(rows)


def test_seeds_are_compared_by_the_robots_that_stayed_up() -> None:
    text = describe_seeding(seeded(("model+ilc",)))
    assert ", 1 of 2, 1 fell" in text
    (line,) = (line for line in text.splitlines() if "1 fell" in line)
    assert "0.1000" in line  # of 0.3 m/s alone
    assert "1.0000" not in line
    alone = seeded(LEARNERS)
    text = describe_seeding(alone[alone["speed"] == 0.2])
    assert text.count("never, 1 fell") == len(LEARNERS)
    assert "nan" not in text
    assert errors_by_seed(alone[alone["speed"] == 0.2]).axes[0].texts[0].get_text() == (
        "no robot stayed up"
    )
