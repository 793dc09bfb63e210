"""Computed torque against inverse dynamics, and in closed loop."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array, IntArray
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import (
    PARTS,
    ComputedTorque,
    Controller,
    ControllerSpec,
    Observation,
    TickLoop,
    load_controller,
    model_feedforward,
)
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait, load_library, replan
from pronk_pin.inverse_dynamics import PLANAR_CONSTRAINT, inverse_dynamics
from pronk_pin.kinematics import contact_jacobian
from pronk_pin.robot import Robot, load_robot, with_rotors

DT = 0.001
OMEGA = 100.0
TICKS = (5, 60, 130)
"""Ticks early, in the middle and late in both parts."""


class Aim(NamedTuple):
    """What the joints should do."""

    position: Array
    velocity: Array
    acceleration: Array


class Reading(NamedTuple):
    """What is measured."""

    joints: Array
    joint_rates: Array
    load: Array


class Asked:
    """A tick controller, asked tick by tick for motor torques within their limits."""

    def __init__(self, loop: TickLoop) -> None:
        self.loop = loop

    def torque(self, part: int, rows: IntArray, tick: int, aim: Aim, reading: Reading) -> Array:
        m = len(rows)
        none = np.zeros((m, 12))
        self.loop.torque(
            Observation(rows, part, tick, np.zeros(m), *reading, None, *aim, none, none)
        )
        return self.loop.previous[rows]


@pytest.fixture(scope="module")
def control(robot: Robot, gaits: list[Gait]) -> Asked:
    return bound(robot, gaits, load_controller("computed-torque"))


def bound(robot: Robot, gaits: list[Gait], spec: ControllerSpec) -> Asked:
    loop = Controller(robot, gaits, spec, timestep=DT).tick_loop
    assert loop is not None
    return Asked(loop)


def reference(gaits: list[Gait], part: int, tick: int) -> Aim:
    """What the joints should do at a tick."""
    phases = [getattr(gait, PARTS[part]) for gait in gaits]
    s = [np.array([tick * DT / phase.duration]) for phase in phases]
    curves = [
        (*phase.joint_reference(at), phase.joint_acceleration(at))
        for phase, at in zip(phases, s, strict=True)
    ]
    return Aim(*(np.concatenate(each) for each in zip(*curves, strict=True)))


def on(aim: Aim, part: int) -> Reading:
    """The reading of robots that are where they should be."""
    return Reading(aim.position, aim.velocity, np.full((len(aim.position), 4), 80.0 * (part == 0)))


def planned(robot: Robot, gaits: list[Gait], part: int, tick: int, change: Array) -> Array:
    """Inverse dynamics of the gaits at a tick, their accelerations (18,) changed, (n, 12)."""
    torques = []
    for gait in gaits:
        phase = getattr(gait, PARTS[part])
        motion = phase.motion(robot, np.array([tick * DT / phase.duration]))
        a = motion.a + change
        if part == 0:
            solution = inverse_dynamics(
                robot, motion.q, motion.v, a, contact="rolling", constraint=PLANAR_CONSTRAINT
            )
        else:
            solution = inverse_dynamics(robot, motion.q, motion.v, a, feet=())
        torques.append(solution.tau[0])
    return np.array(torques)


@pytest.mark.parametrize("part", [0, 1])
def test_on_the_reference_the_torque_is_the_models_feedforward(
    robot: Robot, gaits: list[Gait], control: Asked, part: int
) -> None:
    """In flight but for the polynomials of the trunk, which fall within 0.1 m/s^2 of gravity's."""
    model, rows = with_rotors(robot), np.arange(len(gaits))
    for tick in TICKS:
        aim = reference(gaits, part, tick)
        torque = control.torque(part, rows, tick, aim, on(aim, part))
        expected = planned(model, gaits, part, tick, np.zeros(18))
        assert np.abs(expected).max() < robot.tau_max.max()
        np.testing.assert_allclose(torque, expected, atol=1e-6 if part == 0 else 5e-3)


