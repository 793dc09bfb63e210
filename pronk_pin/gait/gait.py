"""Gaits: periodic motions over one stride, as Bezier polynomials over the phase.

A stride is a sequence of phases, each with its own set of stance feet. Pronking has two: `stance`
on all four feet, then `flight` on none; the touchdown impact closes the cycle.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np

from .._checks import instance_of, real, sequence_of, text
from .._display import Displayed
from .._typing import Array
from ..errors import InvalidInput
from ..kinematics import free_state
from ..robot import NB, Robot, as_numbers, as_robot
from . import bezier

ARRAYS = ("joints", "base", "tau", "lam")
"""Coefficient arrays of a phase."""

PLANAR = 3
"""Coordinates of a trunk in the sagittal plane: x, z and pitch."""

_Value = TypeVar("_Value", float, Array)


@dataclass(frozen=True)
class Motion:
    """A motion sampled at n instants, in Pinocchio's layout.

    Attributes:
        t: Times from the beginning of the phase [s], shape (n,).
        q: Configurations, shape (n, 19).
        v: Velocities, shape (n, 18).
        a: Accelerations, shape (n, 18).
        tau: Motor torques [N m], shape (n, 12).
        lam: Contact forces in the world frame [N], shape (n, 4, 3), zero for feet in the air.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    tau: Array
    lam: Array


def planar_state(
    robot: Robot,
    position: Sequence[Array],
    velocity: Sequence[Array],
    acceleration: Sequence[Array],
) -> tuple[Array, Array, Array]:
    """Whole-body q (n, 19), v and a (n, 18) of a robot whose trunk moves in the sagittal plane.

    Args:
        robot: The robot.
        position, velocity, acceleration: Each the trunk's x, z and pitch in the world (n, 3), and
            the joints (n, 12), or their derivatives by time.
    """
    base, rates, bends = position[0], velocity[0], acceleration[0]
    place = np.stack([base[:, 0], np.zeros(len(base)), base[:, 1]], axis=-1)
    q = robot.q_from_base(place, position[1], pitch=base[:, 2])
    cos, sin = np.cos(base[:, 2]), np.sin(base[:, 2])
    vx, vz, rate = rates.T
    ax, az, bend = bends.T
    v, a = np.zeros((2, len(base), robot.nv))
    v[:, 0], v[:, 2], v[:, 4] = cos * vx - sin * vz, sin * vx + cos * vz, rate
    # Body-frame derivative: R^T a_world - omega x v_body, with omega along y.
    a[:, 0] = cos * ax - sin * az - rate * v[:, 2]
    a[:, 2] = sin * ax + cos * az + rate * v[:, 0]
    a[:, 4] = bend
    v[:, NB:], a[:, NB:] = velocity[1], acceleration[1]
    return q, v, a


def whole_state(
    robot: Robot,
    position: Sequence[Array],
    velocity: Sequence[Array],
    acceleration: Sequence[Array],
) -> tuple[Array, Array, Array]:
    """`planar_state`, or `free_state` where there are six coordinates of the trunk."""
    planar = position[0].shape[-1] == PLANAR
    state = planar_state if planar else free_state
    return state(robot, position, velocity, acceleration)


def _phases(s: Array) -> Array:
    """Phases as numbers.

    Raises:
        InvalidInput: They are none, or not finite.
    """
    s = as_numbers("s", s)
    if not np.isfinite(s).all():
        raise InvalidInput("s holds NaN or infinite values; give phases from 0 to 1")
    return s


