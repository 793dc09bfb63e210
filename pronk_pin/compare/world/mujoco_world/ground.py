"""The ground of a world: level, stepped or rough, the feet that meet it, and their friction."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
from scipy.ndimage import gaussian_filter

from ...._typing import Array
from ....errors import InvalidInput
from ....robot import Robot
from ..scenario import Scenario

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

_AS_LOW = 1e-4
"""Height above a standing foot's lowest point within which other shapes bear weight, too [m]."""


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


def check_feet(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Check that the feet of the robot's own URDF are as large as the robot says.

    Raises:
        InvalidInput: They are not.
    """
    for foot in robot.foot_names:
        radius = float(spec.geom(foot).size[0])
        if abs(radius - robot.foot_radius) > 1e-9:
            raise InvalidInput(
                f"{robot.name}: foot_radius is {robot.foot_radius:g} m, and the collision sphere "
                f"of foot {foot} has {radius:g} m; leave foot_radius out of the RobotSpec, or "
                "correct one of them"
            )


def name_feet(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Name the sphere that each foot stands on; one of our own where the robot has a mesh instead.

    It is sought in all that is welded to the last link of a leg, about where the robot's foot is.

    Args:
        spec: The robot, with its joints named as `robot.joint_names`.
        robot: The robot.

    Raises:
        InvalidInput: The robot would not stand on it, as something else of that link is as low.
    """
    model = spec.compile()
    zero, stands = (
        _posed(model, robot, angles) for angles in (np.zeros(robot.nu), robot.standing[-robot.nu :])
    )
    axes = zero.xmat[model.body(robot.spec.base_link).id].reshape(3, 3)
    solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    bearer = model.body_weldid[model.geom_bodyid]
    for leg, foot, centre in zip(robot.legs, robot.foot_names, _foot_centres(robot), strict=True):
        joint = model.joint(robot.spec.leg_joints(leg)[-1])
        calf = int(joint.bodyid[0])
        shapes = np.flatnonzero(solid & (bearer == calf))
        spheres = shapes[model.geom_type[shapes] == mujoco.mjtGeom.mjGEOM_SPHERE]
        place = zero.xanchor[joint.id] - zero.xpos[calf] + axes @ centre  # from the calf's origin
        apart = np.linalg.norm(zero.geom_xpos[spheres] - zero.xpos[calf] - place, axis=1)
        # One that is farther from the foot than half the link is of a knee, say.
        near = spheres[apart <= max(robot.foot_radius, 0.5 * float(np.linalg.norm(centre)))]
        in_calf = zero.xmat[calf].reshape(3, 3).T @ place
        if len(near):
            index = int(near[np.argmin(apart[np.isin(spheres, near)])])
            geom = next(each for each in spec.geoms if each.id == index)
            lowest = stands.geom_xpos[index, 2] - model.geom_size[index, 0]
            shapes = shapes[shapes != index]
        else:
            geom = spec.joint(joint.name).parent.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                pos=in_calf,
                size=[robot.foot_radius, 0, 0],
                mass=0,
            )
            height = stands.xpos[calf, 2] + stands.xmat[calf].reshape(3, 3)[2] @ in_calf
            lowest = height - robot.foot_radius
        for other in spec.geoms:
            other.name = "" if other.name == foot else other.name
        geom.name = foot
        other_low = min((_bottom(model, stands, int(other)) for other in shapes), default=np.inf)
        if other_low <= lowest + _AS_LOW:
            raise InvalidInput(
                f"{robot.name} would not stand on the sphere of foot {foot} alone: another shape "
                f"of its link is {1e3 * (lowest - other_low):.1f} mm lower; take that away, or "
                "correct foot_pattern, foot_radius or standing of the RobotSpec"
            )


def _posed(model: mujoco.MjModel, robot: Robot, angles: Array) -> mujoco.MjData:
    """The robot with its trunk level and its joints at some angles, shape (12,)."""
    data = mujoco.MjData(model)
    for name, angle in zip(robot.joint_names, angles, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_kinematics(model, data)
    return data


def _foot_centres(robot: Robot) -> list[Array]:
    """Centres of the feet from the joints that move them, in the trunk's axes at zero angles."""
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, pin.neutral(robot.model))
    frames = [robot.model.frames[foot] for foot in robot.foot_ids]
    return [data.oMi[frame.parentJoint].rotation @ frame.placement.translation for frame in frames]


def _bottom(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Height of the lowest point of a shape [m]."""
    down = data.geom_xmat[geom].reshape(3, 3)[2]  # the vertical, in the shape's axes
    x, y, z = model.geom_size[geom]
    half = {
        mujoco.mjtGeom.mjGEOM_SPHERE: x,
        mujoco.mjtGeom.mjGEOM_CAPSULE: x + y * abs(down[2]),
        mujoco.mjtGeom.mjGEOM_CYLINDER: x * np.hypot(down[0], down[1]) + y * abs(down[2]),
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: np.linalg.norm(down * [x, y, z]),
        mujoco.mjtGeom.mjGEOM_BOX: np.abs(down) @ [x, y, z],
    }.get(mujoco.mjtGeom(model.geom_type[geom]), model.geom_rbound[geom])
    return float(data.geom_xpos[geom, 2] - half)
