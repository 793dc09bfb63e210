from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.control import SAMPLES, TorqueLibrary
from pronk_pin.control.learning.torque_library import SCHEMA
from pronk_pin.errors import FileProblem, InvalidInput, PronkError, SpeedOutOfRange

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


# Conditions beside the speed

SLOPES, LOADS = np.array([-0.1, 0.0, 0.1]), np.array([0.0, 3.0])


def of_conditions(torque: Callable[[float, float, float], float]) -> TorqueLibrary:
    """A library of slopes and loads whose torque is a number at each node."""
    libraries = []
    for slope in SLOPES:
        for load in LOADS:
            values = np.array([torque(speed, slope, load) for speed in SPEEDS])
            field = np.broadcast_to(values[:, None, None, None], (3, 2, SAMPLES, 12))
            flight = 0.2 + 0.001 * np.array([slope > 0.0, slope > 0.0, load > 0.0])
            libraries.append(TorqueLibrary(SPEEDS, field, 0.1 * field, flight, -field))
    conditions = {"slope": SLOPES, "payload": LOADS}
    return TorqueLibrary.joined(libraries, conditions, home={"payload": 0.0})


def linear(speed: float, slope: float, load: float) -> float:
    return 1.0 + speed - 20.0 * slope + 0.5 * load + 3.0 * slope * load


def test_between_conditions_a_library_is_linear_in_each() -> None:
    library = of_conditions(linear)
    speeds, slopes, loads = np.array([0.0, 0.15, -0.1]), np.array([0.05, -0.02, 0.1]), 0.7
    torque = library.at(speeds, {"slope": slopes, "payload": loads})
    assert torque.shape == (3, 2, SAMPLES, 12)
    wanted = [linear(v, p, loads) for v, p in zip(speeds, slopes, strict=True)]
    np.testing.assert_allclose(torque[:, 1, 5, 3], wanted)


def test_conditions_that_are_not_given_are_as_at_home() -> None:
    library = of_conditions(linear)
    assert library.home == {"slope": 0.0, "payload": 0.0}
    np.testing.assert_allclose(library.at(np.array([0.3]))[0], linear(0.3, 0.0, 0.0))
    alone = library.in_conditions({"payload": 1.5})
    assert not alone.conditions
    np.testing.assert_allclose(alone.at(np.array([0.3]))[0], linear(0.3, 0.0, 1.5))
    np.testing.assert_allclose(alone.feedback, -alone.torque)


def test_flights_are_those_of_the_nearest_conditions() -> None:
    library, speeds = of_conditions(linear), np.array([0.0, 0.0, 0.3, 0.3])
    flight = library.flight_at(
        speeds, {"slope": np.array([0.04, 0.06, 0.0, 0.0]), "payload": np.array([0, 0, 1.4, 1.6])}
    )
    np.testing.assert_allclose(flight, [0.2, 0.201, 0.2, 0.201])


def test_torques_are_reusable_only_between_conditions_that_land_alike() -> None:
    library, speeds = of_conditions(linear), np.array([0.0, 0.0, 0.0, 0.3])
    conditions = {"slope": np.array([-0.05, 0.05, 0.1, -0.05]), "payload": np.full(4, 1.0)}
    assert library.reusable(speeds, conditions).tolist() == [True, False, True, False]


def test_what_was_left_out_is_known_where_torques_are_linear_and_not_elsewhere() -> None:
    assert of_conditions(linear).leave_one_out()["slope"] == pytest.approx(0.0, abs=1e-12)
    bent = of_conditions(lambda speed, slope, load: abs(slope) + speed)
    # Its neighbours have .1 and .1, so that nothing changes from one to the other, and it has 0.
    assert bent.leave_one_out()["slope"][0] > 1e3
    steep = of_conditions(lambda speed, slope, load: max(slope, 0.0))
    # .05 is interpolated where 0 is right, and .1 is the change.
    np.testing.assert_allclose(steep.leave_one_out()["slope"], [0.5])
    assert steep.leave_one_out()["payload"].size == 0  # two values


def test_a_library_of_conditions_is_the_same_when_loaded(tmp_path: Path) -> None:
    library = replace(of_conditions(linear), robot="go1")
    library.save(tmp_path / "hills.npz")
    again = TorqueLibrary.load(tmp_path / "hills.npz")
    assert again.sha256 == library.sha256
    assert (again.robot, again.home, list(again.conditions)) == (
        "go1",
        {"slope": 0.0, "payload": 0.0},
        ["slope", "payload"],
    )
    np.testing.assert_array_equal(again.feedback, library.feedback)
    assert "3 of slope x 2 of payload" in repr(again)
    assert replace(library, robot="a1").sha256 != library.sha256


@pytest.mark.parametrize(
    ("conditions", "words"),
    [
        ({"slope": 0.11}, "beyond the -0.1 to 0.1"),
        ({"slope": np.array([np.nan])}, "beyond"),
        ({"payload": -0.1}, "beyond the 0 to 3"),
        ({"wind": 1.0}, "wind"),
    ],
)
def test_conditions_that_were_not_practised_are_refused(
    conditions: dict[str, float], words: str
) -> None:
    with pytest.raises(PronkError, match=words):
        of_conditions(linear).at(np.array([0.0]), conditions)


def test_libraries_that_do_not_fill_the_grid_are_not_joined() -> None:
    torque = np.zeros((3, 2, SAMPLES, 12))
    one = TorqueLibrary(SPEEDS, torque, torque, np.ones(3))
    other = TorqueLibrary(SPEEDS + 0.1, torque, torque, np.ones(3))
    with pytest.raises(InvalidInput, match="one for each combination"):
        TorqueLibrary.joined([one], {"slope": SLOPES})
    with pytest.raises(InvalidInput, match="other speeds"):
        TorqueLibrary.joined([one, other], {"payload": LOADS})
    with pytest.raises(InvalidInput, match="slope of a torque library must increase"):
        TorqueLibrary.joined([one, one], {"slope": np.array([0.1, 0.0])})