@dataclass(frozen=True, repr=False)
class GaitPhase(Displayed):
    """One phase of a gait; its arrays are read-only.

    Attributes:
        name: Its name in the contact sequence: "stance" or "flight" in pronking.
        feet: Legs whose feet stand on the ground.
        duration: How long the phase lasts [s].
        joints: Coefficients of the joint angles [rad], shape (12, order + 1): B of eq. (7).
        base: Coefficients of the trunk's x [m], z [m] and pitch [rad], shape (3, order + 1);
            x is 0 where the stride begins. On a free trunk y [m], roll and yaw [rad] follow,
            (6, order + 1).
        tau: Coefficients of the motor torques [N m], shape (12, order + 1).
        lam: Coefficients of the contact forces in the world frame [N], shape (4, 3, order + 1).
    """

    name: str
    feet: tuple[str, ...]
    duration: float
    joints: Array
    base: Array
    tau: Array
    lam: Array

    def __post_init__(self) -> None:
        # An audit is of these numbers; who wants others makes a phase of them.
        for name in ARRAYS:
            coefficients = np.asarray(getattr(self, name), dtype=np.float64).view()
            coefficients.flags.writeable = False
            object.__setattr__(self, name, coefficients)

    def _title(self) -> str:
        return f"GaitPhase {self.name}"

    def _facts(self) -> dict[str, str]:
        return {
            "duration": f"{self.duration:.4g} s",
            "feet": ", ".join(self.feet) or "none stands",
            "order": str(self.joints.shape[-1] - 1),
        }

    def joint_reference(self, s: Array) -> tuple[Array, Array]:
        """Joint angles [rad] and velocities [rad/s] at the phases s, each of shape (n, 12)."""
        s = _phases(s)
        position = bezier.evaluate(self.joints, s)
        rate = bezier.evaluate(self.joints, s, derivative=1)
        return position, rate / self.duration

    def joint_acceleration(self, s: Array) -> Array:
        """Joint accelerations [rad/s^2] at the phases s, shape (n, 12)."""
        return bezier.evaluate(self.joints, _phases(s), derivative=2) / self.duration**2

    def base_reference(self, s: Array) -> tuple[Array, Array]:
        """Trunk x, z, pitch [m, m, rad] and their rates at the phases s, each of shape (n, 3).

        On a free trunk y, roll and yaw too: (n, 6).
        """
        s = _phases(s)
        position = bezier.evaluate(self.base, s)
        rate = bezier.evaluate(self.base, s, derivative=1)
        return position, rate / self.duration

    def motion(self, robot: Robot, s: Array) -> Motion:
        """The whole-body motion at the phases s, shape (n,)."""
        s = np.atleast_1d(_phases(s))
        as_robot(robot)
        curves = [
            [
                bezier.evaluate(coefficients, s, derivative=d) / self.duration**d
                for coefficients in (self.base, self.joints)
            ]
            for d in range(3)
        ]
        q, v, a = whole_state(robot, *curves)
        return Motion(
            t=s * self.duration,
            q=q,
            v=v,
            a=a,
            tau=bezier.evaluate(self.tau, s),
            lam=bezier.evaluate(self.lam, s),
        )


def joint_references(
    parts: Sequence[GaitPhase], phases: Sequence[Array]
) -> list[tuple[Array, Array]]:
    """`GaitPhase.joint_reference` of several parts, each at phases of its own: to the bit the same.

    Polynomials of one order are evaluated at all phases at once, which is several times as fast.
    """
    orders = {part.joints.shape[-1] - 1 for part in parts}
    if len(orders) != 1:
        return [part.joint_reference(s) for part, s in zip(parts, phases, strict=True)]
    (order,) = orders
    s, cuts = np.concatenate(phases), np.cumsum([len(s) for s in phases])[:-1]
    bases = zip(
        parts,
        np.split(bezier.bernstein(s, order), cuts),
        np.split(bezier.bernstein(s, max(order - 1, 0)), cuts),
        strict=True,
    )
    return [
        (
            np.dot(basis, part.joints.T),
            np.dot(rates, bezier.differentiate(part.joints).T) / part.duration,
        )
        for part, basis, rates in bases
    ]


