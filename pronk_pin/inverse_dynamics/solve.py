"""Motor torques and contact forces for a given motion: eq. (2) solved for tau and lambda.

Four feet on the ground leave the forces undetermined: the feet can push against each other without
moving the robot. What decides these internal forces is the cost, |tau|^2 as in eq. (6): of all
forces that give the motion, those with the smallest motor torques. The planar constraint's forces
cost nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from .._checks import (
    POSITIVE,
    Interval,
    known_name,
    none_or,
    real,
    sequence_of,
    shown,
    text,
    whole,
)
from .._typing import Array, BoolArray
from ..errors import InvalidInput
from ..kinematics import Contact, contact_radius
from ..robot import Robot, as_array, as_numbers, as_robot, as_state, leg_indices
from .force_problem import ForceProblem, SaddlePoint, force_problem, saddle_point
from .qp import cone_sides, constrained_forces

CONSTRAINT_COORDINATES = ("x", "y", "z", "roll", "pitch", "yaw")
"""Base coordinates that a planar constraint can hold."""

PLANAR_CONSTRAINT = ("y", "roll", "pitch", "yaw")
"""The planar constraint of section III of the paper: the sagittal plane without rotation."""

_TOLERANCE = 1e-6
"""Violation up to which a solution counts as feasible [N, N m]."""


class Accelerations(Protocol):
    """A motion at n instants; a `gait.Motion` is one."""

    @property
    def q(self) -> Array:
        """Configurations, shape (n, 19)."""

    @property
    def v(self) -> Array:
        """Velocities, shape (n, 18)."""

    @property
    def a(self) -> Array:
        """Accelerations, shape (n, 18)."""


class StridePhase(Protocol):
    """A phase of a stride; a `gait.GaitPhase` is one."""

    @property
    def feet(self) -> tuple[str, ...]:
        """Legs whose feet stand on the ground."""

    def motion(self, robot: Robot, s: Array) -> Accelerations:
        """The motion at phases s (n,) from 0 to 1."""


class Stride(Protocol):
    """A stance and a flight, whose inverse dynamics are asked for; a `gait.Gait` is one."""

    @property
    def stance(self) -> StridePhase:
        """The phase on the ground."""

    @property
    def flight(self) -> StridePhase:
        """The phase in the air."""


class InverseDynamics(NamedTuple):
    """Torques and forces that produce a motion."""

    tau: Array
    """Motor torques [N m], shape (..., 12)."""
    lam: Array
    """Contact forces in the world's axes, foot by foot [N], shape (..., 3 feet)."""
    constraint: Array
    """Forces [N] and moments [N m] of the planar constraint in the world's axes, at the trunk's
    origin, in the order of the coordinates it holds, shape (..., constraints)."""
    residual: Array
    """Largest violation of the equations of motion, eq. (2) [N, N m], shape (...)."""
    feasible: BoolArray
    """Whether the equations hold to 1e-6 and, where friction was given, cones and torque limits
    do too, shape (...)."""


@dataclass(frozen=True)
class Feedforward:
    """Torques and forces of the model along a gait.

    Attributes:
        s: Phases, from 0 to 1, of both grids, shape (samples,).
        stance: Motor torques in stance [N m], shape (samples, 12).
        flight: Motor torques in flight [N m], shape (samples, 12).
        lam: Contact forces in stance in the world's axes [N], shape (samples, 4, 3).
        constraint: Forces of the planar constraint in stance, see `InverseDynamics`, shape
            (samples, constraints).
        feasible: Whether stance keeps to the equations, cones and limits, shape (samples,).
    """

    s: Array
    stance: Array
    flight: Array
    lam: Array
    constraint: Array
    feasible: BoolArray


def inverse_dynamics(
    robot: Robot,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    a: npt.ArrayLike,
    *,
    feet: Iterable[str] | None = None,
    contact: Contact = "point",
    friction: float | None = None,
    torque_limits: npt.ArrayLike | None = None,
    constraint: Sequence[str] | None = None,
) -> InverseDynamics:
    """Motor torques and contact forces for a motion: eq. (2) solved for tau and lambda; batched.

    Of all solutions the one with the smallest |tau|^2 (plus 1e-6 m^2 |lam|^2, which only decides
    where straight legs leave the torques undecided). Without friction it is found in closed form
    and forces may pull. With friction they stay in an inner pyramid of eight sides in the friction
    cone, and torques within their limits: instants where the closed form violates these are solved
    by ProxQP, each started from the one before. Where the base's equations cannot be met they are
    violated least, and `feasible` is false. Whether the motion itself keeps the feet at rest is not
    checked.

    A motion and robot that are mirror images of themselves give left and right legs equal torques.
    The trunk's centre of mass of the A1 is 4 mm off the mirror plane; a planar constraint that
    holds roll, yaw and y takes the difference, at no cost, so left and right are equal there too.

    Args:
        robot: The robot.
        q: Configuration, shape (..., 19).
        v: Velocity, shape (..., 18).
        a: Acceleration, shape (..., 18).
        feet: Legs in contact; all if None, none if empty.
        contact: "point" or "rolling": where the forces act, see `contact_jacobian`.
        friction: Coefficient of friction; None for no cone and no limits.
        torque_limits: Largest torques [N m], one or (12,), where friction is given; the robot's
            own if None, none if infinite.
        constraint: Base coordinates that a planar constraint holds, out of
            `CONSTRAINT_COORDINATES`: forces along and moments about the world's axes at the trunk's
            origin; None for a free base.

    Raises:
        InvalidInput: A wrong shape, NaN, a quaternion that is not normalised, friction or limits
            that are not positive.
        UnknownName: There is no such leg, contact or constraint coordinate.
    """
    q, v = as_state(robot, q, v)
    batch = q.shape[:-1]
    a = as_array("a", a, robot.nv, batch)
    legs, axes = leg_indices(robot, feet), _constraint_axes(constraint)
    friction = none_or(real, "friction", friction, POSITIVE)
    limits = _torque_limits(robot, torque_limits)
    motion = (q, v, a)
    if batch or friction is not None:
        motion = (q.reshape(-1, robot.nq), v.reshape(-1, robot.nv), a.reshape(-1, robot.nv))
    problem = force_problem(robot, motion, legs, contact_radius(robot, contact), axes)
    conditions = saddle_point(problem)
    forces = conditions.solve()
    inside: BoolArray | np.bool_ = np.True_
    if friction is not None:
        tau_max = robot.parameters.torque_constant * limits
        inside = _constrain(problem, conditions, forces, friction, tau_max)
    return _solution(problem, forces, inside, batch, robot.parameters.torque_constant)


