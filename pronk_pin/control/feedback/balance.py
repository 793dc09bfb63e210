"""Balance of a trunk that is free to turn: torques added to the tapes at every tick.

On the ground a moment on the trunk is spread over the contact forces within their friction cones,
and the legs' transposed Jacobians turn what the forces change into torques. In the air the feet are
moved, see `FootPlacement`. None of it is feedforward or tracking error, so none of it is learned;
and of the tracking errors in stance those that come from the trunk's attitude only in part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..._checks import (
    POSITIVE,
    SHARE,
    Interval,
    instance_of,
    keep_instances,
    keep_reals,
    real,
    whole,
)
from ..._typing import Array, IntArray
from ...gait import Gait, known_gaits
from ...inverse_dynamics import distribute_wrench
from ...kinematics import contact_points, leg_geometry
from ...robot import JOINTS, Robot, rotation_matrix
from ..signals import PARTS, ControlContext, Gains
from .attitude import AttitudeRegulator, attitude_angle, attitude_error, pitched
from .foot_placement import FootPlacement, placed


@dataclass(frozen=True)
class BalanceSpec:
    """Parameters of the balance of a trunk that is free to turn.

    Attributes:
        attitude: Attitude regulation, on the ground.
        placement: Foot placement, in the air.
        learned: Share of a deviation from the gait's attitude that the legs learn to undo in
            stance. With all of it (1) learning, which sees the trunk a stride late, and this
            regulation throw the trunk to and fro over tens of strides, the more the faster the
            robot; with nothing of it (0) the trunk stays as far off as regulation leaves it.
        landing: Share of the flight's errors that are learned from in a stride. Where the legs
            land moves the trunk, and that takes some strides to settle; with all of it the A1 with
            3 kg on its trunk falls at 0.6 m/s and faster.
    """

    attitude: AttitudeRegulator = field(default_factory=AttitudeRegulator)
    placement: FootPlacement = field(default_factory=FootPlacement)
    learned: float = 0.4
    landing: float = 0.3

    def __post_init__(self) -> None:
        keep_instances(self, "balance: ", attitude=AttitudeRegulator, placement=FootPlacement)
        keep_reals(self, {"learned": SHARE, "landing": SHARE}, "balance: ")

    def bind(self, context: ControlContext) -> Balance | None:
        """The balance of a controller's robots; None where their trunks are locked."""
        if context.base == "locked":
            return None
        return Balance(
            context.robot,
            context.gaits,
            self,
            gains=context.gains,
            ticks=context.ticks,
            timestep=context.timestep,
        )


_TICKS = Interval(1, 10_000_000)


