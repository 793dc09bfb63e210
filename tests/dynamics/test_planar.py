"""The planar robot's derivatives against finite differences of its forward dynamics."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.dynamics import (
    Rotors,
    planar_acceleration,
    planar_derivatives,
    planar_dynamics,
    planar_rows,
)
from pronk_pin.gait import load_library
from pronk_pin.robot import NB, Robot

H = 1e-6


@pytest.mark.parametrize(
    ("phase", "contact"), [("stance", "rolling"), ("stance", "point"), ("flight", None)]
)
def test_derivatives_are_those_of_the_guided_acceleration(
    robot: Robot, phase: str, contact: Literal["rolling", "point"] | None
) -> None:
    motion, rows = (
        load_library("a1").at(0.45).phase(phase).motion(robot, np.array([0.3])),
        planar_rows(robot),
    )
    q, v, tau = motion.q[0], motion.v[0], motion.tau[0]
    found = planar_derivatives(robot, q, v, tau, contact=contact)

    def acceleration(z: Array) -> Array:
        moved, faster = q.copy(), v.copy()
        moved[[0, 2]] += z[:2]
        moved[NB + 1 :] += z[2:14]
        faster[rows] += z[14:28]
        force, feet = tau + z[28:], () if contact is None else robot.legs
        how = contact or "rolling"
        return planar_dynamics(robot, moved, faster, force, contact=how, feet=feet)[rows]

    steps = H * np.eye(40)
    expected = np.stack([(acceleration(z) - acceleration(-z)) / (2.0 * H) for z in steps], axis=1)
    np.testing.assert_allclose(found.a, acceleration(np.zeros(40)), atol=1e-9)
    np.testing.assert_allclose(found.da_dy, expected[:, :14], atol=1e-5)
    np.testing.assert_allclose(found.da_dv, expected[:, 14:28], atol=1e-5)
    np.testing.assert_allclose(found.da_dtau, expected[:, 28:], atol=1e-5)


def test_rotors_of_each_joint_act_on_it(robot: Robot) -> None:
    """Alike they are the one number; the equations of motion hold with a rotor at one joint."""
    q, v, tau = robot.standing, np.zeros(18), np.linspace(-3.0, 3.0, 12)
    v[6:] = np.linspace(-1.0, 2.0, 12)
    alike = Rotors(np.full(12, 0.01), np.full(12, 0.3))
    np.testing.assert_array_equal(
        planar_acceleration(robot, q, v, tau, rotors=alike)[0],
        planar_acceleration(robot, q, v, tau, rotors=Rotors(0.01, 0.3))[0],
    )
    one = Rotors(np.where(np.arange(12) == 4, 0.05, 0.0), np.where(np.arange(12) == 7, 0.4, 0.0))
    a, _ = planar_acceleration(robot, q, v, tau, rotors=one)
    plain = tau.copy()
    plain[4] -= 0.05 * a[2 + 4]
    plain[7] -= 0.4 * v[6 + 7]
    np.testing.assert_allclose(a, planar_acceleration(robot, q, v, plain)[0], rtol=1e-9)
