"""What acts tick by tick, against Newton: pushes, late torques, and sensors that are off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.compare import MujocoWorld, Scenario, Schedule, Simulation, World, load_scenario
from pronk_pin.control import load_controller
from pronk_pin.gait import Gait
from pronk_pin.robot import Robot

IDEAL = load_scenario("ideal")
Build = Callable[..., Simulation]


@pytest.fixture(scope="module")
def build(robot: Robot, gaits: list[Gait]) -> Build:
    def simulation(scenario: Scenario, *, controller: str = "pd", **times: float) -> Simulation:
        return Simulation(
            robot,
            gaits,
            load_controller(controller),
            scenario,
            schedule=Schedule(**{"startup": 0.2, "baseline": 1.2, "learning": 0.0, **times}),
            rng=np.random.default_rng(0),
        )

    return simulation


@pytest.mark.parametrize("ticks", [1, 7])
def test_a_pushs_impulse_is_the_change_of_momentum(robot: Robot, ticks: int) -> None:
    """Of the whole robot, in the air; however many ticks are played at once."""
    pushed = replace(IDEAL, push_impulse=(3.0, 0.0, 1.0), push_period=0.02, push_duration=0.008)
    world = MujocoWorld(robot, pushed, 1)
    world.reset(np.array([[0.0, 2.0]]), robot.standing[None, 7:])
    momentum = []
    steps = 35
    for _ in range(0, steps, ticks):
        before = world.state
        motion = world.play(np.arange(1), np.zeros((1, ticks, 12)))
        world.advance(np.arange(1), motion, np.array([ticks]))
        assert np.any(before != world.state)
        momentum.append(_momentum(robot, world))
    time = steps * pushed.timestep
    falling = np.array([0.0, -robot.mass * robot.gravity * time])
    # The Jacobian at the end and the velocity meet within a time step of each other.
    np.testing.assert_allclose(momentum[-1], np.array([3.0, 1.0]) + falling, rtol=1e-3, atol=2e-3)


def _momentum(robot: Robot, world: World) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Of the robot in x and z [N s], by Pinocchio."""
    q = robot.q_from_base(np.insert(world.base[0], 1, 0.0), world.joints[0])
    v = np.zeros(18)
    v[[0, 2]], v[6:] = world.base_rate[0], world.joint_rates[0]
    data = robot.model.createData()
    return np.array(pin.computeCentroidalMomentum(robot.model, data, q, v).linear)[[0, 2]]


def test_the_push_of_a_simulation_speeds_it_up_by_its_impulse(build: Build, robot: Robot) -> None:
    """From the last tick before to the first after, in the air or on legs that give way."""
    pushed = replace(
        load_scenario("nominal"),
        push_impulse=(4.0, 0.0, 0.0),
        push_period=0.7,
        push_duration=0.001,
    )
    still, moved = build(replace(pushed, push_impulse=(0.0, 0.0, 0.0))), build(pushed)
    seen = []
    for simulation in (still, moved):
        rates: list[tuple[float, float]] = []
        world, advance = simulation.world, simulation.world.advance

        def spy(rows, motion, ticks, *, log=rates, advance=advance, world=world):  # type: ignore[no-untyped-def]
            for row, path, count in zip(rows, motion.path, ticks, strict=True):
                if row == 0:
                    log += [(path[k, 0], path[k, world._base_rate[0]]) for k in range(count + 1)]
            advance(rows, motion, ticks)

        world.advance = spy  # type: ignore[method-assign]
        simulation.run()
        seen.append({round(time * 1000): rate for time, rate in rates})
    gained = seen[1][701] - seen[0][701]
    assert seen[1][700] == seen[0][700]
    # The legs hang on the trunk by their joints: at first it moves a little more than the whole.
    assert 4.0 / robot.mass < gained < 4.0 / 4.0


