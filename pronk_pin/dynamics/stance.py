"""Stance dynamics: contact forces that keep feet at rest, also in singular stances.

By Pinocchio's solver, and a dense one for singular stances; both for one checked state, with the
legs by index.
"""

from __future__ import annotations

from functools import lru_cache
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import scipy.linalg

from .._typing import Array, BoolArray
from ..errors import InvalidInput
from ..kinematics import bias_at, foot_positions, jacobian_at
from ..robot import NB, REFUSALS, Robot, as_array, sound_base

_SINGULAR = 1e-10
"""Relative eigenvalue of J M^-1 J^T below which a stance counts as singular."""
_SUSPECT = 1e-7
"""Relative pivot of its factorisation below which the eigenvalues are worth computing."""
_DAMPING = 1e-6
"""Damping of singular directions, relative to the largest eigenvalue."""
_REGULAR, _SINGULAR_STANCE = np.bool_(False), np.bool_(True)


class Baumgarte(NamedTuple):
    """Baumgarte gains, which pull drifting feet back: `c_ddot = -kd c_dot - kp (h - radius) e_z`.

    h is the height of the foot's centre. Sideways there is no place to return to, only a velocity
    to lose.
    """

    kp: float
    """Gain of the foot's height over the ground z = 0 [1/s^2]."""
    kd: float
    """Gain of the contact point's velocity [1/s]."""


NO_GAINS = Baumgarte(0.0, 0.0)
"""Feet at rest, whatever has drifted."""


def baumgarte_gains(baumgarte: tuple[float, float] | None) -> Baumgarte:
    """Check the gains that a user gives.

    Raises:
        InvalidInput: Not two numbers, or negative ones.
    """
    if baumgarte is None:
        return NO_GAINS
    gains = Baumgarte(*as_array("baumgarte", baumgarte, 2, ()).tolist())
    if min(gains) < 0.0:
        raise InvalidInput(f"baumgarte={baumgarte}; both gains must be 0 or positive")
    return gains


class StanceDynamics(NamedTuple):
    """Acceleration and contact forces in stance."""

    a: Array
    """Generalised acceleration, shape (..., 18)."""
    lam: Array
    """Contact forces in the world's axes, foot by foot [N], shape (..., 3 feet)."""
    singular: BoolArray | np.bool_
    """Whether the contacts do not determine the forces (straight legs, redundant feet), so that
    lam is the damped least-squares answer, shape (...). The equations of motion hold even so."""


class Impact(NamedTuple):
    """Result of a collision of feet with the ground."""

    v: Array
    """Velocity after the impact, shape (18,)."""
    impulse: Array
    """Contact impulses in the world's axes, foot by foot [N s], shape (3 feet,)."""
    singular: np.bool_
    """Whether the contacts do not determine the impulses, see `StanceDynamics.singular`."""


class Response(NamedTuple):
    """Contact forces or impulses, and their effect on the motion."""

    lam: Array
    """Forces or impulses, shape (3 feet,)."""
    motion: Array
    """The change they make to the generalised acceleration or velocity, shape (18,)."""
    singular: np.bool_
    """Whether the contacts do not determine them."""


