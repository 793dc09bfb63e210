"""What a controller makes of the flight: how long the next one lasts, what its end is shown, and
whether the trunk leaned too far in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import (
    SAMPLES,
    SKIPPED,
    Controller,
    ControllerSpec,
    FlightTiming,
    Gains,
    PDTypeILC,
    PhaseLog,
    ZeroPhaseFilter,
    load_controller,
    phase_grid,
)
from pronk_pin.gait import Gait
from pronk_pin.robot import Robot

DT = 0.001
BOTH = np.arange(2)
YES = np.ones(2, dtype=bool)


@pytest.fixture
def logs(gaits: list[Gait], phase_log: Callable[..., PhaseLog]) -> tuple[PhaseLog, PhaseLog]:
    """Stances and flights of two robots, as planned."""
    made = []
    for part, sensed in (("stance", 2), ("flight", 0)):
        phases = [getattr(gait, part) for gait in gaits]
        ticks = round(phases[0].duration / DT)
        s = [np.minimum(DT * np.arange(ticks) / phase.duration, 1.0) for phase in phases]
        curves = [phase.joint_reference(at) for phase, at in zip(phases, s, strict=True)]
        joints, rates = (np.stack(curve) for curve in zip(*curves, strict=True))
        made.append(phase_log(joints, rates, sensed=sensed))
    return made[0], made[1]


def stride(controller: Controller, gaits: list[Gait], stance: PhaseLog, flight: PhaseLog) -> None:
    """One stride that is learned from."""
    controller.liftoff(BOTH, stance)
    controller.landing(BOTH, flight, np.array([gait.duration for gait in gaits]))
    controller.touchdown(BOTH, YES)


def test_a_flight_of_so_many_ticks_ends_between_the_last_and_the_next(
    robot: Robot, gaits: list[Gait], logs: tuple[PhaseLog, PhaseLog]
) -> None:
    """Contact that is seen after tick k came between k and k + 1: half a tick later on average."""
    stance, flight = logs
    planned = np.array([gait.flight.duration for gait in gaits])
    for gain in (1.0, 0.5):
        spec = ControllerSpec("mine", timing=FlightTiming(gain=gain), law=PDTypeILC(gain=0.0))
        controller = Controller(robot, gaits, spec, timestep=DT)
        ticks = flight.length - np.array([3, 8])
        stride(controller, gaits, stance, replace(flight, length=ticks))
        measured = (ticks + 0.5) * DT
        np.testing.assert_allclose(controller.flight, planned + gain * (measured - planned))


def test_the_end_of_a_flight_is_shown_the_next_stance_at_its_own_pace(
    robot: Robot, gaits: list[Gait], logs: tuple[PhaseLog, PhaseLog]
) -> None:
    """An error that grows with the time since touchdown is read at that time, in seconds: a flight
    lasts longer than a stance, and a tenth of it is more than a tenth of that."""
    stance, flight = logs
    delta = 0.1
    open_filter = ZeroPhaseFilter.butterworth(1, 0.98)
    law = PDTypeILC(gain=1.0, leak=0.0, delta=delta, filter=open_filter, gains=Gains(kd=(0, 0, 0)))
    spec = ControllerSpec("mine", flight_law=law)
    controller = Controller(robot, gaits, spec, timestep=DT)
    since = DT * np.arange(stance.joints.shape[1])
    late = replace(stance, joints=stance.joints - 3.0 * since[:, None], sensed=0)
    stride(controller, gaits, late, flight)
    s = phase_grid()
    for k, gait in enumerate(gaits):
        assert gait.flight.duration > 1.2 * gait.stance.duration  # the one is not the other
        ahead = (s - (1.0 - delta)) * gait.flight.duration  # [s] after touchdown
        expected = np.outer(3.0 * np.maximum(ahead, 0.0), np.tile([35.0, 60.0, 90.0], 4))
        inner = (s > 1.0 - delta + 0.01) & (s < 0.99)
        np.testing.assert_allclose(controller.feedforward[k, 1, inner], expected[inner], rtol=0.03)


def leaning(log: PhaseLog, angles: Array, *, tick: int) -> PhaseLog:
    """The log of robots (n,) whose trunks roll by some angles at one tick."""
    n, ticks = log.joints.shape[:2]
    pose = np.zeros((n, ticks, 7))
    pose[..., 6] = 1.0
    for robot, angle in enumerate(angles):
        pose[robot, tick, 3:] = pin.Quaternion(pin.rpy.rpyToMatrix(angle, 0.0, 0.0)).coeffs()
    return replace(log, pose=pose, twist=np.zeros((n, ticks, 6)))


@pytest.mark.parametrize("part", [0, 1])
def test_a_trunk_that_leans_too_far_in_either_part_teaches_nothing(
    robot: Robot, gaits: list[Gait], logs: tuple[PhaseLog, PhaseLog], part: int
) -> None:
    controller = Controller(robot, gaits, load_controller("ilc"), timestep=DT, base="free")
    limit = controller.spec.selection.tilt
    for angles in ([1.1 * limit, 0.9 * limit], [0.9 * limit, 1.1 * limit], [0.0, 0.0]):
        both = [leaning(log, np.zeros(2), tick=0) for log in logs]
        both[part] = leaning(logs[part], np.array(angles), tick=50)
        stride(controller, gaits, *both)
        told = [SKIPPED[code] for code in controller.skipped]
        assert told == ["tilted" if angle > limit else SKIPPED[0] for angle in angles]


def test_how_a_trunk_leans_after_the_end_of_a_part_does_not_count(
    robot: Robot, gaits: list[Gait], logs: tuple[PhaseLog, PhaseLog]
) -> None:
    controller = Controller(robot, gaits, load_controller("ilc"), timestep=DT, base="free")
    stance = leaning(logs[0], np.zeros(2), tick=0)
    late = leaning(logs[1], np.array([1.0, 1.0]), tick=100)
    short = replace(late, length=np.array([100, 101]))
    stride(controller, gaits, stance, short)
    assert [SKIPPED[code] for code in controller.skipped] == [SKIPPED[0], "tilted"]


def test_a_stride_without_learning_changes_neither_torque_nor_timing(
    robot: Robot, gaits: list[Gait], logs: tuple[PhaseLog, PhaseLog]
) -> None:
    stance, flight = logs
    controller = Controller(robot, gaits, load_controller("ilc"), timestep=DT)
    planned = controller.flight
    controller.liftoff(BOTH, replace(stance, joints=stance.joints - 0.1))
    durations = np.array([gait.duration for gait in gaits])
    controller.landing(BOTH, replace(flight, length=flight.length - 9), durations)
    controller.touchdown(BOTH, ~YES)
    np.testing.assert_array_equal(controller.flight, planned)
    np.testing.assert_array_equal(controller.feedforward, np.zeros((2, 2, SAMPLES, 12)))
