"""Conversion of the trunk's state from Drake's coordinates to Pinocchio's, for every base."""

from __future__ import annotations

import numpy as np

from ...._typing import Array, IntArray
from ....robot import rotation_matrix


class DrakeTrunk:
    """Indices of a trunk in states [time, q, v] of Drake's, and what they say.

    A free trunk has q = [quaternion wxyz, position] and v = [angular, linear velocity], both in the
    world's axes; a guided one x, z, and pitch. They come first in q and in v.

    Args:
        base: How the trunk may move: "locked", "sagittal" or "free".
        nq: Size of q.

    Attributes:
        x_z: Indices of the trunk's x and z.
        x_z_rate: Those of their rates.
        turns: Whether the trunk can turn.
    """

    def __init__(self, base: str, nq: int) -> None:
        self.free, self.turns = base == "free", base != "locked"
        self._q, self._v = 1, 1 + nq
        self.x_z = self._q + np.array([4, 6] if self.free else [0, 1])
        self.x_z_rate = self._v + np.array([3, 5] if self.free else [0, 1])

    def put(self, state: Array, pitch: Array | float, rows: IntArray | None = None) -> None:
        """Set the pitch of the trunks of some robots in states (n, nstate), where they may turn."""
        who = np.arange(len(state)) if rows is None else rows
        angle = np.broadcast_to(np.asarray(pitch, dtype=float), who.shape)
        if self.free:
            state[who, self._q] = np.cos(0.5 * angle)
            state[who, self._q + 2] = np.sin(0.5 * angle)
        elif self.turns:
            state[who, self._q + 2] = angle

    def pose(self, state: Array) -> Array:
        """Position [m] and quaternion xyzw of states (..., nstate), shape (..., 7)."""
        pose = np.zeros((*state.shape[:-1], 7))
        if self.free:
            pose[..., :3] = state[..., self._q + np.array([4, 5, 6])]
            pose[..., 3:] = state[..., self._q + np.array([1, 2, 3, 0])]
            return pose
        pose[..., [0, 2]] = state[..., self.x_z]
        half = 0.5 * state[..., self._q + 2] if self.turns else 0.0
        pose[..., 4], pose[..., 6] = np.sin(half), np.cos(half)
        return pose

    def twist(self, state: Array) -> Array:
        """Linear and angular velocity in the trunk's axes [m/s, rad/s], shape (..., 6)."""
        twist = np.zeros((*state.shape[:-1], 2, 3))
        if self.free:
            twist[..., 0, :] = state[..., self._v + np.array([3, 4, 5])]
            twist[..., 1, :] = state[..., self._v + np.array([0, 1, 2])]
        else:
            twist[..., 0, [0, 2]] = state[..., self.x_z_rate]
            if self.turns:
                twist[..., 1, 1] = state[..., self._v + 2]
        rotation = rotation_matrix(self.pose(state)[..., 3:])
        turned: Array = np.einsum("...ji,...kj->...ki", rotation, twist)
        return turned.reshape(*turned.shape[:-2], 6)

    def generalized(self, state: Array, force: Array, point: Array) -> Array:
        """Generalized force of a force on the trunk, as its first entries of v have it.

        Args:
            state: States, shape (nstate,).
            force: In the world's axes [N], shape (3,).
            point: Where it acts, in the trunk's axes [m], shape (3,).
        """
        if not self.turns:
            return force[[0, 2]]
        moment = np.cross(rotation_matrix(self.pose(state)[3:]) @ point, force)
        if self.free:
            return np.concatenate([moment, force])
        return np.array([force[0], force[2], moment[1]])