class PointStance:
    """Feet at rest as point contacts, by Pinocchio's own algorithms, with memory set up once.

    `pinocchio.constraintDynamics` and `impulseDynamics` factorise the whole of eq. (5) along the
    tree. Their answers for a singular stance mean nothing: where a pivot of the factorisation is
    suspiciously small, the callers ask `contact_response`.

    Args:
        robot: The robot.
        legs: Legs in contact.
    """

    def __init__(self, robot: Robot, legs: tuple[int, ...]) -> None:
        self._size = 3 * len(legs)
        self._model = model = robot.model
        self._data = data = model.createData()
        self._settings = pin.ProximalSettings(1e-12, 0.0, 1)  # no damping, so one pass is exact
        self._contacts = pin.StdVec_RigidConstraintModel()
        self._forces = pin.StdVec_RigidConstraintData()
        for leg in legs:
            frame = model.frames[robot.foot_ids[leg]]
            contact = pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D,
                model,
                frame.parentJoint,
                frame.placement,
                pin.LOCAL_WORLD_ALIGNED,
            )
            self._contacts.append(contact)
            self._forces.append(contact.createData())
        pin.initConstraintDynamics(model, data, self._contacts, self._forces)
        # Views into Pinocchio's memory, which stays where it is.
        self._lam, self._pivots = data.lambda_c, data.constraint_chol.D[: self._size]
        self._force = np.zeros(robot.nv)

    def solve(self, q: Array, v: Array, tau: Array) -> StanceDynamics:
        """Compute accelerations under motor torques (12,); `singular` is a suspicion only."""
        self._force[NB:] = tau
        a = pin.constraintDynamics(
            self._model,
            self._data,
            q,
            v,
            self._force,
            self._contacts,
            self._forces,
            self._settings,
        )
        return StanceDynamics(a, self._lam.copy(), self._suspicious())

    def quick(self, q: Any, v: Any, tau: Array) -> StanceDynamics | None:
        """Compute accelerations of an unchecked state, or None where anything looks odd."""
        try:
            if sound_base(q) and v.ndim == 1:
                solution = self.solve(q, v, tau)
                # NaN in any joint, velocity or torque shows in the base's acceleration.
                if not solution.singular and isfinite(solution.a.item(0)):
                    return solution
        except REFUSALS:
            pass
        return None

    def solve_all(self, q: Array, v: Array, tau: Array, out: tuple[Array, Array]) -> BoolArray:
        """Write accelerations and forces of n states into `out`; return which are suspicious."""
        force = np.zeros_like(v)
        force[:, NB:] = tau
        pivots = np.empty((len(q), self._size))
        model, data, lam, diagonal = self._model, self._data, self._lam, self._pivots
        contacts, forces, settings = self._contacts, self._forces, self._settings
        dynamics = pin.constraintDynamics
        rows = zip(q, v, force, out[0], out[1], pivots, strict=True)
        for q_row, v_row, force_row, a_out, lam_out, pivots_out in rows:
            a_out[:] = dynamics(model, data, q_row, v_row, force_row, contacts, forces, settings)
            lam_out[:] = lam
            pivots_out[:] = diagonal
        return np.asarray(~(pivots.max(axis=1) < _SUSPECT * pivots.min(axis=1)))

    def quick_impact(self, q: Any, v: Any, restitution: float) -> Impact | None:
        """Compute velocity and impulses of an unchecked state, or None where anything looks odd."""
        try:
            if sound_base(q) and v.ndim == 1:
                after = self._impact(q, v, restitution)
                if not after.singular and isfinite(sum(after.v.tolist())):
                    return after
        except REFUSALS:
            pass
        return None

    def _impact(self, q: Array, v: Array, restitution: float) -> Impact:
        after = pin.impulseDynamics(
            self._model,
            self._data,
            q,
            v,
            self._contacts,
            self._forces,
            restitution,
            self._settings,
        )
        return Impact(after, self._data.impulse_c.copy(), self._suspicious())

    def derivatives(self) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Derivatives of a and lam by q, v and tau: six blocks, of the state solved last."""
        blocks = pin.computeConstraintDynamicsDerivatives(
            self._model, self._data, self._contacts, self._forces, self._settings
        )
        a_q, a_v, a_force, lam_q, lam_v, lam_force = blocks
        return a_q, a_v, a_force[:, NB:], lam_q, lam_v, lam_force[:, NB:]

    def _suspicious(self) -> np.bool_:
        """Whether a pivot of the contacts, all negative, is next to nothing; NaN counts too."""
        pivots = self._pivots.tolist()
        return _REGULAR if max(pivots) < _SUSPECT * min(pivots) else _SINGULAR_STANCE


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
) -> StanceDynamics:
    """Accelerations of a state (q, v, tau) with the contact points at rest, or returning to it."""
    if legs and radius == 0.0 and gains == NO_GAINS:
        solution = point_stance(robot, legs).solve(*state)
        if not solution.singular:
            return solution
    # Pinocchio knows no rolling contact, and its Baumgarte gains pull to a fixed place.
    q, v, tau = state
    jacobian = jacobian_at(robot, q, legs, radius)
    target = -gains.kd * (jacobian @ v)
    if gains.kp:
        target[2::3] -= gains.kp * (foot_positions(robot, q)[list(legs), 2] - robot.foot_radius)
    free = pin.aba(robot.model, robot.data, q, v, np.concatenate([np.zeros(NB), tau]))
    residual = target - bias_at(robot, q, v, legs, radius) - jacobian @ free
    lam, motion, singular = contact_response(robot, q, jacobian, residual)
    return StanceDynamics(free + motion, lam, singular)


def contact_response(robot: Robot, q: Array, jacobian: Array, target: Array) -> Response:
    """Solve `J M^-1 J^T lam = wanted` for forces that change the contacts' acceleration.

    Or for impulses that change their velocity.

    `target` and the response have shape (3 feet,), or (3 feet, n) for n of them at once.

    Directions in which the contacts cannot move, or push against each other, get the damped
    least-squares solution; all others the exact one.
    """
    mass = pin.crba(robot.model, robot.data, q)
    spread = scipy.linalg.solve(mass, jacobian.T, assume_a="pos", check_finite=False)
    delassus = jacobian @ spread  # (3 feet, 3 feet)
    try:
        factor = scipy.linalg.cholesky(delassus, lower=True, check_finite=False)
        pivots = factor.diagonal()
        if pivots.min(initial=np.inf) ** 2 > _SUSPECT * pivots.max(initial=0.0) ** 2:
            lam = scipy.linalg.cho_solve((factor, True), target, check_finite=False)
            return Response(lam, spread @ lam, _REGULAR)
    except np.linalg.LinAlgError:
        pass
    values, vectors = np.linalg.eigh(delassus)
    largest = values.max(initial=0.0)
    weak = values <= _SINGULAR * largest
    gains = np.where(
        weak,
        values / (values**2 + (_DAMPING * largest) ** 2 + np.finfo(float).tiny),
        1.0 / np.where(weak, 1.0, values),
    )
    lam = (vectors * gains) @ (vectors.T @ target)
    return Response(lam, spread @ lam, np.bool_(weak.any()))
