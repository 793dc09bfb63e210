"""How nearly a gait in its Bezier form obeys the equations of motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ..dynamics import Contact, contact_jacobian
from ..robot import NB, Robot
from .gait import Gait
from .problem import Base
from .reintegration import guided_rows


class GaitResidual(NamedTuple):
    """What is missing in the equations of motion (2), where it is most."""

    force: float
    """Along the trunk's x and z [N]."""
    moment: float
    """In the joints, and about the trunk's pitch where it is free [N m]."""
    height: float
    """Distance of the standing feet from the ground [m]."""


def gait_residual(
    robot: Robot,
    gait: Gait,
    *,
    contact: Contact = "rolling",
    base: Base = "locked",
    samples: int = 41,
) -> GaitResidual:
    """Put a gait's motion, torques and contact forces into the equations of motion.

    Args:
        robot: The robot.
        gait: The gait.
        contact: How its feet stand.
        base: How the trunk may move; what a guide holds it by is not missing.
        samples: Phases at which to look, in each phase of the gait.
    """
    rows = guided_rows(robot, base)
    force = moment = height = 0.0
    for phase in gait.phases:
        motion = phase.motion(robot, np.linspace(0.0, 1.0, samples))
        standing = [robot.foot_ids[robot.legs.index(leg)] for leg in phase.feet]
        for q, v, a, tau, lam in zip(
            motion.q, motion.v, motion.a, motion.tau, motion.lam, strict=True
        ):
            missing = pin.rnea(robot.model, robot.data, q, v, a).copy()
            missing -= contact_jacobian(robot, q, contact=contact).T @ lam.ravel()
            missing[NB:] -= tau
            force = max(force, float(np.max(np.abs(missing[rows[:2]]))))
            moment = max(moment, float(np.max(np.abs(missing[rows[2:]]))))
            pin.framesForwardKinematics(robot.model, robot.data, q)
            for foot in standing:
                above = robot.data.oMf[foot].translation[2] - robot.foot_radius
                height = max(height, abs(float(above)))
    return GaitResidual(force, moment, height)
