"""What the analysis predicts, beside what happens; and whether learning permits smaller gains."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pronk_pin.cli import main
from pronk_pin.compare.gains import describe_gains, sweep_gains
from pronk_pin.compare.prediction import compare_prediction, describe_prediction, practise
from pronk_pin.compare.scenario import load_scenario
from pronk_pin.control import load_controller
from pronk_pin.errors import InvalidInput

NOMINAL = load_scenario("nominal")


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.0, 0.3])
def test_the_pd_type_laws_errors_are_predicted_within_a_factor_of_1_5(speed: float) -> None:
    spec = load_controller("ilc")
    strides = practise(spec, [speed], NOMINAL, robot="a1", strides=20)
    found = compare_prediction(spec, strides, speed, NOMINAL, number=20)
    assert len(found.factor) == 21
    assert found.factor[0] == pytest.approx(1.0, abs=1e-5)
    assert found.factor.max() < 1.5
    assert f"worst factor {found.factor.max():.2f}" in describe_prediction(found)


@pytest.mark.slow
def test_the_norm_optimal_law_tracks_better_than_the_pd_type_law_within_five_strides() -> None:
    left = {}
    for name in ("ilc", "ilc-norm-optimal"):
        strides = practise(load_controller(name), [0.0, 0.8], NOMINAL, robot="a1", strides=12)
        rms = np.sqrt((strides["rms_error"].sel(joint=["FL_calf", "FL_thigh"]) ** 2).mean("joint"))
        first = int(np.argmax(strides["learning"].isel(speed=0).to_numpy() == 1))
        left[name] = rms.to_numpy()[:, first + 5]
    assert np.all(left["ilc-norm-optimal"] < left["ilc"])


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
