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

from ...._typing import Array, BoolArray, IntArray
from ....control import Gains
from ....robot import Robot
from ..engine import Engine, Motion, World
from ..scenario import Scenario
from ..state_world import StateWorld
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


class MujocoWorld(StateWorld):
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
        self.model = model = build_model(robot, scenario, base=base, servo=servo)
        rates = 1 + model.nq
        self._warmstart = np.zeros((n, model.nv))
        super().__init__(
            *(robot, scenario, n),
            trunk=Trunk(model, robot),
            joints=np.array([1 + model.joint(name).qposadr[0] for name in robot.joint_names]),
            rates=np.array([rates + model.joint(name).dofadr[0] for name in robot.joint_names]),
            size=mujoco.mj_stateSize(model, _FULL),
        )
        self._models = [model] * n  # rollout without checks wants one a robot
        self._scratch = threading.local()
        self._rollout = mujoco.rollout.Rollout(nthread=0)  # on the caller's thread
        self._ctrl = np.array([model.actuator(name).id for name in robot.joint_names])
        address = [model.sensor(name).adr[0] for name in robot.foot_names]
        self._force = np.array(address)[:, None] + np.arange(3)
        # Forces on the bodies come after the motors' controls: force and moment, in the world.
        body = model.body(robot.spec.base_link).id
        self._push = model.nu + 6 * body + np.arange(3)

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
        super().reset(base, joints, base_rate, joint_rates, pitch=pitch)
        self._warmstart[:] = 0.0

    def play(self, rows: IntArray, control: Array) -> Motion:
        """See `World`."""
        m, ticks = control.shape[:2]
        path = np.empty((m, ticks + 1, self._state.shape[1]))
        path[:, 0] = self._state[rows]
        push = self._push_force(rows, path[:, 0, 0], ticks)
        spec = int(_CONTROL if push is None else _CONTROL | _PUSHED)
        controls = np.zeros((m, ticks, mujoco.mj_stateSize(self.model, spec)))
        controls[..., self._ctrl] = control
        if push is not None:
            controls[..., self._push] = push
        states = np.empty((m, ticks, path.shape[2]))
        sensors = np.empty((m, ticks, self.model.nsensordata))
        self._rollout.rollout(
            self._models[:m],
            [self._data],
            path[:, 0].copy(),
            controls,
            control_spec=spec,
            skip_checks=True,
            nstep=ticks,
            initial_warmstart=self._warmstart[rows],
            state=states,
            sensordata=sensors,
        )
        path[:, 1:] = states
        # The sensors are of the state before each step, and have the floor's side of it.
        return self._motion(path, -sensors[..., self._force], _finite(states))

    @property
    def _data(self) -> mujoco.MjData:
        """Scratch memory of the thread."""
        if not hasattr(self._scratch, "data"):
            self._scratch.data = mujoco.MjData(self.model)
        return self._scratch.data

    def advance(self, rows: IntArray, motion: Motion, ticks: IntArray) -> None:
        """See `World`."""
        super().advance(rows, motion, ticks)
        m = np.arange(len(rows))
        rates = slice(1 + self.model.nq, None)
        last = motion.path[m, ticks, rates] - motion.path[m, ticks - 1, rates]
        self._warmstart[rows] = last / self.model.opt.timestep

    def running(self) -> AbstractContextManager[object]:
        """See `World`."""
        return without_warnings()

    def restart(self, rows: IntArray) -> None:
        """See `World`."""
        super().restart(rows)
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
