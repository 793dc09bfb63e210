"""The optimised torques played on Pinocchio's model: an independent integration of a gait.

The collocation asks for the equations of motion at its nodes only. Here the whole robot, with all
its joints, follows the same torques through an adaptive integrator; how far it ends up from the
optimised motion is the error that the mesh made.

The trunk is held by a guide to the sagittal plane without rotation, so the coordinates are x, z
and the joints, and the guide takes the rows of y and the rotations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from .._typing import Array
from ..dynamics import Contact, contact_bias, contact_jacobian
from ..kinematics import foot_positions
from ..robot import NB, Robot
from .gait import Motion

_TOLERANCE = 1e-10


class Drift(NamedTuple):
    """Largest distances between the re-integrated motion and the optimised one."""

    joints: float
    """[rad]"""
    feet: float
    """[m]"""


def guided_rows(robot: Robot) -> Array:
    """Indices of the velocities that the guide leaves free: x, z and the joints.

    The trunk does not turn, so that its body axes are the world's.
    """
    return np.array([0, 2, *range(NB, robot.nv)])


def forward_dynamics(
    robot: Robot, q: Array, v: Array, tau: Array, *, contact: Contact | None = None
) -> Array:
    """Acceleration of the guided robot, all feet standing or none: eq. (5) or (2).

    Args:
        robot: The robot.
        q: Configuration, shape (19,).
        v: Velocity, shape (18,).
        tau: Motor torques [N m], shape (12,).
        contact: How all the feet stand on the ground; None in flight.

    Returns:
        Acceleration, shape (18,), zero where the guide holds the trunk.
    """
    rows = guided_rows(robot)
    mass = pin.crba(robot.model, robot.data, q)[np.ix_(rows, rows)]  # (14, 14)
    force = np.concatenate([np.zeros(NB), tau])
    force = (force - pin.nonLinearEffects(robot.model, robot.data, q, v))[rows]
    a = np.zeros(robot.nv)
    if contact is None:
        a[rows] = np.linalg.solve(mass, force)
        return a
    jacobian = contact_jacobian(robot, q, contact=contact)[:, rows]  # (12, 14)
    bias = contact_bias(robot, q, v, contact=contact)
    corner = np.zeros((len(jacobian), len(jacobian)))
    kkt = np.block([[mass, -jacobian.T], [jacobian, corner]])
    a[rows] = np.linalg.solve(kkt, np.concatenate([force, -bias]))[: len(rows)]
    return a


def drift(robot: Robot, motion: Motion, *, contact: Contact | None) -> Drift:
    """Re-integrate a phase under its optimised torques and compare at every mesh point.

    Args:
        robot: The robot.
        motion: The optimised motion at its nodes, midpoints included.
        contact: How all the feet stand on the ground; None in flight.
    """
    rows = guided_rows(robot)
    n = len(rows)
    position = np.concatenate([motion.q[:, [0, 2]], motion.q[:, NB + 1 :]], axis=1)  # (nodes, 14)
    state = np.concatenate([position[0], motion.v[0, rows]])
    joints = feet = 0.0
    for k in range(0, len(motion.t) - 1, 2):
        times, torques = motion.t[k : k + 3], motion.tau[k : k + 3]

        def rate(t: float, y: Array, times: Array = times, torques: Array = torques) -> Array:
            v = np.zeros(robot.nv)
            v[rows] = y[n:]
            tau = _quadratic(t, times, torques)
            a = forward_dynamics(robot, _configuration(robot, y[:n]), v, tau, contact=contact)
            return np.concatenate([y[n:], a[rows]])

        result = solve_ivp(
            rate, (times[0], times[2]), state, method="DOP853", rtol=_TOLERANCE, atol=_TOLERANCE
        )
        state = np.asarray(result.y[:, -1])
        reached, wanted = state[:n], position[k + 2]
        joints = max(joints, float(np.max(np.abs(reached - wanted)[2:])))
        apart = foot_positions(robot, _configuration(robot, reached)) - foot_positions(
            robot, _configuration(robot, wanted)
        )
        feet = max(feet, float(np.max(np.linalg.norm(apart, axis=-1))))
    return Drift(joints, feet)


def _configuration(robot: Robot, y: Array) -> Array:
    """q of the guided robot from x, z and the joints, shape (19,)."""
    return robot.q_from_base(np.array([y[0], 0.0, y[1]]), y[2:])


def _quadratic(t: float, times: Array, values: Array) -> Array:
    """The parabola through three samples, which is what Simpson's rule integrates."""
    s = 2.0 * (t - times[0]) / (times[2] - times[0]) - 1.0  # -1, 0, 1 at the samples
    first, middle, last = values
    return np.asarray(middle + s * (last - first) / 2 + s**2 * (first - 2 * middle + last) / 2)