def feedforward(
    robot: Robot,
    gait: Stride,
    *,
    samples: int = 101,
    contact: Contact = "point",
    friction: float | None = None,
    torque_limits: npt.ArrayLike | None = None,
    constraint: Sequence[str] | None = None,
) -> Feedforward:
    """Torques of the model along a gait: inverse dynamics in stance and in flight.

    Stance has the feet of its phase on the ground, flight has none; each is sampled on its own
    phase from 0 to 1. In flight the torques move the joints as the gait asks while the trunk moves
    as the gait says, whatever force that would need.

    Args:
        robot: The robot.
        gait: The gait, or whatever has a stance and a flight.
        samples: Number of phases, at least 2.
        contact: See `inverse_dynamics`, as the following.
        friction: For stance.
        torque_limits: For stance.
        constraint: For stance.

    Raises:
        InvalidInput: Fewer than two samples, or as `inverse_dynamics`.
        UnknownName: As `inverse_dynamics`.
    """
    samples = whole("samples", samples, Interval(2, 100_000))
    as_robot(robot)
    if not hasattr(gait, "stance"):  # gaits are a floor above
        raise InvalidInput(f"gait={shown(gait)} is no Gait; take one of a library, by its at()")
    s = np.linspace(0.0, 1.0, samples)
    down, air = gait.stance.motion(robot, s), gait.flight.motion(robot, s)
    stance = inverse_dynamics(
        robot,
        down.q,
        down.v,
        down.a,
        feet=gait.stance.feet,
        contact=contact,
        friction=friction,
        torque_limits=torque_limits,
        constraint=constraint,
    )
    legs = leg_indices(robot, gait.stance.feet)
    lam = np.zeros((samples, len(robot.legs), 3))
    lam[:, legs] = stance.lam.reshape(samples, len(legs), 3)
    flight = inverse_dynamics(robot, air.q, air.v, air.a, feet=())
    return Feedforward(s, stance.tau, flight.tau, lam, stance.constraint, stance.feasible)


def _constraint_axes(constraint: Sequence[str] | None) -> list[int]:
    """Indices of the planar constraint's coordinates."""
    axes = [
        CONSTRAINT_COORDINATES.index(
            known_name("constraint coordinate", name, CONSTRAINT_COORDINATES)
        )
        for name in (() if constraint is None else sequence_of("constraint", constraint, text))
    ]
    if len(set(axes)) != len(axes):
        raise InvalidInput(f"constraint={constraint} names a coordinate twice; name each once")
    return axes


def _torque_limits(robot: Robot, limits: npt.ArrayLike | None) -> Array:
    """Torque limits of every motor [N m], shape (12,)."""
    if limits is None:
        return robot.tau_max
    array = as_numbers("torque_limits", limits)
    if array.shape not in ((), (robot.nu,)) or not np.all(array > 0.0):
        raise InvalidInput(f"torque_limits must be one or {robot.nu} positive numbers")
    return np.broadcast_to(array, (robot.nu,))


def _constrain(
    problem: ForceProblem,
    conditions: SaddlePoint,
    forces: Array,
    friction: float,
    tau_max: Array,
) -> BoolArray:
    """Bring forces y (n, size) within cones and limits, in place; return which are, shape (n,)."""
    contacts = problem.contacts
    sides = cone_sides(friction, contacts // 3).T  # (3 feet, 8 feet)

    def inside() -> BoolArray:
        in_cone = (forces[:, :contacts] @ sides <= _TOLERANCE).all(axis=-1)
        within = (np.abs(problem.torques(forces)) <= tau_max + _TOLERANCE).all(axis=-1)
        return np.asarray(in_cone & within)

    first = inside()
    outside = np.flatnonzero(~first)
    if not contacts or not outside.size:
        return first
    forces[outside] = constrained_forces(problem, conditions, outside, friction, tau_max)
    return inside()


def _solution(
    problem: ForceProblem,
    forces: Array,
    inside: BoolArray | np.bool_,
    batch: tuple[int, ...],
    torque_constant: float,
) -> InverseDynamics:
    """Torques, forces and verdicts, in the shape of the batch."""
    contacts = problem.contacts
    residual = np.abs(problem.rest(forces)).max(axis=-1)
    return InverseDynamics(
        tau=problem.torques(forces).reshape(*batch, problem.b_joints.shape[-1]) / torque_constant,
        lam=forces[..., :contacts].reshape(*batch, contacts),
        constraint=forces[..., contacts:].reshape(*batch, problem.size - contacts),
        residual=residual.reshape(batch),
        feasible=np.asarray(inside & (residual <= _TOLERANCE)).reshape(batch),
    )
