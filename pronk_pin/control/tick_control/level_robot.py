"""Equations of motion of robots whose trunks are locked to x and z, for a batch of states.

    M a + h = S^T tau + J^T lam,    a = (x'', z'', joints''),    J a + sigma = 0 at feet that stand

A level trunk leaves J simple: each foot's velocity is the trunk's and that of its own leg's joints.
"""

from __future__ import annotations

import threading

import numpy as np
import pinocchio as pin

from ..._typing import Array, BoolArray
from ...errors import InvalidInput
from ...kinematics import contact_points, leg_geometry
from ...robot import NB, Robot, with_rotors

TRUNK = 2
"""Coordinates of a locked trunk: x and z."""

_ROWS = np.array([0, 2])
"""Those of the floating base's velocities that it has, and of a foot's force that it feels."""

_FORCE_WEIGHT = 1e-6
"""Cost of contact forces against joint torques [m^2], as in `inverse_dynamics`."""


def level_robot(controller: str, robot: Robot, base: str) -> Robot:
    """The robot with its rotors, if its trunk is level.

    Raises:
        InvalidInput: The base is not locked, or the rotors are not known.
    """
    if base != "locked":
        raise InvalidInput(
            f"controller '{controller}' reckons with trunks that are locked to x and z; "
            f"base='{base}' needs another one, such as 'pd' or 'ilc'"
        )
    return with_rotors(robot)


class LevelRobot:
    """Equations of motion of a robot with a level trunk and feet that roll; for several threads.

    Args:
        robot: The robot, with what its model knows beyond the URDF.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.legs = robot, len(robot.legs)
        self._geometry = leg_geometry(robot)
        self._down = np.array([0.0, 0.0, -robot.foot_radius])
        self._scratch = threading.local()
        self._used = np.concatenate([_ROWS, np.arange(NB, robot.nv)])

    @property
    def _data(self) -> pin.Data:
        """Pinocchio's memory of the thread."""
        if not hasattr(self._scratch, "data"):
            self._scratch.data = self.robot.model.createData()
        return self._scratch.data

    def _state(self) -> tuple[Array, Array, Array]:
        """A configuration, velocity and acceleration to be filled in."""
        return self.robot.standing.copy(), np.zeros(self.robot.nv), np.zeros(self.robot.nv)

    def forces(self, joints: Array, rates: Array, acceleration: Array) -> Array:
        """Forces `M a + h` that a motion needs without contact [N, N m], shape (m, 14).

        The trunk's place and velocity play no part in it.

        Args:
            joints: Joint angles [rad], shape (m, 12).
            rates: Joint velocities [rad/s], shape (m, 12).
            acceleration: Of trunk and joints [m/s^2, rad/s^2], shape (m, 14).
        """
        needed = np.empty((len(joints), self.robot.nv))
        rnea, model, data = pin.rnea, self.robot.model, self._data
        q, v, a = self._state()
        for angles, speeds, wanted, out in zip(joints, rates, acceleration, needed, strict=True):
            q[1 + NB :], v[NB:], a[NB:] = angles, speeds, wanted[TRUNK:]
            a[0], a[2] = wanted[0], wanted[1]
            out[:] = rnea(model, data, q, v, a)
        return needed[:, self._used]

    def mass_matrix(self, joints: Array) -> Array:
        """Mass matrices M of trunk and joints, shape (m, 14, 14)."""
        mass = np.empty((len(joints), self.robot.nv, self.robot.nv))
        (q, _, _), data = self._state(), self._data
        for angles, out in zip(joints, mass, strict=True):
            q[1 + NB :] = angles
            out[:] = pin.crba(self.robot.model, data, q)
        return mass[:, self._used[:, None], self._used]

    def levers(self, joints: Array) -> Array:
        """Velocities of the contact points for unit joint rates, as seen from the trunk.

        Shape (m, legs, 3, 3); the last axis is hip, thigh, calf.
        """
        legs = joints.reshape(len(joints), self.legs, 3)
        return contact_points(self._geometry, legs, self._down).jacobian

    def jacobian(self, levers: Array) -> Array:
        """Contact Jacobians J of all feet, shape (m, 12, 14)."""
        m, legs = levers.shape[:2]
        whole = np.zeros((m, legs, 3, TRUNK + 3 * legs))
        whole[:, :, _ROWS, np.arange(TRUNK)] = 1.0
        for leg in range(legs):
            at = TRUNK + 3 * leg
            whole[:, leg, :, at : at + 3] = levers[:, leg]
        return whole.reshape(m, 3 * legs, -1)

    def bias(self, joints: Array, rates: Array) -> Array:
        """Contact accelerations sigma of all feet without a [m/s^2], shape (m, 12)."""
        (q, v, still), model, data = self._state(), self.robot.model, self._data
        bias, radius = np.empty((len(joints), self.legs, 3)), self.robot.foot_radius
        for angles, speeds, out in zip(joints, rates, bias, strict=True):
            q[1 + NB :], v[NB:] = angles, speeds
            pin.forwardKinematics(model, data, q, v, still)
            for foot, own in zip(self.robot.foot_ids, out, strict=True):
                motion = pin.getFrameClassicalAcceleration(
                    model, data, foot, pin.LOCAL_WORLD_ALIGNED
                )
                turning = motion.angular
                own[:] = motion.linear
                own[:2] += radius * np.array([-turning[1], turning[0]])
        return bias.reshape(joints.shape)


def cheapest_forces(levers: Array, needed: Array, standing: BoolArray) -> Array:
    """Contact forces of the smallest joint torques that carry the trunk [N], shape (m, legs, 3).

    minimise |needed_j - J_j^T lam|^2 + weight |lam|^2, subject to sum lam = needed along x and z;
    none at feet that do not stand. As `inverse_dynamics` without cones.

    Args:
        levers: See `LevelRobot.levers`.
        needed: Forces without contact, see `LevelRobot.forces`, shape (m, 14).
        standing: Which feet stand, shape (m, legs); robots without any get no forces.
    """
    joints = needed[:, TRUNK:].reshape(*levers.shape[:2], 3, 1)
    transposed = np.swapaxes(levers, -1, -2)
    inverse = np.linalg.inv(levers @ transposed + _FORCE_WEIGHT * np.eye(3))
    inverse *= standing[..., None, None]
    relaxed = inverse @ (levers @ joints)  # (m, legs, 3, 1), the trunk not yet carried
    carried = inverse[..., _ROWS].sum(axis=1)[:, _ROWS]  # (m, 2, 2)
    carried += np.where(standing.any(axis=1), 0.0, 1.0)[:, None, None] * np.eye(TRUNK)
    lacking = needed[:, :TRUNK, None] - relaxed[:, :, _ROWS].sum(axis=1)
    push = np.linalg.solve(carried, lacking)  # (m, 2, 1)
    return np.asarray((relaxed + inverse[..., _ROWS] @ push[:, None])[..., 0])
