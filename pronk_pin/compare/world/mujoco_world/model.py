"""Model of the simulated robot in MuJoCo, from the same URDF, with the scenario's mismatches.

With base `locked` the trunk has two slides, x and z, as in the paper (section III); with `sagittal`
a hinge for its pitch besides; with `free` the free joint of the model.
"""

from __future__ import annotations

import mujoco
import numpy as np

from ...._checks import instance_of, known_name, none_or
from ...._registry import imported
from ....control import Gains
from ....errors import InvalidInput
from ....robot import BASES, Robot, as_robot
from ....robot.formats import mujoco_spec
from ..scenario import Scenario
from .ground import add_ground, check_feet, name_feet
from .mjcf import mjcf_spec
from .payload import apply_payload


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
