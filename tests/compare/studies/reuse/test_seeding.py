"""What learning begins with, and how long it takes from there."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pronk_pin.compare import Experiment, Schedule, run_cell
from pronk_pin.compare.studies.reuse.seeding import (
    LEARNERS,
    describe_seeding,
    measure_seeding,
    settling,
)
from pronk_pin.compare.world.scenario import load_scenario
from pronk_pin.errors import InvalidInput


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return measure_seeding([0.0, 0.2, 0.4], load_scenario("nominal"))


def calf(table: pd.DataFrame, stride: int) -> pd.Series:
    return table[table["stride"] == stride].set_index("controller")["calf"]


def test_only_speeds_between_practised_ones_are_seeded(table: pd.DataFrame) -> None:
    assert table["speed"].unique().tolist() == [0.2]
    assert table["controller"].unique().tolist() == list(LEARNERS)


def test_the_nearer_the_seed_to_what_is_learned_the_smaller_the_first_error(
    table: pd.DataFrame,
) -> None:
    """The library never saw this speed, and the model knows neither rotors nor friction."""
    first = calf(table, 0)
    # From the contact on, where the touchdown itself leaves a fifth of PD's error.
    assert first["library+ilc"] < 0.3 * first["model+ilc"] < 0.3 * first["ilc"]


def test_all_seeds_end_where_nothing_does(table: pd.DataFrame) -> None:
    end = table[table["stride"] > table["stride"].max() - 10].groupby("controller")["calf"].mean()
    assert np.all(end < 0.21 * calf(table, 0)["ilc"])
    assert end.max() < 1.05 * end.min()


def test_the_library_is_settled_before_the_others(table: pd.DataFrame) -> None:
    strides = settling(table).set_index("controller")["strides"]
    assert strides["library+ilc"] == 0.0
    assert min(strides["ilc"], strides["model+ilc"]) >= 2.0
    text = describe_seeding(table)
    assert "median over 1 speed\n" in text
    assert "the library   thigh" in text


def test_who_never_settles_is_counted_and_not_averaged() -> None:
    strides = np.arange(40)
    learned = np.where(strides < 4, 0.1, 0.01)
    curves = {LEARNERS[0]: learned, LEARNERS[1]: np.full(40, 0.1), LEARNERS[2]: np.full(40, 0.01)}
    made = pd.concat(
        pd.DataFrame(
            {
                "controller": name,
                "speed": 0.1,
                "stride": strides,
                "thigh": curve,
                "calf": curve,
                "upright": name != LEARNERS[1],
            }
        )
        for name, curve in curves.items()
    )
    found = settling(made).set_index("controller")["strides"]
    assert found[LEARNERS[0]] == 4.0
    assert np.isnan(found[LEARNERS[1]])
    assert found[LEARNERS[2]] == 0.0
    assert "never, 1 fell" in describe_seeding(made)


def test_the_library_seeds_the_learning_that_goes_on_from_it() -> None:
    experiment = Experiment(
        speeds=(0.2,),
        controllers=("library", "library+ilc"),
        schedule=Schedule(startup=0.1, baseline=1.0, learning=1.0),
    )
    cells = {cell.controller: cell for cell in experiment.cells()}
    practised = run_cell(cells["ilc"])
    library, learner = (run_cell(cells[name], practised) for name in ("library", "library+ilc"))
    for name in ("feedforward", "flight_reference"):
        np.testing.assert_array_equal(*(run[name].isel(stride=0) for run in (library, learner)))
    last = {"stride": -1}
    assert np.any(library["feedforward"].isel(last) != learner["feedforward"].isel(last))


def test_a_speed_without_neighbours_cannot_be_seeded() -> None:
    with pytest.raises(InvalidInput, match="three speeds or more"):
        measure_seeding([0.0, 0.2], load_scenario("nominal"))
    with pytest.raises(InvalidInput, match="must increase"):
        measure_seeding([0.0, 0.4, 0.2], load_scenario("nominal"))
