"""Errors of the stance from the true contact on, whatever the controller makes of its sensors.

A controller feels a touchdown late, and may count the stance from a wrong instant. Here the ground
decides: a stance begins at the last tick before a foot bears load, and lasts as long as the gait's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._typing import Array, BoolArray, IntArray
from ...control import Reference
from ...gait import Gait

_BEFORE = 40
"""Ticks before a touchdown as the controller has it in which the true contact is looked for."""


class ContactErrors:
    """Peak and root mean square of stance errors, from the true contact to the gait's lift-off.

    With t_c the last tick before a foot bears load, `e(t) = q_d(t - t_c) - q(t)` for t from t_c on,
    as long as the stance lasts, the gait's and the robot's: q_d is the gait's stance, unmodified.

    Args:
        gaits: The gait of each of the n robots.
        timestep: Length of a tick [s].
        others: Gaits that robots may change to.
    """

    def __init__(
        self, gaits: Sequence[Gait], timestep: float, *, others: Sequence[Gait] = ()
    ) -> None:
        self._stance = Reference.of(
            [gait.stance for gait in gaits], timestep, 1.0, others=[gait.stance for gait in others]
        )
        self._position, self._ticks = self._stance.position, self._stance.ticks
        self._joints = np.full((len(gaits), _BEFORE, self._position.shape[-1]), np.nan)
        self._loaded = np.zeros((len(gaits), _BEFORE), dtype=bool)

    def change(self, rows: IntArray, gaits: Sequence[Gait]) -> None:
        """Take other gaits for robots from now on."""
        self._stance.change(rows, [gait.stance for gait in gaits], 1.0)

    def flight(self, rows: IntArray, joints: Array, force: Array, length: IntArray) -> None:
        """Keep the last ticks of some robots' flights.

        Args:
            rows: Which robots, shape (m,).
            joints: Joint angles of all robots at each tick [rad], shape (n, ticks, 12).
            force: Ground's force on each foot, world frame [N], shape (n, ticks, 4, 3).
            length: Ticks of the flights, shape (m,).
        """
        ticks = length[:, None] + np.arange(-_BEFORE, 0)  # (m, _BEFORE)
        there = np.maximum(ticks, 0)
        self._joints[rows] = joints[rows[:, None], there]
        loaded = _loaded(force[rows[:, None], there])
        self._loaded[rows] = loaded & (ticks > length[:, None] // 2)  # not the lift-off's

    def stance(
        self, rows: IntArray, joints: Array, force: Array, length: IntArray
    ) -> tuple[Array, Array]:
        """Compute peak and root mean square of the errors of some robots' stances [rad].

        Args:
            rows: Which robots, shape (m,).
            joints: Joint angles of all robots at each tick [rad], shape (n, ticks, 12).
            force: Ground's force on each foot, world frame [N], shape (n, ticks, 4, 3).
            length: Ticks of the stances, shape (m,).

        Returns:
            Each of the shape (m, 12).
        """
        ticks = slice(int(length.max()))
        joints = np.concatenate([self._joints[rows], joints[rows, ticks]], axis=1)
        loaded = np.concatenate([self._loaded[rows], _loaded(force[rows, ticks])], axis=1)
        contact = np.where(loaded.any(axis=1), loaded.argmax(axis=1) - 1, _BEFORE)
        tick = np.maximum(contact, 0)[:, None] + np.arange(self._position.shape[1])
        counts = np.arange(self._position.shape[1]) < self._ticks[rows, None]
        counts &= tick < _BEFORE + length[:, None]
        measured = joints[np.arange(len(rows))[:, None], np.minimum(tick, joints.shape[1] - 1)]
        error = np.where(counts[..., None], self._position[rows] - measured, np.nan)
        # Before the first stance nothing is kept: NaN.
        return np.nanmax(np.abs(error), axis=1), np.sqrt(np.nanmean(error**2, axis=1))


def _loaded(force: Array) -> BoolArray:
    """Whether any foot bears load, from the forces on all (..., 4, 3)."""
    return np.asarray((force[..., 2] > 0.0).any(axis=-1))