class Balance:
    """Attitude regulation and foot placement of n robots, each with its own gait.

    On the ground the regulating moment m is a change of the contact forces within their cones,
    `sum r_l x dlam_l = m`, and of the torques, `dtau_l = -J_l^T dlam_l`; in the air the references
    of the joints are those of the displaced feet, `dtau = Kp (q_placed - q_d)`.

    Args:
        robot: The robot.
        gaits: The gait of each of the n robots.
        spec: How they are kept up.
        gains: Feedback gains that pull the feet to their places in flight.
        ticks: Length of the longest tape.
        timestep: Time step of the control [s].
    """

    def __init__(
        self,
        robot: Robot,
        gaits: Sequence[Gait],
        spec: BalanceSpec,
        *,
        gains: Gains,
        ticks: int,
        timestep: float,
    ) -> None:
        gaits = known_gaits(robot, gaits)
        instance_of("spec", spec, BalanceSpec)
        instance_of("gains", gains, Gains)
        ticks, timestep = whole("ticks", ticks, _TICKS), real("timestep", timestep, POSITIVE)
        self._spec, self._gains, self._radius = spec, gains, robot.foot_radius
        self._geometry = leg_geometry(robot)
        duration = np.array([[getattr(g, part).duration for part in PARTS] for g in gaits])
        self._s = np.minimum(np.arange(ticks) * timestep / duration[..., None], 1.0)
        pitch, rate = np.zeros((2, len(gaits), len(PARTS), ticks))
        for k, gait in enumerate(gaits):
            for p, part in enumerate(PARTS):
                base, speed = getattr(gait, part).base_reference(self._s[k, p])
                pitch[k, p] = base[:, 2]
                rate[k, p] = np.where(self._s[k, p] < 1.0, speed[:, 2], 0.0)
        self._reference, self._rate = pitched(pitch), rate
        force = [
            gait.stance.motion(robot, s).lam for gait, s in zip(gaits, self._s[:, 0], strict=True)
        ]
        self._force = np.stack(force)  # (n, ticks, 4, 3)
        self._share = spec.placement.share(self._s[:, 1])
        self._sideways_offset = np.zeros(len(gaits))

    @property
    def at_touchdown(self) -> Array:
        """The attitudes in which the gaits' stances begin, shape (n, 3, 3)."""
        return self._reference[:, 0, 0].copy()

    def lift_off(self, rows: IntArray, sideways: Array) -> None:
        """Note the sideways speeds (m,) with which robots leave the ground, in the world [m/s]."""
        self._sideways_offset[rows] = self._spec.placement.aside(sideways)

    def torque(
        self,
        part: int,
        rows: IntArray,
        tick: int,
        trunk: tuple[Array, Array],
        joints: Array,
        reference: Array,
    ) -> Array:
        """Compute the balancing torques at one tick, to add to the tapes' [N m], shape (m, 12).

        Args:
            part: Part of the stride, an index into `PARTS`.
            rows: Which robots.
            tick: Tick of their tapes.
            trunk: Estimated state of their trunks, in Pinocchio's layout: position and quaternion
                (m, 7), velocity (m, 6).
            joints: Their joint angles [rad], shape (m, 12).
            reference: The tapes' joint angles [rad], shape (m, 12).
        """
        rotation, desired = rotation_matrix(trunk[0][:, 3:7]), self._reference[rows, part, tick]
        if part == 0:
            added = self._ground(rows, tick, rotation, desired, trunk[1][:, 3:6], joints)
        else:
            added = self._air(rows, tick, rotation, desired, reference)
        added[~np.isfinite(added)] = 0.0  # a sensor that fails must not reach the motors
        return added

    def unlearned(self, rows: IntArray, pose: Array, reference: Array) -> Array:
        """Joint errors in stance that are left to the attitude regulation, not learned [rad].

        `(1 - learned) (q_d - q_turned)`: q_turned are the joint angles of the gait's posture over
        feet that stand where they are, with the trunk turned as it is.

        Args:
            rows: Which robots.
            pose: Estimated pose of their trunks at each tick, shape (m, ticks, 7).
            reference: The joints' references [rad], shape (m, ticks, 12).

        Returns:
            Shape (m, ticks, 12).
        """
        turn = np.swapaxes(rotation_matrix(pose[..., 3:7]), -1, -2)
        turn = turn @ self._reference[rows, 0, : pose.shape[1]]
        number = reference.shape[0] * reference.shape[1]
        turned = placed(
            self._geometry,
            reference.reshape(number, -1, len(JOINTS)),
            turn.reshape(number, 3, 3),
            np.zeros((number, 3)),
            np.ones(number),
        ).reshape(reference.shape)
        return np.asarray((1.0 - self._spec.learned) * (reference - turned))

    def tilt(self, part: int, rows: IntArray, pose: Array, length: IntArray) -> Array:
        """Largest angle between trunk and gait in a part of the stride [rad], shape (m,).

        Args:
            part: Part of the stride.
            rows: Which robots.
            pose: Trunk at each tick, position and quaternion, shape (m, ticks, 7).
            length: Ticks that the part lasted, shape (m,).
        """
        ticks = pose.shape[1]
        angle = attitude_angle(rotation_matrix(pose[..., 3:7]), self._reference[rows, part, :ticks])
        return np.asarray(np.where(np.arange(ticks) < length[:, None], angle, 0.0).max(axis=1))

    def _ground(
        self, rows: IntArray, tick: int, rotation: Array, desired: Array, spin: Array, joints: Array
    ) -> Array:
        regulator = self._spec.attitude
        added = np.zeros_like(joints)
        sound = np.isfinite(rotation.sum(axis=(1, 2)) + spin.sum(axis=1) + joints.sum(axis=1))
        regulated = np.flatnonzero(sound & (self._s[rows, 0, tick] < regulator.until))
        if regulated.size == 0:
            return added
        rows, rotation, desired = rows[regulated], rotation[regulated], desired[regulated]
        joints = joints[regulated]
        rate = -np.einsum("nij,nj->ni", rotation, spin[regulated])
        rate[:, 1] += self._rate[rows, 0, tick]
        moment = regulator.moment(attitude_error(rotation, desired), rate)
        points = contact_points(self._geometry, _by_leg(joints), -self._radius * rotation[:, 2])
        arms = np.einsum("nij,nlj->nli", rotation, points.position)
        nominal = self._force[rows, tick]
        wrench = np.concatenate([np.zeros_like(moment), moment], axis=1)
        forces = distribute_wrench(arms, wrench, nominal, friction=regulator.friction)
        change = (forces - nominal) @ rotation  # in the trunk's axes
        torque = -np.einsum("nlij,nli->nlj", points.jacobian, change)
        added[regulated] = torque.reshape(joints.shape)
        return added

    def _air(
        self, rows: IntArray, tick: int, rotation: Array, desired: Array, reference: Array
    ) -> Array:
        turn = np.swapaxes(rotation, -1, -2) @ desired
        offset = (
            self._sideways_offset[rows, None] * rotation[:, 1, :]
        )  # the world's y in the trunk's axes
        share = self._share[rows, tick]
        moved = placed(self._geometry, _by_leg(reference), turn, offset, share)
        change = moved.reshape(reference.shape) - reference
        return np.asarray(self._gains.proportional(change.shape[-1]) * change)


def _by_leg(joints: Array) -> Array:
    return joints.reshape(len(joints), -1, len(JOINTS))