@pytest.mark.parametrize("tick", TICKS)
def test_in_flight_the_torque_moves_the_legs_below_a_trunk_that_falls(
    robot: Robot, gaits: list[Gait], control: Asked, tick: int
) -> None:
    """Forward dynamics of the falling robot give the accelerations of the reference back."""
    model, rows = with_rotors(robot), np.arange(len(gaits))
    aim = reference(gaits, 1, tick)
    torque = control.torque(1, rows, tick, aim, on(aim, 1))
    for row in rows:
        q = model.q_from_base(np.zeros(3), aim.position[row])
        v = np.concatenate([np.zeros(6), aim.velocity[row]])
        free = [0, 2, *range(6, 18)]  # the rest is the guide's
        mass = pin.crba(model.model, model.data, q)[np.ix_(free, free)]
        rest = pin.nonLinearEffects(model.model, model.data, q, v)[free]
        force = np.concatenate([np.zeros(2), torque[row]])
        a = np.linalg.solve(mass, force - rest)
        np.testing.assert_allclose(a[2:], aim.acceleration[row], rtol=1e-9, atol=1e-6)


def test_on_the_reference_of_gaits_with_rotors_it_is_what_their_controller_plays(
    robot: Robot, gaits: list[Gait]
) -> None:
    """Beyond inverse dynamics, the feedforward of `model+rotors` itself, at its samples."""
    model = with_rotors(robot)
    gaits = replan(model, gaits)
    control, rows = bound(robot, gaits, load_controller("computed-torque+rotors")), np.arange(2)
    played = model_feedforward(model, gaits, samples=5)
    for k in (1, 2, 3):
        for row, gait in enumerate(gaits):
            tick = 0.25 * k * gait.stance.duration / DT
            aim = reference([gait], 0, tick)  # type: ignore[arg-type]
            nearest = round(tick)  # the trunk's acceleration is tabulated at ticks
            torque = control.torque(0, rows[row : row + 1], nearest, aim, on(aim, 0))
            np.testing.assert_allclose(torque[0], played[row, 0, k], atol=0.5)


@pytest.mark.parametrize("tick", TICKS)
def test_an_error_in_flight_gives_the_torque_that_takes_it_away(
    robot: Robot, gaits: list[Gait], control: Asked, tick: int
) -> None:
    """The change of torque moves the joint alone, by omega^2 e: M_eff is that of a free trunk."""
    rows, model = np.arange(len(gaits)), with_rotors(robot)
    aim, h = reference(gaits, 1, tick), 1e-6
    for joint in (0, 4, 8):
        step = h * np.eye(12)[joint]
        sides = [
            control.torque(1, rows, tick, aim._replace(position=aim.position + sign * step),
                           on(aim, 1))
            for sign in (1.0, -1.0)
        ]  # fmt: skip
        change = (sides[0] - sides[1]) / (2.0 * h)
        for row in rows:
            mass = effective_mass(model, aim.position[row])
            np.testing.assert_allclose(change[row], OMEGA**2 * mass[:, joint], atol=1e-3)


def effective_mass(model: Robot, joints: Array) -> Array:
    """Mass matrix of the joints below a trunk that is free along x and z, shape (12, 12)."""
    mass = pin.crba(model.model, model.data, model.q_from_base(np.zeros(3), joints))
    trunk, legs = [0, 2], slice(6, 18)
    coupling, whole = mass[trunk, legs], mass[np.ix_(trunk, trunk)]
    return np.asarray(mass[legs, legs] - coupling.T @ np.linalg.solve(whole, coupling))


@pytest.mark.parametrize("tick", TICKS)
def test_an_error_in_stance_gives_the_torque_of_the_wanted_acceleration(
    robot: Robot, gaits: list[Gait], control: Asked, tick: int
) -> None:
    """All feet wide by a joint ask the trunk to go where these legs would carry it."""
    rows, model = np.arange(len(gaits)), with_rotors(robot)
    aim, h = reference(gaits, 0, tick), 1e-6
    for kind in (1, 2):
        step = np.zeros(12)
        step[kind::3] = 1.0
        sides = [
            control.torque(0, rows, tick, aim._replace(position=aim.position + sign * h * step),
                           on(aim, 0))
            for sign in (1.0, -1.0)
        ]  # fmt: skip
        change = (sides[0] - sides[1]) / (2.0 * h)
        for row, gait in enumerate(gaits):
            lever = feet_by_joints(model, aim.position[row]) @ step
            wanted = np.zeros(18)
            wanted[[0, 2]] = -lever.reshape(4, 3).mean(axis=0)[[0, 2]]
            wanted[6:] = step
            expected = planned(model, [gait], 0, tick, OMEGA**2 * h * wanted)
            expected -= planned(model, [gait], 0, tick, -(OMEGA**2) * h * wanted)
            np.testing.assert_allclose(change[row], expected[0] / (2.0 * h), rtol=1e-4, atol=0.5)


