"""Worlds whose robots' states are rows of an array, in whatever coordinates their engine has."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..._checks import Interval, whole
from ..._typing import Array, BoolArray, IntArray
from ...robot import Robot
from .engine import Motion, World
from .motors import Pushes, push_force
from .scenario import Scenario


class TrunkCoordinates(Protocol):
    """Indices of a trunk in an engine's states, and what they say in Pinocchio's layout.

    Attributes:
        x_z: Indices of the trunk's x and z.
        x_z_rate: Those of their rates.
        turns: Whether the trunk can turn.
    """

    x_z: IntArray
    x_z_rate: IntArray
    turns: bool

    def put(self, state: Array, pitch: Array | float, rows: IntArray | None = None) -> None:
        """Set the pitch of the trunks of some robots in states (n, nstate), where they may turn."""

    def pose(self, state: Array) -> Array:
        """Position [m] and quaternion xyzw of states (..., nstate), shape (..., 7)."""

    def twist(self, state: Array) -> Array:
        """Linear and angular velocity in the trunk's axes [m/s, rad/s], shape (..., 6)."""


class StateWorld(World):
    """n robots as an array of states, see `World`; an engine's own world plays them.

    Args:
        robot: The robot.
        scenario: The scenario.
        n: Number of robots.
        trunk: Where the trunk is in a state.
        joints: Indices of the joints' angles in a state, in the order of `Robot.joint_names`.
        rates: Those of their velocities.
        size: Size of a state, nstate.
    """

    def __init__(
        self,
        robot: Robot,
        scenario: Scenario,
        n: int,
        *,
        trunk: TrunkCoordinates,
        joints: IntArray,
        rates: IntArray,
        size: int,
    ) -> None:
        self.robot, self.scenario, self.n = robot, scenario, whole("n", n, Interval(1, 100_000))
        self._trunk, self._joints, self._rates = trunk, joints, rates
        self._base, self._base_rate = trunk.x_z, trunk.x_z_rate
        self._state = np.zeros((self.n, size))
        self.force = np.zeros((self.n, len(robot.foot_names), 3))
        self._pushes = Pushes(self.n, scenario.timestep)
        self.reset(np.zeros((self.n, 2)), np.tile(robot.standing[7:], (self.n, 1)))

    def reset(
        self,
        base: Array,
        joints: Array,
        base_rate: Array | float = 0.0,
        joint_rates: Array | float = 0.0,
        *,
        pitch: Array | float = 0.0,
    ) -> None:
        """See `World`."""
        state = self._state
        state[:] = 0.0
        self._trunk.put(state, pitch)
        state[:, self._base], state[:, self._joints] = base, joints
        state[:, self._base_rate], state[:, self._rates] = base_rate, joint_rates
        self.force[:] = 0.0
        self._pushes.clear()

    def push(self, rows: IntArray, impulse: Array, duration: float) -> None:
        """See `World`."""
        self._pushes.begin(rows, impulse, duration)

    def _push_force(self, rows: IntArray, time: Array, ticks: int) -> Array | None:
        """Forces that push trunks [N], world frame, shape (m, ticks, 3); None where none does.

        Args:
            rows: Which robots.
            time: When the first tick begins, by their own clocks [s], shape (m,).
            ticks: How many.
        """
        asked = self._pushes.force(rows, ticks)
        if not self.scenario.pushes:
            return asked
        planned = push_force(
            self.scenario, time[:, None] + self.scenario.timestep * np.arange(ticks)
        )
        return planned if asked is None else planned + asked

    def _motion(self, path: Array, force: Array, finite: BoolArray) -> Motion:
        """The motion along states (m, ticks + 1, nstate), with forces on the feet."""
        before, trunk = path[:, :-1], self._trunk
        return Motion(
            base=before[..., self._base],
            base_rate=before[..., self._base_rate],
            joints=before[..., self._joints],
            joint_rates=before[..., self._rates],
            force=force,
            finite=finite,
            path=path,
            pose=trunk.pose(before) if trunk.turns else None,
            twist=trunk.twist(before) if trunk.turns else None,
        )

    def advance(self, rows: IntArray, motion: Motion, ticks: IntArray) -> None:
        """See `World`."""
        m = np.arange(len(rows))
        self.force[rows] = motion.force[m, ticks - 1]
        self._state[rows] = motion.path[m, ticks]
        self._pushes.advance(rows, ticks)

    def restart(self, rows: IntArray) -> None:
        """See `World`."""
        self._state[rows] = 0.0
        self._trunk.put(self._state, 0.0, rows)
        self._state[rows[:, None], self._joints] = self.robot.standing[7:]
        self._state[rows, self._base[1]] = self.robot.standing[2]

    @property
    def base(self) -> Array:
        """See `World`."""
        return self._state[:, self._base]

    @property
    def base_rate(self) -> Array:
        """See `World`."""
        return self._state[:, self._base_rate]

    @property
    def joints(self) -> Array:
        """See `World`."""
        return self._state[:, self._joints]

    @property
    def joint_rates(self) -> Array:
        """See `World`."""
        return self._state[:, self._rates]

    @property
    def pose(self) -> Array:
        """See `World`."""
        return self._trunk.pose(self._state)

    @property
    def twist(self) -> Array:
        """See `World`."""
        return self._trunk.twist(self._state)

    @property
    def state(self) -> Array:
        """The engine's state of each robot, a copy, shape (n, nstate)."""
        return self._state.copy()