@dataclass(frozen=True, repr=False)
class Gait(Displayed):
    """A periodic motion of a robot at one speed.

    Attributes:
        robot: Name of the robot it was made for.
        speed: Average forward speed of the trunk [m/s].
        apex: Greatest height of the trunk [m].
        phases: The phases in their order; the last one ends in the touchdown of the first.
    """

    robot: str
    speed: float
    apex: float
    phases: tuple[GaitPhase, ...]

    def _title(self) -> str:
        return f"Gait of {self.robot} at {self.speed:g} m/s"

    def _facts(self) -> dict[str, str]:
        durations = (f"{phase.name} {phase.duration:.4g} s" for phase in self.phases)
        return {
            "apex": f"{self.apex:g} m",
            "phases": ", ".join(durations),
            "sha256": self.sha256[:12],
        }

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the motion: its robot's name and all of its numbers, to the last bit."""
        phases = [
            [phase.name, phase.feet, float(phase.duration).hex(), phase.joints.shape]
            for phase in self.phases
        ]
        head = [self.robot, float(self.speed).hex(), float(self.apex).hex(), phases]
        digest = hashlib.sha256(json.dumps(head).encode())
        for phase in self.phases:
            for coefficients in (phase.joints, phase.base, phase.tau, phase.lam):
                digest.update(coefficients.astype("<f8").tobytes())
        return digest.hexdigest()

    def phase(self, name: str) -> GaitPhase:
        """The phase of that name."""
        text("name of a phase", name)
        for phase in self.phases:
            if phase.name == name:
                return phase
        known = ", ".join(phase.name for phase in self.phases)
        raise InvalidInput(f"the gait has no phase '{name}'; choose one of: {known}")

    @property
    def stance(self) -> GaitPhase:
        """The stance phase."""
        return self.phase("stance")

    @property
    def flight(self) -> GaitPhase:
        """The flight phase."""
        return self.phase("flight")

    @property
    def duration(self) -> float:
        """Duration of a stride [s]."""
        return sum(phase.duration for phase in self.phases)

    def blend(self, other: Gait, weight: float) -> Gait:
        """Interpolate towards another gait: eq. (13), for coefficients and durations alike.

        Args:
            other: A gait of the same phases and orders.
            weight: 0 gives this gait, 1 the other one.
        """

        instance_of("other", other, Gait)
        weight = real("weight", weight)
        kinds = [[(phase.name, phase.joints.shape) for phase in g.phases] for g in (self, other)]
        if kinds[0] != kinds[1]:
            raise InvalidInput("the two gaits differ in phases or orders; blend gaits of one kind")

        def mix(a: _Value, b: _Value) -> _Value:
            return (1.0 - weight) * a + weight * b

        phases = tuple(
            GaitPhase(
                own.name,
                own.feet,
                duration=mix(own.duration, others.duration),
                joints=mix(own.joints, others.joints),
                base=mix(own.base, others.base),
                tau=mix(own.tau, others.tau),
                lam=mix(own.lam, others.lam),
            )
            for own, others in zip(self.phases, other.phases, strict=True)
        )
        return Gait(self.robot, mix(self.speed, other.speed), mix(self.apex, other.apex), phases)


def known_gaits(robot: Robot, gaits: Sequence[Gait]) -> tuple[Gait, ...]:
    """Gaits of a robot, one or more.

    Raises:
        InvalidInput: There is none, or one is no gait, or of another robot.
    """
    as_robot(robot)
    if isinstance(gaits, Gait):
        raise InvalidInput("gaits is one Gait; give a list, with a gait for each robot")
    found = sequence_of(
        "gaits", gaits, lambda name, gait: instance_of(name, gait, Gait), wanted="gaits"
    )
    if not found:
        raise InvalidInput("gaits is empty; give one for each robot")
    for gait in found:
        if gait.robot != robot.name:
            raise InvalidInput(
                f"a gait of the {gait.robot} cannot be played by the {robot.name}; take it from "
                f"load_library('{robot.name}')"
            )
    return found
