"""The whole default comparison, and what it has to show; about two minutes on two cores."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare import DEFAULT_CONTROLLERS, Experiment, reduction, run_experiment

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    folder = tmp_path_factory.mktemp("first") / "comparison"
    return run_experiment(Experiment(), folder, progress=False).summary()


def values(summary: pd.DataFrame, metric: str, controller: str, joint: str = "-") -> pd.Series:
    """A metric by speed, at all 14 of them."""
    rows = summary[
        (summary["metric"] == metric)
        & (summary["controller"] == controller)
        & (summary["joint"] == joint)
    ].set_index("speed")["value"]
    assert len(rows) == 14
    return rows


@pytest.mark.parametrize("controller", DEFAULT_CONTROLLERS)
def test_all_14_speeds_stay_up(summary: pd.DataFrame, controller: str) -> None:
    assert np.all(values(summary, "upright", controller) == 1.0)


def test_pd_alone_misses_as_much_as_the_papers(summary: pd.DataFrame) -> None:
    assert 0.085 <= values(summary, "peak_error", "pd", "calf").mean() <= 0.115


@pytest.mark.parametrize("joint", ["calf", "thigh"])
@pytest.mark.parametrize(("metric", "share"), [("peak_error", 0.94), ("rms_error", 0.95)])
def test_learning_takes_away_nine_tenths_of_the_error(
    summary: pd.DataFrame, joint: str, metric: str, share: float
) -> None:
    before, after = (values(summary, metric, name, joint) for name in ("pd", "ilc"))
    assert 1.0 - after.mean() / before.mean() >= share


@pytest.mark.parametrize("joint", ["calf", "thigh"])
def test_no_speed_is_worse_for_learning(summary: pd.DataFrame, joint: str) -> None:
    reduced = reduction(summary, "peak_error")
    assert np.all(values(reduced, "peak_error", "ilc", joint) > 0.9)


def test_learning_has_settled_within_15_strides_at_every_speed(summary: pd.DataFrame) -> None:
    assert np.all(values(summary, "strides_to_converge", "ilc") <= 15.0)


def test_the_apex_stays_within_half_a_millimetre(summary: pd.DataFrame) -> None:
    assert np.all(values(summary, "apex_deviation", "ilc") < 5e-4)


@pytest.mark.parametrize("joint", ["calf", "thigh"])
def test_the_frozen_library_is_as_good_as_what_learned_it(
    summary: pd.DataFrame, joint: str
) -> None:
    learned, frozen = (
        values(summary, "peak_error", name, joint).mean() for name in ("ilc", "library")
    )
    assert frozen <= 1.05 * learned
