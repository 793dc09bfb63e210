"""Engines: what simulates the robots. The laboratory knows them by these protocols alone.

| promise | |
|---|---|
| order | joints as in `Robot.joint_names`, feet as in `Robot.foot_names`, trunk as in Pinocchio |
| units | SI; angles in radians; forces in the world's frame, of the ground on the feet |
| tick | one step of `Scenario.timestep`; the first row of a motion is the state before the first |
| force | row t acts in the step that leads from state t to state t + 1 |
| playing | changes nothing: a robot stays where it is until `World.advance` says how far it goes |
| repeating | the same controls from the same state give the same motion, to the bit |
| robots | each is alone in its world, whoever is played beside it |
| broken | a state that is not finite is told in `Motion.finite`, and raises nothing |

Outside the engine, the same for all of them: delays, speed-torque curves and sensors. Inside it is
the rest of a scenario: rotors, damping and dry friction, torque constants (which act on what limits
have left of a torque), payload, slope, contact, and pushes: those of the scenario (`push_force`,
for which a state needs its time), and those that are asked for (`World.push`, which an engine may
refuse). The suite
`tests/compare/world/test_engines.py` holds any engine to these promises.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from ..._typing import Array, BoolArray, IntArray
from ...control import Gains
from ...errors import InvalidInput
from ...robot import Robot
from .scenario import Scenario


class Motion(NamedTuple):
    """Motion of m robots over some ticks; a state is that before the tick's step."""

    base: Array
    """Trunk x and z in the world [m], shape (m, ticks, 2)."""
    base_rate: Array
    """Their rates [m/s], shape (m, ticks, 2)."""
    joints: Array
    """Joint angles [rad], shape (m, ticks, 12)."""
    joint_rates: Array
    """Joint velocities [rad/s], shape (m, ticks, 12)."""
    force: Array
    """Ground's force on each foot, world frame [N], shape (m, ticks, 4, 3)."""
    finite: BoolArray
    """Whether the states after the ticks' steps are finite, with nothing huge, shape (m, ticks)."""
    path: Any
    """The engine's own states, for its `World.advance`."""
    pose: Array | None = None
    """Trunk's position and quaternion xyzw, shape (m, ticks, 7); None where it cannot turn."""
    twist: Array | None = None
    """Trunk's linear and angular velocity in its own axes [m/s, rad/s], (m, ticks, 6); likewise."""


def check_motion(motion: Motion, robot: Robot, m: int, ticks: int) -> None:
    """Check that a motion of m robots over some ticks has the shapes that `Motion` names.

    Raises:
        InvalidInput: One is otherwise; it is named.
    """
    joints, feet = robot.nu, len(robot.foot_names)
    sizes: dict[str, tuple[int, ...]] = {
        "base": (2,),
        "base_rate": (2,),
        "joints": (joints,),
        "joint_rates": (joints,),
    }
    sizes |= {"force": (feet, 3), "finite": (), "pose": (7,), "twist": (6,)}
    for name, size in sizes.items():
        array, wanted = getattr(motion, name), (m, ticks, *size)
        if array is not None and np.shape(array) != wanted:
            raise InvalidInput(f"{name} of a motion has the shape {np.shape(array)}; give {wanted}")


class World(Protocol):
    """n robots in an engine, each alone in the same scenario.

    Several threads may play and advance robots at once, each its own ones, where trunks are locked.

    Attributes:
        robot: The robot.
        scenario: The scenario.
        n: Number of robots.
        force: Ground's force on each foot during the last step, world frame [N], (n, 4, 3).
    """

    robot: Robot
    scenario: Scenario
    n: int
    force: Array

    @property
    def base(self) -> Array:
        """Trunk x and z in the world [m], shape (n, 2)."""

    @property
    def base_rate(self) -> Array:
        """Their rates [m/s], shape (n, 2)."""

    @property
    def joints(self) -> Array:
        """Joint angles [rad], shape (n, 12)."""

    @property
    def joint_rates(self) -> Array:
        """Joint velocities [rad/s], shape (n, 12)."""

    @property
    def pose(self) -> Array:
        """Trunk's position [m] and quaternion xyzw, shape (n, 7)."""

    @property
    def twist(self) -> Array:
        """Trunk's linear and angular velocity in its own axes [m/s, rad/s], shape (n, 6)."""

    def reset(
        self,
        base: Array,
        joints: Array,
        base_rate: Array | float = 0.0,
        joint_rates: Array | float = 0.0,
        *,
        pitch: Array | float = 0.0,
    ) -> None:
        """Set the state of every robot, by default at rest.

        Args:
            base: Trunk x and z [m], shape (n, 2).
            joints: Joint angles [rad], shape (n, 12).
            base_rate: Rates of the trunk's x and z [m/s], shape (n, 2).
            joint_rates: Joint velocities [rad/s], shape (n, 12).
            pitch: Of the trunk, where it may turn [rad], shape (n,).
        """

    def play(self, rows: IntArray, control: Array) -> Motion:
        """Simulate robots under controls of their motors or servos, without moving them on.

        Args:
            rows: Which robots, shape (m,).
            control: Torques, or set points of servos (see `Tape.setpoint`) [N m], (m, ticks, 12).
        """

    def advance(self, rows: IntArray, motion: Motion, ticks: IntArray) -> None:
        """Advance robots by so many ticks (m,) along a motion that they `play`; 1 or more each."""

    def restart(self, rows: IntArray) -> None:
        """Reset robots with states that are not finite to rest, so that the others go on."""

    def push(self, rows: IntArray, impulse: Array, duration: float) -> None:
        """Push robots' trunks at their centres of mass, from the next tick on; a reset ends it.

        Args:
            rows: Which robots.
            impulse: What the push gives in all, world frame [N s], shape (m, 3) or (3,).
            duration: How long its force lasts [s], a tick at least.

        Raises:
            InvalidInput: The engine cannot push.
        """
        raise InvalidInput(
            f"engine '{self.scenario.engine}' cannot push a robot that is asked for while it goes; "
            "take engine mujoco"
        )

    def running(self) -> AbstractContextManager[object]:
        """Context to play in, where the engine needs one."""
        return nullcontext()

    def step(self, control: Array) -> Motion:
        """Advance every robot by one time step under controls (n, 12) [N m]."""
        rows = np.arange(self.n)
        motion = self.play(rows, control[:, None])
        self.advance(rows, motion, np.ones(self.n, dtype=np.intp))
        return motion


@runtime_checkable
class Engine(Protocol):
    """Maker of worlds: MuJoCo, Drake, or one of your own.

    Attributes:
        name: Short name, as on the command line.
    """

    @property
    def name(self) -> str:
        """See the class."""

    def check(self, robot: Robot, scenario: Scenario, base: str) -> None:
        """Check that it is installed, and can simulate a scenario.

        Raises:
            InvalidInput: It cannot; what it cannot do is named.
            MissingExtra: It is not installed, and an extra of this package brings it; an engine of
                your own raises `InvalidInput` and says what to install.
        """

    def world(
        self, robot: Robot, scenario: Scenario, n: int, *, base: str, servo: Gains | None = None
    ) -> World:
        """Make a world of n robots at rest.

        Args:
            robot: The robot.
            scenario: The scenario.
            n: Number of robots.
            base: How the trunks may move: "locked" to x and z, "sagittal" with pitch, or "free".
            servo: Gains of servos at the joints, whose controls are then set points (see
                `Tape.setpoint`) and which keep to the motors' limits themselves, at every tick
                anew; without them the controls are torques.

        Raises:
            InvalidInput, MissingExtra: See `check`.
        """
