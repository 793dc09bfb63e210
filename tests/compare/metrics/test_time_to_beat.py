"""When practice beats the model, on strides made by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin.compare.metrics.metrics import peak_history
from pronk_pin.compare.metrics.time_to_beat import (
    WINDOW,
    PeakHistory,
    beat_rows,
    beaten,
    strides_to_beat,
)


def test_the_model_is_beaten_from_the_first_stride_that_stays_below_it() -> None:
    peaks = np.array([0.10, 0.08, 0.06, 0.04, *[0.02] * 20])
    assert strides_to_beat(peaks, 0.05) == 4.0  # earlier means are below it, but not the strides
    assert strides_to_beat(peaks, 0.2) == 1.0
    assert np.isnan(strides_to_beat(peaks, 0.01))


def test_one_unlucky_stride_does_not_undo_it_but_a_relapse_does() -> None:
    peaks = np.full(30, 0.02)
    peaks[15] = 0.06
    assert strides_to_beat(peaks, 0.04) == 1.0
    peaks[15 : 15 + WINDOW] = 0.06
    assert strides_to_beat(peaks, 0.04) > 15.0
    peaks[-WINDOW:] = 0.06
    assert np.isnan(strides_to_beat(peaks, 0.04))


def test_the_same_error_does_not_beat_it() -> None:
    assert np.isnan(strides_to_beat(np.full(20, 0.05), 0.05))
    assert np.isnan(strides_to_beat(np.zeros(WINDOW - 1), 0.05))


@pytest.fixture
def simulated() -> Callable[..., PeakHistory]:
    def build(controller: str, calf: float, thigh: float, *, upright: float = 1.0) -> PeakHistory:
        settings = {"robot": "a1", "base": "locked", "scenario": "nominal", "seed": 0}
        learns = controller != "model"
        peaks = np.column_stack([np.linspace(0.1, calf, 41), np.linspace(0.1, thigh, 41)])
        return PeakHistory(
            {**settings, "controller": controller},
            np.array([0.3]),
            (peaks if learns else np.empty((0, 2)),),
            np.array([[calf, thigh]]),
            np.array([upright]),
        )

    return build


def values(histories: list[PeakHistory]) -> dict[str, float]:
    rows = list(beat_rows(histories))
    assert {row["metric"] for row in rows} == {"strides_to_beat_model"}
    return {str(row["joint"]): float(row["value"]) for row in rows}  # type: ignore[arg-type]


def test_both_joints_count_and_the_later_one_decides(
    simulated: Callable[..., PeakHistory],
) -> None:
    found = values([simulated("model", 0.05, 0.08), simulated("ilc", 0.0, 0.0)])
    assert found["thigh"] < found["calf"] == found["-"]
    one_is_not_enough = values([simulated("model", 0.05, 0.001), simulated("ilc", 0.0, 0.01)])
    assert np.isfinite(one_is_not_enough["calf"])
    assert np.isnan(one_is_not_enough["-"])


def test_who_fell_has_beaten_nobody(simulated: Callable[..., PeakHistory]) -> None:
    found = values([simulated("model", 0.05, 0.08), simulated("ilc", 0.0, 0.0, upright=0.0)])
    assert np.isnan(list(found.values())).all()


def test_without_the_model_there_is_nobody_to_beat(simulated: Callable[..., PeakHistory]) -> None:
    assert not list(beat_rows([simulated("ilc", 0.0, 0.0)]))
    assert not list(beat_rows([simulated("model", 0.0, 0.0)]))


def test_the_count_of_those_who_beat_it_leaves_nobody_out() -> None:
    summary = pd.DataFrame(
        {
            "controller": "ilc",
            "joint": "-",
            "metric": "strides_to_beat_model",
            "value": [3.0, 5.0, np.nan, 9.0],
        }
    )
    assert beaten(summary, controller="ilc") == (5.0, 3, 4)
    median, did, all_ = beaten(summary, controller="pd")
    assert np.isnan(median)
    assert (did, all_) == (0, 0)


def test_strides_are_read_as_they_are_stored() -> None:
    kinds = ["hip", "thigh", "calf"]
    peaks = np.add.outer(np.arange(6.0), [0.0, 10.0, 20.0])
    strides = xr.Dataset(
        {
            "count": ("speed", [5]),
            "peak_error": (("speed", "stride", "joint"), peaks[None]),
            "learning": (("speed", "stride"), [[0.0, 0.0, 1.0, 1.0, 1.0, np.nan]]),
            "upright": (("speed", "stride"), [[1.0] * 5 + [np.nan]]),
        },
        coords={"speed": [0.3], "stride": np.arange(6), "kind": ("joint", kinds)},
        attrs={
            "robot": "a1",
            "base": "locked",
            "scenario": "s",
            "controller": "ilc",
            "seed": 2,
        },
    )
    found = peak_history(strides)
    np.testing.assert_allclose(found.learning[0], [[22, 12], [23, 13], [24, 14]])
    np.testing.assert_allclose(found.level, [[23, 13]])
    assert found.upright.tolist() == [1.0]
