"""When stored feedforward may be reused."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare.studies.reuse.transfer import TOLERANCE, may_be_reused, measure_transfers
from pronk_pin.compare.world.scenario import load_scenario
from pronk_pin.control import load_controller
from pronk_pin.errors import InvalidInput


def test_a_skill_is_reused_where_it_tracks_nearly_as_at_home() -> None:
    learned = np.array([0.003, 0.02])
    assert may_be_reused(1.2 * learned, learned)
    assert not may_be_reused(1.3 * learned, learned)


def excess(table: pd.DataFrame) -> pd.Series:
    """RMS over thigh and calf of the stored feedforward, over that of learning there."""
    stored, practised = (
        (table[f"thigh{of}"] ** 2 + table[f"calf{of}"] ** 2) ** 0.5 for of in ("", "_relearned")
    )
    return stored / practised


@pytest.mark.slow
def test_the_rule_lets_no_skill_be_reused_that_practice_would_better() -> None:
    speeds = np.round(np.arange(-0.4, 0.9, 0.2), 1)
    table = measure_transfers(
        load_controller("ilc"),
        speeds.tolist(),
        load_scenario("nominal"),
        [load_scenario("payload")],
    ).set_index("task")
    assert np.all(excess(table[table["reuse"]]) <= 1.0 + TOLERANCE)
    answers = table["reuse"].to_dict()
    assert answers["at home"]
    assert not answers["payload"]
    # Its neighbours land a tick apart.
    assert not answers["left out -0.20 m/s"]
    for speed in (0.2, 0.4, 0.6):
        assert answers[f"left out {speed:+.2f} m/s"]
    assert (~table["right"]).sum() <= 1  # learning asked for in vain


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "world", "offset"),
    [("a1", "nominal", 0.1), ("a1", "payload", 0.0), ("a1", "slope", 0.0), ("go1", "nominal", 0.0)],
)
def test_the_rule_misses_nothing_where_it_was_not_found(
    robot: str, world: str, offset: float
) -> None:
    """At the speeds between, in other scenarios of learning, and for another robot."""
    speeds = np.round(offset + np.arange(-0.4, 0.7, 0.2), 1)
    table = measure_transfers(
        load_controller("ilc"), speeds.tolist(), load_scenario(world), [], robot=robot
    )
    between = table[table["task"].str.startswith("left out")]
    reused = between[between["reuse"]]
    assert len(reused) > 0
    assert np.all(excess(reused) <= 1.0 + TOLERANCE)


def test_transfers_need_something_to_leave_out() -> None:
    with pytest.raises(InvalidInput, match="three speeds or more"):
        measure_transfers(load_controller("ilc"), [0.0, 0.1], load_scenario("nominal"), [])