def feet_by_joints(robot: Robot, joints: Array) -> Array:
    """Velocities of rolling contact points for unit joint rates, shape (12, 12)."""
    q = robot.q_from_base(np.zeros(3), joints)
    return contact_jacobian(robot, q, contact="rolling")[:, 6:]


def test_torques_keep_to_the_motors_limits_and_failed_sensors_reach_none(
    robot: Robot, gaits: list[Gait], control: Asked
) -> None:
    aim, rows = reference(gaits, 0, 60), np.arange(len(gaits))
    far = on(aim._replace(position=aim.position + 0.5), 0)
    torque = control.torque(0, rows, 60, aim, far)
    assert (np.abs(torque) <= robot.tau_max).all()
    assert (np.abs(torque) == robot.tau_max).any()
    broken = on(aim, 0)
    broken.joints[0, 3] = np.nan
    assert np.isfinite(control.torque(0, rows, 60, aim, broken)).all()


def test_feet_that_feel_no_load_carry_nothing(gaits: list[Gait], control: Asked) -> None:
    """Without any the torque is that of the flight, whatever the schedule says."""
    aim, rows = reference(gaits, 0, 60), np.arange(len(gaits))
    reading = on(aim, 0)._replace(load=np.full((len(gaits), 4), 4.0))
    np.testing.assert_array_equal(
        control.torque(0, rows, 60, aim, reading), control.torque(1, rows, 60, aim, reading)
    )


@pytest.mark.parametrize(
    ("name", "omega", "scenario"),
    [
        ("computed-torque", 100.0, "nominal"),
        ("computed-torque+rotors", 100.0, "nominal"),
        ("whole-body-qp", 100.0, "nominal"),
        ("computed-torque+rotors", 60.0, "delay"),
    ],
)
def test_in_closed_loop_robots_stay_up_and_track_twice_as_well_as_with_the_models_torques(
    robot: Robot, name: str, omega: float, scenario: str
) -> None:
    """Where motors are late, after some ten strides in which the flights find their duration."""
    spec, library = load_controller(name), load_library("a1")
    assert isinstance(spec.tick_controller, ComputedTorque)
    spec = replace(spec, tick_controller=replace(spec.tick_controller, omega=omega))
    gaits = [library.at(speed) for speed in (-0.3, 0.3)]
    model = models_calf_peaks(scenario)
    if spec.gait_model == "datasheet":
        gaits = replan(with_rotors(robot), gaits)
    assert (calf_peaks(robot, gaits, spec, scenario) < 0.5 * model).all()


@lru_cache
def models_calf_peaks(scenario: str) -> Array:
    """Those of the model's torques at -0.3 and 0.3 m/s."""
    gaits = [load_library("a1").at(speed) for speed in (-0.3, 0.3)]
    return calf_peaks(load_robot("a1"), gaits, load_controller("model"), scenario)


def calf_peaks(robot: Robot, gaits: list[Gait], spec: ControllerSpec, scenario: str) -> Array:
    """Felt peak errors of the calves over the last five of some strides [rad], shape (n,)."""
    seconds = 7.0 if scenario == "delay" else 3.5
    simulation = Simulation(
        robot,
        gaits,
        spec,
        load_scenario(scenario),
        schedule=Schedule(startup=0.2, baseline=seconds, learning=0.0),
        rng=np.random.default_rng(0),
        feedforward=model_feedforward(robot, gaits) if spec.source == "model" else None,
    )
    log = simulation.run()
    assert simulation.upright.all()
    last = [log["felt_peak_error"][row, end - 5 : end, 2::3] for row, end in enumerate(log.count)]
    return np.asarray(np.mean(last, axis=(1, 2)))


def test_it_needs_a_locked_trunk_and_known_rotors(robot: Robot, gaits: list[Gait]) -> None:
    spec = load_controller("computed-torque")
    with pytest.raises(InvalidInput, match=r"locked to x and z; base='free' needs another one"):
        Controller(robot, gaits, spec, timestep=DT, base="free")
    unknown = load_robot(replace(robot.spec, rotors=()))
    with pytest.raises(InvalidInput, match="rotors of a1 are not known"):
        Controller(unknown, gaits, spec, timestep=DT)
    with pytest.raises(InvalidInput, match="computed torque: omega"):
        ComputedTorque(omega=0.0)
