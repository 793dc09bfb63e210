"""Similarity: what is not known of a robot, scaled from the A1 by its size.

With the mass m that a leg carries and its length l over the A1's, and the same gravity, robots that
move alike (at equal Froude numbers) do so in times that go with `l^(1/2)`, with torques that go
with `m l`:

    stiffness, Coulomb friction ~ m l,   damping ~ m l^(3/2),   rotor inertia ~ m l^2

and their trunks rise in proportion to the height at which they stand.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ..errors import InvalidInput
from .robot import JOINTS, Robot, load_robot

Leg = tuple[float, float, float]
"""A value for each joint of a leg: hip, thigh, calf."""


class Size(NamedTuple):
    """Size of a robot."""

    mass: float
    """Mass that a leg carries: the robot's over the number of its legs [kg]."""
    leg: float
    """Length of its legs, thigh and calf, the mean of all [m]."""
    height: float
    """Height of its trunk's origin when it stands [m]."""


def size(robot: Robot) -> Size:
    """The size of a robot.

    Raises:
        InvalidInput: It has no legs of three joints.
    """
    if len(robot.spec.joints) != len(JOINTS):
        raise InvalidInput(
            f"{robot.name} has legs of {len(robot.spec.joints)} joints; what its RobotSpec leaves "
            "out is scaled for hip, thigh and calf only: give kp, kd and apex there"
        )
    model, lengths = robot.model, []
    for leg, foot in zip(robot.legs, robot.foot_ids, strict=True):
        calf = model.jointPlacements[model.getJointId(robot.spec.leg_joints(leg)[-1])].translation
        shank: pin.SE3 = model.frames[foot].placement
        lengths.append(float(np.linalg.norm(calf) + np.linalg.norm(shank.translation)))
    bare = robot.bare or robot
    return Size(bare.mass / len(robot.legs), float(np.mean(lengths)), float(robot.standing[2]))


class MotorConstants(NamedTuple):
    """What the motors of a leg add to its joints, as far as a URDF leaves it out."""

    rotors: Leg
    """Rotor inertia as the joints feel it, through the gear [kg m^2]."""
    damping: Leg
    """Viscous friction [N m s/rad]."""
    coulomb: Leg
    """Coulomb friction [N m]."""


def feedback_gains(robot: Robot) -> tuple[Leg, Leg]:
    """Feedback gains of a leg, kp [N m/rad] and kd [N m s/rad], or the A1's, scaled.

    Raises:
        InvalidInput: They are not given, and legs of other than three joints cannot be scaled.
    """
    return _given_or_scaled(robot, "kp", 1.0), _given_or_scaled(robot, "kd", 1.5)


def motor_constants(robot: Robot) -> MotorConstants:
    """The motors of a leg as its specification has them, or the A1's, scaled.

    Raises:
        InvalidInput: As `feedback_gains`.
    """
    return MotorConstants(
        _given_or_scaled(robot, "rotors", 2.0),
        _given_or_scaled(robot, "damping", 1.5),
        _given_or_scaled(robot, "coulomb", 1.0),
    )


def length_scale(robot: Robot) -> float:
    """Lengths of a robot's gaits over the A1's.

    That of the apex where its specification names one, of the standing heights otherwise.
    """
    reference = load_robot("a1")
    known, standard = robot.spec.apex, reference.spec.apex
    if known is not None and standard is not None:
        return known / standard
    return float(robot.standing[2] / reference.standing[2])


def arrow_scale(robot: Robot) -> float:
    """Lengths of drawn forces [m/N] over those of the A1: by the robot's size, and its weight."""
    return length_scale(robot) * load_robot("a1").mass / robot.mass


def torque_scale(robot: Robot) -> float:
    """Torques of a robot's joints over the A1's, as its gains are over those: the calf's."""
    return feedback_gains(robot)[0][-1] / feedback_gains(load_robot("a1"))[0][-1]


def scaled_length(robot: Robot, length: float) -> float:
    """A length of the A1's gaits [m], scaled to a robot, to whole millimetres."""
    return round(length_scale(robot) * length, 3)


def scaled_duration(robot: Robot, duration: float) -> float:
    """A duration of the A1's gaits [s], scaled to a robot, to whole milliseconds."""
    return round(math.sqrt(length_scale(robot)) * duration, 3)


@lru_cache(maxsize=256)
def _given_or_scaled(robot: Robot, name: str, power: float) -> Leg:
    """A field of the specification, or the A1's times the mass and a power of the leg length."""
    given = getattr(robot.spec, name)
    if not given:
        reference = load_robot("a1")
        own, its = size(robot), size(reference)
        factor = own.mass / its.mass * (own.leg / its.leg) ** power
        given = tuple(float(f"{factor * value:.3g}") for value in getattr(reference.spec, name))
    hip, thigh, calf = given
    return hip, thigh, calf
