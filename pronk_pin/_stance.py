"""Contact forces that keep feet at rest: Pinocchio's solver, and a dense one for singular stances.

Both are written for one checked state, with the legs by index.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ._contacts import bias_at, jacobian_at
from ._typing import Array
from .kinematics import foot_positions
from .robot import NB, Robot

_SINGULAR = 1e-10
"""Relative eigenvalue of J M^-1 J^T below which a stance counts as singular."""
_SUSPECT = 1e-7
"""Relative pivot of its factorisation below which the eigenvalues are worth computing."""
_DAMPING = 1e-6
"""Damping of singular directions, relative to the largest eigenvalue."""


class Baumgarte(NamedTuple):
    """Gains that pull drifting feet back: c_ddot = -kd c_dot - kp (height of foot - its radius) z.

    Sideways there is no place to return to, only a velocity to lose.
    """

    kp: float
    """Gain of the foot's height over the ground z = 0 [1/s^2]."""
    kd: float
    """Gain of the contact point's velocity [1/s]."""


class Accelerations(NamedTuple):
    """Motion and forces of one state in stance."""

    a: Array
    """Generalised acceleration, shape (18,)."""
    lam: Array
    """Contact forces in the world's axes [N], shape (3 feet,)."""
    singular: bool
    """Whether the contacts do not determine the forces."""


class Response(NamedTuple):
    """What contact forces or impulses do to the feet."""

    lam: Array
    """Forces or impulses, shape (3 feet,)."""
    motion: Array
    """The change they make to the generalised acceleration or velocity, shape (18,)."""
    singular: bool
    """Whether the contacts do not determine them."""


class PointStance:
    """Stance on point contacts by `pinocchio.constraintDynamics`, with memory set up once.

    Args:
        robot: The robot.
        legs: Legs in contact.
    """

    def __init__(self, robot: Robot, legs: tuple[int, ...]) -> None:
        self._model = robot.model
        self._data = robot.model.createData()
        self._settings = pin.ProximalSettings(1e-12, 0.0, 1)  # no damping, so one pass is exact
        self._contacts = pin.StdVec_RigidConstraintModel()
        self._forces = pin.StdVec_RigidConstraintData()
        for leg in legs:
            frame = self._model.frames[robot.foot_ids[leg]]
            contact = pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D,
                self._model,
                frame.parentJoint,
                frame.placement,
                pin.LOCAL_WORLD_ALIGNED,
            )
            self._contacts.append(contact)
            self._forces.append(contact.createData())
        pin.initConstraintDynamics(self._model, self._data, self._contacts, self._forces)

    def solve(self, q: Array, v: Array, force: Array) -> Accelerations:
        """Accelerations under a generalised force (18,); `singular` is a suspicion only."""
        a = pin.constraintDynamics(
            self._model, self._data, q, v, force, self._contacts, self._forces, self._settings
        )
        lam = np.concatenate([item.contact_force.linear for item in self._forces])
        pivots = np.abs(self._data.constraint_chol.D[: len(lam)])
        # NaN fails the comparison, and so counts as suspect.
        regular = pivots.min() > _SUSPECT * pivots.max()
        return Accelerations(np.array(a), lam, not regular)


@lru_cache(maxsize=64)
def point_stance(robot: Robot, legs: tuple[int, ...]) -> PointStance:
    """The solver of a robot and its stance legs, made once."""
    return PointStance(robot, legs)


def stance_accelerations(
    robot: Robot,
    state: tuple[Array, Array, Array],
    legs: tuple[int, ...],
    radius: float,
    gains: Baumgarte,
) -> Accelerations:
    """Accelerations of a state (q, v, tau) with the contact points at rest, or returning to it."""
    q, v, tau = state
    force = np.concatenate([np.zeros(NB), tau])
    # constraintDynamics of Pinocchio 4.1 knows no rolling and disregards wanted accelerations.
    if legs and radius == 0.0 and not any(gains):
        solution = point_stance(robot, legs).solve(q, v, force)
        if not solution.singular:
            return solution
    jacobian = jacobian_at(robot, q, legs, radius)
    target = -gains.kd * (jacobian @ v)
    target[2::3] -= gains.kp * (foot_positions(robot, q)[list(legs), 2] - robot.foot_radius)
    free = np.array(pin.aba(robot.model, robot.data, q, v, force))
    wanted = target - bias_at(robot, q, v, legs, radius) - jacobian @ free
    lam, motion, singular = contact_response(robot, q, jacobian, wanted)
    return Accelerations(free + motion, lam, singular)


def contact_response(robot: Robot, q: Array, jacobian: Array, wanted: Array) -> Response:
    """Forces that change the contact points' acceleration (or velocity) by `wanted` (3 feet,).

    Directions in which the contacts cannot move, or push against each other, get the damped
    least-squares answer of J M^-1 J^T lam = wanted; all others the exact one.
    """
    mass = np.array(pin.crba(robot.model, robot.data, q))
    spread = np.linalg.solve(mass, jacobian.T)  # (18, 3 feet)
    values, vectors = np.linalg.eigh(jacobian @ spread)
    largest = values.max(initial=0.0)
    weak = values <= _SINGULAR * largest
    gains = np.where(
        weak,
        values / (values**2 + (_DAMPING * largest) ** 2 + np.finfo(float).tiny),
        1.0 / np.where(weak, 1.0, values),
    )
    lam = vectors @ (gains * (vectors.T @ wanted))
    return Response(lam, spread @ lam, bool(weak.any()))
