"""The extended state observer against its closed form, and in closed loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import (
    PARTS,
    Controller,
    ControllerSpec,
    ExtendedStateObserver,
    Gains,
    Observation,
    load_controller,
    model_feedforward,
)
from pronk_pin.control.tick_control.extended_state_observer import (
    ExtendedStateObserverControl,
    effective_inertia,
)
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait, load_library, replan
from pronk_pin.robot import Robot, load_robot, with_rotors

DT, BANDWIDTH, TICKS = 0.001, 80.0, 120
SPEC = load_controller("model+eso")


def bound(robot: Robot, gaits: list[Gait]) -> ExtendedStateObserverControl:
    spec = replace(SPEC, tick_controller=ExtendedStateObserver(bandwidth=BANDWIDTH))
    loop = Controller(robot, gaits, spec, timestep=DT).tick_loop
    assert loop is not None
    assert isinstance(loop.controller, ExtendedStateObserverControl)
    return loop.controller


class Joints:
    """Joints that are pushed off a reference at rest, with the inertia of the model, no ground."""

    def __init__(self, robot: Robot, gaits: list[Gait], part: int, push: Array) -> None:
        self.control, self.part, self.push = bound(robot, gaits), part, push
        self.rows = np.arange(len(gaits))
        table = [effective_inertia(with_rotors(robot), gait)[part] for gait in gaits]
        self.gain = np.linalg.inv(table)  # (n, nodes, 12, 12)
        self.duration = np.array([getattr(gait, PARTS[part]).duration for gait in gaits])
        self.position, self.velocity = np.zeros((2, len(gaits), 12))
        still = np.zeros_like(self.position)
        self.feedforward = still + 1.5

    def tick(self, k: int) -> tuple[Array, Array]:
        """Torques of a tick, and the acceleration by the push [N m, rad/s^2], (n, 12)."""
        phase = np.minimum(k * DT / self.duration, 1.0)
        still, load = np.zeros_like(self.position), np.zeros((len(self.rows), 4))
        measured = (phase, self.position, self.velocity, load, None)
        wanted = (still, still, still, self.feedforward, still)
        torque = self.control.command(Observation(self.rows, self.part, k, *measured, *wanted))
        gain = self.gain[self.rows, np.rint(phase * (self.gain.shape[1] - 1)).astype(int)]
        by_motors = (gain @ (torque - self.feedforward)[..., None])[..., 0]
        self.velocity = self.velocity + DT * (by_motors + self.push)
        self.position = self.position + DT * self.velocity
        return torque, np.linalg.solve(gain, np.broadcast_to(self.push, torque.shape)[..., None])


@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize("push", [20.0, 4000.0])
def test_a_constant_disturbance_is_estimated_as_two_equal_poles_say(
    robot: Robot, gaits: list[Gait], part: int, push: float
) -> None:
    """`d_hat = d (1 - (1 + (1 - p) k) p^k)`, also where motors are at their limits."""
    joints = Joints(robot, gaits, part, push * np.cos(np.arange(12.0)))
    pole = np.exp(-BANDWIDTH * DT)
    torques = []
    for k in range(TICKS):
        torques.append(joints.tick(k)[0])
        share = 1.0 - (1.0 + (1.0 - pole) * k) * pole**k
        expected = np.broadcast_to(share * joints.push, joints.position.shape)
        np.testing.assert_allclose(joints.control.disturbance, expected, rtol=1e-7, atol=1e-9)
    assert (np.abs(torques) == robot.tau_max).any() == (push > 1000.0)


def test_a_constant_disturbance_is_rejected(robot: Robot, gaits: list[Gait]) -> None:
    """The torque that resists it is found: what the feedback would need an error for."""
    joints = Joints(robot, gaits, 0, 20.0 * np.cos(np.arange(12.0)))
    for k in range(TICKS):
        torque, needed = joints.tick(k)
    feedback = Gains().feedback(-joints.position, -joints.velocity)
    found = torque - joints.feedforward - feedback
    np.testing.assert_allclose(found, -needed[..., 0], atol=0.01 * np.abs(needed).max())


def test_the_inertia_is_that_of_legs_below_a_trunk_that_is_free(
    robot: Robot, gaits: list[Gait]
) -> None:
    model = with_rotors(robot)
    table = effective_inertia(model, gaits[0])
    nodes = table.shape[1]
    for part, name in enumerate(PARTS):
        for node in (0, 7, nodes - 1):
            phase = getattr(gaits[0], name)
            joints, _ = phase.joint_reference(np.array([node / (nodes - 1)]))
            q = model.q_from_base(np.zeros(3), joints[0])
            free = [0, 2, *range(6, 18)]  # the rest is the guide's
            mass = pin.crba(model.model, model.data, q)[np.ix_(free, free)]
            gain = np.linalg.inv(mass)[2:, 2:]
            np.testing.assert_allclose(gain @ table[part, node], np.eye(12), atol=1e-9)


def test_each_part_of_the_stride_begins_without_a_disturbance(
    robot: Robot, gaits: list[Gait]
) -> None:
    joints = Joints(robot, gaits, 1, np.full(12, 50.0))
    for k in range(60):
        joints.tick(k)
    control = joints.control
    before = control.disturbance.copy()
    assert (before > 25.0).all()
    still, phase = np.zeros((1, 12)), np.array([0.01])
    measured = (phase, joints.position[1:], joints.velocity[1:], np.zeros((1, 4)), None)
    wanted = (still, still, still, joints.feedforward[1:], still)
    torque = control.command(Observation(np.array([1]), 0, 2, *measured, *wanted))
    feedback = Gains().feedback(-joints.position[1:], -joints.velocity[1:])
    np.testing.assert_array_equal(torque, feedback + joints.feedforward[1:])
    np.testing.assert_array_equal(control.disturbance, [before[0], np.zeros(12)])


def test_a_sensor_that_fails_says_nothing(robot: Robot, gaits: list[Gait]) -> None:
    joints = Joints(robot, gaits, 1, np.full(12, 50.0))
    for k in range(40):
        joints.tick(k)
        if k in (0, 20):  # at the beginning, and in between
            joints.velocity[0, 3] = joints.position[0, 4] = np.nan
            torque, _ = joints.tick(k + 1)
            assert np.isfinite(torque).all()
            joints.velocity[0, 3] = joints.position[0, 4] = 0.0
    assert np.isfinite(joints.control.disturbance).all()


@pytest.fixture(scope="module")
def planned(robot: Robot) -> tuple[tuple[Gait, ...], Array]:
    """The gait of 0.3 m/s that knows the rotors, and its torques."""
    model = with_rotors(robot)
    gaits = tuple(replan(model, [load_library("a1").at(0.3)]))
    return gaits, model_feedforward(model, gaits)


def simulated(
    robot: Robot,
    planned: tuple[tuple[Gait, ...], Array],
    spec: ControllerSpec,
    scenario: str,
    seconds: float,
    chunked: bool = True,
) -> dict[str, Array]:
    """Quantities of the strides of a robot, which stays up."""
    gaits, feedforward = planned
    simulation = Simulation(
        robot,
        gaits,
        spec,
        load_scenario(scenario),
        schedule=Schedule(startup=0.2, baseline=seconds, learning=0.0),
        rng=np.random.default_rng(0),
        feedforward=feedforward,
        chunked=chunked,
    )
    log = simulation.run()
    assert simulation.upright.all()
    names = ("felt_peak_error", "peak_error", "feedforward", "feedback", "duration")
    return {name: log[name][0, : log.count[0]] for name in names}


def test_without_bandwidth_it_is_the_planned_torques_and_feedback_to_the_bit(
    robot: Robot, planned: tuple[tuple[Gait, ...], Array]
) -> None:
    blind = replace(SPEC, tick_controller=ExtendedStateObserver(bandwidth=0.0))
    ours = simulated(robot, planned, blind, "nominal", 2.0)
    known = load_controller("model+rotors")
    theirs = simulated(robot, planned, known, "nominal", 2.0, chunked=False)
    for name in ("felt_peak_error", "peak_error", "feedforward", "duration"):
        np.testing.assert_array_equal(ours[name], theirs[name])
    np.testing.assert_allclose(ours["feedback"], theirs["feedback"], atol=1e-12)  # torque - ff


@pytest.mark.parametrize(
    ("scenario", "seconds", "least", "most"),
    [
        ("nominal", 5.0, 0.0, 1.0),
        ("payload", 9.0, 0.0, 0.8),
        ("weak-motors", 5.0, 0.0, 0.8),
        ("delay", 9.0, 1.1, 4.0),
    ],
)
def test_it_takes_errors_away_but_where_motors_are_late(
    robot: Robot,
    planned: tuple[tuple[Gait, ...], Array],
    scenario: str,
    seconds: float,
    least: float,
    most: float,
) -> None:
    """Felt peaks of calf and thigh over the last ten strides, over those without an observer."""
    if scenario == "delay":  # where fast gaits suffer most
        gaits = tuple(replan(with_rotors(robot), [load_library("a1").at(0.8)]))
        planned = gaits, model_feedforward(with_rotors(robot), gaits)
    ours, theirs = (
        simulated(robot, planned, spec, scenario, seconds)["felt_peak_error"][-10:]
        for spec in (SPEC, load_controller("model+rotors"))
    )
    ours, theirs = (each.reshape(10, 4, 3)[..., 1:] for each in (ours, theirs))
    assert least < ours.mean() / theirs.mean() < most


def test_noise_of_the_sensors_does_not_shake_it(
    robot: Robot, planned: tuple[tuple[Gait, ...], Array]
) -> None:
    log = simulated(robot, planned, SPEC, "noise", 5.0)
    assert all(np.isfinite(each).all() for each in log.values())
    assert log["peak_error"][-5:].mean() < 0.02  # hips, thighs and calves


def test_it_plays_a_feedforward_and_needs_a_locked_trunk_and_known_rotors(
    robot: Robot, gaits: list[Gait]
) -> None:
    with pytest.raises(InvalidInput, match=r"locked to x and z; base='free' needs another one"):
        Controller(robot, gaits, SPEC, timestep=DT, base="free")
    unknown = load_robot(replace(robot.spec, rotors=()))
    with pytest.raises(InvalidInput, match="rotors of a1 are not known"):
        Controller(unknown, gaits, SPEC, timestep=DT)
    with pytest.raises(InvalidInput, match="extended state observer: bandwidth"):
        ExtendedStateObserver(bandwidth=-1.0)
    assert SPEC.source == "model"
