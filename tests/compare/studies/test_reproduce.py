"""Table I beside ours, and readings of its metric on strides whose errors are known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin.compare import Results, steady
from pronk_pin.compare.metrics.paper_table import table_1
from pronk_pin.compare.studies.reproduce import (
    READINGS,
    VARIABLES,
    format_reproduction,
    readings,
    row_by_row,
)
from pronk_pin.robot import load_robot


def test_every_reading_is_ordered_as_its_name_says(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="pd"), VARIABLES)
    strides["error"] = strides["error"].sel(part="stance")
    end = steady(strides)
    values = {name: read(end).transpose("speed", "joint") for name, read in READINGS.items()}
    assert all(value.shape == (2, 3) for value in values.values())
    peak = values["peak, mean over legs and strides"]
    for smaller in ("peak of the mean stride", "peak after the first 50 ms", "RMS"):
        assert (values[smaller] <= peak * 1.001).all(), smaller
    assert (values["mean magnitude"] <= values["RMS"] + 1e-9).all()
    assert (values["peak from when it is felt"] <= peak).all()
    assert (values["largest peak of any stride"] >= peak).all()


def test_readings_of_one_stride_known_by_hand() -> None:
    phase = np.linspace(0.0, 1.0, 41)
    error = np.zeros((1, 1, 41, 12))
    error[0, 0, 2] = 0.09  # in the transient: 0.05 of 0.2 s
    error[0, 0, 20] = -0.04  # in the middle
    joints = load_robot("a1").joint_coordinates
    end = xr.Dataset(
        {
            "error": (("speed", "stride", "phase", "joint"), error),
            "planned_duration": (("speed", "part"), [[0.2, 0.2]]),
        },
        coords={"phase": phase, **joints, "part": ["stance", "flight"], "speed": [0.3]},
    )
    late = READINGS["peak after the first 50 ms"](end).sel(joint="calf")
    np.testing.assert_allclose(late, 0.04)
    middle = READINGS["error in the middle of stance"](end).sel(joint="thigh")
    np.testing.assert_allclose(middle, 0.04)
    np.testing.assert_allclose(READINGS["peak of the mean stride"](end), 0.09)


def test_rows_stand_beside_the_papers_with_an_interval_over_the_seeds(
    summary: pd.DataFrame,
) -> None:
    rng = np.random.default_rng(0)
    parts = []
    for seed in range(8):
        part = summary.assign(seed=seed)
        part.loc[part["metric"] == "peak_error", "value"] *= rng.uniform(0.9, 1.1)
        parts.append(part)
    table = row_by_row(pd.concat(parts), scenario="nominal")
    row = table.loc[("calf", "pd", 0.3)]
    assert row["paper"] == 0.089
    assert row["peak_low"] < row["peak"] < row["peak_high"]
    one_seed = row_by_row(summary, scenario="nominal").loc[("calf", "pd", 0.3)]
    assert np.isnan(one_seed["peak_low"])


def test_the_nearest_reading_stands_first_and_a_perfect_one_has_no_distance(
    comparison: Results, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = readings(comparison, learners=("ilc",))
    assert table["distance"].is_monotonic_increasing
    assert (table["distance"] > 0).all()
    assert len(table) == len(READINGS)
    rows = table_1().copy()
    own = row_by_row(comparison.summary(), scenario="nominal")
    for index, row in rows.iterrows():
        key = (row["joint"], row["controller"], row["speed"])
        if key in own.index:
            rows.loc[index, "value"] = own.loc[key, "peak"]
    monkeypatch.setattr("pronk_pin.compare.studies.reproduce.table_1", lambda: rows)
    best = readings(comparison, learners=("ilc",)).iloc[0]
    assert best["distance"] == pytest.approx(0.0, abs=1e-6)
    assert best.name[1].startswith("peak")


def test_it_can_be_printed(comparison: Results) -> None:
    text = format_reproduction(comparison, learners=("ilc",))
    assert "calf [rad]: peak stance error" in text
    assert "the paper" in text
    assert max(map(len, text.splitlines())) <= 125
