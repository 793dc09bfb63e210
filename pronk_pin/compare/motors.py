"""What acts on a robot tick by tick: motors with a delay and a speed-torque curve, and pushes."""

from __future__ import annotations

import numpy as np

from .._typing import Array, IntArray
from .scenario import Scenario


class Motors:
    """The motors of n robots, each on its own clock.

    Args:
        scenario: Its delay and its speed-torque curve.
        tau_max: Greatest torques [N m], shape (12,).
        n: Number of robots.
    """

    def __init__(self, scenario: Scenario, tau_max: Array, n: int) -> None:
        self._scenario, self._tau_max = scenario, tau_max
        self._late = np.zeros((n, scenario.delay_ticks, len(tau_max)))  # commands on their way
        self._next = np.zeros(n, dtype=np.intp)

    def drive(self, rows: IntArray, command: Array, rates: Array) -> Array:
        """Torques of some of the robots at this tick [N m], shape (m, 12).

        Before the first command has come through the torques are zero.

        Args:
            rows: Which robots, shape (m,).
            command: Torques that they are told to give [N m], shape (m, 12).
            rates: Joint velocities [rad/s], shape (m, 12).
        """
        torque = command
        if self._late.shape[1]:
            at = (rows, self._next[rows])
            torque = self._late[at]  # a copy
            self._late[at] = command
            self._next[rows] = (self._next[rows] + 1) % self._late.shape[1]
        return np.asarray(np.where(torque * rates > 0.0, self._driven(torque, rates), torque))

    def _driven(self, torque: Array, rates: Array) -> Array:
        """Torques that drive, within what is left of them at speed."""
        full, none = self._scenario.full_torque_speed, self._scenario.no_load_speed
        if none is None:
            return torque
        limit = self._tau_max * np.clip((none - np.abs(rates)) / (none - full), 0.0, 1.0)
        return np.asarray(np.clip(torque, -limit, limit))


def push_force(scenario: Scenario, time: Array) -> Array:
    """Force on the trunk's centre of mass, world frame [N], shape (..., 3).

    Args:
        scenario: Its pushes.
        time: From the simulation's beginning [s], shape (...).
    """
    dt = scenario.timestep
    period = max(round(scenario.push_period / dt), 1)
    lasts = max(round(scenario.push_duration / dt), 1)  # ticks
    number, tick = np.divmod(np.rint(time / dt).astype(np.intp), period)
    sign = np.where(number % 2 == 1, 1.0, -1.0) * ((number >= 1) & (tick < lasts))
    return np.asarray(sign[..., None] * np.array(scenario.push_impulse) / (lasts * dt))
