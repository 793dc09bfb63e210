"""Following a command: flights that last as long as the lift-off lets them."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.compare.experiment import feedforward_by_speed
from pronk_pin.control import SpeedCommand, SpeedProfile, load_controller
from pronk_pin.control.command_following import _SETTLED, CommandFollower
from pronk_pin.control.signals import LATEST_TOUCHDOWN, Reference
from pronk_pin.gait import GaitLibrary, load_library
from pronk_pin.robot import Robot

ROW = np.array([0])


@pytest.fixture(scope="module")
def library() -> GaitLibrary:
    return load_library("a1")


def follower(robot: Robot, library: GaitLibrary, words: str) -> tuple[CommandFollower, Reference]:
    command = SpeedCommand([SpeedProfile.parse(words)], library)
    gaits, others = command.first_gaits, command.all_gaits
    stance, flight = (
        Reference.of(
            [getattr(gait, part) for gait in gaits],
            1e-3,
            latest,
            others=[getattr(gait, part) for gait in others],
        )
        for part, latest in (("stance", 1.0), ("flight", LATEST_TOUCHDOWN))
    )
    feedforward = command.initial_feedforward.feedforward
    assert feedforward is not None
    following = CommandFollower(
        command,
        robot,
        load_controller("pd"),
        gaits=gaits,
        stance=stance,
        flight=flight,
        feedforward=feedforward,
    )
    return following, flight


@pytest.mark.parametrize(("faster", "higher"), [(0.02, 0.0), (-0.03, 0.0), (0.0, -0.001)])
def test_a_flight_lasts_as_ballistics_have_it_after_a_change(
    robot: Robot, library: GaitLibrary, faster: float, higher: float
) -> None:
    """Beside what is usual, which is 0.05 m/s less than the gait's lift-off here."""
    following, flight = follower(robot, library, "0.4 4s, 0.4->0 2s")
    gait, after = library.at(0.4), library.at(0.2)
    begin, end = np.zeros(1), np.ones(1)
    rising = gait.flight.base_reference(begin)[1][0, 1] - 0.05
    joints = gait.flight.joint_reference(begin)[0]
    measured = np.array([0.4])

    def lift_off(to: float, rising: float) -> None:
        now = {"rising": np.array([rising]), "joints": joints}
        following.lift_off(ROW, np.array([to]), measured, **now)

    for _ in range(_SETTLED + 1):
        lift_off(0.4, rising)
        assert flight.duration[0] == pytest.approx(gait.flight.duration, abs=1e-12)
    following._stood_before[:] = 0.6  # a change has come before
    joints = joints.copy()
    legs = joints.reshape(-1, 3)
    straighten = -higher / _height_by_bend(following, joints)
    legs[:, 1:] -= straighten * np.array([-0.5, 1.0])
    lift_off(0.2, rising + faster)
    sinking = -gait.flight.base_reference(end)[1][0, 1]
    expected = (faster * gait.flight.duration + higher) / sinking
    assert flight.duration[0] - after.flight.duration == pytest.approx(expected, rel=0.05)


def _height_by_bend(following: CommandFollower, joints: np.ndarray) -> float:
    """Height that is gained where knees bend by one radian, and thighs by half of it back."""
    bent = joints.reshape(-1, 3) + 1e-6 * np.array([0.0, -0.5, 1.0])
    both = following._height_of(np.stack([bent.ravel(), joints[0]]))
    return float((both[0] - both[1]) / 1e-6)


def test_flights_of_a_robot_that_slows_down_end_when_it_touches_down(
    robot: Robot, library: GaitLibrary, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, gaits = load_controller("model"), [library.at(speed) for speed in library.speeds]
    torque = feedforward_by_speed(model, gaits, model=robot)
    words = "0 3s, 0->0.8 2s, 0.8 3s, 0.8->0 2s, 0 1s"

    def beside_usual() -> np.ndarray:
        """How much shorter flights are than their references while it slows down [s]."""
        command = SpeedCommand([SpeedProfile.parse(words)], library, torque=torque)
        initial = command.initial_feedforward
        made = Simulation(
            robot,
            command.first_gaits,
            model,
            load_scenario("nominal"),
            schedule=Schedule(0.5, 0.0, 11.0),
            rng=np.random.default_rng(0),
            feedforward=initial.feedforward,
            flight=initial.flight,
            command=command,
        ).run()
        count = int(made.count[0])
        start, reference = made["start"][0, :count], made["flight_reference"][0, :count]
        beside = (made["duration"] - made["stance"])[0, :count] - reference
        before, during = (start > 6.0) & (start < 7.5), (start > 8.3) & (start < 10.0)
        return np.asarray(beside[during] - np.median(beside[before]))

    corrected = np.abs(beside_usual()).mean()
    monkeypatch.setattr(CommandFollower, "_longer", lambda self, rows, *_: np.zeros(len(rows)))
    plain = np.abs(beside_usual()).mean()
    assert plain > 1e-3  # a tick or more
    assert corrected < 0.6 * plain
