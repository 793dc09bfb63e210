"""Engine-neutral description of a robot as a mechanism, by which models are compared.

Everything is placed relative to the joints' anchors, in the axes that the trunk has at zero joint
angles. So it does not matter where a model attaches its bodies' frames, nor how it turns them:
only physics is left. Links bear the name of the joint that moves them, and links that fixed joints
tie together are one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import pinocchio as pin

from .._typing import Array
from ..errors import InvalidInput
from ..robot import NB, Robot

TRUNK = "trunk"
"""The link that floats."""

FLOATING = "floating"

_HUGE = 1e300
"""Limits beyond it are none."""


class Link(NamedTuple):
    """Rigid body that moves with a joint, in the trunk's axes at zero joint angles."""

    mass: float
    """[kg]"""
    centre: Array
    """Centre of mass from the joint's anchor (the trunk's origin) [m], shape (3,)."""
    inertia: Array
    """About the centre of mass [kg m^2], shape (3, 3)."""


class Joint(NamedTuple):
    """A hinge or a slide; units are those of a hinge."""

    kind: str
    """"hinge" or "slide"."""
    parent: str
    """The link that carries it."""
    origin: Array
    """Anchor from the parent's anchor [m], shape (3,)."""
    axis: Array
    """In the trunk's axes at zero joint angles, shape (3,)."""
    zero: float
    """Angle of the pose in which the file draws the robot (MuJoCo's `ref`) [rad]."""
    limits: Array
    """Lowest and highest angle [rad], shape (2,)."""
    torque_limits: Array
    """Lowest and highest torque of the motor [N m], shape (2,)."""
    speed_limit: float | None
    """[rad/s]; None where the format knows none."""
    armature: float
    """Rotor inertia at the joint [kg m^2]."""
    damping: float
    """[N m s/rad]"""
    friction: float
    """Coulomb friction [N m]."""
    stiffness: float
    """Of a spring [N m/rad]."""
    actuator: str | None
    """Kind of actuator; None where the whole model has none, so that torques act on the joints."""
    torque_per_control: float | None
    """Of a motor [N m]; None for other actuators."""


class Foot(NamedTuple):
    """A sphere that the robot stands on."""

    name: str
    centre: Array
    """From the anchor of the joint that moves it [m], shape (3,)."""
    radius: float
    """[m]"""


class Point(NamedTuple):
    """A material point of a link."""

    link: str
    offset: Array
    """From the link's anchor at zero joint angles [m], shape (3,)."""


class State(NamedTuple):
    """A state of the floating robot; joints in the order that goes with it."""

    position: Array
    """Of the trunk's origin in the world [m], shape (3,)."""
    quaternion: Array
    """Attitude of the trunk, xyzw, shape (4,)."""
    base_velocity: Array
    """Linear and angular, in the trunk's frame, shape (6,)."""
    angles: Array
    """Joint angles [rad], shape (n,)."""
    rates: Array
    """Joint velocities [rad/s], shape (n,)."""


class Dynamics(NamedTuple):
    """M, h and J at a state, in Pinocchio's layout with the joints in the order asked for."""

    mass_matrix: Array
    """Shape (6 + n, 6 + n)."""
    bias: Array
    """Coriolis, centrifugal and gravitational forces, shape (6 + n,)."""
    jacobian: Array
    """Of the points, in the world's axes, shape (3 points, 6 + n)."""


