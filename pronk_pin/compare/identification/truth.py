"""True parameters of the terms, from the world that the strides were simulated in."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
import xarray as xr

from ..._typing import Array
from ...errors import FileProblem, InvalidInput
from ...robot import JOINTS, Robot
from ..world import Scenario, build_model, mjcf_sha256


def truth(robot: Robot, scenario: Scenario) -> dict[str, float]:
    """The terms' true parameters by name: what the simulated robot has beyond its model.

    They are read from the world as it is simulated, whether its robot is the URDF's or that of an
    MJCF: of a kind of joint the mean over the legs, of the masses those of the trunk. Motors that
    differ are as weak as their mean, and besides that there is the truth of each kind, "calf weak
    motors" say.

    Args:
        robot: The robot as its URDF has it.
        scenario: Where it was simulated.

    Raises:
        FileProblem: The scenario's MJCF is not there.
        InvalidInput: The MJCF is of another robot.
    """
    world = build_model(robot, scenario)
    return {**_of_joints(robot, world), **_of_trunk(robot, world), **_of_motors(robot, scenario)}


def true_parameters(robot: Robot, strides: xr.Dataset) -> dict[str, float]:
    """The true parameters of strides, as far as they can be told from their attributes.

    Strides of a robot have none. An MJCF that is gone, or is not what it was, leaves those of the
    motors.
    """
    try:
        scenario = Scenario.from_json(strides.attrs["scenario_parameters"])
    except (KeyError, InvalidInput):
        return {}
    try:
        if scenario.mjcf:
            digest = mjcf_sha256(scenario.mjcf)
            if strides.attrs.get("mjcf_sha256", digest) != digest:
                return _of_motors(robot, scenario)
        return truth(robot, scenario)
    except (FileProblem, InvalidInput):
        return _of_motors(robot, scenario)


def _of_joints(robot: Robot, world: mujoco.MjModel) -> dict[str, float]:
    dofs = [world.joint(name).dofadr[0] for name in robot.joint_names]
    beyond = {
        "armature": world.dof_armature[dofs] - robot.model.armature[-robot.nu :],
        "damping": world.dof_damping[dofs] - robot.of_joint("damping"),
        "Coulomb": world.dof_frictionloss[dofs] - robot.of_joint("coulomb"),
    }
    return {key: v for name, values in beyond.items() for key, v in _by_kind(robot, name, values)}


def _by_kind(robot: Robot, name: str, values: Array) -> Iterator[tuple[str, float]]:
    """Means over the legs of values of each joint (12,), by the name of a term."""
    for kind, joint in enumerate(JOINTS):
        yield f"{joint} {name}", float(values[robot.joint_kinds == kind].mean())


def _of_trunk(robot: Robot, world: mujoco.MjModel) -> dict[str, float]:
    """Mass and first moments of the trunk, with all that is fixed to it."""
    data = mujoco.MjData(world)
    mujoco.mj_kinematics(world, data)
    trunk = world.body(robot.spec.base_link).id
    fixed = world.body_weldid == trunk
    mass = world.body_mass[fixed]
    moment = mass @ (data.xipos[fixed] - data.xpos[trunk])
    own = robot.model.inertias[1]
    beyond = np.append(mass.sum() - own.mass, moment - own.mass * own.lever)
    payload, x, _, z = (beyond.round(12) + 0.0).tolist()  # nothing is zero, not a last bit
    return {"payload": payload, "trunk moment x": x, "trunk moment z": z}


def _of_motors(robot: Robot, scenario: Scenario) -> dict[str, float]:
    """They are the scenario's, whatever the robot's own."""
    if isinstance(scenario.torque_constant, float):
        return {"weak motors": 1.0 - scenario.torque_constant, "delay": scenario.delay}
    weak = 1.0 - scenario.by_joint("torque_constant", robot)
    by_kind = dict(_by_kind(robot, "weak motors", weak))
    return {"weak motors": float(weak.mean()), **by_kind, "delay": scenario.delay}
