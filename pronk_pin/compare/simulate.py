"""One simulation: n robots, one controller, one world, at 1 kHz.

The state machine lives here. A stance ends by time, as its reference does; a flight ends with the
touchdown that the feet feel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from .._typing import Array, IntArray
from ..control import Controller, ControllerSpec, PhaseLog, Player, phase_grid
from ..errors import InvalidInput
from ..gait import Gait
from ..robot import NL, Robot
from .record import StrideLog
from .scenario import Scenario
from .world import World, without_warnings

Progress: TypeAlias = Callable[[int], object]
"""Called with the number of time steps done since the last call."""

_EARLIEST_TOUCHDOWN = 0.5
"""Phase of flight before which contact is the lift-off's, not a touchdown."""

TOUCHDOWN_LOAD = 0.1
"""Share of the weight on the feet that counts as a touchdown."""

_FALLEN = 0.6
"""Trunk height, over that of the gait's lowest point, below which a robot has fallen."""


_SHORTEST = 1.0
"""Shortest practice and learning [s]: even a robot that lies on the ground finishes a stride."""


@dataclass(frozen=True)
class Schedule:
    """What happens when in a simulation: the paper's procedure (section III.A).

    Attributes:
        startup: Standing in the posture of the first stride [s].
        practice: Pronking without learning [s].
        learning: Pronking with the law switched on [s].
        scatter: Standard deviation of the joint angles at the start [rad].
    """

    startup: float = 0.5
    practice: float = 20.0
    learning: float = 20.0
    scatter: float = 0.01

    def __post_init__(self) -> None:
        values = (self.startup, self.practice, self.learning, self.scatter)
        if not all(0.0 <= value < np.inf for value in values):
            raise InvalidInput(
                "the durations and the scatter of a schedule must be finite and not negative"
            )
        if self.practice + self.learning < _SHORTEST:
            raise InvalidInput(
                f"practice and learning of {self.practice:g} + {self.learning:g} s are too short "
                f"for a stride; make them {_SHORTEST:g} s or more together"
            )

    @property
    def duration(self) -> float:
        """Duration of the whole simulation [s]."""
        return self.startup + self.practice + self.learning


