"""The equations of motion along recorded strides, as rows of a linear regression.

In flight nothing but the motors and the fall acts: the rows are those of the joints. In stance the
ground pushes too, and is not measured. A standing leg's three joints tell what its foot bears, so
that the contact forces can be eliminated leg by leg,

    r_base - sum_legs J_base^T J_leg^-T r_leg = 0,

where r are the forces that the motors give beyond what the motion needs, and J the contact Jacobian
at the spheres' lowest points. Of these rows of the trunk those count that the planar constraint
leaves free: with a locked base the balances of forces along x and z. They hold whatever the feet
do, as long as they are pushed where they touch.

Both sides are seen through the same window. That is exact, because the equations are linear in the
unknowns at every tick; to smooth the motion first would not be.

Motors that are late play the torque of d ago, so that the rows are functions of the delay d: those
of the commanded torques are laid out for delays a millisecond apart, and a cubic spline goes
through them, which the window has made smooth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import scipy.ndimage
from scipy.interpolate import CubicSpline

from ..._typing import Array, BoolArray, IntArray
from ...dynamics import mass_matrix
from ...kinematics import jacobian_at
from ...robot import NB, Robot
from .model_terms import LONGEST_DELAY, Motion, Term
from .recording import PhaseRecording

WINDOW = 0.02
"""Length of the Hann window that both sides of the equations are seen through [s]."""
EVERY = 0.004
"""Distance of the rows [s]: a fifth of the window holds all that it lets through."""
_SETTLED = {"stance": (0.002, 0.002), "flight": (0.03, 0.012)}
"""Times left out at the beginning and the end of a phase [s]: feet that have not left the ground
yet in flight, or touch it before it is felt."""
_DELAYS_EVERY = 0.001
"""Distance of the delays between which rows are interpolated [s]."""
_STICKING = 0.2
"""Joint velocity below which friction may hold the joint, which no term describes [rad/s]."""

GROUPS = ("x", "z", "hip", "thigh", "calf")
"""Kinds of rows: balance of forces along x and z in stance [N], joints in flight [N m]."""
_JOINTS = 2
"""Index of the first joint among the groups."""
_PLANAR_ROWS = (0, 2)
"""Rows of the trunk that a locked base leaves free: x and z."""


class PhaseForces(NamedTuple):
    """Generalised forces along a recorded phase of k strides."""

    recording: PhaseRecording
    """The phase."""
    motion: Motion
    """Its motion, n = k ticks."""
    needed: Array
    """`rnea(q, v, a)`: what the URDF's motion needs, shape (k, ticks, 18)."""
    columns: Array
    """Generalised force of a unit of each term, shape (k, ticks, 18, terms); zero for the terms
    that depend on the torque, see `torque_forces`."""
    lean: Array
    """Generalised force of the difference between true and model gravity, mean over
    the strides, shape (ticks, 18)."""
    balance: Array | None
    """In stance, combinations of the equations that contact forces do not enter, shape
    (k, ticks, 2, 18)."""


class Equations(NamedTuple):
    """Rows `y = A theta` of one speed, for each of its strides, with a given delay."""

    y: Array
    """Forces beyond those that the URDF's motion needs [N or N m], shape (k, m)."""
    A: Array
    """Force of a unit of each term, shape (k, m, terms)."""
    group: IntArray
    """Kind of each row, index into `GROUPS`, shape (m,)."""


