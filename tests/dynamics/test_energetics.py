"""Energy, momentum and power agree with the equations of motion, and with each other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import Robot, dynamics
from pronk_pin._typing import Array
from pronk_pin.dynamics.energetics import (
    centroidal_momentum,
    cost_of_transport,
    kinetic_energy,
    mechanical_power,
    potential_energy,
)
from pronk_pin.errors import InvalidInput
from pronk_pin.robot.conventions import rotation_matrix

Draw = Callable[..., tuple[Array, Array, Array, Array]]


def test_kinetic_energy_is_half_of_v_m_v(any_robot: Robot, any_states: Draw) -> None:
    q, v, _, _ = any_states(20)
    expected = [
        0.5 * v_row @ dynamics.mass_matrix(any_robot, q_row) @ v_row
        for q_row, v_row in zip(q, v, strict=True)
    ]
    np.testing.assert_allclose(kinetic_energy(any_robot, q, v), expected, rtol=1e-12)
    shaped = kinetic_energy(any_robot, q.reshape(4, 5, -1), v.reshape(4, 5, -1))
    np.testing.assert_array_equal(shaped.ravel(), kinetic_energy(any_robot, q, v))
    assert float(kinetic_energy(any_robot, q[0], v[0])) == pytest.approx(expected[0])


def test_gravity_is_the_gradient_of_the_potential_energy(
    any_robot: Robot, any_states: Draw
) -> None:
    step = 1e-6
    for q in any_states(3)[0]:
        numeric = [
            potential_energy(any_robot, pin.integrate(any_robot.model, q, step * axis))
            - potential_energy(any_robot, pin.integrate(any_robot.model, q, -step * axis))
            for axis in np.eye(any_robot.nv)
        ]
        forces = dynamics.gravity(any_robot, q)
        np.testing.assert_allclose(np.array(numeric) / (2 * step), forces, atol=1e-6)


def test_momentum_is_that_of_the_base_s_equations(any_robot: Robot, any_states: Draw) -> None:
    """The base's rows of M v are the whole robot's momentum, in the base's frame about it."""
    q, v, _, _ = any_states(20)
    momentum = centroidal_momentum(any_robot, q, v)
    for row, rotation in enumerate(rotation_matrix(q[:, 3:7])):
        base = (dynamics.mass_matrix(any_robot, q[row]) @ v[row])[:6]
        linear, angular = rotation @ base[:3], rotation @ base[3:]
        centre = pin.centerOfMass(any_robot.model, any_robot.data, q[row]) - q[row, :3]
        np.testing.assert_allclose(momentum.linear[row], linear, atol=1e-11)
        np.testing.assert_allclose(
            momentum.angular[row], angular - np.cross(centre, linear), atol=1e-11
        )


def test_power_is_the_rate_of_the_energy_in_flight(robot: Robot, random_states: Draw) -> None:
    q, v, _, tau = (x[0] for x in random_states(1))
    a, step = dynamics.flight_dynamics(robot, q, v, tau), 1e-6

    def energy(t: float) -> float:
        ahead = pin.integrate(robot.model, q, t * v + 0.5 * t**2 * a)
        return float(kinetic_energy(robot, ahead, v + t * a) + potential_energy(robot, ahead))

    rate = (energy(step) - energy(-step)) / (2 * step)
    assert mechanical_power(robot, v, tau).sum() == pytest.approx(rate, rel=1e-5)


def test_the_cost_of_transport_of_a_lift_is_weight_times_height(robot: Robot) -> None:
    """A motor that gives 3 W for 2 s and takes 1 W for 2 s, on a walk of 1.5 m."""
    t = np.array([0.0, 2.0, 2.0 + 1e-12, 4.0])
    q = np.tile(robot.standing, (4, 1))
    q[:, 0], q[:, 1] = np.linspace(0.0, 0.9, 4), np.linspace(0.0, 1.2, 4)
    v, tau = np.zeros((4, 18)), np.zeros((4, 12))
    v[:, 8], tau[:, 2] = 1.0, [3.0, 3.0, -1.0, -1.0]
    weight = robot.mass * robot.gravity
    assert cost_of_transport(robot, t, q, v, tau) == pytest.approx(6.0 / (weight * 1.5))
    generous = cost_of_transport(robot, t, q, v, tau, regeneration=1.0)
    assert generous == pytest.approx(4.0 / (weight * 1.5))
    assert cost_of_transport(robot, t, np.tile(q[0], (4, 1)), v, tau) == np.inf


def test_wrong_arguments_are_refused_with_a_remedy(robot: Robot) -> None:
    t, q = np.array([0.0, 1.0]), np.tile(robot.standing, (2, 1))
    v, tau = np.zeros((2, 18)), np.zeros((2, 12))
    with pytest.raises(InvalidInput, match="increasing times"):
        cost_of_transport(robot, t[::-1], q, v, tau)
    with pytest.raises(InvalidInput, match="two or more samples"):
        cost_of_transport(robot, t[:1], q[:1], v[:1], tau[:1])
    with pytest.raises(InvalidInput, match="from 0 to 1"):
        cost_of_transport(robot, t, q, v, tau, regeneration=2.0)
    with pytest.raises(InvalidInput, match=r"tau has shape \(12,\)"):
        mechanical_power(robot, v, tau[0])
    with pytest.raises(InvalidInput, match="NaN"):
        potential_energy(robot, np.nan * q)
