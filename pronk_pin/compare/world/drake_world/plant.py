"""The robot on its ground as a discrete plant of Drake's, built from Pinocchio's model.

Body frames are Pinocchio's joint frames; links that are fixed to each other are one body.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties, Sphere
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    PrismaticJoint,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.systems.framework import DiagramBuilder

from ...._typing import IntArray
from ....errors import InvalidInput
from ....robot import Robot
from ..scenario import Scenario

_APPROXIMATIONS = {
    "sap": DiscreteContactApproximation.kSap,
    "lagged": DiscreteContactApproximation.kLagged,
    "similar": DiscreteContactApproximation.kSimilar,
}

_STICKING = 1e-4
"""Joint speed below which dry friction holds, as a stiff damper [rad/s]."""

_DISSIPATION = 20.0
"""Of Hunt and Crossley's force, k x (1 + h v) at depth x and speed v inward, h [s/m].

Feet land without a bounce, and let go where they are lifted faster than 1 / h. The lagged
approximation needs that to be fast: beyond that speed it forgets the friction, too, and at
1 cm/s (h = 100 s/m) feet slid in stances in which they should stand.
"""


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Keep Drake from telling each time that ground is not for deformable bodies."""
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


class Plant(NamedTuple):
    """A plant in its diagram, finished, and where things are in it."""

    diagram: Any
    """The plant with the geometry of its contacts."""
    plant: Any
    """The plant."""
    joints: IntArray
    """Indices of the joints in Drake's q, in the order of `Robot.joint_names`, shape (12,)."""
    rates: IntArray
    """Those of their velocities in Drake's v, shape (12,)."""
    foot_bodies: dict[int, int]
    """Foot, in the order of `Robot.foot_names`, by the index of the body that it is part of."""
    trunk: pin.Inertia
    """Inertia of the trunk with its payload, in the trunk's frame."""

    def context(self) -> tuple[Any, Any]:
        """Scratch memory: that of the diagram, which owns it, and the plant's part of it."""
        with _without_warnings():
            root = self.diagram.CreateDefaultContext()
        return root, self.plant.GetMyMutableContextFromRoot(root)


def build_plant(robot: Robot, scenario: Scenario, *, base: str, approximation: str) -> Plant:
    """Build the robot in its world.

    Args:
        robot: The robot, whose parameters beyond the URDF are not used.
        scenario: What the world adds to that; `DrakeEngine.check` has let it pass.
        base: How the trunk may move: "locked" to x and z, "sagittal" with pitch, or "free".
        approximation: Of the contacts, see `DrakeEngine`.

    Raises:
        InvalidInput: Drake refuses the robot.
    """
    model = (robot.bare or robot).model
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, scenario.timestep)
    plant.set_discrete_contact_approximation(_APPROXIMATIONS[approximation])
    plant.set_contact_model(ContactModel.kPoint)
    plant.SetUseSampledOutputPorts(False)  # the contacts are those that act in the next step
    plant.mutable_gravity_field().set_gravity_vector(np.array(scenario.gravity_vector))
    trunk = _loaded_trunk(model, scenario)
    try:
        bodies = [plant.world_body(), _add_trunk(plant, trunk, base)]
        for index in range(2, model.njoints):
            bodies.append(_add_link(plant, model, index, bodies[model.parents[index]]))
        _add_friction(plant, robot, scenario, model)
        places = [model.frames[foot] for foot in robot.foot_ids]
        for name, frame in zip(robot.foot_names, places, strict=True):
            centre = RigidTransform(frame.placement.translation)
            properties = _contact(robot, scenario, approximation)
            ball, body = Sphere(robot.foot_radius), bodies[frame.parentJoint]
            plant.RegisterCollisionGeometry(body, centre, ball, name, properties)
        properties = _contact(robot, scenario, approximation)
        ground = RigidTransform(), HalfSpace(), "ground", properties
        plant.RegisterCollisionGeometry(plant.world_body(), *ground)
        plant.Finalize()
        diagram = builder.Build()
    except RuntimeError as error:
        raise InvalidInput(
            f"{robot.name}: Drake refuses it ({' '.join(str(error).split())})"
        ) from error
    joints = [plant.GetJointByName(name) for name in robot.joint_names]
    return Plant(
        diagram,
        plant,
        np.array([joint.position_start() for joint in joints]),
        np.array([joint.velocity_start() for joint in joints]),
        {int(bodies[frame.parentJoint].index()): foot for foot, frame in enumerate(places)},
        trunk,
    )


def _loaded_trunk(model: pin.Model, scenario: Scenario) -> pin.Inertia:
    """The trunk's inertia with its shifted centre of mass and the payload, a point."""
    trunk = model.inertias[1].copy()
    trunk.lever = trunk.lever + np.array(scenario.com_shift)
    place = np.array(scenario.payload_position)
    return trunk + pin.Inertia(scenario.payload, place, np.zeros((3, 3)))


