"""What the world does to the trunk's mass: a payload on it, its centre of mass elsewhere."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin

from .scenario import Scenario


def load_trunk(trunk: mujoco.MjsBody, scenario: Scenario) -> None:
    """Shift the trunk's centre of mass, and merge the payload into its inertia.

    A body of its own for the payload would be fused wrongly (MuJoCo 4.0.0 doubles its offset).

    Args:
        trunk: The trunk; its inertia stands in `inertia` and `iquat`.
        scenario: The world.
    """
    trunk.ipos = np.array(trunk.ipos) + np.array(scenario.com_shift)
    if scenario.payload == 0.0:
        return
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.array(trunk.iquat))
    rotation = flat.reshape(3, 3)
    inertia = rotation @ np.diag(trunk.inertia) @ rotation.T
    own = pin.Inertia(float(trunk.mass), np.array(trunk.ipos), inertia)
    point = pin.Inertia(scenario.payload, np.array(scenario.payload_position), np.zeros((3, 3)))
    both = own + point
    principal, axes = np.linalg.eigh(both.inertia)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    trunk.mass, trunk.ipos = both.mass, both.lever
    trunk.inertia, trunk.iquat = principal, quaternion
