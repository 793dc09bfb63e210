"""Tick controllers: what computes motor commands from measurements at a rate of its own.

A whole-body QP, model-predictive control, a trained policy, a PD of one's own: any object with
`command(observation)`, for a batch of robots. One that needs to know its robots has
`bind(context)`, too, from a `ControlContext` to the object that is to be used for them.

    @dataclass(frozen=True)
    class MyPD:
        def command(self, observation):
            error = observation.position - observation.joints
            return observation.feedforward + 90.0 * error - 2.0 * observation.joint_rates

    ControllerSpec("mine", tick_controller=MyPD())
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ..._typing import Array, IntArray
from ...errors import InvalidInput
from ..feedback import TrunkEstimate
from ..signals import ControlContext


class Observation(NamedTuple):
    """What m robots know at a tick, and what their gaits want of them; the batch comes first."""

    rows: IntArray
    """Which robots of the context they are, shape (m,)."""
    part: int | None
    """Part of the stride, an index into `PARTS`; None for the start-up, in which they stand."""
    tick: int
    """Ticks since that part began."""
    phase: Array
    """Phase of the reference, from 0 to 1, shape (m,); 0 in the start-up."""
    joints: Array
    """Measured joint angles [rad], shape (m, 12)."""
    joint_rates: Array
    """Measured joint velocities [rad/s], shape (m, 12)."""
    load: Array
    """Ground's force on each foot, upward, as measured in the tick before [N], shape (m, 4)."""
    trunk: TrunkEstimate | None
    """State of the trunks, as far as they know it; None where they are locked level."""
    position: Array
    """Reference of the joint angles [rad], shape (m, 12)."""
    velocity: Array
    """Of the joint velocities [rad/s], shape (m, 12)."""
    acceleration: Array
    """Of the joint accelerations [rad/s^2], shape (m, 12)."""
    feedforward: Array
    """Feedforward torques, planned or learned [N m], shape (m, 12)."""
    previous: Array
    """The torques that were commanded in the tick before [N m], shape (m, 12)."""

    def of(self, which: Array) -> Observation:
        """The same of some of the robots, by a mask or by indices."""
        arrays = {
            name: part[which]
            for name, part in self._asdict().items()
            if isinstance(part, np.ndarray)
        }
        if self.trunk is not None:
            arrays["trunk"] = TrunkEstimate(*(part[which] for part in self.trunk))
        return self._replace(**arrays)


class SetPoints(NamedTuple):
    """Set points for the motor drivers, which follow them at every tick:

    `tau = feedforward + kp (position - q) + kd (velocity - q')`; each broadcasts to (m, 12).
    """

    position: Array | float
    """[rad]"""
    velocity: Array | float = 0.0
    """[rad/s]"""
    feedforward: Array | float = 0.0
    """[N m]"""
    kp: Array | float = 0.0
    """[N m/rad]"""
    kd: Array | float = 0.0
    """[N m s/rad]"""


class TickController(Protocol):
    """Computes commands from observations.

    It may have, besides:
        period: Time between two questions [s], a whole number of time steps; without it, or with
            0, it is asked at every tick. What it answers holds until the next.
        reset(rows): Called once before robots (m,) begin, and where one begins again.
        bind(context): Returns the tick controller to use for the robots of a `ControlContext`.
    """

    def command(self, observation: Observation) -> Array | SetPoints:
        """Motor torques [N m], shape (m, 12), or `SetPoints`; clipped to the torque limits."""


class BindableTickController(Protocol):
    """Settings of a tick controller, which are bound to the robots of a context."""

    def bind(self, context: ControlContext) -> TickController:
        """The tick controller to use for them."""


def known_tick_controller(
    name: str, controller: object
) -> TickController | BindableTickController | None:
    """A tick controller, or one that is to be bound, or None.

    Raises:
        InvalidInput: It is neither.
    """
    asked = getattr(controller, "command", None) or getattr(controller, "bind", None)
    if controller is not None and (isinstance(controller, type) or not callable(asked)):
        raise InvalidInput(
            f"{name}={controller!r} is no tick controller; give an object with "
            "command(observation), or with bind(context), such as ComputedTorque(); or None"
        )
    return controller  # type: ignore[return-value]


