"""What the analysis predicts, beside what happens; and whether learning permits smaller gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.cli import main
from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.compare.studies.gain_reduction import describe_gains, sweep_gains
from pronk_pin.compare.studies.prediction import (
    Prediction,
    compare_prediction,
    describe_prediction,
    simulate_learning,
    stored_learning,
)
from pronk_pin.compare.world.scenario import load_scenario
from pronk_pin.control import load_controller
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library

NOMINAL = load_scenario("nominal")
NORM_OPTIMAL = "ilc-norm-optimal"
SPEEDS = load_library("a1").speeds


def predictions(name: str, speeds: Sequence[float]) -> list[Prediction]:
    spec = load_controller(name)
    strides = simulate_learning(spec, speeds, NOMINAL, robot="a1", strides=20)
    return [compare_prediction(spec, strides, v, NOMINAL, number=20) for v in speeds]


def test_both_predictions_begin_with_what_was_measured() -> None:
    (found,) = predictions("ilc", [0.0])
    for factor in (found.factor, found.rehearsed_factor):
        assert len(factor) == 21
        assert factor[:3] == pytest.approx(1.0, abs=0.15)
        assert f"worst factor {factor.max():.2f}" in describe_prediction(found)


@pytest.mark.slow
def test_the_lifted_model_predicts_the_pd_type_law_within_a_factor_of_1_5() -> None:
    assert max(found.factor.max() for found in predictions("ilc", SPEEDS)) < 1.5


@pytest.mark.slow
def test_the_rehearsal_predicts_the_norm_optimal_law_within_a_factor_of_1_5() -> None:
    """At all speeds but two, and at those within 2."""
    factors = np.stack([found.rehearsed_factor for found in predictions(NORM_OPTIMAL, SPEEDS)])
    assert np.count_nonzero(factors.max(axis=1) > 1.5) <= 2
    assert factors.max() < 2.0


@pytest.mark.slow
def test_the_norm_optimal_law_tracks_better_than_the_pd_type_law_within_five_strides() -> None:
    left = {}
    for name in ("ilc", NORM_OPTIMAL):
        strides = simulate_learning(
            load_controller(name), [0.0, 0.8], NOMINAL, robot="a1", strides=12
        )
        rms = np.sqrt((strides["rms_error"].sel(joint=["FL_calf", "FL_thigh"]) ** 2).mean("joint"))
        first = int(np.argmax(strides["learning"].isel(speed=0).to_numpy() == 1))
        left[name] = rms.to_numpy()[:, first + 5]
    assert np.all(left[NORM_OPTIMAL] < left["ilc"])


@pytest.fixture(scope="module")
def stance_only(tmp_path_factory: pytest.TempPathFactory) -> Results:
    experiment = Experiment(
        speeds=(0.0, 0.2),
        controllers=("ilc", "ilc-stance", NORM_OPTIMAL),
        schedule=Schedule(baseline=4.0, learning=6.0),
    )
    folder = tmp_path_factory.mktemp("stance") / "result"
    return run_experiment(experiment, folder, workers=1, progress=False)


def test_a_stored_practice_is_predicted_as_one_that_was_made_for_it(stance_only: Results) -> None:
    """They differ in how long PD went before."""
    spec = load_controller("ilc-stance")
    stored = stored_learning(stance_only, spec, [0.2], NOMINAL)
    made = simulate_learning(spec, [0.2], NOMINAL, robot="a1", strides=10)
    one, other = (compare_prediction(spec, s, 0.2, NOMINAL, number=10) for s in (stored, made))
    np.testing.assert_allclose(one.measured[:5], other.measured[:5], rtol=0.05)
    np.testing.assert_allclose(one.predicted[:5], other.predicted[:5], rtol=0.05)
    assert max(one.factor.max(), one.rehearsed_factor.max()) < 2.0


def test_what_also_learned_in_flight_is_not_laid_over_a_prediction_of_the_stance(
    stance_only: Results, comparison: Results
) -> None:
    with pytest.raises(InvalidInput, match=f"choose ilc-stance or {NORM_OPTIMAL}, which this"):
        stored_learning(stance_only, load_controller("ilc"), [0.0], NOMINAL)
    with pytest.raises(InvalidInput, match="make a result with 'pronk-pin compare --controllers"):
        stored_learning(comparison, load_controller("ilc"), [0.0], NOMINAL)
    with pytest.raises(InvalidInput, match="does not learn in stance"):
        stored_learning(comparison, load_controller("pd"), [0.0], NOMINAL)


def test_only_speeds_and_worlds_of_the_result_are_predicted(stance_only: Results) -> None:
    spec = load_controller("ilc-stance")
    with pytest.raises(InvalidInput, match=r"no speed 0.1 m/s; choose from 0, 0.2"):
        stored_learning(stance_only, spec, [0.0, 0.1], NOMINAL)
    with pytest.raises(InvalidInput, match="no 'ilc-stance' in scenario 'payload'"):
        stored_learning(stance_only, spec, [0.0], load_scenario("payload"))
    free = replace(stance_only.experiment, base="sagittal", controllers=("ilc-stance",))
    with pytest.raises(InvalidInput, match="with --base locked"):
        stored_learning(replace(stance_only, experiment=free), spec, [0.0], NOMINAL)


def test_analyze_draws_what_was_measured_over_what_was_predicted(
    stance_only: Results, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, result = tmp_path / "new" / "analysis.svg", str(stance_only.folder)
    words = ["ilc", "analyze", "ilc-stance", "--speed", "0.2", "--result", result]
    assert main([*words, "--strides", "8", "--figure", str(path)]) == 0
    printed = capsys.readouterr().out
    assert f"figure  {path}" in printed
    assert printed.count("lifted model: worst factor") == 1
    assert path.read_text().count("strides of learning") == 1
    assert main(["ilc", "analyze", "ilc", "--result", result]) == 1
    assert "choose ilc-stance" in capsys.readouterr().err


def test_learning_permits_half_the_feedback_gains() -> None:
    table = sweep_gains(load_controller("ilc"), [0.0], NOMINAL, shares=(1.0, 0.5))
    alone, learned = (
        table[table["learned"] == known].set_index("share") for known in (False, True)
    )
    assert learned.loc[0.5, "calf"] < alone.loc[1.0, "calf"] < alone.loc[0.5, "calf"]
    assert "Yes: down to 50% of the gains" in describe_gains(table)


def test_a_controller_that_does_not_learn_cannot_be_analysed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for action in ("gains", "analyze"):
        assert main(["ilc", action, "pd"]) == 1
        assert "does not learn" in capsys.readouterr().err
    with pytest.raises(InvalidInput, match="does not learn"):
        sweep_gains(load_controller("pd"), [0.0], NOMINAL)