class Simulation:
    """n robots that pronk at their own speeds under one controller in one world.

    Args:
        robot: The robot.
        gaits: The gait of each of the n robots.
        spec: The controller.
        scenario: The world.
        schedule: What happens when.
        rng: Source of the scatter at the start.
        feedforward: Feedforward to begin with [N m], shape (n, samples, 12).
    """

    def __init__(
        self,
        robot: Robot,
        gaits: Sequence[Gait],
        spec: ControllerSpec,
        scenario: Scenario,
        *,
        schedule: Schedule,
        rng: np.random.Generator,
        feedforward: Array | None = None,
    ) -> None:
        n, dt = len(gaits), scenario.timestep
        self.schedule, self._gaits, self._dt = schedule, tuple(gaits), dt
        self.controller = Controller(robot, gaits, spec, timestep=dt, feedforward=feedforward)
        self.world = World(robot, scenario, n)
        ticks = self.controller.max_ticks
        self._player = Player(n, ticks, spec.gains, robot.tau_max)
        self._joints, self._rates = np.zeros((2, n, ticks, NL))
        self._feedback, self._forward, self._missing = np.zeros((3, n, ticks, NL))
        self._base = np.zeros((n, ticks, 2))
        self._channels = (
            self._joints,
            self._rates,
            self._feedback,
            self._forward,
            self._missing,
            self._base,
        )
        self._late = spec.touchdown_ticks
        self._flying = np.zeros(n, dtype=bool)
        self._rows = np.arange(n)
        self._load = TOUCHDOWN_LOAD * robot.mass * robot.gravity
        self._earliest = np.array(
            [_EARLIEST_TOUCHDOWN * gait.flight.duration / dt for gait in gaits]
        )
        heights = [gait.stance.base_reference(phase_grid())[0][:, 1] for gait in gaits]
        self._floor = _FALLEN * np.min(heights, axis=1)
        self.upright = np.ones(n, dtype=bool)
        self.log = StrideLog(gaits, schedule.duration, dt)
        self._stand(robot, rng)

    def _stand(self, robot: Robot, rng: np.random.Generator) -> None:
        """Put the robots on the ground in the posture of their first stride."""
        start = np.array([0.0])
        joints = np.stack([gait.stance.joint_reference(start)[0][0] for gait in self._gaits])
        height = [gait.stance.base_reference(start)[0][0, 1] for gait in self._gaits]
        joints += self.schedule.scatter * rng.standard_normal(joints.shape)
        self.world.reset(np.column_stack([np.zeros(len(joints)), height]), joints)

    def run(self, progress: Progress | None = None) -> StrideLog:
        """Simulate to the end of the schedule.

        Args:
            progress: Called with the number of steps done since the last call.
        """
        with without_warnings():
            self._startup()
            self._pronk(progress)
        self.log.finish(self.upright)
        return self.log

    def _startup(self) -> None:
        for _ in range(round(self.schedule.startup / self._dt)):
            self._player.load(self._rows, self.controller.stand())
            self._advance()
        # The first stance begins as if its touchdown had been felt late, with the robots at rest.
        self._joints[:, : self._late] = self.world.joints[:, None]
        self._rates[:, : self._late] = self.world.joint_rates[:, None]
        self._base[:, : self._late] = self.world.base[:, None]
        self._begin_stance(self._rows, np.full(len(self._rows), np.inf), 0.0)

    def _pronk(self, progress: Progress | None) -> None:
        dt, schedule = self._dt, self.schedule
        learns = self.controller.spec.law is not None
        steps = round((schedule.practice + schedule.learning) / dt)
        for step in range(steps):
            time = step * dt
            self.controller.learning = learns and time >= schedule.practice
            self._advance()
            self._events(time + dt)
            if progress is not None and step % 500 == 499:
                progress(500)
        if progress is not None:
            progress(steps % 500)

    def _advance(self) -> None:
        """One tick: play the tapes, log, step the world."""
        world, player = self.world, self._player
        torque, feedback, feedforward = player.play(world.joints, world.joint_rates)
        at = (self._rows, player.tick)
        self._joints[at], self._rates[at] = world.joints, world.joint_rates
        self._feedback[at], self._forward[at] = feedback, feedforward
        self._missing[at] = torque - feedback - feedforward
        self._base[at] = world.base
        world.step(torque)
        player.tick += 1
        broken = ~world.finite
        if broken.any():
            world.restart(np.flatnonzero(broken))
            self.upright &= ~broken

    def _events(self, time: float) -> None:
        """Lift-offs by time, touchdowns by contact; who has fallen."""
        player, world = self._player, self.world
        over = player.tick >= player.length
        landed = (world.force[:, :, 2].sum(axis=1) > self._load) & (player.tick > self._earliest)
        too_low = world.base[:, 1] < self._floor
        self.upright &= ~(too_low | (over & self._flying))  # or a touchdown missed
        for rows, event in (
            (np.flatnonzero(over & ~self._flying), self._begin_flight),
            (np.flatnonzero((landed | over) & self._flying), self._end_flight),
        ):
            if rows.size:
                event(rows, time)

    def _begin_flight(self, rows: IntArray, time: float) -> None:
        log = self._phase_log(rows, self._player.tick[rows], felt=self._late)
        tape, record = self.controller.liftoff(rows, log)
        self.log.stance(rows, record, log, self._base[rows])
        self._player.load(rows, tape)
        self._flying[rows] = True

    def _end_flight(self, rows: IntArray, time: float) -> None:
        # Felt late: the last ticks of the flight's tape are the first of the stance.
        flown, touchdown = self._player.tick[rows] - self._late, time - self._late * self._dt
        self.log.flight(rows, self._phase_log(rows, flown), self._base[rows])
        felt = flown[:, None] + np.arange(self._late)  # (m, late)
        for channel in self._channels:
            channel[rows, : self._late] = channel[rows[:, None], felt]
        duration = self.log.close(rows, touchdown, self._base[rows, 0, 0], self.upright[rows])
        self._begin_stance(rows, duration, touchdown)

    def _begin_stance(self, rows: IntArray, duration: Array, touchdown: float) -> None:
        tape = self.controller.touchdown(rows, duration, self.upright[rows])
        self.log.judge(rows, self.controller.skipped[rows])
        self._player.load(rows, tape)
        self._flying[rows] = False
        x = self._base[rows, 0, 0]
        self.log.open(rows, touchdown, x, learning=self.controller.learning)

    def _phase_log(self, rows: IntArray, length: IntArray, *, felt: int = 0) -> PhaseLog:
        return PhaseLog(
            self._joints[rows],
            self._rates[rows],
            self._feedback[rows],
            self._forward[rows],
            self._missing[rows],
            length,
            felt,
        )
