"""Residual of a gait's Bezier form in the equations of motion (2)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from .._checks import Interval, instance_of, known_name, whole
from .._typing import Array
from ..dynamics import planar_rows
from ..kinematics import Contact, contact_jacobian, foot_positions
from ..robot import BASES, NB, Base, Robot, as_robot
from .gait import Gait, Motion


class GaitResidual(NamedTuple):
    """Largest residuals in the equations of motion (2)."""

    force: float
    """Along the trunk's x and z, and y where it is free [N]."""
    moment: float
    """In the joints, and about the trunk's axes where it is free [N m]."""
    height: float
    """Distance of the standing feet from the ground [m]."""


def missing_forces(robot: Robot, motion: Motion, contact: Contact) -> Array:
    """Residual `M a + H v + G - S tau - J^T lam` of eq. (2) along a motion, shape (n, 18)."""
    missing = []
    for q, v, a, tau, lam in zip(motion.q, motion.v, motion.a, motion.tau, motion.lam, strict=True):
        force = pin.rnea(robot.model, robot.data, q, v, a).copy()
        force -= contact_jacobian(robot, q, contact=contact).T @ lam.ravel()
        force[NB:] -= robot.joint_torques(tau, v[NB:])
        missing.append(force)
    return np.array(missing)


def gait_residual(
    robot: Robot,
    gait: Gait,
    *,
    contact: Contact = "rolling",
    base: Base = "locked",
    samples: int = 41,
) -> GaitResidual:
    """Evaluate the residual of a gait's motion, torques and contact forces in eq. (2).

    Args:
        robot: The robot.
        gait: The gait.
        contact: How its feet stand.
        base: How the trunk may move; the planar constraint's forces are no residual.
        samples: Phases at which to look, in each phase of the gait.
    """
    as_robot(robot)
    instance_of("gait", gait, Gait)
    known_name("base", base, BASES)
    samples = whole("samples", samples, Interval(2, 100_000))
    rows = planar_rows(robot, base)
    forces = 3 if base == "free" else 2
    force = moment = height = 0.0
    for phase in gait.phases:
        motion = phase.motion(robot, np.linspace(0.0, 1.0, samples))
        missing = np.abs(missing_forces(robot, motion, contact)[:, rows])
        force = max(force, float(np.max(missing[:, :forces])))
        moment = max(moment, float(np.max(missing[:, forces:])))
        if phase.feet:
            legs = [robot.legs.index(leg) for leg in phase.feet]
            above = foot_positions(robot, motion.q)[:, legs, 2] - robot.foot_radius
            height = max(height, float(np.max(np.abs(above))))
    return GaitResidual(force, moment, height)
