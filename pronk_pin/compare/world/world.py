"""The simulated scenario: robots in MuJoCo, from the same URDF, with the scenario's mismatches.

With base `locked` the trunk has two slides, x and z, as in the paper (section III); with `sagittal`
a hinge for its pitch besides; with `free` the free joint of the model. `qpos` and `qvel` stay
inside this module; what it takes and gives is in Pinocchio's order.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import mujoco
import mujoco.rollout
import numpy as np

from ..._checks import Interval, instance_of, known_name, none_or, whole
from ..._registry import imported
from ..._typing import Array, BoolArray, IntArray
from ...control import Gains
from ...errors import InvalidInput
from ...robot import BASES, Robot, as_robot
from ...robot.formats import mujoco_spec
from .ground import add_ground, check_feet, name_feet
from .mjcf import mjcf_spec
from .motors import push_force
from .payload import apply_payload
from .scenario import Scenario
from .trunk_state import Trunk

_FULL = mujoco.mjtState.mjSTATE_FULLPHYSICS
_CONTROL, _PUSHED = mujoco.mjtState.mjSTATE_CTRL, mujoco.mjtState.mjSTATE_XFRC_APPLIED


def build_model(
    robot: Robot, scenario: Scenario, *, base: str = "locked", servo: Gains | None = None
) -> mujoco.MjModel:
    """Compile the robot in its world.

    Args:
        robot: The robot, whose URDF is used if the scenario names no MJCF.
        scenario: What the world adds to that.
        base: How the trunk may move: "locked" to x and z, "sagittal" with pitch, or "free".
        servo: Gains of servos at the joints, see `World`; without them torque motors.

    Raises:
        InvalidInput: The scenario has values of another number of joints, or its `edit` fails.
    """
    as_robot(robot)
    instance_of("scenario", scenario, Scenario, "a Scenario, as load_scenario() returns it")
    none_or(instance_of, "servo", servo, Gains)
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
    if known_name("base", base, BASES) != "free":
        for joint in trunk.joints:
            spec.delete(joint)
        for name, axis in (("x", [1, 0, 0]), ("z", [0, 0, 1])):
            trunk.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        if base == "sagittal":
            trunk.add_joint(name="pitch", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    apply_payload(trunk, scenario)
    _add_motors(spec, robot, scenario, servo)
    name_feet(spec, robot)
    if not scenario.mjcf:
        check_feet(spec, robot)
    add_ground(spec, robot, scenario)
    return _edited(spec, scenario) if scenario.edit else spec.compile()


def _edited(spec: mujoco.MjSpec, scenario: Scenario) -> mujoco.MjModel:
    """Compile a world that the scenario's own function has changed."""
    function = imported(scenario.edit, sha256=scenario.edit_sha256)
    if not callable(function):
        raise InvalidInput(f"scenario '{scenario.name}': edit {scenario.edit} cannot be called")
    try:
        function(spec)
        return spec.compile()
    except Exception as error:  # whatever a user's function does
        raise InvalidInput(
            f"scenario '{scenario.name}': {scenario.edit} ends in {type(error).__name__}: {error}"
        ) from error


def _add_motors(spec: mujoco.MjSpec, robot: Robot, scenario: Scenario, servo: Gains | None) -> None:
    """A motor at every joint; rotor and friction come on top of the joint's own."""
    names = ("armature", "damping", "coulomb", "torque_constant")
    values = np.stack([scenario.by_joint(name, robot) for name in names], axis=-1)  # (12, 4)
    if servo is not None:
        proportional, derivative = servo.proportional(robot.nu), servo.derivative(robot.nu)
    for index, (name, own) in enumerate(zip(robot.joint_names, values.tolist(), strict=True)):
        armature, damping, coulomb, constant = own
        joint = spec.joint(name)
        joint.armature += armature
        linear, *higher = joint.damping
        joint.damping = [linear + damping, *higher]
        joint.frictionloss += coulomb
        # The default time constant of 0.02 s would smear Coulomb friction into a damper.
        joint.solref_friction = [0.002, 1]
        joint.actfrclimited = False  # the limit is the controller's or the servo's business
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm = [constant] + [0] * 9
        motor.biasprm = [0] * 10
        if servo is not None:
            kp, kd = proportional[index], derivative[index]
            motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
            motor.biasprm = [0.0, -constant * kp, -constant * kd] + [0] * 7
            limit = constant * robot.tau_max[index]
            motor.forcerange, motor.forcelimited = [-limit, limit], True


