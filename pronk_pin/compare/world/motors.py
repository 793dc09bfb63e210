"""Actuator models, with a delay and a speed-torque curve, and pushes on the trunk."""

from __future__ import annotations

import numpy as np

from ..._typing import Array, IntArray
from .scenario import Scenario


class Motors:
    """The motors of n robots, each on its own clock.

    Commands come through late, so that as many torques are known beforehand as commands are on
    their way; before the first has come through they are zero.

    Args:
        scenario: Its delay and its speed-torque curve.
        tau_max: Greatest torques [N m], shape (12,).
        n: Number of robots.
    """

    def __init__(self, scenario: Scenario, tau_max: Array, n: int) -> None:
        self._scenario, self._tau_max = scenario, tau_max
        self._queue = np.zeros((n, scenario.delay_ticks, len(tau_max)))  # commands on their way

    def coming(self, rows: IntArray, ticks: int) -> Array:
        """Commands that take effect in the next ticks, at most as many as the delay.

        Returns:
            Torques [N m], shape (m, ticks, 12).
        """
        return self._queue[rows, :ticks]

    def command(self, rows: IntArray, commands: Array, ticks: IntArray) -> None:
        """Queue commands (m, most, 12) of so many ticks (m,), by which time goes on."""
        queue = np.concatenate([self._queue[rows], commands], axis=1)
        delay = np.arange(self._queue.shape[1])
        self._queue[rows] = queue[np.arange(len(rows))[:, None], ticks[:, None] + delay]

    def take_over(self, before: Motors, torque: Array) -> None:
        """Go on with the commands that are on their way to other motors of the same robots.

        Args:
            before: The others.
            torque: What they gave last [N m], shape (n, 12): it is held where the delay grows.
        """
        delay, others = self._queue.shape[1], before._queue
        held = np.repeat(torque[:, None], max(delay - others.shape[1], 0), axis=1)
        self._queue[:] = np.concatenate([held, others], axis=1)[:, -delay or others.shape[1] :]

    def drive(self, rows: IntArray, command: Array, rates: Array) -> Array:
        """Compute the torques of robots at this tick, after delay and limits [N m], shape (m, 12).

        Args:
            rows: Which robots, shape (m,).
            command: Torques that they are told to give [N m], shape (m, 12).
            rates: Joint velocities [rad/s], shape (m, 12).
        """
        torque = command
        if self._queue.shape[1]:
            torque = self.coming(rows, 1)[:, 0]
            self.command(rows, command[:, None], np.ones(len(rows), dtype=np.intp))
        return np.asarray(np.where(torque * rates > 0.0, self._driven(torque, rates), torque))

    def _driven(self, torque: Array, rates: Array) -> Array:
        """Limit driving torques to `tau_max (v_0 - |v|) / (v_0 - v_full)` at joint speed v."""
        full, none = self._scenario.full_torque_speed, self._scenario.no_load_speed
        if none is None:
            return torque
        limit = self._tau_max * np.clip((none - np.abs(rates)) / (none - full), 0.0, 1.0)
        return np.asarray(np.clip(torque, -limit, limit))


class Pushes:
    """Pushes on the trunks' centres of mass of n robots that are asked for while they go.

    A push is a constant force; it lasts while its robot goes on, however often a motion is played.

    Args:
        n: Number of robots.
        timestep: Length of a tick [s].
    """

    def __init__(self, n: int, timestep: float) -> None:
        self._timestep = timestep
        self._force = np.zeros((n, 3))
        self._left = np.zeros(n, dtype=np.intp)  # ticks to go

    def begin(self, rows: IntArray, impulse: Array, duration: float) -> None:
        """Begin pushes of robots that give an impulse each (m, 3) [N s], in place of any before.

        Args:
            rows: Which robots.
            impulse: In the world frame [N s], shape (m, 3) or (3,).
            duration: How long they last [s], a tick at least.
        """
        ticks = max(round(duration / self._timestep), 1)
        self._force[rows], self._left[rows] = impulse / (ticks * self._timestep), ticks

    def force(self, rows: IntArray, ticks: int) -> Array | None:
        """Forces in the next ticks, world frame [N], shape (m, ticks, 3); None without any."""
        acts = np.arange(ticks) < self._left[rows, None]
        return acts[..., None] * self._force[rows, None] if acts.any() else None

    def advance(self, rows: IntArray, ticks: IntArray) -> None:
        """Take note that robots have gone on by so many ticks (m,)."""
        self._left[rows] = np.maximum(self._left[rows] - ticks, 0)

    def clear(self) -> None:
        """End all pushes."""
        self._left[:] = 0


def push_force(scenario: Scenario, time: Array) -> Array:
    """Compute the pushing force on the trunk's centre of mass, world frame [N], shape (..., 3).

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