@dataclass(frozen=True, eq=False)
class DelayedEquations:
    """Rows of one speed as functions of the parameters, of which the delay is not linear.

    Attributes:
        motion: Rows of the motion alone, zero in the columns that depend on the torque.
        torque: Rows of the torque that motors late by so much [s] give, and columns of the terms
            that depend on it, shape (k, m, 1 + of_torque).
        of_torque: Which terms depend on it.
        delay: Which term is the delay; None if none is.
    """

    motion: Equations
    torque: CubicSpline
    of_torque: tuple[int, ...]
    delay: int | None

    @property
    def group(self) -> IntArray:
        """Kind of each row, see `Equations`."""
        return self.motion.group

    def at(self, value: Array) -> Equations:
        """The rows linearised about parameters (terms,).

        With the residual `r(d) = y(d) - A(d) theta`, the column of the delay is `-dr/dd` and its
        unknown the whole delay, so that least squares are a step of Gauss and Newton.
        """
        delay = 0.0 if self.delay is None else float(value[self.delay])
        torque, of_torque = self.torque(delay), list(self.of_torque)
        y, A = self.motion.y + torque[..., 0], self.motion.A.copy()
        A[..., of_torque] = torque[..., 1:]
        if self.delay is not None:
            rate = self.torque(delay, 1)
            column = rate[..., 1:] @ value[of_torque] - rate[..., 0]
            A[..., self.delay] = column
            y = y + delay * column
        return Equations(y, A, self.group)

    def given_delay(self, delay: float) -> Equations:
        """The rows with a delay that is given, without its column."""
        value = np.zeros(self.motion.A.shape[-1])
        if self.delay is None:
            return self.at(value)
        value[self.delay] = delay
        y, A, group = self.at(value)
        return Equations(y - delay * A[..., self.delay], np.delete(A, self.delay, -1), group)


def phase_forces(robot: Robot, phase: PhaseRecording, terms: tuple[Term, ...]) -> PhaseForces:
    """The forces along a phase.

    Args:
        robot: The robot as its URDF has it.
        phase: Its recorded phase.
        terms: What the model may lack.
    """
    motion = phase.motion(robot)
    needed, columns = forces(robot, motion, terms)
    balance = None
    if phase.part == "stance":
        balance = phase.of_ticks(ground_free(robot, motion.q))
    lean = phase.of_ticks(_weight(robot, motion.q, phase.lean)).mean(axis=0)
    return PhaseForces(
        phase, motion, phase.of_ticks(needed), phase.of_ticks(columns), lean, balance
    )


def equations(
    robot: Robot, phases: tuple[PhaseForces, ...], terms: tuple[Term, ...]
) -> DelayedEquations:
    """The rows of one speed, from its phases."""
    timestep = phases[0].recording.timestep
    step = max(timestep, _DELAYS_EVERY)
    delays = step * np.arange(int(np.ceil(LONGEST_DELAY / step)) + 2)
    motion = [
        _rows(robot, phase, np.concatenate([-phase.needed[..., None], phase.columns], axis=-1))
        for phase in phases
    ]
    torque = [
        np.concatenate(
            [_rows(robot, each, torque_forces(robot, each, terms, delay)) for each in phases],
            axis=1,
        )
        for delay in delays
    ]
    rows = np.concatenate(motion, axis=1)
    return DelayedEquations(
        Equations(
            rows[..., 0], rows[..., 1:], np.concatenate([_kept(robot, p)[1] for p in phases])
        ),
        CubicSpline(delays, torque),
        tuple(k for k, term in enumerate(terms) if term.of_torque),
        next((k for k, term in enumerate(terms) if term.column is None), None),
    )


def _rows(robot: Robot, forces_: PhaseForces, values: Array) -> Array:
    """Generalised forces (k, ticks, 18, p) as rows of the equations (k, m, p)."""
    phase, balance = forces_.recording, forces_.balance
    if balance is not None:
        values = np.einsum("ktij,ktjp->ktip", balance, values)
    else:
        values = values[:, :, NB:]
    keep, _ = _kept(robot, forces_)
    return np.asarray(windowed(values, phase.timestep)[:, settled_ticks(phase)][:, keep])


def _kept(robot: Robot, forces_: PhaseForces) -> tuple[BoolArray, IntArray]:
    """Which rows of the settled ticks count, and the kind of each that does."""
    phase = forces_.recording
    if forces_.balance is not None:
        group, moving = np.arange(_JOINTS), np.ones((phase.ticks, _JOINTS), dtype=bool)
    else:
        group = robot.joint_kinds + _JOINTS
        moving = np.abs(phase.rates[:, 1:].mean(axis=0)) > _STICKING  # (ticks, 12)
    length = 2 * window_half(phase.timestep) + 1
    ticks = settled_ticks(phase)
    keep = scipy.ndimage.minimum_filter1d(moving, length, axis=0)[ticks] & (group >= 0)
    return keep, np.broadcast_to(group, keep.shape)[keep]