@contextmanager
def without_warnings() -> Iterator[None]:
    """Keep MuJoCo from writing warnings to a file in the current folder: `World.finite` tells."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


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
    path: Array
    """MuJoCo's full physics states, and the one after the last tick, (m, ticks + 1, nstate)."""
    pose: Array | None = None
    """Trunk's position and quaternion xyzw, shape (m, ticks, 7); None where it cannot turn."""
    twist: Array | None = None
    """Trunk's linear and angular velocity in its own axes [m/s, rad/s], (m, ticks, 6); likewise."""


class World:
    """n robots in MuJoCo, each alone in the same scenario.

    Several threads may play and advance robots at once, each its own ones.

    Args:
        robot: The robot.
        scenario: The scenario.
        n: Number of robots.
        base: How the trunks may move, see `build_model`.
        servo: Gains of servos at the joints, whose controls are then set points (see
            `Tape.setpoint`) and which keep to the motors' limits themselves; without them the
            controls are torques.

    Attributes:
        base: Trunk x and z in the world [m], shape (n, 2).
        base_rate: Their rates [m/s], shape (n, 2).
        joints: Joint angles [rad], shape (n, 12).
        joint_rates: Joint velocities [rad/s], shape (n, 12).
        force: Ground's force on each foot during the last step, world frame [N], (n, 4, 3).
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
        """Set the state of every robot, by default at rest.

        Args:
            base: Trunk x and z [m], shape (n, 2).
            joints: Joint angles [rad], shape (n, 12).
            base_rate: Rates of the trunk's x and z [m/s], shape (n, 2).
            joint_rates: Joint velocities [rad/s], shape (n, 12).
            pitch: Of the trunk, where it may turn [rad], shape (n,).
        """
        state = self._state
        state[:] = 0.0
        self._trunk.put(state, pitch)
        state[:, self._base], state[:, self._qpos] = base, joints
        state[:, self._base_rate], state[:, self._qvel] = base_rate, joint_rates
        self._warmstart[:], self.force[:] = 0.0, 0.0

    def play(self, rows: IntArray, control: Array) -> Motion:
        """Simulate robots under controls (m, ticks, 12) of their motors or servos [N m].

        They stay where they are until `advance` says how far they go.
        """
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
        """Advance robots by so many ticks (m,) along a motion that they `play`; 1 or more each."""
        m = np.arange(len(rows))
        self.force[rows] = motion.force[m, ticks - 1]
        self._state[rows] = motion.path[m, ticks]
        rates = slice(1 + self.model.nq, None)
        last = motion.path[m, ticks, rates] - motion.path[m, ticks - 1, rates]
        self._warmstart[rows] = last / self.model.opt.timestep

    def step(self, tau: Array) -> Motion:
        """Advance every robot by one time step under controls (n, 12) of its motors [N m]."""
        rows = np.arange(self.n)
        motion = self.play(rows, tau[:, None])
        self.advance(rows, motion, np.ones(self.n, dtype=np.intp))
        return motion

    @property
    def base(self) -> Array:
        """See the class."""
        return self._state[:, self._base]

    @property
    def pose(self) -> Array:
        """Trunk's position and quaternion xyzw, shape (n, 7)."""
        return self._trunk.pose(self._state)

    @property
    def twist(self) -> Array:
        """Trunk's linear and angular velocity in its own axes [m/s, rad/s], shape (n, 6)."""
        return self._trunk.twist(self._state)

    @property
    def base_rate(self) -> Array:
        """See the class."""
        return self._state[:, self._base_rate]

    @property
    def joints(self) -> Array:
        """See the class."""
        return self._state[:, self._qpos]

    @property
    def joint_rates(self) -> Array:
        """See the class."""
        return self._state[:, self._qvel]

    @property
    def state(self) -> Array:
        """MuJoCo's full physics state of each robot, a copy, shape (n, nstate)."""
        return self._state.copy()

    def restart(self, rows: IntArray) -> None:
        """Reset robots with states that are not finite to rest, so that the others go on."""
        self._state[rows] = 0.0
        self._trunk.put(self._state, 0.0, rows)
        self._state[rows[:, None], self._qpos] = self.robot.standing[7:]
        self._state[rows, self._base[1]] = self.robot.standing[2]
        self._warmstart[rows] = 0.0


def finite(path: Array) -> BoolArray:
    """Whether states (..., nstate) are finite, with nothing huge (MuJoCo's limit)."""
    return np.asarray((np.abs(path) < mujoco.mjMAXVAL).all(axis=-1))
