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
@pytest.mark.parametrize(
    ("metric", "share"), [("peak_error", 0.79), ("felt_peak_error", 0.93), ("rms_error", 0.94)]
)
def test_learning_takes_away_most_of_the_error(
    summary: pd.DataFrame, joint: str, metric: str, share: float
) -> None:
    """From the contact on; from when it is felt; and in the mean square from the contact on."""
    before, after = (values(summary, metric, name, joint) for name in ("pd", "ilc"))
    assert 1.0 - after.mean() / before.mean() >= share


@pytest.mark.parametrize("joint", ["calf", "thigh"])
def test_no_speed_is_worse_for_learning(summary: pd.DataFrame, joint: str) -> None:
    for metric, least in (("peak_error", 0.75), ("felt_peak_error", 0.9)):
        reduced = reduction(summary, metric)
        assert np.all(values(reduced, metric, "ilc", joint) > least)


@pytest.mark.parametrize("joint", ["calf", "thigh"])
def test_practice_on_gaits_with_rotors_is_the_best_of_all(
    summary: pd.DataFrame, joint: str
) -> None:
    """Twelve milliradians from the contact on at every speed, and less than who knows the most."""
    best = values(summary, "peak_error", "ilc+rotors", joint)
    assert np.all(best <= 0.012)
    assert np.all(values(summary, "felt_peak_error", "ilc+rotors", joint) <= 0.006)
    for rival in ("model", "model+rotors", "ilc", "library"):
        assert best.mean() < values(summary, "peak_error", rival, joint).mean()


@pytest.mark.parametrize("joint", ["calf", "thigh"])
def test_a_model_that_knows_the_rotors_beats_practice_that_does_not(
    summary: pd.DataFrame, joint: str
) -> None:
    """The case in which we lose, from the contact on."""
    model, learned = (
        values(summary, "peak_error", name, joint).mean() for name in ("model+rotors", "ilc")
    )
    assert model < learned


def test_nobody_diverges_but_the_papers_scope_at_one_speed(summary: pd.DataFrame) -> None:
    assert values(summary, "diverging", "ilc").sum() == 0
    assert values(summary, "diverging", "ilc+rotors").sum() == 0


def test_learning_has_settled_within_30_strides_at_every_speed(summary: pd.DataFrame) -> None:
    """15 at 13 of the 14 speeds, by the error from the contact on."""
    settled = values(summary, "strides_to_converge", "ilc")
    assert np.all(settled <= 30.0)
    assert (settled <= 15.0).sum() >= 13


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
