"""Metrics of strides that are all different: by robot, stride, leg and joint.

Each number is computed once more by a loop over what its definition names.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin._typing import Array
from pronk_pin.compare import summarize
from pronk_pin.compare.metrics import PeakHistory, beat_rows, by_joint
from pronk_pin.compare.metrics.time_to_beat import strides_to_beat
from pronk_pin.control import PARTS, SKIPPED
from pronk_pin.robot import load_robot

KINDS = ("hip", "thigh", "calf")
COUNTS, STRIDES, BEFORE = (55, 48), 60, 12
SPEEDS = (0.1, 0.4)


@pytest.fixture(scope="module")
def strides() -> xr.Dataset:
    """Two robots whose every stride, leg and joint has its own numbers; NaN after the last."""
    rng = np.random.default_rng(3)
    stride, curve = ("speed", "stride"), ("speed", "stride", "part", "phase", "joint")
    shape, joints = (len(SPEEDS), STRIDES), load_robot("a1").joint_coordinates

    def some(*more: int) -> Array:
        values = rng.uniform(0.01, 0.1, (*shape, *more))
        for robot, count in enumerate(COUNTS):
            values[robot, count:] = np.nan
        return values

    learning = np.where(np.isnan(some()), np.nan, np.arange(STRIDES) >= BEFORE)
    reasons = np.where(np.isnan(learning), np.nan, rng.integers(0, len(SKIPPED), shape))
    return xr.Dataset(
        {
            "count": ("speed", list(COUNTS)),
            "planned_apex": ("speed", [0.33, 0.35]),
            **{
                name: ((*stride, "joint"), some(12))
                for name in ("peak_error", "rms_error", "felt_peak_error")
            },
            **{name: (stride, some()) for name in ("mean_speed", "apex", "duration")},
            "upright": (stride, np.where(np.isnan(learning), np.nan, 1.0)),
            "learning": (stride, learning),
            "skipped": (stride, reasons),
            "feedback": (curve, some(2, 5, 12)),
            "feedforward": (curve, 2.0 * some(2, 5, 12)),
        },
        coords={
            "speed": list(SPEEDS),
            "stride": np.arange(STRIDES),
            "part": list(PARTS),
            **joints,
        },
        attrs={
            "robot": "a1",
            "base": "locked",
            "scenario": "nominal",
            "controller": "ilc",
            "seed": 4,
        },
    )


def values_of(summary: pd.DataFrame, metric: str, joint: str = "-") -> list[float]:
    """A number for each speed, in their order."""
    rows = summary[(summary["metric"] == metric) & (summary["joint"] == joint)]
    assert rows["speed"].tolist() == list(SPEEDS), metric
    return rows["value"].tolist()


def steady_of(count: int) -> range:
    """The last 30 strides, as there are so many after the transient of ten."""
    assert count - BEFORE - 10 >= 26
    return range(count - min(30, count - BEFORE - 10), count)


def test_errors_are_over_legs_and_steady_strides(strides: xr.Dataset) -> None:
    summary = summarize(strides)
    for metric in ("peak_error", "felt_peak_error", "rms_error"):
        for place, joint in enumerate(KINDS):
            expected = []
            for robot, count in enumerate(COUNTS):
                of_joint = [
                    float(strides[metric].to_numpy()[robot, k, 3 * leg + place])
                    for k in steady_of(count)
                    for leg in range(4)
                ]
                if metric == "rms_error":  # a root mean square of strides is that of their squares
                    expected.append(np.sqrt(np.mean(np.square(of_joint))))
                else:
                    expected.append(np.mean(of_joint))
            assert values_of(summary, metric, joint) == pytest.approx(expected), metric


def test_motion_is_over_steady_strides_and_relative_to_the_gait(strides: xr.Dataset) -> None:
    summary = summarize(strides)
    end = {
        name: [strides[name].to_numpy()[row, steady_of(count)] for row, count in enumerate(COUNTS)]
        for name in ("mean_speed", "apex", "duration")
    }
    found = {
        "speed_error": [np.mean(end["mean_speed"][k]) - SPEEDS[k] for k in (0, 1)],
        "apex_error": [np.mean(end["apex"][k]) - (0.33, 0.35)[k] for k in (0, 1)],
        "apex_deviation": [np.std(end["apex"][k]) for k in (0, 1)],
        "stride_duration": [np.mean(end["duration"][k]) for k in (0, 1)],
    }
    for metric, expected in found.items():
        assert values_of(summary, metric) == pytest.approx(expected), metric


def test_the_share_of_the_feedback_is_of_root_mean_squares_in_stance(strides: xr.Dataset) -> None:
    expected = []
    for robot, count in enumerate(COUNTS):
        fb, ff = (
            np.sqrt(np.mean(strides[name].to_numpy()[robot, steady_of(count), 0] ** 2))
            for name in ("feedback", "feedforward")
        )
        expected.append(fb / (fb + ff))
    assert values_of(summarize(strides), "feedback_share") == pytest.approx(expected)


def test_strides_that_taught_nothing_are_counted_by_reason_and_robot(strides: xr.Dataset) -> None:
    summary = summarize(strides)
    made = [count - BEFORE for count in COUNTS]
    assert values_of(summary, "strides_of_learning") == made
    for number, reason in enumerate(SKIPPED[1:], start=1):
        counted = [
            int(np.sum(strides["skipped"].to_numpy()[k, BEFORE:count] == number))
            for k, count in enumerate(COUNTS)
        ]
        assert values_of(summary, f"skipped_{reason.replace(' ', '_')}") == counted


def test_joints_of_a_kind_are_averaged_over_the_legs_and_over_nothing_else(
    strides: xr.Dataset,
) -> None:
    found = by_joint(strides["peak_error"]).transpose("speed", "stride", "joint").to_numpy()
    peaks = strides["peak_error"].to_numpy()[0, 7]
    np.testing.assert_allclose(found[0, 7], [np.mean(peaks[k::3]) for k in range(3)])


def history(controller: str, *, scenario: str, seed: int, level: float, end: float) -> PeakHistory:
    """A robot whose errors fall linearly to `end`, or a model with a level."""
    settings = {"robot": "a1", "base": "locked", "scenario": scenario, "seed": seed}
    peaks = np.tile(np.linspace(0.1, end, 41)[:, None], 2)
    return PeakHistory(
        {**settings, "controller": controller},
        np.array([0.3]),
        (peaks if controller != "model" else np.empty((0, 2)),),
        np.full((1, 2), level),
        np.ones(1),
    )


def test_learning_is_measured_against_the_model_of_its_own_world_and_seed() -> None:
    levels = {("nominal", 0): 0.08, ("nominal", 1): 0.05, ("payload", 0): 0.03}
    models = [
        history("model", scenario=scenario, seed=seed, level=level, end=0.0)
        for (scenario, seed), level in levels.items()
    ]
    learners = [
        history("ilc", scenario=scenario, seed=seed, level=0.0, end=0.0)
        for scenario, seed in [*levels, ("payload", 1)]  # the last has no rival
    ]
    found = {
        (row["scenario"], row["seed"]): row["value"]
        for row in beat_rows([*models, *learners])
        if row["joint"] == "calf"
    }
    fall = np.linspace(0.1, 0.0, 41)
    assert found == {place: strides_to_beat(fall, level) for place, level in levels.items()}
    assert len(set(found.values())) == 3
