"""Whole-body QP: the accelerations of computed torque, as far as cones and limits let it.

    minimise    |a - a_d|^2_M + weight |tau|^2
    subject to  M a + h = S^T tau + J^T lam
                J a + sigma = 0             at feet that stand
                lam_l in the friction cone of each of these feet
                |tau| <= tau_max

Its tasks are weighted by the mass matrix, as a body itself weights them (Gauss's principle of least
constraint). Where neither cones nor limits bind, its torques are those of computed torque: then the
closed form is the answer, and only the others are solved, by DAQP, a dual active-set method, which
gives the same to the bit each time. Where there is no solution (no torques keep the feet down),
computed torque's are played, within the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np

from ..._checks import Interval, keep_reals
from ..._typing import Array, BoolArray
from ...inverse_dynamics import cone_sides
from ..signals import ControlContext
from .computed_torque import ComputedTorque, ComputedTorqueControl, State
from .level_robot import TRUNK, LevelRobot, cheapest_forces
from .tick_controller import TickController

_TORQUE_WEIGHT = 1e-6
"""Cost of torques against missed accelerations [1/(kg m^2)]: it decides among internal forces."""
_FORCE_WEIGHT = 1e-6
"""Cost of forces against torques [m^2], as in `inverse_dynamics`."""
_ACCURACY = 1e-6
"""Violation of cones and limits that passes [N, N m]."""
_UNBOUNDED = 1e30
_INEQUALITY, _EQUALITY, _SOLVED = 0, 5, 1
"""DAQP's words."""


@dataclass(frozen=True)
class WholeBodyQP(ComputedTorque):
    """Settings of a whole-body QP: those of `ComputedTorque`, and the ground's friction.

    Attributes:
        friction: Coefficient of friction that it reckons with.
    """

    friction: float = 0.6

    def __post_init__(self) -> None:
        super().__post_init__()
        keep_reals(self, {"friction": Interval(0, 10, above=True)}, "whole-body QP: ")

    def bind(self, context: ControlContext) -> TickController:
        """See `ComputedTorque.bind`."""
        return WholeBodyQPControl(self, context)


class WholeBodyQPControl(ComputedTorqueControl):
    """Whole-body QP of n robots; arguments and errors are those of `ComputedTorqueControl`.

    Attributes:
        solved: How many QPs were solved, of so many that the closed form did not answer.
    """

    def __init__(self, settings: WholeBodyQP, context: ControlContext) -> None:
        super().__init__(settings, context)
        self._friction = settings.friction
        self._sides = cone_sides(settings.friction, self.model.legs)
        self.solved = np.zeros(2, dtype=np.intp)

    def joint_torque(self, wanted: Array, state: State) -> Array:
        """See `ComputedTorqueControl`; here within cones and limits."""
        torque, model = super().joint_torque(wanted, state), self.model
        limit = model.robot.parameters.torque_constant * model.robot.tau_max
        binds = (np.abs(torque) > limit + _ACCURACY).any(axis=1)
        if state.levers is not None:
            terms = Terms.of(model, wanted, state, state.levers)
            binds |= (terms.consistent_forces() @ self._sides.T > _ACCURACY).any(axis=1)
        elif binds.any():
            terms = Terms.of(model, wanted, state, model.levers(state.joints))
        for k in np.flatnonzero(binds):
            answer = solve(terms, int(k), self._friction, limit)
            self.solved += [answer is not None, 1]
            torque[k] = torque[k] if answer is None else answer
        return torque


@dataclass(frozen=True)
class Terms:
    """Terms of the equations of m robots.

    Attributes:
        mass: M, shape (m, 14, 14).
        rest: h, shape (m, 14).
        jacobian: J of all feet, shape (m, 12, 14).
        bias: sigma, shape (m, 12).
        wanted: a_d, shape (m, 14).
        levers: See `LevelRobot.levers`, shape (m, legs, 3, 3).
        standing: Which feet stand, shape (m, legs).
    """

    mass: Array
    rest: Array
    jacobian: Array
    bias: Array
    wanted: Array
    levers: Array
    standing: BoolArray

    @classmethod
    def of(cls, model: LevelRobot, wanted: Array, state: State, levers: Array) -> Terms:
        """The terms at states."""
        joints, rates = state.joints, state.rates
        return cls(
            model.mass_matrix(joints),
            model.forces(joints, rates, np.zeros_like(wanted)),
            model.jacobian(levers),
            model.bias(joints, rates),
            wanted,
            levers,
            state.standing,
        )

    def consistent_forces(self) -> Array:
        """Contact forces of computed torque with feet at rest, without cones [N], shape (m, 12).

        Those of the wanted acceleration, and what the ground adds to keep the feet where they are.
        """
        stands = np.repeat(self.standing, 3, axis=1)
        needed = (self.mass @ self.wanted[..., None])[..., 0] + self.rest
        force = cheapest_forces(self.levers, needed, self.standing).reshape(stands.shape)
        jacobian = self.jacobian * stands[..., None]
        spread = np.linalg.solve(self.mass, np.swapaxes(jacobian, -1, -2))  # (m, 14, 12)
        delassus = jacobian @ spread
        # Directions in which straight legs cannot move the foot are let go, by damping.
        delassus += np.where(stands, 1e-9, 1.0)[..., None] * np.eye(stands.shape[1])
        slip = (jacobian @ self.wanted[..., None])[..., 0] + self.bias * stands
        return np.asarray(force - np.linalg.solve(delassus, slip[..., None])[..., 0])


def solve(terms: Terms, k: int, friction: float, limit: Array) -> Array | None:
    """Solve the QP of one robot for its joint torques [N m], (12,); None without a solution.

    Unknowns are the 14 accelerations and the forces of the feet that stand.
    """
    mass, rest, wanted = terms.mass[k], terms.rest[k], terms.wanted[k]
    stands = np.repeat(terms.standing[k], 3)
    jacobian, bias = terms.jacobian[k][stands], terms.bias[k][stands]
    size, forces = len(rest), len(bias)
    # Forces of trunk and joints over the unknowns: [M, -J^T] y + h
    balance = np.hstack([mass, -jacobian.T])
    torque = balance[TRUNK:]
    hessian = _TORQUE_WEIGHT * torque.T @ torque
    hessian[:size, :size] += mass
    hessian[size:, size:] += _TORQUE_WEIGHT * _FORCE_WEIGHT * np.eye(forces)
    gradient = _TORQUE_WEIGHT * torque.T @ rest[TRUNK:]
    gradient[:size] -= mass @ wanted
    sides = cone_sides(friction, forces // 3)
    constraints = np.vstack(
        [
            balance[:TRUNK],
            np.hstack([jacobian, np.zeros((forces, forces))]),
            np.hstack([np.zeros((len(sides), size)), sides]),
            torque,
        ]
    )
    equal = np.concatenate([-rest[:TRUNK], -bias])
    upper = np.concatenate([equal, np.zeros(len(sides)), limit - rest[TRUNK:]])
    lower = np.concatenate([equal, np.full(len(sides), -_UNBOUNDED), -limit - rest[TRUNK:]])
    sense = np.full(len(upper), _INEQUALITY, dtype=np.int32)
    sense[: len(equal)] = _EQUALITY
    solution, _, status, _ = daqp.solve(hessian, gradient, constraints, upper, lower, sense)
    return np.asarray(torque @ solution + rest[TRUNK:]) if status == _SOLVED else None
