"""One phase of a motion, flight or stance, integrated under given torques."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from ._contacts import jacobian_at
from ._stance import Baumgarte, StanceDynamics, stance_accelerations
from ._state import as_array
from ._typing import Array
from .errors import IntegrationFailed, InvalidInput
from .kinematics import foot_positions
from .robot import NB, Robot

_EVALUATIONS = 300_000
"""Evaluations of the dynamics after which the motion counts as hopeless; a stride takes 1,000."""

Torque = Callable[[float], Array]
"""Motor torques [N m], shape (12,), at a time since the start [s]."""


def sampled_torque(robot: Robot, tau: npt.ArrayLike, duration: float) -> Torque:
    """Torques as a function of time, from one (12,) or from samples at even times (m, 12).

    Raises:
        InvalidInput: A wrong shape or NaN.
    """
    array = as_array("tau", tau, robot.nu, None)
    if array.ndim == 1:
        return lambda t: array
    if array.ndim > 2 or len(array) < 2:
        raise InvalidInput(
            f"tau has shape {array.shape}; give one, ({robot.nu},), two or more samples, "
            f"(m, {robot.nu}), or a function of time"
        )
    times = np.linspace(0.0, duration, len(array))
    return make_interp_spline(times, array, k=1)  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False)
class PhaseSimulation:
    """A simulated phase, sampled.

    Attributes:
        t: Times since the start [s], shape (n,).
        q: Configurations, shape (n, 19).
        v: Velocities, shape (n, 18).
        a: StanceDynamics, shape (n, 18).
        tau: Motor torques [N m], shape (n, 12).
        lam: Contact forces in the world's axes [N], shape (n, 3 feet).
        foot_drift: How far a standing foot strays from where it stood [m]; of a rolling foot the
            change of its height.
        contact_speed: Greatest speed of a contact point that should be at rest [m/s].
        energy_drift: Greatest change of the mechanical energy that is not the motors' work [J].
            Contacts at rest do no work, so this is the error of the integration.
        singular: Whether the contacts left the forces undetermined somewhere, see
            `StanceDynamics`.
    """

    t: Array
    q: Array = field(repr=False)
    v: Array = field(repr=False)
    a: Array = field(repr=False)
    tau: Array = field(repr=False)
    lam: Array = field(repr=False)
    foot_drift: float
    contact_speed: float
    energy_drift: float
    singular: bool


@dataclass(frozen=True, eq=False)
class PhaseProblem:
    """What `integrate` integrates, all of it checked.

    Attributes:
        robot: The robot.
        torque: The motor torques.
        legs: Legs in contact, by index; none in flight.
        radius: Distance from the foot's centre to the contact point [m].
        gains: Gains that pull drifting feet back.
    """

    robot: Robot
    torque: Torque
    legs: tuple[int, ...]
    radius: float
    gains: Baumgarte

    def tau(self, t: float) -> Array:
        """Motor torques at a time [N m], shape (12,)."""
        return as_array("tau(t)", self.torque(t), self.robot.nu, ())

    def accelerations(self, q: Array, v: Array, tau: Array) -> StanceDynamics:
        """Acceleration and contact forces."""
        return stance_accelerations(self.robot, (q, v, tau), self.legs, self.radius, self.gains)

    def rate(self, t: float, y: Array) -> Array:
        """Time derivative of y = [q, v, work of the motors]."""
        nq, nv = self.robot.nq, self.robot.nv
        q, v, tau = _normalized(y[:nq]), y[nq : nq + nv], self.tau(t)
        out = np.empty_like(y)
        x, y_, z, w = q[3:7]
        # The quaternion turns with the angular velocity of the base in its own frame:
        # d/dt quat = quat * (omega, 0) / 2.
        spread = 0.5 * np.array([[w, -z, y_], [z, w, -x], [-y_, x, w], [-x, -y_, -z]])
        out[:3] = pin.Quaternion(w, x, y_, z).matrix() @ v[:3]
        out[3:7] = spread @ v[3:NB]
        out[7:nq] = v[NB:]
        out[nq : nq + nv] = self.accelerations(q, v, tau).a
        out[-1] = tau @ v[NB:]
        return out


def integrate(
    problem: PhaseProblem, q: Array, v: Array, times: Array, tolerance: float
) -> PhaseSimulation:
    """Integrate from a state (q, v) by an adaptive Runge-Kutta method of order 8, sampled at times.

    Raises:
        IntegrationFailed: The steps became too small or too many.
    """
    robot, evaluations = problem.robot, itertools.count(1)

    def rate(t: float, y: Array) -> Array:
        if next(evaluations) > _EVALUATIONS:
            reason = f"{_EVALUATIONS} evaluations of the dynamics spent"
            raise IntegrationFailed(t, float(times[-1]), reason)
        return problem.rate(t, y)

    result = solve_ivp(
        rate,
        (0.0, float(times[-1])),
        np.concatenate([q, v, [0.0]]),
        method="DOP853",
        t_eval=times,
        rtol=tolerance,
        atol=tolerance,
    )
    if not result.success:
        reached = float(result.t[-1]) if len(result.t) else 0.0
        raise IntegrationFailed(reached, float(times[-1]), str(result.message))
    split = [robot.nq, robot.nq + robot.nv]
    positions, velocities, work = np.split(result.y.T, split, axis=1)
    positions = np.array([_normalized(row) for row in positions])
    torques = np.array([problem.tau(float(t)) for t in times])
    solved = [
        problem.accelerations(*state) for state in zip(positions, velocities, torques, strict=True)
    ]
    energy = np.array([_energy(robot, *state) for state in zip(positions, velocities, strict=True)])
    return PhaseSimulation(
        t=times,
        q=positions,
        v=velocities,
        a=np.array([item.a for item in solved]),
        tau=torques,
        lam=np.array([item.lam for item in solved]),
        foot_drift=_foot_drift(problem, positions),
        contact_speed=_contact_speed(problem, positions, velocities),
        energy_drift=float(np.abs(energy - energy[0] - work[:, 0]).max()),
        singular=any(bool(item.singular) for item in solved),
    )


def _normalized(q: Array) -> Array:
    """q with a unit quaternion; the integration keeps it one to its tolerance only."""
    q = q.copy()
    q[3:7] /= np.linalg.norm(q[3:7])
    return q


def _energy(robot: Robot, q: Array, v: Array) -> float:
    """Kinetic and potential energy [J]."""
    return float(pin.computeMechanicalEnergy(robot.model, robot.data, q, v))


def _foot_drift(problem: PhaseProblem, q: Array) -> float:
    feet = foot_positions(problem.robot, q)[:, list(problem.legs)]  # (n, feet, 3)
    moved = feet - feet[0]
    distance = moved[..., 2] if problem.radius else np.linalg.norm(moved, axis=-1)
    return float(np.abs(distance).max(initial=0.0))


def _contact_speed(problem: PhaseProblem, q: Array, v: Array) -> float:
    speed = [
        jacobian_at(problem.robot, q_row, problem.legs, problem.radius) @ v_row
        for q_row, v_row in zip(q, v, strict=True)
    ]
    by_foot = np.reshape(speed, (len(q), -1, 3))
    return float(np.linalg.norm(by_foot, axis=-1).max(initial=0.0))
