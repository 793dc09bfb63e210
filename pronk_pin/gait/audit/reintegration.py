"""Independent integration of a gait: the optimised torques on Pinocchio's model.

The collocation asks for the equations of motion at its nodes only. Here the whole robot, with all
its joints, follows the same torques through an adaptive integrator; how far it ends up from the
optimised motion is the error that the mesh made.

A planar constraint holds the trunk to the sagittal plane, without rotation or free to pitch, so
that the coordinates are x, z, perhaps pitch, and the joints; it takes the other rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from ..._typing import Array
from ...dynamics import planar_dynamics, planar_rows
from ...kinematics import (
    COORDINATES,
    Contact,
    foot_positions,
    free_coordinates,
    free_rates,
    free_state,
)
from ...robot import NB, Base, Robot
from ..gait import Motion

_TOLERANCE = 1e-10


class Worst(NamedTuple):
    """A largest value, and its time."""

    value: float
    time: float
    """From the beginning of the phase [s]."""


class Drift(NamedTuple):
    """Largest distances between the re-integrated motion and the optimised one."""

    joints: Worst
    """Of the joints, and the pitch [rad]."""
    feet: Worst
    """Of the feet's centres [m]."""


def drift(
    robot: Robot,
    motion: Motion,
    *,
    contact: Contact = "rolling",
    feet: Sequence[str] = (),
    base: Base = "locked",
) -> Drift:
    """Re-integrate a phase under its optimised torques and compare at every mesh point.

    Args:
        robot: The robot.
        motion: The optimised motion at its nodes, midpoints included.
        contact: How feet stand on the ground.
        feet: The legs whose feet stand.
        base: What the planar constraint leaves the trunk.
    """
    rows = planar_rows(robot, base)
    n = len(rows)
    places = [k for k in range(n - robot.nu) if k in (0, 1, 3)]  # x and z, y of a free trunk
    angles = [k for k in range(n) if k not in places]
    position = _coordinates(motion.q, n - robot.nu)  # (nodes, n)
    state = np.concatenate([position[0], motion.v[0, rows]])
    joints, moved = Worst(0.0, 0.0), Worst(0.0, 0.0)
    for k in range(0, len(motion.t) - 1, 2):
        times, torques = motion.t[k : k + 3], motion.tau[k : k + 3]

        def rate(t: float, y: Array, times: Array = times, torques: Array = torques) -> Array:
            q, v = _configuration(robot, y[:n]), np.zeros(robot.nv)
            v[rows] = y[n:]
            tau = _quadratic(t, times, torques)
            a = planar_dynamics(robot, q, v, tau, contact=contact, feet=feet, base=base)
            return np.concatenate([_rates(y, n, robot.nu), a[rows]])

        result = solve_ivp(
            rate, (times[0], times[2]), state, method="DOP853", rtol=_TOLERANCE, atol=_TOLERANCE
        )
        state = np.asarray(result.y[:, -1])
        reached, target = state[:n], position[k + 2]
        joints = max(joints, Worst(float(np.max(np.abs(reached - target)[angles])), times[2]))
        apart = foot_positions(robot, _configuration(robot, reached)) - foot_positions(
            robot, _configuration(robot, target)
        )
        moved = max(moved, Worst(float(np.max(np.linalg.norm(apart, axis=-1))), times[2]))
    return Drift(joints, moved)


def _coordinates(q: Array, nb: int) -> Array:
    """x, z, perhaps pitch, and the joints of configurations, shape (n, nb + 12); y, roll and yaw
    after pitch where the trunk is free."""
    if nb == len(COORDINATES):
        return np.concatenate([free_coordinates(q), q[:, NB + 1 :]], axis=1)
    pitch = 2.0 * np.arctan2(q[:, 4], q[:, 6])[:, None]
    return np.concatenate([q[:, [0, 2]], pitch[:, : nb - 2], q[:, NB + 1 :]], axis=1)


def _rates(y: Array, n: int, nl: int) -> Array:
    """Rates of the coordinates: x and z turn from the trunk's axes into the world's."""
    rates = y[n:].copy()
    if n - nl == len(COORDINATES):
        rates[: n - nl] = free_rates(y[: n - nl], y[n:])
        return rates
    if n - nl > 2:
        cos, sin = np.cos(y[2]), np.sin(y[2])
        rates[:2] = cos * y[n] + sin * y[n + 1], -sin * y[n] + cos * y[n + 1]
    return rates


def _configuration(robot: Robot, y: Array) -> Array:
    """Configuration from the planar coordinates x, z, perhaps pitch, and the joints, (19,)."""
    nb = len(y) - robot.nu
    if nb == len(COORDINATES):
        still = np.zeros((1, nb)), np.zeros((1, robot.nu))
        return np.asarray(free_state(robot, (y[None, :nb], y[None, nb:]), still, still)[0][0])
    pitch = float(y[2]) if nb > 2 else 0.0
    return robot.q_from_base(np.array([y[0], 0.0, y[1]]), y[nb:], pitch=pitch)


def _quadratic(t: float, times: Array, values: Array) -> Array:
    """The parabola through three samples, which is what Simpson's rule integrates."""
    s = 2.0 * (t - times[0]) / (times[2] - times[0]) - 1.0  # -1, 0, 1 at the samples
    first, middle, last = values
    return np.asarray(middle + s * (last - first) / 2 + s**2 * (first - 2 * middle + last) / 2)