class Engine(Protocol):
    """Computes the dynamics of a mechanism."""

    def evaluate(self, names: tuple[str, ...], points: list[Point], state: State) -> Dynamics:
        """M, h and J, with the joints in the order of `names`."""
        ...


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A robot as an engine has read it.

    Attributes:
        label: What it was read from, for people.
        base: "floating", or how the trunk is held instead.
        gravity: In the world [m/s^2], shape (3,).
        joints: By name, in the order of the model.
        links: The trunk, then by the name of the joint that moves them.
        feet: Of each link that has any.
        named_feet: Whether they are known to be the feet; otherwise they are spheres.
        extras: What else acts, counted: loops, tendons and the like.
        engine: Computes its dynamics.
        round_off: Relative error that its numbers may have from where they were written down.
    """

    label: str
    base: str
    gravity: Array
    joints: dict[str, Joint]
    links: dict[str, Link]
    feet: dict[str, tuple[Foot, ...]]
    named_feet: bool
    extras: dict[str, int]
    engine: Engine
    round_off: float = 0.0


def read_pinocchio(model: pin.Model, label: str, robot: Robot | None = None) -> Mechanism:
    """Pinocchio's model, whose first joint is a free flyer.

    Args:
        model: The model.
        label: What to call it.
        robot: The robot it is of, which knows the feet.

    Raises:
        InvalidInput: A joint is neither a hinge nor a slide.
    """
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    anchors = [np.array(data.oMi[joint].translation) for joint in range(model.njoints)]
    rotations = [np.array(data.oMi[joint].rotation) for joint in range(model.njoints)]
    names = [TRUNK if joint == 1 else model.names[joint] for joint in range(model.njoints)]
    joints = {
        names[joint]: _pinocchio_joint(model, data, joint, names, anchors)
        for joint in range(2, model.njoints)
    }
    links = {}
    for joint in range(1, model.njoints):
        inertia, turn = model.inertias[joint], rotations[joint]
        links[names[joint]] = Link(
            float(inertia.mass), turn @ inertia.lever, turn @ inertia.inertia @ turn.T
        )
    feet: dict[str, tuple[Foot, ...]] = {}
    if robot is not None:
        for name, foot in zip(robot.foot_names, robot.foot_ids, strict=True):
            frame = model.frames[foot]
            centre = rotations[frame.parentJoint] @ frame.placement.translation
            feet[names[frame.parentJoint]] = (Foot(name, centre, robot.foot_radius),)
    return Mechanism(
        label=label,
        base=FLOATING,
        gravity=np.array(model.gravity.linear),
        joints=joints,
        links=links,
        feet=feet,
        named_feet=robot is not None,
        extras={},
        engine=_Pinocchio(model),
    )


def _pinocchio_joint(
    model: pin.Model, data: pin.Data, joint: int, names: list[str], anchors: list[Array]
) -> Joint:
    if model.joints[joint].nv != 1:
        raise InvalidInput(
            f"joint {names[joint]} is a {model.joints[joint].shortname()}; only robots of hinges "
            "and slides can be compared"
        )
    q, v, parent = model.joints[joint].idx_q, model.joints[joint].idx_v, model.parents[joint]
    column = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)[:, v]
    hinge = bool(np.any(column[3:]))
    # An endless joint is written as a cosine and a sine, without limits.
    endless = model.joints[joint].nq != 1
    limits = np.array([model.lowerPositionLimit[q], model.upperPositionLimit[q]])
    effort = _finite_or_none(np.array([-1.0, 1.0]) * model.effortLimit[v])
    return Joint(
        kind="hinge" if hinge else "slide",
        parent=names[parent],
        origin=anchors[joint] - anchors[parent],
        axis=np.array(column[3:] if hinge else column[:3]),
        zero=0.0,
        limits=np.array([-np.inf, np.inf]) if endless else _finite_or_none(limits),
        torque_limits=effort,
        speed_limit=float(_finite_or_none(model.velocityLimit[v])),
        armature=float(model.armature[v]),
        damping=float(model.damping[v]),
        friction=float(model.friction[v]),
        stiffness=0.0,
        actuator="motor",
        torque_per_control=1.0,
    )


def _finite_or_none(limit: Array) -> Array:
    return np.where(np.abs(limit) > _HUGE, np.copysign(np.inf, limit), limit)


class _Pinocchio:
    """Pinocchio's dynamics of a floating robot."""

    def __init__(self, model: pin.Model) -> None:
        self._model, self._data = model, model.createData()
        pin.forwardKinematics(model, self._data, pin.neutral(model))
        self._rotations = [np.array(place.rotation) for place in self._data.oMi]

    def evaluate(self, names: tuple[str, ...], points: list[Point], state: State) -> Dynamics:
        """See `Engine.evaluate`."""
        model, data = self._model, self._data
        ids = [model.getJointId(name) for name in names]
        order = [*range(NB), *(model.joints[joint].idx_v for joint in ids)]
        q, v = pin.neutral(model), np.zeros(model.nv)
        q[:3], q[3:7] = state.position, state.quaternion
        for joint, angle in zip(ids, state.angles, strict=True):
            start, size = model.joints[joint].idx_q, model.joints[joint].nq
            q[start : start + size] = angle if size == 1 else [np.cos(angle), np.sin(angle)]
        v[order] = np.concatenate([state.base_velocity, state.rates])
        mass = pin.crba(model, data, q)[np.ix_(order, order)]
        bias = pin.nonLinearEffects(model, data, q, v)[order]
        pin.computeJointJacobians(model, data, q)
        rows = [np.zeros((0, len(order)))]
        for link, offset in points:
            joint = 1 if link == TRUNK else model.getJointId(link)
            arm = data.oMi[joint].rotation @ self._rotations[joint].T @ offset
            whole = pin.getJointJacobian(model, data, joint, pin.LOCAL_WORLD_ALIGNED)[:, order]
            rows.append(whole[:3] - pin.skew(arm) @ whole[3:])
        return Dynamics(np.array(mass), np.array(bias), np.vstack(rows))
