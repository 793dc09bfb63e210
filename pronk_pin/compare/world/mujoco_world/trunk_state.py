"""Conversion of the trunk's state from MuJoCo's coordinates to Pinocchio's, for every base."""

from __future__ import annotations

import mujoco
import numpy as np

from ...._typing import Array, IntArray
from ....robot import Robot, rotation_matrix


class Trunk:
    """Indices of a model's trunk in MuJoCo's full physics state (time, qpos, qvel).

    Attributes:
        x_z: Indices of the trunk's x and z.
        x_z_rate: Those of their rates.
        turns: Whether the trunk can turn.
    """

    def __init__(self, model: mujoco.MjModel, robot: Robot) -> None:
        body = model.body(robot.spec.base_link)
        joints = body.jntadr[0] + np.arange(body.jntnum[0])
        position = 1 + model.jnt_qposadr[joints]
        rate = 1 + model.nq + model.jnt_dofadr[joints]
        self._free = model.jnt_type[joints[0]] == mujoco.mjtJoint.mjJNT_FREE
        self._start, self._rate = int(position[0]), int(rate[0])
        if self._free:
            self.x_z, self.x_z_rate = position[0] + np.array([0, 2]), rate[0] + np.array([0, 2])
            self._pitch = None
        else:
            self.x_z, self.x_z_rate = position[:2], rate[:2]
            self._pitch = (int(position[2]), int(rate[2])) if len(joints) > 2 else None
        self.turns = self._free or self._pitch is not None

    def put(self, state: Array, pitch: Array | float, rows: IntArray | None = None) -> None:
        """Set the pitch of the trunks of some robots in states (n, nstate), where they may turn."""
        who = np.arange(len(state)) if rows is None else rows
        half = 0.5 * np.broadcast_to(np.asarray(pitch, dtype=float), who.shape)
        if self._free:
            state[who, self._start + 3] = np.cos(half)
            state[who, self._start + 5] = np.sin(half)
        elif self._pitch is not None:
            state[who, self._pitch[0]] = 2.0 * half

    def pose(self, state: Array) -> Array:
        """Position [m] and quaternion xyzw of states (..., nstate), shape (..., 7)."""
        pose = np.zeros((*state.shape[:-1], 7))
        pose[..., 6] = 1.0
        if self._free:
            pose[..., :3] = state[..., self._start : self._start + 3]
            pose[..., 3:] = state[..., self._start + np.array([4, 5, 6, 3])]
            return pose
        pose[..., [0, 2]] = state[..., self.x_z]
        if self._pitch is not None:
            half = 0.5 * state[..., self._pitch[0]]
            pose[..., 4], pose[..., 6] = np.sin(half), np.cos(half)
        return pose

    def twist(self, state: Array) -> Array:
        """Linear and angular velocity in the trunk's axes [m/s, rad/s], shape (..., 6)."""
        twist = np.zeros((*state.shape[:-1], 6))
        if self._free:
            twist[:] = state[..., self._rate : self._rate + 6]  # the angular part is the trunk's
        else:
            twist[..., [0, 2]] = state[..., self.x_z_rate]
            if self._pitch is None:
                return twist
            twist[..., 4] = state[..., self._pitch[1]]
        rotation = rotation_matrix(self.pose(state)[..., 3:])
        twist[..., :3] = np.einsum("...ji,...j->...i", rotation, twist[..., :3])
        return twist