def _spatial(inertia: pin.Inertia) -> Any:
    """An inertia in Drake's words."""
    if inertia.mass == 0.0:
        return SpatialInertia.Zero()
    (xx, xy, xz), (_, yy, yz), (*_, zz) = inertia.inertia
    central = RotationalInertia(xx, yy, zz, xy, xz, yz)
    return SpatialInertia.MakeFromCentralInertia(inertia.mass, inertia.lever, central)


def _add_trunk(plant: Any, inertia: pin.Inertia, base: str) -> Any:
    """Add the trunk, on slides without mass where it is guided; returns its body."""
    guides = {"locked": ("x", "z"), "sagittal": ("x", "z", "pitch"), "free": ()}[base]
    parent = plant.world_body()
    for name in guides:
        last = name == guides[-1]
        body = plant.AddRigidBody(
            "trunk" if last else f"slide_{name}",
            _spatial(inertia if last else pin.Inertia.Zero()),
        )
        kind, axis = {
            "x": (PrismaticJoint, [1.0, 0.0, 0.0]),
            "z": (PrismaticJoint, [0.0, 0.0, 1.0]),
            "pitch": (RevoluteJoint, [0.0, 1.0, 0.0]),
        }[name]
        plant.AddJoint(kind(name, parent.body_frame(), body.body_frame(), axis))
        parent = body
    return parent if guides else plant.AddRigidBody("trunk", _spatial(inertia))


def _add_link(plant: Any, model: pin.Model, index: int, parent: Any) -> Any:
    """Add what one of Pinocchio's joints moves, and the joint; returns the body."""
    name, kind = model.names[index], model.joints[index]
    motion = kind.createData()
    kind.calc(motion, pin.neutral(model))
    axis: Any = np.ravel(motion.S)[3:]
    if kind.nv != 1 or not np.any(axis):
        raise InvalidInput(
            f"joint {name} is a {kind.shortname()}; in Drake's worlds are hinges only"
        )
    body = plant.AddRigidBody(f"{name}_link", _spatial(model.inertias[index]))
    place = model.jointPlacements[index]
    at = RigidTransform(RotationMatrix(place.rotation), place.translation)
    frame = plant.AddFrame(FixedOffsetFrame(f"{name}_frame", parent.body_frame(), at))
    joint = plant.AddJoint(RevoluteJoint(name, frame, body.body_frame(), axis))
    address = kind.idx_q
    low, high = model.lowerPositionLimit[address], model.upperPositionLimit[address]
    joint.set_position_limits([low], [high])
    return body


def _add_friction(plant: Any, robot: Robot, scenario: Scenario, model: pin.Model) -> None:
    """Rotors and friction of the joints, which come on top of the URDF's own.

    A rotor's inertia belongs to an actuator. Dry friction is the same actuator as a speed
    controller that holds the joint as well as its effort limit lets it, which SAP solves together
    with the contacts: torque max(-c, min(c, -c v / v_s)), at the end of the step.
    """
    own = slice(-robot.nu, None)
    damping = scenario.by_joint("damping", robot) + model.damping[own]
    rotors = scenario.by_joint("armature", robot) + model.armature[own]
    dry = scenario.by_joint("coulomb", robot) + model.friction[own]
    for index, name in enumerate(robot.joint_names):
        joint, coulomb = plant.GetMutableJointByName(name), float(dry[index])
        joint.set_default_damping(float(damping[index]))
        limit = coulomb if coulomb > 0.0 else np.inf
        actuator = plant.AddJointActuator(f"{name}_rotor", joint, limit)
        actuator.set_default_rotor_inertia(float(rotors[index]))
        actuator.set_default_gear_ratio(1.0)
        if coulomb > 0.0:
            actuator.set_controller_gains(PdControllerGains(p=0.0, d=coulomb / _STICKING))


def _contact(robot: Robot, scenario: Scenario, approximation: str) -> Any:
    """Contact parameters of a foot or of the ground, which share the contact's softness.

    Springs of the robot's weight on its feet, m each, with the contact's time constant T:
    k = m / T^2. SAP has their critical damping, too, 2 m / T, as a relaxation time of 2 T; the
    others are damped by `_DISSIPATION`.
    """
    mass = (robot.bare or robot).mass / len(robot.foot_names)
    constant = scenario.ground_time_constant
    properties, friction = ProximityProperties(), scenario.ground_friction
    AddContactMaterial(
        dissipation=None if approximation == "sap" else _DISSIPATION,
        point_stiffness=2.0 * mass / constant**2,  # two such springs in series
        friction=CoulombFriction(friction, friction),
        properties=properties,
    )
    if approximation == "sap":
        properties.AddProperty("material", "relaxation_time", constant)  # they add up
    return properties
