"""When a stored skill may be reused."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.compare.scenario import load_scenario
from pronk_pin.compare.transfer import may_be_reused, measure_transfers
from pronk_pin.control import load_controller
from pronk_pin.errors import InvalidInput


def test_a_skill_is_reused_where_it_tracks_nearly_as_at_home() -> None:
    learned = np.array([0.003, 0.02])
    assert may_be_reused(1.2 * learned, learned)
    assert not may_be_reused(1.3 * learned, learned)


@pytest.mark.slow
def test_left_out_speeds_track_within_25_percent_and_a_payload_needs_practice() -> None:
    table = measure_transfers(
        load_controller("ilc"),
        [0.0, 0.2, 0.4],
        load_scenario("nominal"),
        [load_scenario("payload")],
    ).set_index("task")
    for joint in ("thigh", "calf"):
        for task in ("at home", "speeds left out", "left out +0.20 m/s"):
            assert table.loc[task, joint] <= 1.25 * table.loc[task, f"{joint}_practised"]
    assert table["reuse"].tolist() == [True, True, True, False]
    assert table["right"].all()


def test_transfers_need_something_to_leave_out() -> None:
    with pytest.raises(InvalidInput, match="three speeds or more"):
        measure_transfers(load_controller("ilc"), [0.0, 0.1], load_scenario("nominal"), [])
