from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pronk_pin.control import SAMPLES, TorqueLibrary
from pronk_pin.control.learning.torque_library import SCHEMA
from pronk_pin.errors import FileProblem, InvalidInput, SpeedOutOfRange

SPEEDS = np.array([-0.1, 0.0, 0.3])


@pytest.fixture
def learned() -> TorqueLibrary:
    torque = np.random.default_rng(0).normal(size=(3, 2, SAMPLES, 12))
    return TorqueLibrary(SPEEDS, torque, np.zeros_like(torque), np.array([0.19, 0.2, 0.23]))


def test_practised_speeds_get_what_was_learned_there(learned: TorqueLibrary) -> None:
    np.testing.assert_array_equal(learned.at(SPEEDS), learned.torque)


def test_speeds_between_get_a_mixture_of_their_neighbours(learned: TorqueLibrary) -> None:
    expected = 2.0 / 3.0 * learned.torque[1] + 1.0 / 3.0 * learned.torque[2]
    np.testing.assert_allclose(learned.at(np.array([0.1]))[0], expected)


def test_flights_last_as_long_as_at_the_nearest_practised_speed(learned: TorqueLibrary) -> None:
    wanted = np.array([0.3, -0.1, 0.1, 0.2, 0.15])
    skill = learned.initial_feedforward(wanted)
    np.testing.assert_array_equal(skill.flight, [0.23, 0.19, 0.2, 0.23, 0.2])
    np.testing.assert_array_equal(skill.feedforward, learned.at(wanted))


def test_a_skill_is_reusable_where_it_was_practised_and_where_its_neighbours_land_alike() -> None:
    torque = np.zeros((4, 2, SAMPLES, 12))
    flight = np.array([0.1985, 0.1986, 0.1995, 0.1995])
    library = TorqueLibrary(np.array([0.0, 0.1, 0.2, 0.3]), torque, torque, flight)
    wanted = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3])
    assert library.reusable(wanted).tolist() == [True, True, True, False, True, True, True]


def test_a_speed_that_was_not_practised_is_refused(learned: TorqueLibrary) -> None:
    with pytest.raises(SpeedOutOfRange) as caught:
        learned.at(np.array([0.0, 0.31]))
    assert (caught.value.speed, caught.value.lowest, caught.value.highest) == (0.31, -0.1, 0.3)


def test_strides_are_averaged_and_missing_ones_left_out() -> None:
    torque = np.zeros((2, 3, 2, SAMPLES, 12))
    torque[:, 0], torque[:, 1], torque[:, 2] = 1.0, 3.0, 5.0
    torque[1, 2] = np.nan
    flight = np.array([[0.2, 0.21, 0.3], [0.3, 0.4, np.nan]])
    library = TorqueLibrary.from_strides(np.array([0.0, 0.1]), torque, flight)
    np.testing.assert_allclose(library.flight, [0.21, 0.35])
    np.testing.assert_allclose(library.torque[:, 1, 0, 0], [3.0, 2.0])
    np.testing.assert_allclose(library.spread[:, 1, 0, 0], [np.std([1.0, 3.0, 5.0]), 1.0])


def test_speeds_must_increase() -> None:
    torque = np.zeros((2, 2, SAMPLES, 12))
    with pytest.raises(InvalidInput, match="must increase"):
        TorqueLibrary(np.array([0.1, 0.1]), torque, torque, np.ones(2))


def test_every_speed_needs_a_torque() -> None:
    torque = np.zeros((2, 2, SAMPLES, 12))
    with pytest.raises(InvalidInput, match="one flight for each speed"):
        TorqueLibrary(SPEEDS, torque, torque, np.ones(3))
    with pytest.raises(InvalidInput, match="one flight for each speed"):
        TorqueLibrary(SPEEDS[:2], torque, torque, np.ones(3))


def test_a_library_that_was_saved_is_the_same_when_loaded(
    learned: TorqueLibrary, tmp_path: Path
) -> None:
    learned.save(tmp_path / "skill.npz")
    again = TorqueLibrary.load(tmp_path / "skill.npz")
    for name in ("speeds", "torque", "spread"):
        np.testing.assert_array_equal(getattr(again, name), getattr(learned, name))
    assert [path.name for path in tmp_path.iterdir()] == ["skill.npz"]


def test_a_damaged_library_says_so(learned: TorqueLibrary, tmp_path: Path) -> None:
    path = tmp_path / "skill.npz"
    with pytest.raises(FileProblem, match="missing"):
        TorqueLibrary.load(path)
    learned.save(path)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(FileProblem, match="damaged"):
        TorqueLibrary.load(path)
    np.savez(path, schema=np.array(SCHEMA), speeds=np.array([0.0, 0.1]))
    with pytest.raises(FileProblem, match="damaged"):
        TorqueLibrary.load(path)


def test_a_pickle_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "skill.npz"
    with path.open("wb") as file:
        np.savez(file, schema=np.array(SCHEMA), speeds=np.array([None, {}], dtype=object))
    with pytest.raises(FileProblem, match="damaged"):
        TorqueLibrary.load(path)


def test_a_speed_left_out_is_interpolated_between_the_others(learned: TorqueLibrary) -> None:
    rest = learned.without(0.0)
    np.testing.assert_array_equal(rest.speeds, [-0.1, 0.3])
    expected = 0.75 * learned.torque[0] + 0.25 * learned.torque[2]
    np.testing.assert_allclose(rest.at(np.array([0.0]))[0], expected)
    skill, reusable = learned.left_out(np.array([0.0]))
    np.testing.assert_allclose(skill.feedforward, expected[None])
    np.testing.assert_array_equal(skill.flight, [0.19])
    assert reusable.tolist() == [False]  # one lands 40 ms after the other


def test_the_first_and_the_last_speed_have_no_neighbours_to_learn_from(
    learned: TorqueLibrary,
) -> None:
    for speed in (-0.1, 0.3):
        with pytest.raises(SpeedOutOfRange):
            learned.left_out(np.array([0.0, speed]))
