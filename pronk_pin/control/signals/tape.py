"""Tapes: feedforward torque and reference at every tick between two events.

A controller writes a tape at each touchdown and lift-off; the simulation plays it:
`tau = ff + kp (q_d - q) + kd (v_d - v)`, clipped to the motors' limits. That is affine in q and v,
so that servos can play a whole tape from its set points `ff + kp q_d + kd v_d` alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..._checks import Interval, keep_vectors, real
from ..._typing import Array, IntArray
from ...robot import Robot, feedback_gains

_STIFFNESS = Interval(0, 1e4)


@dataclass(frozen=True)
class Gains:
    """Diagonal gains of a leg, in the order hip, thigh, calf; the defaults are the paper's.

    Attributes:
        kp: Proportional gains [N m/rad].
        kd: Derivative gains [N m s/rad].
    """

    kp: tuple[float, float, float] = (35.0, 60.0, 90.0)  # paper, section III
    kd: tuple[float, float, float] = (1.0, 6.0, 2.0)

    def __post_init__(self) -> None:
        proportional, derivative = Interval(0, 1e5, "N m/rad"), Interval(0, 1e4, "N m s/rad")
        keep_vectors(self, {"kp": proportional, "kd": derivative}, prefix="feedback gains: ")

    @classmethod
    def of(cls, robot: Robot) -> Gains:
        """A robot's own gains: those of its specification, or the A1's, scaled by its size."""
        return cls(*feedback_gains(robot))

    def proportional(self, joints: int) -> Array:
        """Proportional gains of a robot's joints, by leg [N m/rad], shape (joints,)."""
        return np.resize(self.kp, joints)

    def derivative(self, joints: int) -> Array:
        """Derivative gains of a robot's joints, by leg [N m s/rad], shape (joints,)."""
        return np.resize(self.kd, joints)

    def scaled(self, stiffness: float) -> Gains:
        """Gains of a multiple of the stiffness; the damping goes with its root, as its ratio asks.

        Args:
            stiffness: The multiple, 0 or more.
        """
        root = math.sqrt(real("stiffness", stiffness, _STIFFNESS))
        kp, kd = np.multiply(stiffness, self.kp), np.multiply(root, self.kd)
        return Gains(tuple(kp.tolist()), tuple(kd.tolist()))

    def feedback(self, error: Array, error_rate: Array) -> Array:
        """Compute the feedback torque Kp e + Kd e' [N m], eq. (9); 0 where a sensor failed.

        A sensor that fails must not reach the motors.

        Args:
            error: Reference minus measured joint angles [rad], shape (..., 12).
            error_rate: Its time derivative [rad/s], shape (..., 12).
        """
        joints = error.shape[-1]
        feedback = self.proportional(joints) * error
        feedback += self.derivative(joints) * error_rate
        if not np.isfinite(feedback.sum()):
            feedback[~np.isfinite(feedback)] = 0.0
        return feedback


@dataclass(frozen=True)
class Tape:
    """Commands of n robots for one phase, at each tick: feedforward and joint reference.

    A tape is played as `tau = clip(ff + Kp (q_d - q) + Kd (v_d - v))`, feedback as in eq. (9).

    Attributes:
        feedforward: Torques [N m], shape (n, ticks, 12).
        position: Reference joint angles [rad], shape (n, ticks, 12).
        velocity: Reference joint velocities [rad/s], shape (n, ticks, 12).
        length: Ticks after which each robot's phase ends at the latest, shape (n,): more than are
            on the tape, where the last of them is to be held, see `held`.
        begin: Tick at which to begin; those before have passed already.
        acceleration: Reference joint accelerations [rad/s^2], shape (n, ticks, 12), for a tick
            controller; None for others.
        phase: Phase of the reference, shape (n, ticks), likewise.
    """

    feedforward: Array
    position: Array
    velocity: Array
    length: IntArray
    begin: int = 0
    acceleration: Array | None = None
    phase: Array | None = None

    @property
    def ticks(self) -> int:
        """Number of ticks on the tape."""
        return int(self.position.shape[1])

    @property
    def reference_end(self) -> IntArray:
        """Ticks from which on the reference is constant, as far as it is on the tape, (n,)."""
        moves = (self.velocity != 0.0).any(axis=-1)  # (n, ticks)
        return np.asarray(self.ticks - np.argmax(moves[:, ::-1], axis=1), dtype=np.intp)

    def held(self, ticks: int) -> Tape:
        """Extend the tape to `ticks` ticks, if it is shorter, by holding the last one."""
        if ticks <= self.ticks:
            return self
        index = np.minimum(np.arange(ticks), self.ticks - 1)
        return replace(
            self,
            feedforward=self.feedforward[:, index],
            position=self.position[:, index],
            velocity=self.velocity[:, index],
            acceleration=None if self.acceleration is None else self.acceleration[:, index],
            phase=None if self.phase is None else self.phase[:, index],
        )

    def setpoint(self, gains: Gains) -> Array:
        """Set points of servos with these gains: the torque at q = v = 0 [N m], (n, ticks, 12)."""
        joints = self.position.shape[-1]
        pulled = self.feedforward + gains.proportional(joints) * self.position
        return np.asarray(pulled + gains.derivative(joints) * self.velocity)


def clip_torque(feedback: Array, feedforward: Array, tau_max: Array) -> Array:
    """Commanded torque: the sum of feedforward and feedback, within the motors' limits [N m]."""
    return np.clip(feedforward + feedback, -tau_max, tau_max)