def forces(robot: Robot, motion: Motion, terms: tuple[Term, ...]) -> tuple[Array, Array]:
    """What the URDF's motion needs, `rnea(q, v, a)` (n, 18), and the columns of the terms that the
    torque does not enter (n, 18, terms), zero for the others."""
    model, data = robot.model, robot.data
    needed = np.array(
        [
            pin.rnea(model, data, q, v, a)
            for q, v, a in zip(motion.q, motion.v, motion.a, strict=True)
        ]
    )
    columns = [
        np.zeros_like(needed)
        if term.column is None or term.of_torque
        else term.column(robot, motion)
        for term in terms
    ]
    return needed, np.stack(columns, axis=-1)


def torque_forces(robot: Robot, phase: PhaseForces, terms: Sequence[Term], delay: float) -> Array:
    """Generalised force of the torque that motors late by so much [s] give, and the columns of the
    terms that depend on it, shape (k, ticks, 18, 1 + of_torque)."""
    recording = phase.recording
    tau = recording.torque_after(delay).reshape(-1, robot.nu)
    motion = phase.motion._replace(tau=tau)
    given = np.zeros_like(motion.v)
    given[:, NB:] = tau
    columns = [
        term.column(robot, motion) for term in terms if term.of_torque and term.column is not None
    ]
    return recording.of_ticks(np.stack([given, *columns], axis=-1))


def explained_forces(
    robot: Robot, phase: PhaseForces, terms: Sequence[Term], value: Array
) -> Array:
    """Generalised force of each term with its parameter, mean over the strides, (ticks, 18, terms).

    That of the delay is the commanded torque less the one that comes so much later.
    """
    delay = sum(v for term, v in zip(terms, value, strict=True) if term.column is None)
    late = torque_forces(robot, phase, terms, float(delay)).mean(axis=0)
    commanded = torque_forces(robot, phase, (), 0.0).mean(axis=0)
    force = phase.columns.mean(axis=0) * value
    of_torque = [k for k, term in enumerate(terms) if term.of_torque]
    force[..., of_torque] = late[..., 1:] * value[of_torque]
    force[..., [k for k, term in enumerate(terms) if term.column is None]] = (
        commanded - late[..., :1]
    )
    return np.asarray(force)


def _weight(robot: Robot, q: Array, lean: Array) -> Array:
    """Generalised force `M [:, (x, z)] a` of an acceleration of x and z, shape (n, 18)."""
    if not lean.any():
        return np.zeros((len(q), robot.nv))
    return np.array([mass_matrix(robot, each)[:, list(_PLANAR_ROWS)] @ lean for each in q])


def ground_free(robot: Robot, q: Array) -> Array:
    """Combinations of the equations that forces on all feet do not enter: the balances of the
    trunk's forces along x and z, shape (n, 2, 18)."""
    legs, rows = range(len(robot.legs)), list(_PLANAR_ROWS)
    jacobians = np.array([jacobian_at(robot, each, legs, robot.foot_radius) for each in q])
    balance = np.zeros((len(q), len(rows), robot.nv))
    balance[:, np.arange(len(rows)), rows] = 1.0
    for leg in legs:
        joints = slice(NB + 3 * leg, NB + 3 * leg + 3)
        foot = jacobians[:, 3 * leg : 3 * leg + 3]
        # lam = J_leg^-T r_leg, which pushes the trunk by J_base^T lam.
        balance[:, :, joints] = -np.swapaxes(
            np.linalg.solve(foot[:, :, joints], foot[:, :, rows]), -1, -2
        )
    return balance


def settled_ticks(phase: PhaseRecording) -> IntArray:
    """Ticks in the middle of windows that lie within what is settled of the phase."""
    half = window_half(phase.timestep)
    before, after = (round(time / phase.timestep) for time in _SETTLED[phase.part])
    every = max(1, round(EVERY / phase.timestep))
    return np.arange(before + half, phase.ticks - after - half, every)


def window_half(timestep: float) -> int:
    """Ticks of the window to each side of its middle."""
    return max(1, round(WINDOW / timestep / 2))


def windowed(values: Array, timestep: float) -> Array:
    """Values seen through the window along axis 1."""
    window = np.hanning(2 * window_half(timestep) + 3)[1:-1]
    return np.asarray(scipy.ndimage.convolve1d(values, window / window.sum(), axis=1))