@dataclass
class ControlTime:
    """How long a controller computes: time of the thread it runs in.

    Attributes:
        seconds: Time so far [s].
        ticks: Ticks of all robots that it was for.
    """

    seconds: float = 0.0
    ticks: int = 0

    @property
    def per_tick(self) -> float:
        """Time a robot and tick [us]; NaN before the first."""
        return 1e6 * self.seconds / self.ticks if self.ticks else math.nan

    def add(self, other: ControlTime) -> None:
        """Count the time of another controller in."""
        self.seconds += other.seconds
        self.ticks += other.ticks

    @contextmanager
    def measured(self) -> Iterator[None]:
        """Around what the controller computes."""
        began = time.thread_time()
        yield
        self.seconds += time.thread_time() - began


class TickLoop:
    """Asks a tick controller at its rate, checks what it answers, and holds it in between.

    Args:
        controller: The tick controller; bound to the robots here, if it can be.
        context: The n robots.

    Attributes:
        controller: The tick controller, bound.
        previous: Torques that the motors were told last, within their limits [N m], shape (n, 12).
        time: How long the controller took.

    Raises:
        InvalidInput: It cannot be bound, or its period is no whole number of time steps.
    """

    def __init__(
        self, controller: TickController | BindableTickController, context: ControlContext
    ) -> None:
        bind = getattr(controller, "bind", None)
        self.controller: TickController = controller if bind is None else bind(context)  # type: ignore[assignment]
        self._name = f"the tick controller {type(self.controller).__name__} of controller "
        self._name += f"'{context.controller}'"
        if not callable(getattr(self.controller, "command", None)):
            raise InvalidInput(f"{self._name} has no command(observation); add it")
        steps = float(getattr(self.controller, "period", 0.0)) / context.timestep
        if not abs(steps - round(steps)) < 1e-6 or steps < 0.0:
            raise InvalidInput(
                f"{self._name}: its period must be a whole number of time steps of "
                f"{context.timestep:g} s"
            )
        n, joints = len(context.gaits), context.robot.nu
        self._period, self._limit = max(1, round(steps)), context.robot.tau_max
        self._age = np.zeros(n, dtype=np.intp)  # ticks since it was first asked
        self._held = SetPoints(*np.zeros((len(SetPoints._fields), n, joints)))
        self.previous = np.zeros((n, joints))
        self.time = ControlTime()
        self._reset(np.arange(n))

    def _reset(self, rows: IntArray) -> None:
        if callable(reset := getattr(self.controller, "reset", None)):
            reset(rows)

    def restart(self, rows: IntArray) -> None:
        """Begin again with robots (m,)."""
        self._age[rows], self.previous[rows] = 0, 0.0
        self._reset(rows)

    def torque(self, observation: Observation) -> Array:
        """Motor torques of m robots, not yet within their limits [N m], shape (m, 12).

        Raises:
            InvalidInput: The tick controller answers something else than commands of that shape.
        """
        rows = observation.rows
        due = self._age[rows] % self._period == 0
        if due.any():
            asked = observation if due.all() else observation.of(due)
            with self.time.measured():
                answer = self.controller.command(asked)
            self._hold(asked, answer)
        self._age[rows] += 1
        self.time.ticks += len(rows)
        position, velocity, feedforward, kp, kd = (np.asarray(part)[rows] for part in self._held)
        torque = feedforward + kp * (position - observation.joints)
        torque += kd * (velocity - observation.joint_rates)
        # What a sensor that fails says must not reach the motors.
        torque = np.where(np.isfinite(torque), torque, 0.0)
        self.previous[rows] = np.clip(torque, -self._limit, self._limit)
        return torque

    def _hold(self, asked: Observation, answer: Array | SetPoints) -> None:
        """Keep what was answered."""
        rows, wanted = asked.rows, asked.joints.shape
        if not isinstance(answer, SetPoints):
            if np.shape(answer) != wanted:
                raise InvalidInput(
                    f"{self._name} answers {type(answer).__name__} of shape {np.shape(answer)}; "
                    f"let it answer torques of shape {wanted}, or SetPoints"
                )
            answer = SetPoints(0.0, feedforward=answer)
        for held, part in zip(self._held, answer, strict=True):
            try:
                held[rows] = part  # type: ignore[index]
            except (ValueError, TypeError) as error:
                raise InvalidInput(
                    f"{self._name} answers set points that do not broadcast to {wanted} ({error})"
                ) from error
            measured = np.isfinite(asked.joints + asked.joint_rates).all(axis=1)
            if not np.isfinite(held[rows[measured]]).all():  # type: ignore[index]
                raise InvalidInput(
                    f"{self._name} answers numbers that are not finite at tick {asked.tick} of "
                    f"part {asked.part}, of measurements that are"
                )
