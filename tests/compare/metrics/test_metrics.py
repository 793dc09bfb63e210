"""Metrics of strides made by hand, where every number is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from pronk_pin._typing import Array
from pronk_pin.compare import Results, reduction, steady, summarize
from pronk_pin.compare.metrics import (
    COLUMNS,
    KEYS,
    STEADY_STRIDES,
    by_joint,
    feedback_share,
    settling_stride,
    strides_to_converge,
)
from pronk_pin.control import PARTS
from pronk_pin.robot import load_robot

BASELINE = 40
JOINTS = load_robot("a1").joint_coordinates
NAMES = JOINTS["joint"][1]


@pytest.fixture
def made() -> Callable[..., xr.Dataset]:
    def build(peak: Array, *, baseline: int = BASELINE, controller: str = "ilc") -> xr.Dataset:
        """Strides of one robot by the peak errors of its calves; other joints have less."""
        n = len(peak)
        errors = peak[None, :, None] * np.tile([0.1, 0.5, 1.0], 4)
        torque = np.ones((1, n, 1, 5, 12))
        stride, scalars = ("speed", "stride"), np.ones((1, n))
        curve = (*stride, "part", "phase", "joint")
        learning = (np.arange(n) >= baseline) & (controller == "ilc")
        return xr.Dataset(
            {
                "count": ("speed", [n]),
                "planned_apex": ("speed", [0.34]),
                "peak_error": ((*stride, "joint"), errors),
                "rms_error": ((*stride, "joint"), 0.1 * errors),
                "felt_peak_error": ((*stride, "joint"), 1.5 * errors),
                "upright": (stride, scalars),
                "learning": (stride, learning[None].astype(float)),
                "mean_speed": (stride, 0.25 * scalars),
                "apex": (stride, 0.33 + 0.01 * (-1.0) ** np.arange(n)[None]),
                "duration": (stride, 0.4 * scalars),
                "feedback": (curve, np.concatenate([3.0 * torque, 9.0 * torque], axis=2)),
                "feedforward": (curve, np.concatenate([torque, torque], axis=2)),
            },
            coords={"speed": [0.3], "stride": np.arange(n), "part": list(PARTS), **JOINTS},
            attrs={
                "robot": "a1",
                "base": "locked",
                "scenario": "nominal",
                "controller": controller,
                "seed": 4,
            },
        )

    return build


def learned(
    strides: int = 40, *, begin: float = 0.1, end: float = 0.02, rate: float = 0.5
) -> Array:
    """Peaks that are constant in learning and then fall by a rate from stride to stride."""
    falling = end + (begin - end) * rate ** np.arange(strides)
    return np.concatenate([np.full(BASELINE, begin), falling])


def value(summary: pd.DataFrame, metric: str, joint: str = "-") -> float:
    rows = summary[(summary["metric"] == metric) & (summary["joint"] == joint)]
    assert len(rows) == 1
    return float(rows["value"].iloc[0])


def test_the_summary_of_strides_known_by_hand(made: Callable[..., xr.Dataset]) -> None:
    summary = summarize(made(learned()))
    for joint, scale in (("hip", 0.1), ("thigh", 0.5), ("calf", 1.0)):
        assert value(summary, "peak_error", joint) == pytest.approx(scale * 0.02, rel=0.01)
        assert value(summary, "rms_error", joint) == pytest.approx(scale * 0.002, rel=0.01)
    assert value(summary, "upright") == 1.0
    assert value(summary, "speed_error") == pytest.approx(-0.05)
    assert value(summary, "apex_error") == pytest.approx(-0.01)
    assert value(summary, "apex_deviation") == pytest.approx(0.01)
    assert value(summary, "stride_duration") == pytest.approx(0.4)
    assert value(summary, "feedback_share") == pytest.approx(0.75)
    # 0.5 ** 4 = 6 % of the improvement is missing in the fifth stride.
    assert value(summary, "strides_to_converge") == 5.0


def test_the_summary_is_one_sorted_table_with_the_promised_columns(
    made: Callable[..., xr.Dataset],
) -> None:
    summary = summarize(made(learned()))
    assert list(summary.columns) == COLUMNS
    pd.testing.assert_frame_equal(summary, summary.sort_values(KEYS, ignore_index=True))
    assert set(summary["seed"]) == {4}
    assert set(summary["unit"]) == {"rad", "1", "m/s", "m", "s"}


def test_without_learning_there_is_nothing_to_converge(made: Callable[..., xr.Dataset]) -> None:
    summary = summarize(made(np.full(50, 0.1), controller="pd"))
    assert "strides_to_converge" not in set(summary["metric"])


def test_one_fall_in_the_end_is_a_robot_that_fell(made: Callable[..., xr.Dataset]) -> None:
    strides = made(learned())
    strides["upright"][0, -1] = 0.0
    assert value(summarize(strides), "upright") == 0.0


def test_the_steady_state_is_the_last_30_finished_strides(
    made: Callable[..., xr.Dataset],
) -> None:
    two = xr.concat([made(learned()), made(learned()).assign_coords(speed=[0.4])], dim="speed")
    two["count"] = ("speed", [80, 75])
    two["start"] = (("speed", "stride"), np.tile(np.arange(80.0), (2, 1)))
    end = steady(two)
    assert end.sizes["stride"] == STEADY_STRIDES == 30
    np.testing.assert_array_equal(end["start"].isel(stride=[0, -1]), [[50.0, 79.0], [45.0, 74.0]])


def test_the_steady_state_of_a_short_learning_holds_no_stride_of_practice(
    made: Callable[..., xr.Dataset],
) -> None:
    for strides, kept in ((8, 4), (16, 8), (25, 15), (40, 30), (60, 30)):
        end = steady(made(learned(strides)))
        assert end.sizes["stride"] == kept  # no transient: ten strides, or the half of them
        assert np.all(end["learning"] == 1.0)


def test_who_does_not_learn_is_judged_on_the_same_strides_as_who_does(
    made: Callable[..., xr.Dataset],
) -> None:
    for controller in ("pd", "ilc"):
        strides = made(learned(8), controller=controller)
        strides["start"] = (("speed", "stride"), 0.4 * np.arange(BASELINE + 8.0)[None])
        strides.attrs |= {"switch": 0.4 * BASELINE, "timestep": 0.001}
        assert steady(strides).sizes["stride"] == 4
        strides.attrs["switch"] = 1000.0  # never
        assert steady(strides).sizes["stride"] == STEADY_STRIDES


def test_a_short_simulation_is_steady_as_a_whole(made: Callable[..., xr.Dataset]) -> None:
    assert steady(made(np.full(7, 0.1), controller="pd")).sizes["stride"] == 7


def test_joints_of_a_kind_are_averaged_over_the_legs() -> None:
    values = xr.DataArray(np.arange(12.0), dims="joint", coords=JOINTS)
    mean = by_joint(values)
    assert mean["joint"].to_numpy().tolist() == ["hip", "thigh", "calf"]
    np.testing.assert_allclose(mean, [4.5, 5.5, 6.5])


@pytest.mark.parametrize(
    ("peak", "stride"),
    [
        ([0.02, 0.02, 0.02], 1.0),  # settled from the beginning
        ([0.10, 0.05, 0.02, 0.02], 3.0),
        ([0.02, 0.02, 0.05, 0.02], 4.0),  # left the band once more
        ([0.10, 0.05, 0.027, 0.02], 3.0),  # within a tenth of the improvement
        ([0.02, 0.02, 0.05], np.nan),  # never stays
        ([], np.nan),
    ],
)
def test_learning_has_settled_once_the_peak_stays_near_its_final_value(
    peak: list[float], stride: float
) -> None:
    assert settling_stride(np.array(peak), 0.1, 0.02) == pytest.approx(stride, nan_ok=True)


def test_learning_that_makes_it_worse_never_settles() -> None:
    assert np.isnan(settling_stride(np.array([0.1, 0.1]), before=0.1, final=0.1))
    assert np.isnan(settling_stride(np.array([0.2, 0.2]), before=0.1, final=0.2))


def test_a_drift_of_a_percent_is_nothing_that_settles() -> None:
    assert np.isnan(settling_stride(np.array([0.099, 0.099]), before=0.1, final=0.099))


@pytest.mark.parametrize("joint", ["thigh", "calf"])
def test_a_robot_has_settled_only_when_both_joints_have(
    made: Callable[..., xr.Dataset], joint: str
) -> None:
    strides = made(learned())
    worse = [name.endswith(joint) for name in NAMES]
    strides["peak_error"][0, BASELINE:, worse] = 0.5
    assert np.isnan(value(summarize(strides), "strides_to_converge"))


def test_unfinished_strides_do_not_count_for_convergence(made: Callable[..., xr.Dataset]) -> None:
    strides = made(np.append(learned(), np.full(3, np.nan)))
    strides["count"][0] -= 3
    assert strides_to_converge(strides.isel(speed=0), "calf") == 5.0


def test_learning_without_practice_has_nothing_to_compare_with(
    made: Callable[..., xr.Dataset],
) -> None:
    strides = made(np.full(30, 0.02), baseline=0)
    assert np.isnan(strides_to_converge(strides.isel(speed=0), "calf"))


@pytest.mark.parametrize(
    ("feedback", "feedforward", "share"), [(1.0, 0.0, 1.0), (0.0, 2.0, 0.0), (0.0, 0.0, np.nan)]
)
def test_the_feedbacks_share_of_the_torque(
    feedback: float, feedforward: float, share: float
) -> None:
    torque = np.sin(np.linspace(0.0, 6.0, 40))
    strides = xr.Dataset({"feedback": ("t", feedback * torque), "feedforward": feedforward})
    assert feedback_share(strides) == pytest.approx(share, nan_ok=True)


def test_the_reduction_is_against_pd_at_the_same_speed(made: Callable[..., xr.Dataset]) -> None:
    parts = []
    for speed, before, after in ((0.0, 0.1, 0.02), (0.3, 0.2, 0.3)):
        for controller, error in (("pd", before), ("ilc", after)):
            strides = made(np.full(80, error), controller=controller)
            parts.append(summarize(strides.assign_coords(speed=[speed])))
    reduced = reduction(pd.concat(parts), "peak_error")
    assert set(reduced["controller"]) == {"ilc"}
    calf = reduced[reduced["joint"] == "calf"].set_index("speed")["value"]
    assert calf[0.0] == pytest.approx(0.8)
    assert calf[0.3] == pytest.approx(-0.5)


def test_the_metrics_of_a_simulation_are_those_of_its_curves(comparison: Results) -> None:
    """The peak from the recorded error curves, whose grid is twice as coarse."""
    cell = comparison.find(controller="pd")
    end = steady(comparison.strides(cell))
    calf = [name for name in NAMES if name.endswith("calf")]
    peak = (
        np.abs(end["error"]).sel(part="stance", joint=calf).max("phase").mean(["stride", "joint"])
    )
    summary = comparison.summary()
    rows = summary[(summary["controller"] == "pd") & (summary["joint"] == "calf")]
    stored = rows[rows["metric"] == "peak_error"].sort_values("speed")["value"]
    np.testing.assert_allclose(stored, peak, rtol=0.05)
