"""Logs of a simulation, tick by tick in one phase, and stride by stride; preallocated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._typing import Array, BoolArray, IntArray
from ...control import (
    PARTS,
    Gains,
    PhaseLog,
    StrideRecord,
    Tape,
    phase_grid,
    resample,
    roll_pitch_yaw,
)
from ...gait import Gait
from ...robot import Robot, rotation_matrix
from ..world import Motion
from .contact_errors import ContactErrors
from .quantities import (
    COMMAND_QUANTITIES,
    CONDITION_QUANTITIES,
    EVERY,
    LAST,
    SAMPLES,
    STRIDE_QUANTITIES,
    TICK_QUANTITIES,
    sizes_of,
)

SHORTEST_STRIDE = 0.5
"""Strides shorter than this share of the planned duration do not occur: it sizes the log."""

LONGEST_PART = 1.25
"""Share of the planned duration of a part up to which its ticks are kept."""


class TickLog:
    """Log of the current phase of n robots, tick by tick; the next phase overwrites it.

    Attributes:
        size: Ticks of the longest phase.
        joints, joint_rates: Measured joint angles and velocities, shape (n, size, 12).
        feedback, feedforward, missing: Torques [N m], see `PhaseLog`, shape (n, size, 12).
        base, base_rate: Trunk x, z [m] and their rates [m/s], shape (n, size, 2).
        balance: Torques that keep the trunk up, see `control.feedback.balance` [N m], shape (n,
        size, 12).
        pose, twist: Trunk in Pinocchio's layout, shape (n, size, 7) and (n, size, 6).
        specific_force: What the accelerometer says, trunk's axes [m/s^2], shape (n, size, 3).
        force: Ground's force on each foot, world frame [N], shape (n, size, 4, 3).
        turns: Whether the trunk can turn; else `pose`, `twist` and `balance` are of no use.
        inertial: Whether an IMU is read at each tick; else `specific_force` is of no use.
    """

    def __init__(
        self, n: int, size: int, robot: Robot, *, turns: bool = True, inertial: bool = False
    ) -> None:
        joints, feet = robot.nu, len(robot.legs)
        self.size, self.turns, self.inertial = size, turns, inertial
        self.specific_force = np.zeros((n, size, 3))
        self.joints, self.joint_rates = np.zeros((2, n, size, joints))
        self.feedback, self.feedforward, self.missing, self.balance = np.zeros((4, n, size, joints))
        self.base, self.base_rate = np.zeros((2, n, size, 2))
        self.force = np.zeros((n, size, feet, 3))
        self.pose, self.twist = np.zeros((n, size, 7)), np.zeros((n, size, 6))
        self.pose[..., 6] = 1.0  # level, until something else is written
        self._torques = [self.feedback, self.feedforward, self.missing]
        self._torques += [self.balance] if turns else []
        self._channels = [*self._torques, self.joints, self.joint_rates]
        self._channels += [self.base, self.base_rate, self.force]
        self._channels += [self.pose, self.twist] if turns else []
        self._channels += [self.specific_force] if inertial else []

    def write(self, rows: IntArray, tick: int, motion: Motion) -> None:
        """Write a motion of robots from a tick on."""
        at = _compact(rows), slice(tick, tick + motion.base.shape[1])
        self.joints[at], self.joint_rates[at] = motion.joints, motion.joint_rates
        self.base[at], self.base_rate[at] = motion.base, motion.base_rate
        self.force[at] = motion.force
        if motion.pose is not None and motion.twist is not None:
            self.pose[at], self.twist[at] = motion.pose, motion.twist

    def torques(
        self, rows: IntArray, tape: Tape, gains: Gains, tau_max: Array, played: int
    ) -> None:
        """Write the torques that tapes commanded in the ticks that they were played for."""
        at, ticks = _compact(rows), slice(tape.begin, played)
        feedforward = tape.feedforward[:, ticks]
        feedback = gains.feedback(
            tape.position[:, ticks] - self.joints[at, ticks],
            tape.velocity[:, ticks] - self.joint_rates[at, ticks],
        )
        self.feedback[at, ticks], self.feedforward[at, ticks] = feedback, feedforward
        commanded = feedback + feedforward
        if self.turns:
            commanded += self.balance[at, ticks]
        self.missing[at, ticks] = np.clip(commanded, -tau_max, tau_max) - commanded

    def torque(self, rows: IntArray, ticks: slice) -> Array:
        """Commanded torque of the motors, within their limits [N m], shape (m, ticks, 12)."""
        at = _compact(rows), ticks
        torque = self.feedback[at] + self.feedforward[at]
        torque += self.missing[at]
        if self.turns:
            torque += self.balance[at]
        return torque

    def take_torques(self, rows: IntArray, other: TickLog) -> None:
        """Copy the torques of another log."""
        for torque, others in zip(self._torques, other._torques, strict=True):
            torque[rows] = others[rows]

    def phase(self, rows: IntArray, length: IntArray, *, sensed: int = 0) -> PhaseLog:
        """Make the controller's log of a phase that has ended after so many ticks (m,).

        It may share the log's memory, and holds until something else is written.
        """
        at = _compact(rows), slice(int(length.max()))
        return PhaseLog(
            self.joints[at],
            self.joint_rates[at],
            self.feedback[at],
            self.feedforward[at],
            self.missing[at],
            length,
            sensed,
            load=self.force[at][..., 2].sum(axis=-1),
            pose=self.pose[at] if self.turns else None,
            twist=self.twist[at] if self.turns else None,
            specific_force=self.specific_force[at] if self.inertial else None,
        )

    def attitude(self, rows: IntArray, length: IntArray, index: Array) -> Array:
        """Roll, pitch and heading at fractional ticks (m, k) before the lengths (m,) [rad]."""
        if not self.turns:
            return np.zeros((*index.shape, 3))
        quaternion = resample(self.pose[rows, : int(length.max()), 3:], index)
        quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
        return roll_pitch_yaw(rotation_matrix(quaternion))

    def take_over(self, before: TickLog, ticks: int) -> None:
        """Take the first ticks, which were felt late, of another log of the same robots."""
        for channel, others in zip(self._channels, before._channels, strict=True):
            channel[:, :ticks] = others[:, :ticks]

    def rewind(self, rows: IntArray, start: IntArray, ticks: int) -> None:
        """Move the ticks from `start` (m,) on to the beginning, as the first of the next phase."""
        kept = np.minimum(start[:, None] + np.arange(ticks), self.size - 1)  # (m, ticks)
        for channel in self._channels:
            channel[rows, :ticks] = channel[rows[:, None], kept]


def _compact(rows: IntArray) -> IntArray | slice:
    """The rows as a slice where they follow each other, which is read without being copied."""
    first, last = int(rows[0]), int(rows[-1])
    together = last - first == len(rows) - 1 and bool(np.all(np.diff(rows) == 1))
    return slice(first, last + 1) if together else rows


class StrideLog:
    """The strides of n robots, numbered from 0; a stride goes from touchdown to touchdown.

    Its arrays are those of `STRIDE_QUANTITIES`, `log["peak_error"]` for instance, whose first axes
    are n robots and strides, NaN where a stride has not come so far; those of `COMMAND_QUANTITIES`,
    NaN where no speed is commanded; those of
    `CONDITION_QUANTITIES`; and those of `TICK_QUANTITIES`, see `ticks`.

    Args:
        gaits: The gait of each robot.
        duration: How long is simulated [s].
        timestep: Length of a tick [s].
        others: Gaits that robots may change to.
        conditions: Number of conditions that are estimated.

    Attributes:
        count: Strides that each robot has finished, shape (n,).
    """

    def __init__(
        self,
        gaits: Sequence[Gait],
        duration: float,
        timestep: float,
        *,
        others: Sequence[Gait] = (),
        conditions: int = 0,
    ) -> None:
        n = len(gaits)
        parts = [[getattr(gait, part).duration for gait in gaits] for part in PARTS]
        self._planned = np.array(parts)  # (2, n)
        whole = self._planned.sum(axis=0)
        shortest = min(gait.duration for gait in (*gaits, *others))
        self._timestep = timestep
        self._grid = phase_grid(SAMPLES)
        self._begin_x = np.zeros(n)
        self._contact = ContactErrors(gaits, timestep, others=others)
        self.count = np.zeros(n, dtype=np.intp)
        # Ticks are kept in turn, and only near the end of the simulation.
        self._near = (LAST + 1) * LONGEST_PART * whole
        self._close = np.zeros(n, dtype=bool)
        self._strides = int(np.ceil(duration / (SHORTEST_STRIDE * shortest))) + 1
        longest = max(getattr(gait, part).duration for gait in (*gaits, *others) for part in PARTS)
        ticks = int(np.ceil(LONGEST_PART * longest / timestep))
        sizes = {"speed": n, "stride": self._strides, "tick": ticks, **sizes_of(gaits[0])}
        sizes["condition"] = conditions
        kept = (*STRIDE_QUANTITIES, *COMMAND_QUANTITIES, *CONDITION_QUANTITIES)
        self._arrays = {each.name: each.empty(sizes) for each in kept}
        self._ticks = {each.name: each.empty(sizes) for each in TICK_QUANTITIES}

    def __getitem__(self, name: str) -> npt.NDArray[np.floating[Any]]:
        """The array of a quantity of the strides."""
        return self._arrays[name]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities of the strides."""
        return tuple(self._arrays)

    def change(self, rows: IntArray, gaits: Sequence[Gait], commanded: Array) -> None:
        """Take other gaits for robots from the stride on that begins, at commanded speeds (m,)."""
        at = rows, self.count[rows]
        self["commanded"][at] = commanded
        self["gait_speed"][at] = [gait.speed for gait in gaits]
        for part, name in enumerate(PARTS):
            self._planned[part, rows] = [getattr(gait, name).duration for gait in gaits]
        self._contact.change(rows, gaits)

    def begin(self, rows: IntArray, start: Array, learning: BoolArray, *, remaining: Array) -> None:
        """Begin strides at the times `start` (m,) [s], with `remaining` (m,) [s] to go."""
        at = (rows, self.count[rows])
        self["start"][at], self["learning"][at] = start, learning
        self._close[rows] = remaining < self._near[rows]

    def stance(self, rows: IntArray, record: StrideRecord, log: TickLog, length: IntArray) -> None:
        """Log a stance of so many ticks (m,)."""
        at = (rows, self.count[rows])
        self["peak_error"][at], self["rms_error"][at] = self._contact.stance(
            rows, log.joints, log.force, length
        )
        self["felt_peak_error"][at] = np.abs(record.error).max(axis=1)
        self["stance"][at] = length * self._timestep
        self._begin_x[rows] = log.base[rows, 0, 0]
        self._keep(0, rows, record, log, length)

    def flight(self, rows: IntArray, record: StrideRecord, log: TickLog, length: IntArray) -> None:
        """Log a flight of so many ticks (m,)."""
        ticks = np.arange(int(length.max()))
        height = log.base[_compact(rows), : len(ticks), 1]
        highest = np.where(ticks < length[:, None], height, -np.inf).max(axis=1)
        self["apex"][rows, self.count[rows]] = highest
        self._contact.flight(rows, log.joints, log.force, length)
        self._keep(1, rows, record, log, length)

    def _keep(
        self, part: int, rows: IntArray, record: StrideRecord, log: TickLog, length: IntArray
    ) -> None:
        """Curves of a part of the strides, and its ticks where the end is near."""
        at = (rows, self.count[rows], part)
        self["error"][at] = record.error[:, ::EVERY]
        self["feedback"][at] = record.feedback[:, ::EVERY]
        self["feedforward"][at] = record.feedforward[:, ::EVERY]
        index = self._grid * self._planned[part, rows, None] / self._timestep
        index = np.minimum(index, length[:, None] - 1.0)
        self["base"][at] = resample(log.base[_compact(rows), : int(length.max())], index)
        self["attitude"][at] = log.attitude(rows, length, index)
        close = self._close[rows]
        if close.any():
            self._keep_ticks(part, rows[close], log, length[close])

    def _keep_ticks(self, part: int, rows: IntArray, log: TickLog, length: IntArray) -> None:
        slot, size = self.count[rows] % LAST, self._ticks["tick_base"].shape[3]
        at = _compact(rows), slice(min(int(length.max()), size))
        values = {
            "tick_joints": log.joints[at],
            "tick_joint_rates": log.joint_rates[at],
            "tick_torque": log.torque(rows, at[1]),
            "tick_feedforward": log.feedforward[at],
            "tick_base": log.base[at],
            "tick_base_rate": log.base_rate[at],
            "tick_force": log.force[at],
        }
        who, beyond = np.nonzero(np.arange(size) >= length[:, None])
        for name, array in self._ticks.items():
            array[rows, slot, part, at[1]] = values[name]
            array[rows[who], slot[who], part, beyond] = np.nan

    def end(
        self,
        rows: IntArray,
        duration: Array,
        x: Array,
        upright: BoolArray,
        skipped: IntArray,
        *,
        tilt: Array | float = 0.0,
        heading: Array | float = 0.0,
        flight_reference: Array | float = np.nan,
    ) -> None:
        """End strides after their durations (m,) [s], with the trunk at x (m,) [m].

        Args:
            rows: Whose.
            duration: From touchdown to touchdown [s].
            x: Where the trunk is [m].
            upright: Whether they have not fallen.
            skipped: Why nothing is learned from them, see `StrideSelection`.
            tilt: Largest angle between trunk and gait [rad].
            heading: Of the trunk at touchdown [rad].
            flight_reference: How long the reference of the flight lasted [s].
        """
        at = (rows, self.count[rows])
        self["duration"][at] = duration
        self["mean_speed"][at] = (x - self._begin_x[rows]) / duration
        self["upright"][at] = upright
        self["skipped"][at] = skipped
        self["tilt"][at], self["heading"][at] = tilt, heading
        self["flight_reference"][at] = flight_reference
        self.count[rows] = np.minimum(self.count[rows] + 1, self._strides - 1)

    @property
    def full(self) -> bool:
        """Whether a robot has no room for another stride."""
        return bool(np.any(self.count >= self._strides - 1))

    def restart(self) -> None:
        """Forget all strides, and number the next ones from 0."""
        self.count[:] = 0
        for array in self._ticks.values():
            array[:] = np.nan

    def finish(self, upright: BoolArray) -> None:
        """End the log; a fall in an unfinished stride counts for the last finished one."""
        self["upright"][np.arange(len(upright)), np.maximum(self.count - 1, 0)] = upright

    def ticks(self) -> dict[str, Array]:
        """The last strides at every tick, by name: shape (n, last, 2, ticks, ...), oldest first.

        NaN where a part has ended, and before a robot's first stride.
        """
        order = (self.count[:, None] + np.arange(LAST)) % LAST  # (n, last)
        rows = np.arange(len(order))[:, None]
        sorted_ = {name: store[rows, order] for name, store in self._ticks.items()}
        used = np.isfinite(sorted_["tick_base"]).any(axis=(0, 1, 2, 4))
        length = int(np.flatnonzero(used).max(initial=0)) + 1
        return {name: values[:, :, :, :length] for name, values in sorted_.items()}
