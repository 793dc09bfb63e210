"""Between two events everything is a tape: feedforward torque and reference at every tick.

A controller writes a tape at each touchdown and lift-off; the simulation plays it:
`tau = ff + kp (q_d - q) + kd (v_d - v)`, clipped to the motors' limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._typing import Array, IntArray
from ..errors import InvalidInput
from ..robot import NL


@dataclass(frozen=True)
class Gains:
    """Diagonal gains of a leg, in the order hip, thigh, calf.

    Attributes:
        kp: Proportional gains [N m/rad].
        kd: Derivative gains [N m s/rad].
    """

    kp: tuple[float, float, float] = (35.0, 60.0, 90.0)  # paper, section III
    kd: tuple[float, float, float] = (1.0, 6.0, 2.0)

    def __post_init__(self) -> None:
        if min(*self.kp, *self.kd) < 0.0:
            raise InvalidInput("feedback gains must not be negative")

    @property
    def proportional(self) -> Array:
        """Proportional gains of all joints [N m/rad], shape (12,)."""
        return np.tile(self.kp, NL // 3)

    @property
    def derivative(self) -> Array:
        """Derivative gains of all joints [N m s/rad], shape (12,)."""
        return np.tile(self.kd, NL // 3)


@dataclass(frozen=True)
class Tape:
    """What n robots are told for one phase, at each tick.

    Attributes:
        feedforward: Torques [N m], shape (n, ticks, 12).
        position: Reference joint angles [rad], shape (n, ticks, 12).
        velocity: Reference joint velocities [rad/s], shape (n, ticks, 12).
        length: Ticks after which each robot's phase ends at the latest, shape (n,).
        begin: Tick at which to begin: those before have passed already.
    """

    feedforward: Array
    position: Array
    velocity: Array
    length: IntArray
    begin: int = 0


class Player:
    """Plays one tape for each of n robots, each on its own clock.

    Attributes:
        tick: Tick at which each robot's tape is, shape (n,).
        length: Length of each robot's tape, shape (n,).
    """

    def __init__(self, n: int, ticks: int, gains: Gains, tau_max: Array) -> None:
        self._feedforward, self._position, self._velocity = np.zeros((3, n, ticks, NL))
        self._kp, self._kd, self._tau_max = gains.proportional, gains.derivative, tau_max
        self._rows = np.arange(n)
        self.tick, self.length = np.zeros((2, n), dtype=np.intp)

    def load(self, rows: IntArray, tape: Tape) -> None:
        """Put a tape in for some robots, wound to where it begins."""
        ticks = tape.position.shape[1]
        self._feedforward[rows, :ticks] = tape.feedforward
        self._position[rows, :ticks] = tape.position
        self._velocity[rows, :ticks] = tape.velocity
        self.length[rows], self.tick[rows] = tape.length, tape.begin

    def play(self, joints: Array, joint_rates: Array) -> tuple[Array, Array, Array]:
        """Torques at this tick: the sum within the limits, its feedback, its feedforward [N m].

        Args:
            joints: Joint angles [rad], shape (n, 12).
            joint_rates: Joint velocities [rad/s], shape (n, 12).
        """
        at = (self._rows, self.tick)
        feedback = self._kp * (self._position[at] - joints)
        feedback += self._kd * (self._velocity[at] - joint_rates)
        feedback[~np.isfinite(feedback)] = 0.0  # a sensor that fails must not reach the motors
        feedforward = self._feedforward[at]
        torque = np.clip(feedforward + feedback, -self._tau_max, self._tau_max)
        return torque, feedback, feedforward
