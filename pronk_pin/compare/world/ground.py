"""The ground of a world: level, stepped or rough, the feet that meet it, and their friction."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter

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

_CELL = 0.02
"""Spacing of the heights of rough ground [m]."""
_CORRELATION = 0.05
"""Standard deviation of the Gaussian that smooths them [m]: bumps are some 10 cm apart."""
_PERIOD = 10.0
"""Distance along the way after which they repeat [m]."""
_ROUGH_LENGTH, _ROUGH_WIDTH = 100.0, 2.5
"""Half the length and half the width of rough ground [m]; beyond it is level, at its lowest."""


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
    if scenario.ground_roughness > 0.0:
        heights = rough_heights(scenario)
        ground[0].pos = [0, 0, heights.min()]
        ground.append(_add_heights(spec, heights))
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


def rough_heights(scenario: Scenario) -> Array:
    """Heights of rough ground [m], by place across and along the way, the origin in the middle.

    White noise of the scenario's seed, smoothed to a normal height of standard deviation
    `ground_roughness`; level at the start.
    """
    count = round(_PERIOD / _CELL), round(2.0 * _ROUGH_WIDTH / _CELL) + 1
    noise = np.random.default_rng(scenario.seed).standard_normal(count[::-1])
    tile = gaussian_filter(noise, _CORRELATION / _CELL, mode="wrap")
    along = _CELL * np.arange(round(2.0 * _ROUGH_LENGTH / _CELL) + 1) - _ROUGH_LENGTH
    heights = np.take(tile, np.arange(len(along)) % count[0], axis=1)
    heights *= scenario.ground_roughness / tile.std()
    return np.asarray(heights * np.clip(np.abs(along) / _LEVEL - 1.0, 0.0, 1.0))


def _add_heights(spec: mujoco.MjSpec, heights: Array) -> mujoco.MjsGeom:
    """Ground of some heights, about the origin."""
    low, high = float(heights.min()), float(heights.max())
    rows, columns = heights.shape
    size = [_ROUGH_LENGTH, _ROUGH_WIDTH, high - low, 1.0]  # the last: how deep it goes
    data = ((heights - low) / (high - low)).astype(np.float32).ravel()
    field = spec.add_hfield(name="rough", nrow=rows, ncol=columns, size=size, userdata=data)
    kind = mujoco.mjtGeom.mjGEOM_HFIELD
    return spec.worldbody.add_geom(type=kind, hfieldname=field.name, pos=[0, 0, low])


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
