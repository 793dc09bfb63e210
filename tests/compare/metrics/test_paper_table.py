from __future__ import annotations

from importlib import resources

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare.metrics.paper_table import table_1
from pronk_pin.gait import SPEEDS


def test_the_table_has_the_papers_14_speeds_for_each_joint_and_controller() -> None:
    table = table_1()
    assert len(table) == 14 * 2 * 2
    for _, rows in table.groupby(["joint", "controller"]):
        np.testing.assert_allclose(rows["speed"], SPEEDS)


@pytest.mark.parametrize("joint", ["calf", "thigh"])
def test_the_printed_reductions_follow_from_the_printed_errors(joint: str) -> None:
    """Within what rounding to 1 mrad can do to them: a transcription error would show."""
    with (
        resources.files("pronk_pin.compare.metrics") / "data" / "paper_table1.csv"
    ).open() as file:
        printed = pd.read_csv(file)
    pd_error, ilc_error = printed[f"{joint}_pd_rad"], printed[f"{joint}_ilc_rad"]
    lowest = 100.0 * (1.0 - (ilc_error + 0.0005) / (pd_error - 0.0005))
    highest = 100.0 * (1.0 - (ilc_error - 0.0005) / (pd_error + 0.0005))
    reduction = printed[f"{joint}_reduction_pct"]
    assert np.all((reduction > lowest - 0.05) & (reduction < highest + 0.05))


@pytest.mark.parametrize(("joint", "mean"), [("calf", 0.0985), ("thigh", 0.038)])
def test_the_mean_pd_errors_are_the_known_ones(joint: str, mean: float) -> None:
    table = table_1()
    rows = table[(table["joint"] == joint) & (table["controller"] == "pd")]
    assert rows["value"].mean() == pytest.approx(mean, abs=2e-4)