def test_a_delay_is_the_same_torque_later(build: Build) -> None:
    """What the motors give is what they were told, so many ticks before."""
    late = build(replace(load_scenario("nominal"), delay=0.003))
    told: list[np.ndarray] = []  # type: ignore[type-arg]
    given: list[np.ndarray] = []  # type: ignore[type-arg]
    command, play, advance = late.player.motors.command, late.world.play, late.world.advance

    def spy_command(rows, commands, ticks):  # type: ignore[no-untyped-def]
        for k in np.flatnonzero(rows == 0):
            told.extend(commands[k, : ticks[k]].copy())
        command(rows, commands, ticks)

    played: list[np.ndarray] = []  # type: ignore[type-arg]

    def spy_play(rows, control):  # type: ignore[no-untyped-def]
        played[:] = control.copy()
        return play(rows, control)

    def spy_advance(rows, motion, ticks):  # type: ignore[no-untyped-def]
        for k in np.flatnonzero(rows == 0):
            given.extend(played[k][: ticks[k]])
        advance(rows, motion, ticks)

    late.player.motors.command = spy_command  # type: ignore[method-assign]
    late.world.play, late.world.advance = spy_play, spy_advance  # type: ignore[method-assign]
    late.run()
    assert len(told) == len(given) > 1000
    np.testing.assert_array_equal(np.array(given)[3:], np.array(told)[:-3])


def test_motors_that_are_fast_enough_and_perfect_sensors_change_nothing(build: Build) -> None:
    nominal = load_scenario("nominal")
    fast = replace(nominal, full_torque_speed=500.0, no_load_speed=1000.0)
    assert not fast.affine
    one, other = (build(scenario).run() for scenario in (nominal, fast))
    np.testing.assert_allclose(one["peak_error"], other["peak_error"], atol=1e-6)


def test_a_late_torque_makes_larger_errors(build: Build) -> None:
    errors = [
        np.nanmean(build(load_scenario(name)).run()["peak_error"][..., 2::3])
        for name in ("nominal", "delay=0.006")
    ]
    assert errors[1] > 1.1 * errors[0]


def test_what_is_kept_of_a_robot_with_biased_encoders_is_the_truth(build: Build) -> None:
    """The robot believes its encoders, and holds a posture that is off by their bias."""
    nominal = load_scenario("nominal")
    biased = replace(nominal, sensors=replace(nominal.sensors, encoder_bias=0.02))
    simulation = build(biased)
    simulation.run()
    bias = simulation.player.sensors._encoder_bias
    believed, true = simulation.player.sensed.joints, simulation.player.log.joints
    ticks = slice(simulation.controller.spec.touchdown_ticks, 50)
    np.testing.assert_allclose(
        (believed - true)[:, ticks], np.broadcast_to(bias[:, None], true[:, ticks].shape)
    )


def test_the_same_seed_makes_the_same_noise_for_every_controller(build: Build) -> None:
    noisy = load_scenario("noise")
    first, second = (build(noisy, controller=name) for name in ("pd", "model"))
    np.testing.assert_array_equal(
        first.player.sensors._encoder_bias, second.player.sensors._encoder_bias
    )
    rows, zero = np.arange(2), np.zeros((2, 12))
    np.testing.assert_array_equal(
        first.player.sensors.encoders(rows, zero, zero),
        second.player.sensors.encoders(rows, zero, zero),
    )


def test_the_accelerometer_integrates_to_the_change_of_speed(build: Build, robot: Robot) -> None:
    """Over a stance; in flight it feels nothing but the legs' swing."""
    simulation = build(load_scenario("nominal"), controller="ilc-imu")
    liftoff, found = simulation.controller.liftoff, []

    def spy(rows, log, commanded):  # type: ignore[no-untyped-def]
        rate = simulation.player.log.base_rate[rows]
        for row, length in enumerate(log.length):
            force = log.specific_force[row, : length - 1] - [0.0, 0.0, robot.gravity]
            gained = force.sum(axis=0)[[0, 2]] * 0.001
            found.append(gained - (rate[row, length - 1] - rate[row, 0]))
        return liftoff(rows, log, commanded)

    simulation.controller.liftoff = spy  # type: ignore[method-assign]
    simulation.run()
    assert len(found) > 4
    np.testing.assert_allclose(found, 0.0, atol=1e-9)
