"""Skills carried from one engine to another: two that are one, and one with softer ground."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare import MujocoEngine, Scenario, World, load_scenario
from pronk_pin.compare.studies import describe_engine_transfer, measure_engine_transfer
from pronk_pin.control import Gains
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library
from pronk_pin.robot import Robot


@dataclass(frozen=True)
class Softer(MujocoEngine):
    """MuJoCo with another contact, as an engine that sees the same scenario otherwise."""

    name: str = "softer"
    factor: float = 3.0

    def world(
        self, robot: Robot, scenario: Scenario, n: int, *, base: str, servo: Gains | None = None
    ) -> World:
        soft = replace(scenario, ground_time_constant=self.factor * scenario.ground_time_constant)
        return super().world(robot, soft, n, base=base, servo=servo)


softer, same = Softer(), Softer("same", 1.0)


def measure(robot: Robot, *engines: str) -> pd.DataFrame:
    gait = load_library("a1").at(0.2)
    return measure_engine_transfer(robot, [gait], load_scenario("nominal"), engines)


def mean_error(table: pd.DataFrame, engine: str, start: str, stride: int) -> float:
    chosen = (table["engine"] == engine) & (table["start"] == start) & (table["stride"] == stride)
    return float(table[chosen][["thigh", "calf"]].to_numpy().mean())


def test_a_skill_holds_at_once_in_an_engine_that_is_the_same(robot: Robot) -> None:
    table = measure(robot, "mujoco", f"{__name__}:same")
    columns = ["speed", "stride", "thigh", "calf"]
    mujoco, other = (
        table[(table["engine"] == name) & (table["start"] == "mujoco")][columns].to_numpy()
        for name in ("mujoco", "same")
    )
    np.testing.assert_array_equal(mujoco, other)
    text = describe_engine_transfer(table)
    taken = re.findall(r"the skill of mujoco takes (\d+)%", text)
    assert len(taken) == 1
    assert int(taken[0]) == pytest.approx(100, abs=3)


def test_a_skill_of_another_ground_is_learned_on_from(robot: Robot) -> None:
    table = measure(robot, "mujoco", f"{__name__}:softer")
    assert set(table["start"]) == {"nothing", "the model", "mujoco", "softer"}
    for there, origin in (("mujoco", "softer"), ("softer", "mujoco")):
        nothing, carried, home = (
            mean_error(table, there, start, 0) for start in ("nothing", origin, there)
        )
        assert home < carried < 0.5 * nothing
        assert mean_error(table, there, origin, 15) < carried


def test_one_engine_alone_is_refused(robot: Robot) -> None:
    with pytest.raises(InvalidInput, match="needs two of them"):
        measure(robot, "mujoco", "mujoco")
