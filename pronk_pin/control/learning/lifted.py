"""Lifted linear model of strides: errors and next touchdown by the feedforward of a stance.

Along the gait the planar robot under its feedback is a linear time-varying system. Stacked over the
phase grid, its response to a change of the feedforward is a matrix, and a learning law becomes an
iteration that linear algebra can judge (Bristow, Tharayil and Alleyne 2006, the lifted system).
A legged robot does not begin every trial in the same state, as ILC's textbooks assume: how it lifts
off decides how it lands. The model therefore carries the state at touchdown from stride to stride.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..._checks import instance_of, numbers
from ..._typing import Array
from ...errors import InvalidInput
from ..signals import Gains, StrideRecord


@dataclass(frozen=True)
class LiftedModel:
    """Linear maps from the feedforward u and the state x at touchdown to a stride's errors.

        e_k = e_0 - angle u_k - angle_start x_k,    e'_k = e'_0 - rate u_k - rate_start x_k,
        x_{k+1} = A x_k + B u_k,

    all of them differences from one stride. Stacked vectors hold the phase grid sample by sample,
    all joints of a sample together: `u = feedforward.reshape(-1)` of size samples * joints.

    Attributes:
        angle: Response of the joint angles to the feedforward [rad/(N m)], shape (size, size).
        rate: Response of the joint velocities [rad/s/(N m)], shape (size, size).
        angle_start: Response of the joint angles to the state at touchdown, shape (size, states).
        rate_start: Response of the joint velocities to it, shape (size, states).
        A: Derivative of the next touchdown's state by this one's, shape (states, states).
        B: Derivative of the next touchdown's state by the feedforward, shape (states, size).
        gains: Feedback gains that the model is closed with.
        torque: Feedforward that the gait asks for [N m], shape (samples, joints).
    """

    angle: Array
    rate: Array
    angle_start: Array
    rate_start: Array
    A: Array
    B: Array
    gains: Gains
    torque: Array

    def __post_init__(self) -> None:
        names = ("angle", "rate", "angle_start", "rate_start", "A", "B", "torque")
        given = {name: getattr(self, name) for name in names}
        for name, array in zip(given, numbers(**given), strict=True):
            object.__setattr__(self, name, array)
        instance_of("gains", self.gains, Gains)
        if self.torque.ndim != 2 or self.A.ndim != 2:
            raise InvalidInput(
                f"torque and carry of the shapes {self.torque.shape} and {self.A.shape}; give "
                "(samples, joints) and (states, states)"
            )
        size, states = self.torque.size, len(self.A)
        shapes = {
            "angle": (size, size),
            "rate": (size, size),
            "angle_start": (size, states),
            "rate_start": (size, states),
            "A": (states, states),
            "B": (states, size),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InvalidInput(
                    f"{name} of shape {getattr(self, name).shape}; a lifted model of {size} "
                    f"torques and {states} states needs {shape}"
                )

    @classmethod
    def with_resets(cls, angle: Array, rate: Array, *, gains: Gains, torque: Array) -> LiftedModel:
        """Make a model whose trials all begin in the same state, as in ILC's textbooks."""
        size = len(angle)
        start = np.zeros((size, 0))
        return cls(angle, rate, start, start, np.zeros((0, 0)), start.T, gains, torque)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of samples and joints."""
        return self.torque.shape[0], self.torque.shape[1]

    @property
    def within_a_stride(self) -> LiftedModel:
        """The same model if every stride began in the same state."""
        return LiftedModel.with_resets(self.angle, self.rate, gains=self.gains, torque=self.torque)

    @property
    def settled(self) -> LiftedModel:
        """The static model: its response is that of the strides once the touchdown has settled.

        A model with resets and the response
        `angle + angle_start (1 - A)^-1 B`.
        """
        start = np.linalg.solve(np.eye(len(self.A)) - self.A, self.B)
        return LiftedModel.with_resets(
            self.angle + self.angle_start @ start,
            self.rate + self.rate_start @ start,
            gains=self.gains,
            torque=self.torque,
        )

    @property
    def planned(self) -> StrideRecord:
        """The steady stride without feedforward, which lacks the torque of the gait.

        As if flight were tracked perfectly, and the robot were the model.
        """
        model = self.settled
        u = self.torque.reshape(-1)
        return self.record(model.angle @ u, model.rate @ u, np.zeros_like(u))

    def record(self, error: Array, rate: Array, feedforward: Array) -> StrideRecord:
        """Make a stride's record from its errors (..., size) and its feedforward (..., size)."""
        shape = (-1, *self.shape)
        error, rate = error.reshape(shape), rate.reshape(shape)
        joints = self.shape[1]
        feedback = self.gains.proportional(joints) * error + self.gains.derivative(joints) * rate
        return StrideRecord.of(error, rate, feedback, feedforward.reshape(error.shape))

    def stride(self, feedforward: Array, begin: StrideRecord, state: Array) -> StrideRecord:
        """Predict strides by their feedforwards and states at touchdown, from a recorded stride.

        Args:
            feedforward: Feedforwards [N m], shape (n, samples, joints).
            begin: The stride from which the others differ, of one robot or n.
            state: How the states at touchdown differ from that stride's, shape (n, states).
        """
        change = (feedforward - begin.feedforward).reshape(len(feedforward), -1)
        error = begin.error.reshape(len(begin.error), -1) - change @ self.angle.T
        rate = begin.error_rate.reshape(len(begin.error), -1) - change @ self.rate.T
        error = error - state @ self.angle_start.T
        rate = rate - state @ self.rate_start.T
        return self.record(error, rate, feedforward)

    def land(self, feedforward: Array, begin: StrideRecord, state: Array) -> Array:
        """Predict differences of the next touchdown's states (n, states); arguments of `stride`."""
        change = (feedforward - begin.feedforward).reshape(len(feedforward), -1)
        return np.asarray(state @ self.A.T + change @ self.B.T)

    def delayed(self, samples: int) -> LiftedModel:
        """The model with the feedforward delayed by some samples of the grid."""
        later = samples * self.shape[1]
        return self._responding(lambda response: np.pad(response[:, later:], ((0, 0), (0, later))))

    def scaled(self, factor: float) -> LiftedModel:
        """The model with the feedforward scaled by a factor."""
        return self._responding(lambda response: factor * response)

    def _responding(self, change: Callable[[Array], Array]) -> LiftedModel:
        """The model with other responses to the feedforward, shape (..., size)."""
        return replace(self, angle=change(self.angle), rate=change(self.rate), B=change(self.B))
