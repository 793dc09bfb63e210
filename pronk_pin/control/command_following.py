"""Following of a commanded speed: what changes at lift-off and touchdown, with the gait."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .._typing import Array, IntArray
from ..errors import InvalidInput
from ..gait import Gait
from .controller_spec import ControllerSpec
from .learning import Memory, ModelBasedILC
from .signals import LATEST_TOUCHDOWN, Reference
from .speed_command import SpeedCommand


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

    @property
    def gaits(self) -> tuple[Gait, ...]:
        """The gaits that the robots fly to, or stand in."""
        return tuple(self._gaits)

    def lift_off(self, rows: IntArray, commanded: Array, measured: Array) -> Array:
        """Let robots fly to the touchdowns of other gaits.

        Args:
            rows: Which robots.
            commanded: Speeds commanded for their landing [m/s], shape (m,).
            measured: Speeds of their trunks [m/s], shape (m,).

        Returns:
            Speeds at lift-off that the regulation is to want [m/s], shape (m,).
        """
        command, flight = self._command, self._flight
        change = command.change(rows, commanded, measured)
        parts = [gait.flight for gait in change.gaits]
        stretched = command.memory.stretch_at(rows, change.speed)
        flight.change(rows, parts, LATEST_TOUCHDOWN, stretched=stretched)
        self._feedforward[rows, 1] = command.memory.at(rows, change.speed, 1)
        for row, gait in zip(rows, change.gaits, strict=True):
            self._gaits[row] = gait
        return change.lift_off_speed

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
