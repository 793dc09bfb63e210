"""MuJoCo agrees with the gaits: replayed with their own torques they keep speed and apex.

The ground is as rigid as MuJoCo makes it, and nothing is unknown. What a contact model leaves
shrinks with its time constant, so that the time step is a tenth of the usual one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest

from pronk_pin.compare import MujocoWorld, World
from pronk_pin.compare.world.scenario import Scenario
from pronk_pin.control.signals.tape import Gains, Tape
from pronk_pin.gait import Gait, GaitProblem, bezier, load_library, optimize_gait
from pronk_pin.robot import Robot, load_robot

RIGID = Scenario("rigid", ground_time_constant=2e-4, timestep=1e-4)
STRIDES = 6
SETTLING = 3
"""Strides before those that count."""


class Replay(NamedTuple):
    """What became of gaits, each of shape (n,)."""

    speed: np.ndarray
    apex: np.ndarray


class Played(NamedTuple):
    """What became of one phase, each of shape (n,)."""

    ticks: np.ndarray
    top: np.ndarray


def tapes(gaits: Sequence[Gait], name: str, dt: float) -> Tape:
    """A phase of the gaits tick by tick; after its end it stays where it ended."""
    length = max(round(1.3 * gait.phase(name).duration / dt) for gait in gaits)
    position, velocity, torque = np.zeros((3, len(gaits), length, 12))
    for i, gait in enumerate(gaits):
        phase = gait.phase(name)
        s = np.minimum(np.arange(length) * dt / phase.duration, 1.0)
        position[i], velocity[i] = phase.joint_reference(s)
        torque[i] = bezier.evaluate(phase.tau, s)
    ticks = [round(gait.phase(name).duration / dt) for gait in gaits]
    last = ticks if name == "stance" else [length - 1] * len(gaits)
    return Tape(torque, position, velocity, np.array(last))


def play(robot: Robot, world: World, tape: Tape, early: np.ndarray | None = None) -> Played:
    """Play tapes to their ends, or from the ticks `early` on until the feet carry a load."""
    n = world.n
    motion = world.play(np.arange(n), tape.setpoint(Gains()))
    ticks = tape.length
    if early is not None:
        loaded = motion.force[..., 2].sum(axis=-1) > 0.1 * robot.mass * robot.gravity
        loaded &= np.arange(loaded.shape[1]) >= early[:, None]
        assert loaded.any(axis=1).all()
        ticks = 1 + np.argmax(loaded, axis=1)
    world.advance(np.arange(n), motion, ticks)
    height = motion.base[..., 1]
    inside = np.arange(height.shape[1]) < ticks[:, None]
    return Played(ticks, np.where(inside, height, 0.0).max(axis=1))


def replay(robot: Robot, gaits: Sequence[Gait]) -> Replay:
    """Average speed and mean apex over the last strides, from a start at lift-off."""
    n, dt = len(gaits), RIGID.timestep
    world = MujocoWorld(robot, RIGID, n, servo=Gains())
    stance, flight = tapes(gaits, "stance", dt), tapes(gaits, "flight", dt)
    start = np.array([0.0])
    states = [(g.flight.base_reference(start), g.flight.joint_reference(start)) for g in gaits]
    base, base_rate = (np.array([s[0][k][0, :2] for s in states]) for k in (0, 1))
    joints, rates = (np.array([s[1][k][0] for s in states]) for k in (0, 1))
    world.reset(base, joints, base_rate, rates)
    early = np.array([0.7 * gait.flight.duration / dt for gait in gaits])
    play(robot, world, flight, early)
    tops, clock, landings = [], np.zeros(n), [(np.zeros(n), world.base[:, 0])]
    for _ in range(STRIDES):
        down = play(robot, world, stance)
        up = play(robot, world, flight, early)
        clock = clock + (down.ticks + up.ticks) * dt
        landings.append((clock, world.base[:, 0]))
        tops.append(up.top)
    (begun, first), (ended, last) = landings[SETTLING], landings[-1]
    return Replay((last - first) / (ended - begun), np.mean(tops[SETTLING:], axis=0))


def check(robot: Robot, gaits: Sequence[Gait]) -> None:
    speeds = np.array([gait.speed for gait in gaits])
    found = replay(robot, gaits)
    # 2 %; and where the speed is nearly zero, 2 % of 0.1 m/s.
    np.testing.assert_allclose(found.speed, speeds, rtol=0.02, atol=0.002)
    np.testing.assert_allclose(found.apex, [gait.apex for gait in gaits], rtol=0, atol=0.002)


def test_gaits_keep_their_speed_and_apex_in_mujoco(robot: Robot) -> None:
    library = load_library("a1")
    check(robot, [library.at(speed) for speed in (-0.3, 0.4)])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a1", "go1", "go2"])
def test_every_gait_keeps_its_speed_and_apex_in_mujoco(name: str) -> None:
    check(load_robot(name), load_library(name).gaits)


def test_a_gait_of_point_feet_does_not_keep_its_speed(robot: Robot) -> None:
    """The feet are spheres that roll: 7 % of the speed here, which is why the gaits roll too."""
    gait = optimize_gait(GaitProblem(robot, 0.4, contact="point")).gait
    assert abs(replay(robot, [gait]).speed[0] / 0.4 - 1.0) > 0.05
