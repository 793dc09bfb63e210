"""One phase of a motion, flight or stance, integrated under given torques."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline

from .._checks import Interval, real, whole
from .._typing import Array
from ..errors import IntegrationFailed, InvalidInput
from ..kinematics import Contact, contact_radius, foot_positions, jacobian_at
from ..robot import NB, Robot, as_array, as_one, as_state, leg_indices
from .energetics import kinetic_energy, potential_energy
from .stance import Baumgarte, StanceDynamics, baumgarte_gains, stance_accelerations

_EVALUATIONS = 300_000
"""Evaluations of the dynamics after which the motion counts as hopeless; a stride takes 1,000."""

Torque = Callable[[float], Array]
"""Motor torques [N m], shape (12,), at a time since the start [s]."""


def _sampled_torque(robot: Robot, tau: npt.ArrayLike, duration: float) -> Torque:
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
        a: Accelerations, shape (n, 18).
        tau: Motor torques [N m], shape (n, 12).
        lam: Contact forces in the world's axes [N], shape (n, 3 feet).
        foot_drift: How far a standing foot strays from where it stood [m]; of a rolling foot the
            change of its height.
        contact_speed: Greatest speed of a contact point that should be at rest [m/s].
        energy_drift: Greatest change of the mechanical energy that is not the motors' work, less
            what joint friction takes [J]. Contacts at rest do no work, so this is the error of the
            integration.
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
class _PhaseProblem:
    """The checked problem of one integration.

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
        tau = self.robot.joint_torques(tau, v[NB:])
        return stance_accelerations(self.robot, (q, v, tau), self.legs, self.radius, self.gains)

    def rate(self, t: float, y: Array) -> Array:
        """Time derivative of y = [q, v, work of the motors, less what friction takes]."""
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
        out[-1] = self.robot.joint_torques(tau, v[NB:]) @ v[NB:]
        return out


def simulate_phase(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike | Torque,
    *,
    duration: float,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
    baumgarte: tuple[float, float] | None = None,
    samples: int = 101,
    tolerance: float = 1e-11,
) -> PhaseSimulation:
    """Integrate flight or stance from a state under given torques, and report the drift.

    The contacts neither slip nor open nor close: a phase has one set of feet. Touchdown is
    `impact`, which also brings the feet to rest where the start has them moving.

    Args:
        robot: The robot.
        q: Configuration at the start, shape (19,).
        v: Velocity at the start, shape (18,).
        tau: Motor torques [N m]: constant, shape (12,); samples at even times from start to end,
            shape (m, 12), straight lines between; or a function of the time since the start [s].
        duration: How long the phase lasts [s].
        feet: Legs in contact; all if None, none if empty, which is flight.
        contact: "point" or "rolling", see `contact_jacobian`.
        baumgarte: Gains that pull drifting feet back, see `Baumgarte`; none if None.
        samples: Number of samples returned, start and end included, at least 2.
        tolerance: Relative and absolute tolerance of the integrator, DOP853.

    Raises:
        InvalidInput: A wrong shape, NaN, a quaternion that is not normalised, or a duration,
            number of samples or tolerance that makes no sense.
        UnknownName: There is no such leg or contact.
        IntegrationFailed: The integrator could not reach the end.
    """
    q, v = as_state(robot, q, v)
    as_one("q", q)
    duration = real("duration", duration, Interval(0.0, unit="s", above=True))
    samples = whole("samples", samples, Interval(2, 1_000_000))
    tolerance = real("tolerance", tolerance, Interval(0.0, 1.0, above=True, below=True))
    problem = _PhaseProblem(
        robot,
        tau if callable(tau) else _sampled_torque(robot, tau, duration),
        leg_indices(robot, feet),
        contact_radius(robot, contact),
        baumgarte_gains(baumgarte),
    )
    return _integrate(problem, q, v, np.linspace(0.0, duration, samples), tolerance)


def _integrate(
    problem: _PhaseProblem, q: Array, v: Array, times: Array, tolerance: float
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
    energy = kinetic_energy(robot, positions, velocities) + potential_energy(robot, positions)
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


def _foot_drift(problem: _PhaseProblem, q: Array) -> float:
    feet = foot_positions(problem.robot, q)[:, list(problem.legs)]  # (n, feet, 3)
    moved = feet - feet[0]
    distance = moved[..., 2] if problem.radius else np.linalg.norm(moved, axis=-1)
    return float(np.abs(distance).max(initial=0.0))


def _contact_speed(problem: _PhaseProblem, q: Array, v: Array) -> float:
    speed = [
        jacobian_at(problem.robot, q_row, problem.legs, problem.radius) @ v_row
        for q_row, v_row in zip(q, v, strict=True)
    ]
    by_foot = np.reshape(speed, (len(q), -1, 3))
    return float(np.linalg.norm(by_foot, axis=-1).max(initial=0.0))
