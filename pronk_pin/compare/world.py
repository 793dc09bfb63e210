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
import pinocchio as pin

from .._typing import Array, BoolArray, IntArray
from .._urdf import mujoco_spec
from ..robot import Robot
from .scenario import Scenario

_FLOOR = "floor"
_FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS


def build_model(robot: Robot, scenario: Scenario, *, free: bool = False) -> mujoco.MjModel:
    """Compile the robot in its world.

    Args:
        robot: The robot, whose URDF is used.
        scenario: What the world adds to the URDF.
        free: Leave the trunk its six degrees of freedom instead of x and z only.
    """
    spec = mujoco_spec(robot)
    spec.option.timestep = scenario.timestep
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
    _add_payload(trunk, scenario)
    _add_motors(spec, robot, scenario)
    _name_feet(spec, robot)
    _add_ground(spec, robot, scenario)
    return spec.compile()


def _add_payload(trunk: mujoco.MjsBody, scenario: Scenario) -> None:
    """Merge the payload into the trunk's inertia (a body of its own would be fused wrongly)."""
    if scenario.payload == 0.0:
        return
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.array(trunk.iquat))
    rotation = flat.reshape(3, 3)
    inertia = rotation @ np.diag(trunk.inertia) @ rotation.T
    own = pin.Inertia(float(trunk.mass), np.array(trunk.ipos), inertia)
    point = pin.Inertia(scenario.payload, np.array(scenario.payload_position), np.zeros((3, 3)))
    both = own + point
    principal, axes = np.linalg.eigh(both.inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    trunk.mass, trunk.ipos = both.mass, both.lever
    trunk.inertia, trunk.iquat = principal, quaternion


def _add_motors(spec: mujoco.MjSpec, robot: Robot, scenario: Scenario) -> None:
    """A torque motor at every joint, with the friction and the rotor that the URDF leaves out."""
    for name in robot.urdf_joint_names:
        joint = spec.joint(name)
        joint.armature = scenario.armature
        joint.damping = [scenario.damping, 0, 0]
        joint.frictionloss = scenario.coulomb
        # The default time constant of 0.02 s would smear Coulomb friction into a damper.
        joint.solref_friction = [0.002, 1]
        joint.actfrclimited = False  # the limit is the controller's business
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm = [scenario.torque_constant] + [0] * 9
        motor.biasprm = [0] * 10


def _name_feet(spec: mujoco.MjSpec, robot: Robot) -> None:
    """The sphere that each foot stands on; one of our own where the URDF has a mesh instead."""
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    for leg, foot, foot_id in zip(robot.legs, robot.foot_names, robot.foot_ids, strict=True):
        calf = spec.joint(robot.spec.leg_joints(leg)[-1]).parent
        centre = np.array(robot.model.frames[foot_id].placement.translation)
        geom = next((geom for geom in calf.geoms if geom.type == sphere), None)
        if geom is None:
            geom = calf.add_geom(type=sphere, pos=centre, size=[robot.foot_radius, 0, 0])
        geom.name = foot


def _add_ground(spec: mujoco.MjSpec, robot: Robot, scenario: Scenario) -> None:
    """The floor, and sensors of the force between it and each foot."""
    contact = {
        "solref": [scenario.ground_time_constant, 1],
        "friction": [scenario.ground_friction, 0.005, 0.0001],
        "condim": 3,
    }
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    spec.worldbody.add_geom(
        name=_FLOOR, type=plane, size=[0, 0, 1], contype=1, conaffinity=0, **contact
    )
    for geom in spec.geoms:
        if geom.name != _FLOOR:
            geom.contype, geom.conaffinity = 0, 1  # the robot meets the floor, not itself
            geom.solref, geom.friction, geom.condim = contact.values()
    for foot in robot.foot_names:
        force = mujoco.mjtConDataField.mjCONDATA_FORCE
        spec.add_sensor(
            name=foot,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_GEOM,
            objname=foot,
            reftype=mujoco.mjtObj.mjOBJ_GEOM,
            refname=_FLOOR,
            # data fields, reduction (3: net force in the world frame), number of contacts
            intprm=[1 << int(force), 3, 1],
        )


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
