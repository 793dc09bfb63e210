"""Terms that a model may lack: the generalised force of a unit of each along a motion.

Everything is linear: with the parameters theta of the terms,

    S tau(t - d) - rnea(q, v, a) + J^T lam = sum_i column_i(q, v, a, tau(t - d)) theta_i

where `rnea` is Pinocchio's inverse dynamics of the URDF, and tau(t - d) the torque that was
commanded d ago. The delay d of the motors alone is not linear: it has no column, and is looked for.
A term of one's own is a function of a `Motion` and a line in `TERMS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ..._typing import Array
from ...robot import JOINTS, NB, NOTHING, ModelParameters, Robot


class Motion(NamedTuple):
    """Recorded motion and torques at n instants, in Pinocchio's layout."""

    q: Array
    """Configurations, shape (n, 19)."""
    v: Array
    """Velocities, shape (n, 18)."""
    a: Array
    """Accelerations, shape (n, 18)."""
    sliding: Array
    """Joint velocities that friction acts on [rad/s], shape (n, 12)."""
    direction: Array
    """Their signs, from less noisy velocities, between -1 and 1, shape (n, 12)."""
    tau: Array
    """Torques that the motors were told, as late as they are [N m], shape (n, 12)."""


Column = Callable[[Robot, Motion], Array]


@dataclass(frozen=True)
class Term:
    """A term that the model may lack: one parameter, linear but for the delay.

    Attributes:
        name: Its name, as in tables.
        cause: The cause that it belongs to, for shares and figures.
        unit: Unit of its parameter.
        scale: Size that a robot of this kind could have; the estimate is drawn to zero, very
            weakly, in this measure.
        lower, upper: Bounds of the parameter.
        column: Generalised force of a unit of the parameter, shape (n, 18); None for the delay.
        advice: Which experiment would tell it from others.
        of_torque: Whether the column depends on `Motion.tau`, and so on the delay.
    """

    name: str
    cause: str
    unit: str
    scale: float
    lower: float
    upper: float
    column: Column | None
    advice: str
    of_torque: bool = False


def _of_joints(values: Array, robot: Robot, kind: int) -> Array:
    """Joint torques (n, 12) of one kind of joint, as generalised forces (n, 18)."""
    force = np.zeros((len(values), robot.nv))
    force[:, NB:] = np.where(robot.joint_kinds == kind, values, 0.0)
    return force


def _armature(robot: Robot, motion: Motion, kind: int) -> Array:
    return _of_joints(motion.a[:, NB:], robot, kind)


def _damping(robot: Robot, motion: Motion, kind: int) -> Array:
    return _of_joints(motion.sliding, robot, kind)


def _coulomb(robot: Robot, motion: Motion, kind: int) -> Array:
    return _of_joints(motion.direction, robot, kind)


def _trunk(robot: Robot, motion: Motion, parameter: int) -> Array:
    """Of one of the trunk's inertial parameters, by Pinocchio's regressor of a body."""
    force = np.zeros((len(motion.q), robot.nv))
    gravity = robot.model.gravity
    for out, q, v, a in zip(force, motion.q, motion.v, motion.a, strict=True):
        # The trunk is the root: what it needs is felt by the base alone, in its own frame.
        pose = pin.XYZQUATToSE3(q[: NB + 1])
        fall = pin.Motion(a[:NB]) - pose.actInv(gravity)
        out[:NB] = pin.bodyRegressor(pin.Motion(v[:NB]), fall)[:, parameter]
    return force


def _weakness(robot: Robot, motion: Motion) -> Array:
    force = np.zeros((len(motion.q), robot.nv))
    force[:, NB:] = motion.tau
    return force


LONGEST_DELAY = 0.02
"""Longest delay of the motors that is looked for [s]."""
_LEAST_PAYLOAD = 0.1
"""Load below which the trunk's moments are its own [kg]."""

_SWING = "swing the legs in the air, slowly and fast"
_LIFT = "let the robot fly longer, or hang its trunk up and swing the legs: then no weight acts"
_PITCH = "let the trunk pitch (a free or a sagittal base)"
_STEPS = "command steps of torque in the air"

TERMS: tuple[Term, ...] = (
    *(
        Term(
            f"{joint} armature",
            "armature",
            "kg m^2",
            0.02,
            0.0,
            0.2,
            partial(_armature, kind=kind),
            _SWING,
        )
        for kind, joint in enumerate(JOINTS)
    ),
    *(
        Term(
            f"{joint} damping",
            "damping",
            "N m s/rad",
            0.5,
            0.0,
            5.0,
            partial(_damping, kind=kind),
            _SWING,
        )
        for kind, joint in enumerate(JOINTS)
    ),
    *(
        Term(
            f"{joint} Coulomb",
            "Coulomb",
            "N m",
            0.5,
            0.0,
            5.0,
            partial(_coulomb, kind=kind),
            _SWING,
        )
        for kind, joint in enumerate(JOINTS)
    ),
    Term("payload", "load", "kg", 3.0, -10.0, 30.0, partial(_trunk, parameter=0), _LIFT),
    Term("trunk moment x", "load", "kg m", 0.3, -5.0, 5.0, partial(_trunk, parameter=1), _PITCH),
    Term("trunk moment z", "load", "kg m", 0.3, -5.0, 5.0, partial(_trunk, parameter=3), _PITCH),
    Term("weak motors", "weak motors", "1", 0.2, -1.0, 0.8, _weakness, _LIFT, of_torque=True),
    Term("delay", "delay", "s", 0.005, 0.0, LONGEST_DELAY, None, _STEPS),
)
"""The terms that are looked for by default."""


_JOINT_TERMS = {"armature": "armature", "damping": "damping", "coulomb": "Coulomb"}
"""Fields of `ModelParameters` and `Scenario`, and their terms, by the name after the joint's."""


def parameters(values: Mapping[str, float], robot: Robot) -> ModelParameters:
    """Convert the terms' parameters to those that `Robot.with_parameters` takes.

    Only of the terms that are given: the load sits where `ModelParameters` has it by default if its
    moments are not, and without a load the moments shift the trunk's own centre of mass. A delay
    is none of the model's.

    Args:
        values: Parameters by the name of their term.
        robot: The robot as its URDF has it.
    """
    by_joint = {
        field: tuple(values.get(f"{joint} {name}", 0.0) for joint in JOINTS)
        for field, name in _JOINT_TERMS.items()
    }
    payload = values.get("payload", 0.0)
    moment = np.array([values.get(f"trunk moment {axis}", 0.0) for axis in "xyz"])
    place, shift = NOTHING.payload_position, NOTHING.trunk_shift
    if moment.any():
        carries = abs(payload) > _LEAST_PAYLOAD
        mass = payload if carries else float(robot.model.inertias[1].mass)
        x, y, z = (moment / mass).tolist()
        place, shift = ((x, y, z), shift) if carries else (place, (x, y, z))
    return ModelParameters(
        **by_joint,
        payload=payload,
        payload_position=place,
        trunk_shift=shift,
        torque_constant=1.0 - values.get("weak motors", 0.0),
    )
