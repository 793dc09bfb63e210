"""Following of a commanded speed: what changes at lift-off and touchdown, with the gait."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Array, BoolArray, IntArray
from ..errors import InvalidInput
from ..gait import Gait
from ..kinematics import leg_geometry, leg_motion
from ..robot import Robot
from .controller_spec import ControllerSpec
from .learning import Memory, ModelBasedILC
from .signals import LATEST_TOUCHDOWN, Reference
from .speed_command import SpeedCommand

_STEADY = 0.05
"""Change of the gait's speed [m/s] in a stride below which there is none."""

_UNCHANGED = 2
"""Strides without a change after which a stride tells of the conditions."""

_SETTLED = 5
"""Strides without a change after which a robot is as usual."""

_MOST = 0.05
"""Largest change of a flight's duration by the speed at which it begins, over the planned one."""


def check_follows(spec: ControllerSpec) -> None:
    """Refuse a controller whose law is made of one gait's model.

    Raises:
        InvalidInput: It is.
    """
    if any(isinstance(law, ModelBasedILC) for law in spec.laws):
        raise InvalidInput(
            f"controller '{spec.name}' learns by a model of one gait, and with a commanded speed "
            "gaits change; choose another law, as that of 'library+ilc'"
        )


class CommandFollower:
    """Changes the gaits of robots at each stride, and with them what was learned for each speed.

    At lift-off they fly to the touchdown of another gait; at touchdown they stand in it, and what
    they learned since is stored in the command's memory.

    Args:
        command: Their speeds, the gaits for them, and the memory.
        robot: The robot.
        spec: Their controller.
        gaits: The gaits that they begin with.
        stance: References of their stances, which change.
        flight: Those of their flights, which change.
        feedforward: What they play [N m], shape (n, 2, samples, 12), which changes.

    Raises:
        InvalidInput: The controller's guard, or its law, is of one gait.
    """

    def __init__(
        self,
        command: SpeedCommand,
        robot: Robot,
        spec: ControllerSpec,
        *,
        gaits: Sequence[Gait],
        stance: Reference,
        flight: Reference,
        feedforward: Array,
    ) -> None:
        if spec.guard is not None:
            raise InvalidInput(
                f"controller '{spec.name}' cannot change its gait, as the guard of its learning is "
                "of one gait; use it with guard=None"
            )
        check_follows(spec)
        self._command, self._profile = command, spec.regulator.profile
        self._stance, self._flight, self._feedforward = stance, flight, feedforward
        self._gaits = list(gaits)  # those that are flown to, or stood in
        self._standing = np.array([gait.speed for gait in gaits])
        self._stood_before = self._standing.copy()
        self._since = np.full(len(gaits), _SETTLED)  # strides since the gait changed
        self._usual = np.full((len(gaits), len(command.speeds)), np.nan)
        self._geometry = leg_geometry(robot)
        flights = [gait.flight for gait in command.gaits_at(command.speeds)]
        begin, end = np.zeros(1), np.ones(1)
        self._rising = np.array([flight.base_reference(begin)[1][0, 1] for flight in flights])
        self._sinking = np.array([-flight.base_reference(end)[1][0, 1] for flight in flights])
        self._lasting = np.array([flight.duration for flight in flights])
        joints = np.concatenate([flight.joint_reference(begin)[0] for flight in flights])
        self._height = self._height_of(joints)

    def _height_of(self, joints: Array) -> Array:
        """Height of trunks above their feet [m], from joint angles (m, 12) to (m,)."""
        angles = joints.reshape(len(joints), -1, 3)
        feet = leg_motion(self._geometry, angles, np.zeros_like(angles)).position
        return np.asarray(-feet[..., 2].mean(axis=1))

    @property
    def gaits(self) -> tuple[Gait, ...]:
        """The gaits that the robots fly to, or stand in."""
        return tuple(self._gaits)

    def lift_off(
        self,
        rows: IntArray,
        commanded: Array,
        measured: Array,
        *,
        rising: Array,
        joints: Array,
    ) -> Array:
        """Let robots fly to the touchdowns of other gaits.

        Args:
            rows: Which robots.
            commanded: Speeds commanded for their landing [m/s], shape (m,).
            measured: Speeds of their trunks [m/s], shape (m,).
            rising: Their speeds upward [m/s], shape (m,).
            joints: Joint angles in which they lift off [rad], shape (m, 12).

        Returns:
            Speeds at lift-off that the regulation is to want [m/s], shape (m,).
        """
        command, flight = self._command, self._flight
        change = command.change(rows, commanded, measured)
        parts = [gait.flight for gait in change.gaits]
        stretched = command.memory.stretch_at(rows, change.speed)
        longer = self._longer(rows, rising, joints)
        stretched += np.clip(longer / [part.duration for part in parts], -_MOST, _MOST)
        flight.change(rows, parts, LATEST_TOUCHDOWN, stretched=stretched)
        self._feedforward[rows, 1] = command.memory.at(rows, change.speed, 1)
        for row, gait in zip(rows, change.gaits, strict=True):
            self._gaits[row] = gait
        return change.lift_off_speed

    def _longer(self, rows: IntArray, rising: Array, joints: Array) -> Array:
        """How much longer than usual flights will last by ballistics [s], from (m,) to (m,).

        `dT = (T dv + dz) / w`, for a trunk that lifts off at speed dv and height dz beside the
        gait's, and sinks at w when it lands. A stance that brakes leaves the ground more slowly.
        What is usual beside a gait, as the ground and the motors have it, is known by speed from
        strides that no change came before; where there was none, nothing is done.
        """
        speeds, standing = self._command.speeds, self._standing[rows]
        planned = (self._rising, self._height, self._lasting, self._sinking)
        speed, height, lasting, sinking = (np.interp(standing, speeds, of) for of in planned)
        beside = ((rising - speed) * lasting + self._height_of(joints) - height) / sinking
        changed = np.abs(standing - self._stood_before[rows]) > _STEADY
        self._stood_before[rows] = standing
        self._since[rows] = np.where(changed, 0, self._since[rows] + 1)
        steady = self._since[rows] >= _SETTLED
        longer = np.zeros(len(rows))
        for k, row in enumerate(rows):
            usual = self._usual[row]
            if steady[k]:
                knot = int(np.argmin(np.abs(speeds - standing[k])))
                known = usual[knot]
                usual[knot] = beside[k] if np.isnan(known) else known + 0.5 * (beside[k] - known)
            elif (there := np.isfinite(usual)).any():
                longer[k] = beside[k] - np.interp(standing[k], speeds[there], usual[there])
        return longer

    def touchdown(self, rows: IntArray, before: Memory) -> None:
        """Store what robots have learned, and let them stand in the gaits that they flew to.

        Args:
            rows: Which robots.
            before: What they played before they learned.
        """
        memory, landed = self._command.memory, self._command.speed[rows]
        learned = self._feedforward[rows] - before.feedforward
        memory.teach(rows, self._standing[rows], 0, learned[:, 0])
        memory.teach(rows, landed, 1, learned[:, 1])
        longer = (self._flight.duration[rows] - before.flight) / self._flight.planned[rows]
        memory.teach_stretch(rows, landed, longer)
        self._standing[rows] = landed
        self._feedforward[rows, 0] = memory.at(rows, landed, 0)
        self._stance.change(rows, [self._gaits[row].stance for row in rows], 1.0)

    def steady(self, rows: IntArray) -> BoolArray:
        """Whether robots' gaits have not changed for some strides, shape (m,)."""
        same = np.abs(self._command.speed[rows] - self._standing[rows]) < _STEADY
        return np.asarray(same & (self._since[rows] >= _UNCHANGED))

    def stored(self, rows: IntArray) -> Array:
        """Speeds for which robots store what they play [m/s], shape (m, knots)."""
        return np.tile(self._command.memory.speeds, (len(rows), 1))

    def shift(self, rows: IntArray, change: Memory) -> None:
        """Change what robots store for each speed.

        Args:
            rows: Which robots.
            change: What comes on top: torques (m, knots, 2, samples, 12) [N m], and durations of
                flights (m, knots) [s].
        """
        memory = self._command.memory
        memory.feedforward[rows] += change.feedforward
        lasting = np.interp(memory.speeds, self._command.speeds, self._lasting)
        memory.stretch[rows] += change.flight / lasting

    def joined(
        self, rows: IntArray, began: Array, position: Array, velocity: Array
    ) -> tuple[Array, Array]:
        """Flights that begin where the stances before end, and go over to their own.

        What lies between goes as the regulation comes, with `1 - profile`.

        Args:
            rows: Which robots.
            began: Joint angles in which their stances end [rad], shape (m, 12).
            position: Joint angles of their flights [rad], shape (m, ticks, 12).
            velocity: Joint velocities of their flights [rad/s], shape (m, ticks, 12).
        """
        reference = self._flight
        phase = reference.phase[rows, : position.shape[1]]
        share, rate = self._profile(phase)
        between = (began - reference.position[rows, 0])[:, None]
        return (
            position + (1.0 - share)[..., None] * between,
            velocity - (rate / reference.duration[rows, None])[..., None] * between,
        )
