"""The truth: robots in MuJoCo, built from the same URDF, with what the scenario adds.

The base is locked to the sagittal plane without rotation, as in the paper (section III): the trunk
has two slides, x and z. `qpos` and `qvel` stay inside this module; what it takes and gives is in
Pinocchio's order.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import mujoco.rollout
import numpy as np

from .._typing import Array, BoolArray, IntArray
from .._urdf import mujoco_spec
from ..robot import Robot
from .foreign import mjcf_spec
from .ground import add_ground, name_feet
from .scenario import Scenario
from .trunk import load_trunk

_FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS


def build_model(robot: Robot, scenario: Scenario, *, free: bool = False) -> mujoco.MjModel:
    """Compile the robot in its world.

    Args:
        robot: The robot, whose URDF is used if the scenario names no MJCF.
        scenario: What the world adds to that.
        free: Leave the trunk its six degrees of freedom instead of x and z only.
    """
    spec = mjcf_spec(robot, scenario.mjcf) if scenario.mjcf else mujoco_spec(robot)
    spec.option.timestep = scenario.timestep
    spec.option.gravity = scenario.gravity_vector
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    # MuJoCo 4.0.0 has a bug in Newton's sparse Cholesky; dense is faster at this size anyway.
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    # A state that is not finite must be seen, not replaced by the zero posture.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET

    trunk = spec.body(robot.spec.base_link)
    if not free:
        for joint in trunk.joints:
            spec.delete(joint)
        for name, axis in (("x", [1, 0, 0]), ("z", [0, 0, 1])):
            trunk.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    load_trunk(trunk, scenario)
    _add_motors(spec, robot, scenario)
    name_feet(spec, robot)
    add_ground(spec, robot, scenario)
    return spec.compile()


def _add_motors(spec: mujoco.MjSpec, robot: Robot, scenario: Scenario) -> None:
    """A torque motor at every joint; rotor and friction come on top of the joint's own."""
    for name in robot.urdf_joint_names:
        joint = spec.joint(name)
        joint.armature += scenario.armature
        linear, *higher = joint.damping
        joint.damping = [linear + scenario.damping, *higher]
        joint.frictionloss += scenario.coulomb
        # The default time constant of 0.02 s would smear Coulomb friction into a damper.
        joint.solref_friction = [0.002, 1]
        joint.actfrclimited = False  # the limit is the controller's business
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm = [scenario.torque_constant] + [0] * 9
        motor.biasprm = [0] * 10


@contextmanager
def without_warnings() -> Iterator[None]:
    """Keep MuJoCo from writing warnings to a file in the current folder: `World.finite` tells."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


class World:
    """n robots, each alone in the same world, stepped together.

    Attributes:
        base: Trunk x and z in the world [m], shape (n, 2).
        base_rate: Their rates [m/s], shape (n, 2).
        joints: Joint angles [rad], shape (n, 12).
        joint_rates: Joint velocities [rad/s], shape (n, 12).
        force: Ground's force on each foot, world frame [N], shape (n, 4, 3); as MuJoCo's sensors
            give it, of the instant before the last step.
    """

    def __init__(self, robot: Robot, scenario: Scenario, n: int) -> None:
        self.robot, self.scenario, self.n = robot, scenario, n
        self.model = build_model(robot, scenario)
        # rollout without checks wants one model a robot, and one data a thread.
        self._models, self._data = [self.model] * n, [mujoco.MjData(self.model)]
        # Without threads of its own: batches run side by side in processes.
        self._rollout = mujoco.rollout.Rollout(nthread=0)
        model = self.model
        self._qpos = np.array([model.joint(name).qposadr[0] for name in robot.joint_names])
        self._qvel = np.array([model.joint(name).dofadr[0] for name in robot.joint_names])
        self._ctrl = np.array([model.actuator(name).id for name in robot.joint_names])
        self._base = np.array([model.joint(name).qposadr[0] for name in ("x", "z")])
        self._base_rate = np.array([model.joint(name).dofadr[0] for name in ("x", "z")])
        address = [model.sensor(name).adr[0] for name in robot.foot_names]
        self._force = np.array(address)[:, None] + np.arange(3)
        self._state = np.zeros((n, 1, mujoco.mj_stateSize(model, _FULL)))
        self._sensors = np.zeros((n, 1, model.nsensordata))
        self._control = np.zeros((n, 1, model.nu))
        self._warmstart = np.zeros((n, model.nv))
        self.reset(np.zeros((n, 2)), np.tile(robot.standing[7:], (n, 1)))

    def reset(
        self,
        base: Array,
        joints: Array,
        base_rate: Array | float = 0.0,
        joint_rates: Array | float = 0.0,
    ) -> None:
        """Put every robot somewhere, by default at rest.

        Args:
            base: Trunk x and z [m], shape (n, 2).
            joints: Joint angles [rad], shape (n, 12).
            base_rate: Rates of the trunk's x and z [m/s], shape (n, 2).
            joint_rates: Joint velocities [rad/s], shape (n, 12).
        """
        state, nq = self._state[:, 0], self.model.nq
        state[:] = 0.0
        state[:, 1 + self._base] = base
        state[:, 1 + self._qpos] = joints
        state[:, 1 + nq + self._base_rate] = base_rate
        state[:, 1 + nq + self._qvel] = joint_rates
        self._warmstart[:] = 0.0
        self._sensors[:] = 0.0
        self._read()

    def step(self, tau: Array) -> None:
        """Advance every robot by one time step under motor torques (n, 12) [N m]."""
        model = self.model
        self._control[:, 0, self._ctrl] = tau
        before = self._state[:, 0, 1 + model.nq :].copy()
        self._rollout.rollout(
            self._models,
            self._data,
            self._state[:, 0].copy(),
            self._control,
            skip_checks=True,
            nstep=1,
            initial_warmstart=self._warmstart,
            state=self._state,
            sensordata=self._sensors,
        )
        self._warmstart = (self._state[:, 0, 1 + model.nq :] - before) / model.opt.timestep
        self._read()

    def _read(self) -> None:
        position = self._state[:, 0, 1 : 1 + self.model.nq]
        rate = self._state[:, 0, 1 + self.model.nq :]
        self.base, self.base_rate = position[:, self._base], rate[:, self._base_rate]
        self.joints, self.joint_rates = position[:, self._qpos], rate[:, self._qvel]
        self.force = -self._sensors[:, 0][:, self._force]  # the sensor has the floor's side of it

    @property
    def state(self) -> Array:
        """MuJoCo's full physics state of each robot, a copy, shape (n, nstate)."""
        return self._state[:, 0].copy()

    @property
    def finite(self) -> BoolArray:
        """Which robots still have finite states, none huge (MuJoCo's limit), shape (n,)."""
        return np.asarray((np.abs(self._state[:, 0]) < mujoco.mjMAXVAL).all(axis=1))

    def restart(self, rows: IntArray) -> None:
        """Put robots that left the finite numbers back to rest, so that the others go on."""
        self._state[rows, 0] = 0.0
        self._state[rows[:, None], 0, 1 + self._qpos] = self.robot.standing[7:]
        self._state[rows, 0, 1 + self._base[1]] = self.robot.standing[2]
        self._warmstart[rows] = 0.0
        self._read()
