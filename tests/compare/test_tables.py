from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare import Results
from pronk_pin.compare.metrics import COLUMNS
from pronk_pin.compare.tables import (
    beside_the_paper,
    format_tables,
    overview,
    verdict,
    worst_reduction,
)

PEAKS = {"pd": (0.10, 0.05), "ilc": (0.02, 0.01), "model": (0.03, 0.005)}


@pytest.fixture
def summary() -> pd.DataFrame:
    """Two speeds, of which the paper has one; errors twice as large at the other."""
    rows: list[dict[str, object]] = []
    for controller, peaks in PEAKS.items():
        for speed, scale in ((0.3, 1.0), (0.35, 2.0)):
            key = {"robot": "a1", "base": "locked", "scenario": "nominal", "speed": speed}
            key |= {"controller": controller, "seed": 0}
            for joint, peak in zip(("calf", "thigh"), peaks, strict=True):
                for metric, share in (("peak_error", 1.0), ("rms_error", 0.1)):
                    value = scale * share * peak
                    rows.append({**key, "joint": joint, "metric": metric, "value": value})
            scalars = {"upright": 1.0, "feedback_share": 0.2, "speed_error": 0.1 * (scale - 1.5)}
            scalars["apex_error"] = 0.0
            if controller == "ilc":
                scalars["strides_to_converge"] = 4.0 * scale
            rows += [{**key, "joint": "-", "metric": m, "value": v} for m, v in scalars.items()]
    return pd.DataFrame(rows).assign(unit="1")[COLUMNS]


def test_our_errors_stand_beside_the_papers_at_the_same_speed(summary: pd.DataFrame) -> None:
    table = beside_the_paper(summary, scenario="nominal")
    assert table.index.tolist() == [0.3, 0.35, "mean"]
    assert table.loc[0.3, ("calf", "ours")].tolist() == pytest.approx([0.10, 0.02, 0.8])
    assert table.loc[0.3, ("calf", "paper", "PD")] == 0.089
    assert np.isnan(table.loc[0.35, ("calf", "paper", "PD")])
    assert table.loc["mean", ("thigh", "ours")].tolist() == pytest.approx([0.075, 0.015, 0.8])


def test_the_overview_has_means_reductions_and_the_slowest_speed(summary: pd.DataFrame) -> None:
    table = overview(summary, scenario="nominal")
    assert set(table.index) == set(PEAKS)
    ilc = table.loc["ilc"]
    assert ilc["calf"] == pytest.approx(0.03)
    assert ilc["calf_reduction"] == pytest.approx(0.8)
    assert ilc["strides"] == 8.0
    assert ilc["speed_error"] == pytest.approx(0.05)  # magnitudes do not cancel
    assert (ilc["upright"], ilc["robots"]) == (2, 2)


def test_the_worst_reduction_is_that_of_the_worst_speed(summary: pd.DataFrame) -> None:
    worse = (summary["controller"] == "ilc") & (summary["speed"] == 0.35)
    worse &= (summary["metric"] == "peak_error") & (summary["joint"] == "calf")
    summary.loc[worse, "value"] = 0.3
    worst = worst_reduction(summary, scenario="nominal", controller="ilc")
    assert worst["calf"] == pytest.approx(-0.5)
    assert worst["thigh"] == pytest.approx(0.8)


def test_the_verdict_says_in_words_what_the_numbers_say(summary: pd.DataFrame) -> None:
    words = verdict(summary, scenario="nominal")
    assert "by 80% in the calf and 80% in the thigh against PD" in words
    assert "within 8 strides at every speed" in words
    assert "It beats the model's feedforward in the calf only" in words
    assert words.endswith("No robot fell.")


def test_the_verdict_does_not_hide_a_fall_or_a_speed_that_never_settles(
    summary: pd.DataFrame,
) -> None:
    summary.loc[summary[summary["metric"] == "upright"].index[0], "value"] = 0.0
    summary.loc[summary["metric"] == "strides_to_converge", "value"] = np.nan
    words = verdict(summary, scenario="nominal")
    assert "at some speed it has not settled" in words
    assert "No robot fell" not in words


def test_one_speed_that_never_settles_is_not_hidden_by_the_others(summary: pd.DataFrame) -> None:
    settled = summary["metric"] == "strides_to_converge"
    summary.loc[summary[settled].index[0], "value"] = np.nan
    assert np.isnan(overview(summary, scenario="nominal").loc["ilc", "strides"])


def test_there_is_no_verdict_without_pd(summary: pd.DataFrame) -> None:
    assert verdict(summary[summary["controller"] != "pd"], scenario="nominal") == ""


def test_the_tables_of_a_comparison_can_be_printed(comparison: Results) -> None:
    text = format_tables(comparison.summary(), scenario="nominal")
    assert "nan" not in text
    assert max(map(len, text.splitlines()[:12])) <= 120
    assert "library" in text
