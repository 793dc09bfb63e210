"""The ground of a world, level or stepped, the feet that meet it, and the friction between them."""

from __future__ import annotations

import mujoco
import numpy as np

from ..._typing import Array
from ...robot import Robot
from .scenario import Scenario

_FLOOR = "floor"
_LEVEL = 0.45
"""Half the length of the level ground at the start [m]: a standing robot has room on it."""

_FARTHEST = 45.0
"""Distance to which there are steps [m], in both directions; a simulation does not go farther."""

_STEP_WIDTH = 5.0
"""Half the width of a step [m]."""


def add_ground(spec: mujoco.MjSpec, robot: Robot, scenario: Scenario) -> None:
    """The floor with its steps, the robot's contacts with it, and sensors of the feet's forces.

    Args:
        spec: The robot; its feet are geometries named as `robot.foot_names`.
        robot: The robot.
        scenario: The scenario.
    """
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 0, 1  # the robot meets the ground, not itself
        _set_contact(geom, scenario)
    plane, box = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_BOX
    ground = [spec.worldbody.add_geom(name=_FLOOR, type=plane, size=[0, 0, 1])]
    half = 0.5 * scenario.step_length
    for centre, height in zip(*steps(scenario), strict=True):
        size = [half, _STEP_WIDTH, height]  # half of it below the floor
        ground.append(spec.worldbody.add_geom(type=box, size=size, pos=[centre, 0, 0]))
    for geom in ground:
        geom.contype, geom.conaffinity = 1, 0
        _set_contact(geom, scenario)
    force = mujoco.mjtConDataField.mjCONDATA_FORCE
    for foot in robot.foot_names:
        spec.add_sensor(
            name=foot,
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_GEOM,
            objname=foot,
            reftype=mujoco.mjtObj.mjOBJ_BODY,
            refname="world",
            # data fields, reduction (3: net force in the world frame), number of contacts
            intprm=[1 << int(force), 3, 1],
        )


def _set_contact(geom: mujoco.MjsGeom, scenario: Scenario) -> None:
    """Softness and friction, the same of feet and ground, so that they are those of the contact.

    With `condim` 3 it is the friction against sliding; those against spinning and rolling are
    MuJoCo's, and do not act.
    """
    geom.solref = [scenario.ground_time_constant, 1]
    geom.friction = [scenario.ground_friction, 0.005, 0.0001]
    geom.condim = 3


def steps(scenario: Scenario) -> tuple[Array, Array]:
    """Centres along the way and heights of a world's steps [m], from the start outward.

    The start is level. The heights, uniform up to `step_height`, are drawn alternately ahead and
    behind, so that those within reach do not depend on how far the steps go.
    """
    if scenario.step_height == 0.0:
        return np.empty(0), np.empty(0)
    count = int((_FARTHEST - _LEVEL) / scenario.step_length)
    ahead = _LEVEL + scenario.step_length * (np.arange(count) + 0.5)
    rng = np.random.default_rng(scenario.seed)
    heights = scenario.step_height * rng.uniform(size=2 * count)
    return np.column_stack([ahead, -ahead]).ravel(), heights


def name_feet(spec: mujoco.MjSpec, robot: Robot) -> None:
    """The sphere that each foot stands on; one of our own where the robot has a mesh instead.

    Args:
        spec: The robot, with its joints named as `robot.joint_names`.
        robot: The robot.
    """
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    for leg, foot, foot_id in zip(robot.legs, robot.foot_names, robot.foot_ids, strict=True):
        calf = spec.joint(robot.spec.leg_joints(leg)[-1]).parent
        centre = np.array(robot.model.frames[foot_id].placement.translation)
        spheres = [geom for geom in calf.geoms if geom.type == sphere]
        if spheres:
            geom = min(spheres, key=lambda each: float(np.linalg.norm(each.pos - centre)))
        else:
            geom = calf.add_geom(type=sphere, pos=centre, size=[robot.foot_radius, 0, 0], mass=0)
        geom.name = foot
