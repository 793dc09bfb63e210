"""The memory over speed, and gaits that are chosen anew at each stride."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import (
    SpeedCommand,
    SpeedMemory,
    SpeedProfile,
    TorqueLibrary,
    load_controller,
)
from pronk_pin.errors import InvalidInput, SpeedOutOfRange
from pronk_pin.gait import GaitLibrary, load_library
from pronk_pin.robot import Robot

ROWS = np.array([1, 0])


@pytest.fixture(scope="module")
def library() -> GaitLibrary:
    return load_library("a1")


def memory() -> SpeedMemory:
    speeds = np.array([0.0, 0.2, 0.6])
    torque = speeds[:, None, None, None] * np.ones((3, 2, 5, 2))
    return SpeedMemory(2, speeds, torque, 1.0 + 0.1 * speeds)


def test_a_memory_is_linear_between_its_knots_and_held_beyond() -> None:
    speed = np.array([0.5, -1.0])
    np.testing.assert_allclose(memory().at(ROWS, speed, 1)[:, 0, 0], [0.5, 0.0])
    np.testing.assert_allclose(memory().stretch_at(ROWS, speed), [1.05, 1.0])


def test_what_a_stride_teaches_is_there_at_its_speed_and_fades_to_the_next_knots() -> None:
    taught, speed = memory(), np.array([0.3, 0.3])
    learned = np.ones((2, 5, 2)) * np.array([3.0, 0.0])[:, None, None]
    taught.teach(ROWS, speed, 0, learned)
    taught.teach_stretch(ROWS, speed, np.array([0.02, 0.0]))
    np.testing.assert_allclose(taught.at(ROWS, speed, 0)[:, 0, 0], [3.3, 0.3])
    np.testing.assert_allclose(taught.stretch_at(ROWS, speed), [1.05, 1.03])
    np.testing.assert_allclose(taught.at(ROWS, np.zeros(2), 0)[:, 0, 0], 0.0)  # no knot of its own
    np.testing.assert_allclose(taught.at(ROWS, speed, 1)[:, 0, 0], 0.3)  # the other part
    nearer = taught.feedforward[1, 1, 0, 0, 0] - 0.2, taught.feedforward[1, 2, 0, 0, 0] - 0.6
    np.testing.assert_allclose(nearer, np.array([0.75, 0.25]) * 3.0 / (0.75**2 + 0.25**2))


def skill(library: GaitLibrary, speeds: list[float]) -> TorqueLibrary:
    """Torques that are their speed, over the joints, and flights that last a tenth longer."""
    torque = (
        np.array(speeds)[:, None, None, None] * np.linspace(1.0, 2.0, 12) * np.ones((2, 161, 1))
    )
    planned = np.array([library.at(speed).flight.duration for speed in speeds])
    return TorqueLibrary(np.array(speeds), torque, np.zeros_like(torque), 1.1 * planned)


def test_other_torques_are_remembered_by_speed_and_held_beyond_theirs(library: GaitLibrary) -> None:
    command = SpeedCommand([SpeedProfile.parse("0.2 1s")] * 2, library)
    command.remember(skill(library, [0.0, 0.2, 0.4]))
    played = command.memory.at(ROWS, np.array([0.3, 0.8]), 1)
    np.testing.assert_allclose(played[:, 0, 0], [0.3, 0.4])
    np.testing.assert_allclose(played[:, 0, 11], [0.6, 0.8])
    stretched = command.memory.stretch_at(ROWS, np.array([0.2, 0.8]))
    np.testing.assert_allclose(stretched, 1.1, rtol=1e-3)
    learned = command.learned(1)
    np.testing.assert_allclose(learned.at(np.array([0.1]))[0, 0, 0, 0], 0.1)
    again = SpeedCommand([SpeedProfile.parse("0.2 1s")], library)
    again.remember(learned)
    np.testing.assert_allclose(again.memory.feedforward, command.memory.feedforward[1:])
    np.testing.assert_allclose(again.memory.stretch, command.memory.stretch[1:])
    command.remember(None)
    assert not command.memory.feedforward.any()
    np.testing.assert_array_equal(command.memory.stretch, 1.0)
    few = np.zeros((1, 2, 161, 6))
    with pytest.raises(InvalidInput, match="learned by this robot"):
        command.remember(TorqueLibrary(np.zeros(1), few, few, np.ones(1)))


def test_other_profiles_are_followed_if_there_are_gaits_for_them(library: GaitLibrary) -> None:
    command = SpeedCommand([SpeedProfile.parse("0.2 1s")] * 2, library)
    command.follow([SpeedProfile.parse("0.1 1s"), SpeedProfile.parse("0.4 1s")])
    np.testing.assert_allclose(command.commanded(ROWS, np.zeros(2)), [0.4, 0.1])
    with pytest.raises(SpeedOutOfRange):
        command.follow([SpeedProfile.parse("0.1 1s"), SpeedProfile.parse("3 1s")])
    np.testing.assert_allclose(command.commanded(ROWS, np.zeros(2)), [0.4, 0.1])


def simulation(robot: Robot, library: GaitLibrary, words: str | None, name: str) -> Simulation:
    spec = replace(load_controller(name), guard=None)
    command = None if words is None else SpeedCommand([SpeedProfile.parse(words)], library)
    gaits = [library.at(0.3)] if command is None else command.first_gaits
    made = Simulation(
        robot,
        gaits,
        spec,
        load_scenario("nominal"),
        schedule=Schedule(0.5, 0.0, 5.0),
        rng=np.random.default_rng(0),
        command=command,
    )
    made.run()
    return made


@pytest.mark.parametrize("name", ["pd", "ilc"])
def test_a_command_that_stays_makes_the_strides_of_that_speed(
    robot: Robot, library: GaitLibrary, name: str
) -> None:
    """At a speed of the library: in between, what is learned is stored a little otherwise."""
    own, commanded = (simulation(robot, library, w, name) for w in (None, "0.3 5s"))
    count = int(own.strides.count[0])
    assert count == int(commanded.strides.count[0]) > 10
    for quantity in ("start", "peak_error", "mean_speed", "feedforward"):
        np.testing.assert_allclose(
            commanded.strides[quantity][0, :count], own.strides[quantity][0, :count], atol=1e-9
        )


def test_a_robot_follows_a_ramp_with_the_gaits_of_its_command(
    robot: Robot, library: GaitLibrary
) -> None:
    strides = simulation(robot, library, "0.1 2s, 0.1->0.5 1s, 0.5 2s", "pd").strides
    count = int(strides.count[0])
    start = strides["start"][0, :count]
    late = start > 3.5
    np.testing.assert_allclose(strides["commanded"][0, :count][late], 0.5)
    np.testing.assert_allclose(strides["gait_speed"][0, :count][late], 0.5)
    assert np.abs(strides["mean_speed"][0, :count][late] - 0.5).max() < 0.06
    assert np.abs(strides["mean_speed"][0, :count][start < 1.5][2:] - 0.1).max() < 0.06
    # The gait is that of the speed that is commanded when the flight before it ends.
    np.testing.assert_allclose(
        strides["gait_speed"][0, 1:count], strides["commanded"][0, 1:count], atol=0.01
    )


def test_commands_that_cannot_be_followed_are_refused(robot: Robot, library: GaitLibrary) -> None:
    profile = SpeedProfile.parse("0 1s, 0->0.9 1s")
    with pytest.raises(SpeedOutOfRange):
        SpeedCommand([profile], library)
    with pytest.raises(InvalidInput, match="give one for each robot"):
        SpeedCommand([], library)
    command = SpeedCommand([SpeedProfile.parse("0 1s")], library)
    for name, base in (("ilc", "locked"), ("pd", "free")):
        with pytest.raises(InvalidInput, match="cannot change its gait"):
            Simulation(
                robot,
                command.first_gaits,
                load_controller(name),
                load_scenario("nominal"),
                schedule=Schedule(0.5, 0.0, 2.0),
                rng=np.random.default_rng(0),
                base=base,
                command=command,
            )
