"""Robots in MuJoCo. `qpos` and `qvel` stay in this room; what the world takes and gives is in
Pinocchio's order."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

import mujoco
import mujoco.rollout
import numpy as np

from ...._checks import Interval, whole
from ...._typing import Array, BoolArray, IntArray
from ....control import Gains
from ....robot import Robot
from ..engine import Engine, Motion, World
from ..motors import push_force
from ..scenario import Scenario
from .model import build_model
from .trunk_state import Trunk

_FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL, _PUSHED = mujoco.mjtState.mjSTATE_CTRL, mujoco.mjtState.mjSTATE_XFRC_APPLIED


@contextmanager
def without_warnings() -> Iterator[None]:
    """Keep MuJoCo from writing warnings to a file in the current folder: `Motion.finite` tells."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


class MujocoWorld(World):
    """n robots in MuJoCo, see `World`; a tick is a step of `mujoco.rollout`.

    Args:
        robot: The robot.
        scenario: The scenario.
        n: Number of robots.
        base: How the trunks may move, see `build_model`.
        servo: Gains of servos at the joints, whose controls are then set points (see
            `Tape.setpoint`) and which keep to the motors' limits themselves; without them the
            controls are torques.

    Attributes:
        model: The compiled model, the same for all.
    """

    def __init__(
        self,
        robot: Robot,
        scenario: Scenario,
        n: int,
        *,
        base: str = "locked",
        servo: Gains | None = None,
    ) -> None:
        n = whole("n", n, Interval(1, 100_000))
        self.robot, self.scenario, self.n = robot, scenario, n
        self.model = build_model(robot, scenario, base=base, servo=servo)
        self._models = [self.model] * n  # rollout without checks wants one a robot
        self._scratch = threading.local()
        self._rollout = mujoco.rollout.Rollout(nthread=0)  # on the caller's thread
        model = self.model
        nq = model.nq
        self._qpos = np.array([1 + model.joint(name).qposadr[0] for name in robot.joint_names])
        self._qvel = np.array([1 + nq + model.joint(name).dofadr[0] for name in robot.joint_names])
        self._ctrl = np.array([model.actuator(name).id for name in robot.joint_names])
        self._trunk = Trunk(model, robot)
        self._base, self._base_rate = self._trunk.x_z, self._trunk.x_z_rate
        address = [model.sensor(name).adr[0] for name in robot.foot_names]
        self._force = np.array(address)[:, None] + np.arange(3)
        # Forces on the bodies come after the motors' controls: force and moment, in the world.
        self._control = int(_CONTROL | _PUSHED if scenario.pushes else _CONTROL)
        trunk = model.body(robot.spec.base_link).id
        self._push = model.nu + 6 * trunk + np.arange(3)
        self._state = np.zeros((n, mujoco.mj_stateSize(model, _FULL)))
        self._warmstart = np.zeros((n, model.nv))
        self.force = np.zeros((n, *self._force.shape))
        self.reset(np.zeros((n, 2)), np.tile(robot.standing[7:], (n, 1)))

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
        state[:, self._base], state[:, self._qpos] = base, joints
        state[:, self._base_rate], state[:, self._qvel] = base_rate, joint_rates
        self._warmstart[:], self.force[:] = 0.0, 0.0

    def play(self, rows: IntArray, control: Array) -> Motion:
        """See `World`."""
        m, ticks = control.shape[:2]
        path = np.empty((m, ticks + 1, self._state.shape[1]))
        path[:, 0] = self._state[rows]
        controls = np.zeros((m, ticks, mujoco.mj_stateSize(self.model, self._control)))
        controls[..., self._ctrl] = control
        if self.scenario.pushes:
            time = path[:, :1, 0] + self.scenario.timestep * np.arange(ticks)  # (m, ticks)
            controls[..., self._push] = push_force(self.scenario, time)
        states = np.empty((m, ticks, path.shape[2]))
        sensors = np.empty((m, ticks, self.model.nsensordata))
        self._rollout.rollout(
            self._models[:m],
            [self._data],
            path[:, 0].copy(),
            controls,
            control_spec=self._control,
            skip_checks=True,
            nstep=ticks,
            initial_warmstart=self._warmstart[rows],
            state=states,
            sensordata=sensors,
        )
        path[:, 1:] = states
        before = path[:, :-1]
        return Motion(
            base=before[..., self._base],
            base_rate=before[..., self._base_rate],
            joints=before[..., self._qpos],
            joint_rates=before[..., self._qvel],
            # The sensors are of the state before each step, and have the floor's side of it.
            force=-sensors[..., self._force],
            finite=_finite(states),
            path=path,
            pose=self._trunk.pose(before) if self._trunk.turns else None,
            twist=self._trunk.twist(before) if self._trunk.turns else None,
        )

    @property
    def _data(self) -> mujoco.MjData:
        """Scratch memory of the thread."""
        if not hasattr(self._scratch, "data"):
            self._scratch.data = mujoco.MjData(self.model)
        return self._scratch.data

    def advance(self, rows: IntArray, motion: Motion, ticks: IntArray) -> None:
        """See `World`."""
        m = np.arange(len(rows))
        self.force[rows] = motion.force[m, ticks - 1]
        self._state[rows] = motion.path[m, ticks]
        rates = slice(1 + self.model.nq, None)
        last = motion.path[m, ticks, rates] - motion.path[m, ticks - 1, rates]
        self._warmstart[rows] = last / self.model.opt.timestep

    @property
    def base(self) -> Array:
        """See `World`."""
        return self._state[:, self._base]

    @property
    def pose(self) -> Array:
        """See `World`."""
        return self._trunk.pose(self._state)

    @property
    def twist(self) -> Array:
        """See `World`."""
        return self._trunk.twist(self._state)

    @property
    def base_rate(self) -> Array:
        """See `World`."""
        return self._state[:, self._base_rate]

    @property
    def joints(self) -> Array:
        """See `World`."""
        return self._state[:, self._qpos]

    @property
    def joint_rates(self) -> Array:
        """See `World`."""
        return self._state[:, self._qvel]

    def running(self) -> AbstractContextManager[object]:
        """See `World`."""
        return without_warnings()

    @property
    def state(self) -> Array:
        """MuJoCo's full physics state of each robot, a copy, shape (n, nstate)."""
        return self._state.copy()

    def restart(self, rows: IntArray) -> None:
        """See `World`."""
        self._state[rows] = 0.0
        self._trunk.put(self._state, 0.0, rows)
        self._state[rows[:, None], self._qpos] = self.robot.standing[7:]
        self._state[rows, self._base[1]] = self.robot.standing[2]
        self._warmstart[rows] = 0.0


def finite(states: Array) -> BoolArray:
    """Whether states (..., nstate) are finite, with nothing huge (MuJoCo's limit)."""
    return np.asarray((np.abs(states) < mujoco.mjMAXVAL).all(axis=-1))


def _finite(states: Array) -> BoolArray:
    """Whether the states of a motion (m, ticks, nstate) are; what is not so stays that way."""
    last = finite(states[:, -1])
    if last.all():
        return np.broadcast_to(last[:, None], states.shape[:2])
    return finite(states)


@dataclass(frozen=True)
class MujocoEngine(Engine):
    """MuJoCo: soft contacts, Newton's solver, semi-implicit Euler. It can do every scenario.

    Attributes:
        name: Short name.
    """

    name: str = "mujoco"

    def check(self, robot: Robot, scenario: Scenario, base: str) -> None:
        """See `Engine`: there is nothing that it cannot do."""

    def world(
        self, robot: Robot, scenario: Scenario, n: int, *, base: str, servo: Gains | None = None
    ) -> World:
        """See `Engine`."""
        return MujocoWorld(robot, scenario, n, base=base, servo=servo)
