"""A robot as a mechanism, read from a compiled MuJoCo model."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin

from .._typing import Array
from ..errors import InvalidInput
from ..robot import NB, rotation_matrix
from .actuators import actuator_kind, joint_actuators, through_gears, torque_limits
from .mechanism import FLOATING, TRUNK, Dynamics, Foot, Joint, Link, Mechanism, Point, State

_FREE = int(mujoco.mjtJoint.mjJNT_FREE)
_KINDS = {int(mujoco.mjtJoint.mjJNT_HINGE): "hinge", int(mujoco.mjtJoint.mjJNT_SLIDE): "slide"}


def read_mujoco(model: mujoco.MjModel, label: str, *, round_off: float = 0.0) -> Mechanism:
    """The robot in a MuJoCo model: of several bodies in the world, the one with the most joints.

    Args:
        model: The compiled model.
        label: What to call it.
        round_off: Relative error of its numbers.

    Raises:
        InvalidInput: Nothing in it has joints, or a joint is neither a hinge nor a slide.
    """
    reader = _Reader(model, label)
    return Mechanism(
        label=label,
        base=reader.base,
        gravity=_gravity(model),
        joints={reader.names[joint]: reader.joint(joint) for joint in reader.joints},
        links={name: reader.link(name) for name in (TRUNK, *reader.names.values())},
        feet=reader.spheres(),
        named_feet=False,
        extras=_extras(model, reader),
        engine=_MuJoCo(model, reader),
        round_off=round_off,
    )


class _Reader:
    """Bodies and joints of the robot, and their places at zero joint angles."""

    def __init__(self, model: mujoco.MjModel, label: str) -> None:
        self.model = model
        self._choose(label)
        self.base_joints = [
            joint for joint in range(model.njnt) if model.jnt_bodyid[joint] == self.root != 0
        ]
        self.joints = [
            joint
            for joint in range(model.njnt)
            if model.jnt_bodyid[joint] in self.bodies and joint not in self.base_joints
        ]
        for joint in self.joints:
            if model.jnt_type[joint] not in _KINDS:
                raise InvalidInput(
                    f"{label}: joint {self._name(joint)} is a ball or free joint inside the "
                    "robot; only robots of hinges and slides can be compared"
                )
        self.names = {joint: self._name(joint) for joint in self.joints}
        self.data = mujoco.MjData(model)
        for joint in range(model.njnt):
            start = model.jnt_qposadr[joint]
            if joint in self.joints:
                self.data.qpos[start] = 0.0
            elif joint in self.base_joints and model.jnt_type[joint] == _FREE:
                self.data.qpos[start : start + 7] = [0, 0, 0, 1, 0, 0, 0]
        mujoco.mj_kinematics(model, self.data)
        self._position = self.data.xpos[self.root].copy()
        self._axes = self.data.xmat[self.root].reshape(3, 3).copy()  # of the trunk, in the world
        self.anchors = {TRUNK: np.zeros(3)}
        for joint, name in self.names.items():
            self.anchors[name] = self._in_trunk(self.data.xanchor[joint])

    def _choose(self, label: str) -> None:
        """The robot's bodies, and the trunk's body (the world where several limbs hang from it)."""
        model = self.model
        free: list[int] = []
        held: list[int] = []
        for root in np.flatnonzero(model.body_parentid == 0)[1:]:  # 0 is the world itself
            floats = bool(np.any((model.jnt_bodyid == root) & (model.jnt_type == _FREE)))
            (free if floats else held).append(int(root))
        moving = [root for root in held if self._count([root])]
        groups = [[root] for root in free] + [moving]
        best = max(groups, key=self._count)
        if not self._count(best):
            raise InvalidInput(
                f"{label}: nothing in it has a joint besides the trunk's; give the robot's own "
                "MJCF or URDF"
            )
        self.root = best[0] if len(best) == 1 else 0
        rooted = np.isin(model.body_rootid, best)
        self.bodies = set(np.flatnonzero(rooted).tolist())
        if self.root == 0:
            self.bodies.add(0)

    def _count(self, roots: list[int]) -> int:
        """Number of hinges, slides and balls of the bodies under these roots."""
        body = self.model.jnt_bodyid
        inside = np.isin(self.model.body_rootid[body], roots)
        return int(np.count_nonzero(inside & (self.model.jnt_type != _FREE)))

    @property
    def base(self) -> str:
        kinds = [self.model.jnt_type[joint] for joint in self.base_joints]
        if kinds == [_FREE]:
            return FLOATING
        if not kinds:
            return "fixed to the world"
        return f"held by {', '.join(map(self._name, self.base_joints))}"

    def _name(self, joint: int) -> str:
        body = self.model.body(self.model.jnt_bodyid[joint]).name
        return self.model.joint(joint).name or f"(joint of {body or 'a body'} without a name)"

    def _in_trunk(self, point: Array) -> Array:
        return np.asarray(self._axes.T @ (point - self._position))

    def link_of(self, body: int) -> str:
        """Name of the link that a body belongs to; bodies without joints belong to what bears
        them."""
        moved_by = self.model.body_weldid[body]
        if moved_by in (0, self.root):
            return TRUNK
        last = self.model.body_jntadr[moved_by] + self.model.body_jntnum[moved_by] - 1
        return self.names[int(last)]

    def link(self, name: str) -> Link:
        model, data = self.model, self.data
        total = pin.Inertia.Zero()
        for body in self.bodies:
            if body == 0 or self.link_of(body) != name:
                continue
            turn = self._axes.T @ data.ximat[body].reshape(3, 3)
            inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
            centre = self._in_trunk(data.xipos[body])
            total += pin.Inertia(float(model.body_mass[body]), centre, inertia)
        centre = total.lever - self.anchors[name] if total.mass > 0.0 else np.zeros(3)
        return Link(float(total.mass), centre, np.array(total.inertia))

    def joint(self, joint: int) -> Joint:
        model = self.model
        body, dof = int(model.jnt_bodyid[joint]), model.jnt_dofadr[joint]
        first = model.body_jntadr[body] == joint
        parent = self.link_of(model.body_parentid[body]) if first else self.names[joint - 1]
        drives = [
            index for index in joint_actuators(model) if model.actuator_trnid[index, 0] == joint
        ]
        gears = [float(model.actuator_gear[index, 0]) for index in drives]
        actuator, gain = actuator_kind(model, drives)
        unlimited = np.array([-np.inf, np.inf])
        return Joint(
            kind=_KINDS[model.jnt_type[joint]],
            parent=parent,
            origin=self.anchors[self.names[joint]] - self.anchors[parent],
            axis=self._axes.T @ self.data.xaxis[joint],
            zero=float(model.qpos0[model.jnt_qposadr[joint]]),
            limits=model.jnt_range[joint].copy() if model.jnt_limited[joint] else unlimited,
            torque_limits=torque_limits(model, joint, drives, gain),
            speed_limit=None,
            armature=float(model.dof_armature[dof])
            + through_gears(model, "actuator_armature", drives, gears),
            damping=float(model.dof_damping[dof])
            + through_gears(model, "actuator_damping", drives, gears),
            friction=float(model.dof_frictionloss[dof]),
            stiffness=float(model.jnt_stiffness[joint]),
            actuator=actuator,
            torque_per_control=gain,
        )

    def spheres(self) -> dict[str, tuple[Foot, ...]]:
        """Spheres that collide, at the ends of the limbs."""
        model = self.model
        bearing = {self.link_of(model.body_parentid[model.jnt_bodyid[j]]) for j in self.joints}
        spheres: dict[str, list[Foot]] = {}
        for geom in range(model.ngeom):
            body = int(model.geom_bodyid[geom])
            solid = model.geom_contype[geom] or model.geom_conaffinity[geom]
            sphere = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_SPHERE
            if body not in self.bodies or not solid or not sphere:
                continue
            link = self.link_of(body)
            if link in bearing or link == TRUNK:
                continue
            place = self.data.xpos[body] + self.data.xmat[body].reshape(3, 3) @ model.geom_pos[geom]
            centre = self._in_trunk(place) - self.anchors[link]
            foot = Foot(model.geom(geom).name, centre, float(model.geom_size[geom, 0]))
            spheres.setdefault(link, []).append(foot)
        return {link: tuple(feet) for link, feet in spheres.items()}


def _gravity(model: mujoco.MjModel) -> Array:
    off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY
    return np.zeros(3) if off else np.array(model.opt.gravity)


def _extras(model: mujoco.MjModel, reader: _Reader) -> dict[str, int]:
    """Counts of other elements that act on the robot."""
    dofs = [model.jnt_dofadr[joint] for joint in reader.joints]
    nonlinear = sum(
        int(np.any(getattr(model, name)[rows], axis=1).sum())
        for name, rows in (("dof_dampingpoly", dofs), ("jnt_stiffnesspoly", reader.joints))
        if hasattr(model, name)  # MuJoCo 3 has none
    )
    bodies = sorted(reader.bodies)
    return {
        "closed loops and other equality constraints": int(model.neq),
        "tendons": int(model.ntendon),
        "actuators that act on no joint": len(model.actuator_trntype) - len(joint_actuators(model)),
        "joints with nonlinear damping or springs": nonlinear,
        "bodies with gravity compensation": int(np.count_nonzero(model.body_gravcomp[bodies])),
    }


class _MuJoCo:
    """MuJoCo's dynamics of a floating robot, without contacts and passive forces."""

    def __init__(self, model: mujoco.MjModel, reader: _Reader) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._joints = {name: joint for joint, name in reader.names.items()}
        self._base = next(iter(reader.base_joints), 0)
        self._bodies = {TRUNK: reader.root}
        self._places = {}
        for name, joint in self._joints.items():
            self._bodies[name] = int(model.jnt_bodyid[joint])
        for name, body in self._bodies.items():
            turn = reader.data.xmat[body].reshape(3, 3)
            anchor = reader.data.xpos[reader.root] + reader._axes @ reader.anchors[name]
            # From the body's frame to a point given from the anchor, in the trunk's axes.
            self._places[name] = (turn.T @ (anchor - reader.data.xpos[body]), turn.T @ reader._axes)

    def evaluate(self, names: tuple[str, ...], points: list[Point], state: State) -> Dynamics:
        """See `Engine.evaluate`."""
        model, data = self._model, self._data
        joints = [self._joints[name] for name in names]
        place, base = model.jnt_qposadr[self._base], model.jnt_dofadr[self._base]
        dofs = [model.jnt_dofadr[joint] for joint in joints]
        data.qpos[:] = model.qpos0
        data.qpos[place : place + 3] = state.position
        data.qpos[place + 3 : place + 7] = state.quaternion[[3, 0, 1, 2]]
        data.qpos[[model.jnt_qposadr[joint] for joint in joints]] = state.angles

        rotation = rotation_matrix(state.quaternion)
        change = np.zeros((model.nv, NB + len(joints)))  # qvel = change @ v
        change[base : base + 3, :3] = rotation
        change[base + 3 : base + NB, 3:NB] = np.eye(3)
        change[dofs, range(NB, NB + len(joints))] = 1.0
        data.qvel[:] = change @ np.concatenate([state.base_velocity, state.rates])
        transport = np.zeros(model.nv)  # the rest of qacc = change @ a + transport
        linear, angular = state.base_velocity[:3], state.base_velocity[3:]
        transport[base : base + 3] = rotation @ np.cross(angular, linear)

        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_comVel(model, data)
        bias = np.zeros(model.nv)
        mujoco.mj_rne(model, data, 0, bias)
        mass = change.T @ np.column_stack([self._times_mass(column) for column in change.T])
        force = change.T @ (bias + self._times_mass(transport))
        rows = [np.zeros((0, change.shape[1]))]
        rows += [self._jacobian(point) @ change for point in points]
        return Dynamics(mass, force, np.vstack(rows))

    def _times_mass(self, vector: Array) -> Array:
        product = np.zeros(self._model.nv)
        mujoco.mj_mulM(self._model, self._data, product, np.ascontiguousarray(vector))
        return product

    def _jacobian(self, point: Point) -> Array:
        body = self._bodies[point.link]
        origin, turn = self._places[point.link]
        in_body = origin + turn @ point.offset
        place = self._data.xpos[body] + self._data.xmat[body].reshape(3, 3) @ in_body
        jacobian = np.zeros((3, self._model.nv))
        mujoco.mj_jac(self._model, self._data, jacobian, None, place, body)
        return jacobian
