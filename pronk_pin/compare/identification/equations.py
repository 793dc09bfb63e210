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
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
import scipy.ndimage

from ..._typing import Array, IntArray
from ...dynamics import mass_matrix
from ...kinematics import jacobian_at
from ...robot import NB, Robot
from .model_terms import Motion, Term
from .recording import PhaseRecording

WINDOW = 0.02
"""Length of the Hann window that both sides of the equations are seen through [s]."""
_EVERY = 0.004
"""Distance of the rows [s]: a fifth of the window holds all that it lets through."""
_SETTLED = {"stance": (0.002, 0.002), "flight": (0.03, 0.012)}
"""Times left out at the beginning and the end of a phase [s]: feet that have not left the ground
yet in flight, or touch it before it is felt."""
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
    known: Array
    """`S tau - rnea(q, v, a)`: forces beyond those that the URDF's motion needs, (k, ticks, 18)."""
    columns: Array
    """Generalised force of a unit of each term, shape (k, ticks, 18, terms)."""
    lean: Array
    """Generalised force of the difference between true and model gravity, mean over
    the strides, shape (ticks, 18)."""
    balance: Array | None
    """In stance, combinations of the equations that contact forces do not enter, shape
    (k, ticks, 2, 18)."""


class Equations(NamedTuple):
    """Rows `y = A theta` of one speed, for each of its strides."""

    y: Array
    """Forces beyond those that the URDF's motion needs [N or N m], shape (k, m)."""
    A: Array
    """Force of a unit of each term, shape (k, m, terms)."""
    group: IntArray
    """Kind of each row, index into `GROUPS`, shape (m,)."""


def phase_forces(robot: Robot, phase: PhaseRecording, terms: tuple[Term, ...]) -> PhaseForces:
    """The forces along a phase.

    Args:
        robot: The robot as its URDF has it.
        phase: Its recorded phase.
        terms: What the model may lack.
    """
    motion = phase.motion(robot)
    residual, columns = forces(robot, motion, terms)
    balance = None
    if phase.part == "stance":
        balance = phase.of_ticks(ground_free(robot, motion.q))
    lean = phase.of_ticks(_weight(robot, motion.q, phase.lean)).mean(axis=0)
    return PhaseForces(phase, phase.of_ticks(residual), phase.of_ticks(columns), lean, balance)


def equations(robot: Robot, phases: tuple[PhaseForces, ...]) -> Equations:
    """The rows of one speed, from its phases."""
    parts = [_rows(robot, phase) for phase in phases]
    return Equations(
        np.concatenate([part.y for part in parts], axis=1),
        np.concatenate([part.A for part in parts], axis=1),
        np.concatenate([part.group for part in parts]),
    )


def _rows(robot: Robot, forces_: PhaseForces) -> Equations:
    phase, balance = forces_.recording, forces_.balance
    if balance is not None:
        y = np.einsum("ktij,ktj->kti", balance, forces_.known)
        A = np.einsum("ktij,ktjp->ktip", balance, forces_.columns)
        group, moving = np.arange(_JOINTS), np.ones((phase.ticks, _JOINTS), dtype=bool)
    else:
        y, A = forces_.known[:, :, NB:], forces_.columns[:, :, NB:]
        group = robot.joint_kinds + _JOINTS
        moving = np.abs(phase.rates[:, 1:].mean(axis=0)) > _STICKING  # (ticks, 12)
    ticks = settled_ticks(phase)
    length = 2 * window_half(phase.timestep) + 1
    keep = scipy.ndimage.minimum_filter1d(moving, length, axis=0)[ticks] & (group >= 0)
    return Equations(
        windowed(y, phase.timestep)[:, ticks][:, keep],
        windowed(A, phase.timestep)[:, ticks][:, keep],
        np.broadcast_to(group, keep.shape)[keep],
    )


def forces(robot: Robot, motion: Motion, terms: tuple[Term, ...]) -> tuple[Array, Array]:
    """Residual `S tau - rnea(q, v, a)` of the URDF (n, 18), and the terms' columns
    (n, 18, terms)."""
    residual = np.zeros_like(motion.v)
    residual[:, NB:] = motion.tau
    model, data = robot.model, robot.data
    for out, q, v, a in zip(residual, motion.q, motion.v, motion.a, strict=True):
        out -= pin.rnea(model, data, q, v, a)
    return residual, np.stack([term.column(robot, motion) for term in terms], axis=-1)


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
    every = max(1, round(_EVERY / phase.timestep))
    return np.arange(before + half, phase.ticks - after - half, every)


def window_half(timestep: float) -> int:
    """Ticks of the window to each side of its middle."""
    return max(1, round(WINDOW / timestep / 2))


def windowed(values: Array, timestep: float) -> Array:
    """Values seen through the window along axis 1."""
    window = np.hanning(2 * window_half(timestep) + 3)[1:-1]
    return np.asarray(scipy.ndimage.convolve1d(values, window / window.sum(), axis=1))
