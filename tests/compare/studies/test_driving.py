"""The study of commanded speeds: pushes, settling, and gaits of one's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare import load_scenario
from pronk_pin.compare.studies import machine_and_gaits, measure_driving
from pronk_pin.compare.studies.driving import _last_change, _strides_to_settle
from pronk_pin.control import SpeedProfile
from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.gait import GaitLibrary
from pronk_pin.robot import ROBOTS

STAYS = "0.3 5s"


def test_a_push_comes_once_and_what_was_learned_brings_the_robot_back() -> None:
    driving = measure_driving(
        (STAYS,),
        load_scenario("nominal"),
        controllers=("pd",),
        references=("commanded", "measured"),
        push=30.0,
    )
    strides = driving.strides
    assert set(strides["controller"]) == {"pd, commanded", "pd, measured"}
    mine = strides[strides["controller"] == "pd, commanded"]
    before, after = mine[mine["time"].between(1.0, 2.4)], mine[mine["time"] > 4.0]
    # 30 N s make 12 kg faster by more than 2 m/s, which the next stances brake.
    pushed = mine[mine["time"].between(2.5, 3.5)]["speed"].max()
    assert pushed > before["speed"].max() + 0.3
    assert np.abs(after["speed"] - 0.3).max() < 0.06
    settles = driving.summary.query("metric == 'strides_to_settle'").set_index("controller")
    assert 1 <= settles["value"]["pd, commanded"] <= 5


def test_strides_settle_when_they_stay_near_the_command() -> None:
    time = 0.4 * np.arange(10)
    speed = np.array([0, 0, 0, 0.5, 0.1, 0.3, 0.29, 0.31, 0.3, 0.3])
    strides = pd.DataFrame({"time": time, "speed": speed, "commanded": np.full(10, 0.3)})
    assert _strides_to_settle(strides, 1.3) == 2.0  # that of the change, and the one after it
    assert _strides_to_settle(strides, 2.5) == 0.0
    strides.loc[9, "speed"] = 0.0
    assert np.isnan(_strides_to_settle(strides, 1.3))
    assert _last_change(SpeedProfile.parse("0 2s, 0->0.3 1s, 0.3 4s")) == 3.0
    assert _last_change(SpeedProfile.parse("0 2s, 0.3 4s")) == 2.0
    assert _last_change(SpeedProfile.parse("0.3 4s")) == 0.0


def test_a_robot_and_gaits_of_ones_own_are_driven_as_the_same_ones_that_are_shipped(
    twin: GaitLibrary, tmp_path: Path
) -> None:
    spec = replace(ROBOTS["a1"], name="twin")
    path = twin.save(tmp_path / "twin.npz")
    for gaits in (twin, str(path)):
        own = measure_driving(
            (STAYS,), load_scenario("nominal"), controllers=("pd",), robot=spec, gaits=gaits
        )
        shipped = measure_driving((STAYS,), load_scenario("nominal"), controllers=("pd",))
        pd.testing.assert_frame_equal(own.strides, shipped.strides)


def test_gaits_of_another_robot_or_none_are_refused(twin: GaitLibrary, tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="these are gaits of twin"):
        machine_and_gaits("a1", twin)
    with pytest.raises(FileProblem):
        machine_and_gaits("a1", str(tmp_path / "none.npz"))
    with pytest.raises(InvalidInput, match="no commands; give one"):
        measure_driving((), load_scenario("nominal"))
