"""The robot folded on its mirror plane: the model that the gait optimisation differentiates.

A pronking robot is its own mirror image, so the left legs say everything. The folded model keeps
the trunk and the left legs, and counts each left leg twice where it acts on the trunk. With the
trunk held to the sagittal plane without rotation its coordinates are

    ``q = [x, z, front hip, thigh, calf, rear hip, thigh, calf]``  [m, m, rad, ...]  (8)

with the pitch after z where it is free (9), and its equations are the x, z, pitch and left-leg rows
of the whole robot's: no quaternion, no redundant right side. The trunk's centre of mass is taken to
lie in the mirror plane; what it lies beside it gives a roll moment, which the planar constraint
that keeps the trunk in the plane takes. Where the URDF's left and right legs differ, the folded leg
is their mean, which leaves the motion exact: `asymmetry` says what each side needs besides.

A gait without mirror symmetry needs the whole robot on a free trunk: the same model, not folded.
Its legs are all kept, each counts once, and the trunk's coordinates are x, z and pitch as above,
then y, roll and yaw (18). Mirrored in the sagittal plane, the last three change their sign.

Everything is a CasADi SX expression, so that the solver gets exact derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ..._typing import Array, BoolArray, IntArray
from ...kinematics import Contact, mirror
from ...robot import JOINTS, SLIDING, Base, Robot
from .newton_euler import BASE_COORDINATES, FrameMotion, Half, newton_euler


@dataclass(frozen=True, eq=False)
class FoldedModel:
    """Dynamics and contact kinematics of the folded robot, or of the whole one on a free trunk.

    Forces are those of one motor and of one foot, not of a pair.

    Attributes:
        robot: The robot it was folded from.
        contact: The contact model.
        base: How the trunk may move.
        legs: The legs that are kept, front to rear.
        lever: From a foot's centre to where the ground acts, in the world [m], shape (3,).
        dynamics: ``(q, v, a, lam) -> forces`` (8 or 9): what must act along each coordinate
            besides the contact forces `lam` (6) [N]: zero for the trunk, the motor torques along
            the joints. Eq. (2) of the paper.
        impact: ``(q, dv, impulse) -> residual`` (8 or 9): zero where the contact impulses [N s]
            cause the jump `dv` of the velocity, with no impulse from the motors.
        asymmetry: ``(q, v, a) -> torques`` (6): what the left motors need more than the mean of
            left and right, and the right ones less [N m].
        jump_asymmetry: ``(q, dv) -> momentum`` (6): the same for a jump of the velocity [N m s].
        feet: ``(q, v, a) -> (position, velocity, acceleration)``, each (3, 2): the position is
            that of the spheres' centres [m]; velocity and acceleration are those that vanish in
            contact. Eq. (3) of the paper.
    """

    robot: Robot
    contact: Contact
    base: Base
    legs: tuple[str, ...]
    lever: Array
    dynamics: ca.Function
    impact: ca.Function
    asymmetry: ca.Function
    jump_asymmetry: ca.Function
    feet: ca.Function

    @property
    def nb(self) -> int:
        """Coordinates of the trunk."""
        return BASE_COORDINATES[self.base]

    @property
    def nl(self) -> int:
        """Motors of the folded robot."""
        return len(self.legs) * len(JOINTS)

    @property
    def nq(self) -> int:
        """Coordinates of the folded robot."""
        return self.nb + self.nl

    def joint_rows(self) -> IntArray:
        """Indices of the robot's joints that the folded robot keeps, shape (6,)."""
        kept = np.array([self.robot.legs.index(leg) for leg in self.legs], dtype=np.intp)
        return _leg_joints(kept)

    def leg_index(self) -> IntArray:
        """For each leg of the robot, which leg of the folded robot moves it, shape (4,)."""
        if self.base == "free":
            return np.arange(len(self.legs), dtype=np.intp)
        kept = {leg: i for i, pair in enumerate(mirror(self.robot).pairs) for leg in pair}
        return np.array([kept[leg] for leg in range(len(self.robot.legs))], dtype=np.intp)

    def joint_index(self) -> IntArray:
        """For each joint of the robot, which joint of the folded robot moves it, shape (12,)."""
        return _leg_joints(self.leg_index())

    def joint_sign(self) -> Array:
        """-1 for the joints that the mirror reverses (the A1's right hips), else 1, (12,)."""
        return np.where(self._right()[:, None], mirror(self.robot).sign, 1.0).ravel()

    def force_sign(self) -> Array:
        """-1 where the mirror reverses a contact force (right feet, y), else 1, shape (4, 3)."""
        return np.where(self._right()[:, None] & np.array([False, True, False]), -1.0, 1.0)

    def unfold_joints(self, folded: Array) -> Array:
        """Joint quantities of the whole robot (..., 12) from those of the kept legs (..., 6)."""
        return np.asarray(folded[..., self.joint_index()] * self.joint_sign())

    def unfold_torques(self, mean: Array, left: Array) -> Array:
        """Torques of the whole robot (..., 12) from the mean of left and right (..., 6) and the
        surplus of the left motors over it (..., 6)."""
        sides = np.where(np.repeat(self._right(), len(JOINTS)), -1.0, 1.0)
        return np.asarray(self.unfold_joints(mean) + sides * self.unfold_joints(left))

    def unfold_forces(self, folded: Array) -> Array:
        """Contact forces of the whole robot (..., 4, 3) from those of the kept feet (..., 6)."""
        by_leg = folded.reshape(*folded.shape[:-1], len(self.legs), 3)
        return np.asarray(by_leg[..., self.leg_index(), :] * self.force_sign())

    def mirrored(self, x: ca.SX) -> ca.SX:
        """Mirror the coordinates of the robot on a free trunk, or their rates, (18,)."""
        partner, sign = mirror(self.robot).partner, mirror(self.robot).sign.ravel()
        joints = x[self.nb :][_leg_joints(np.array(partner, dtype=np.intp)).tolist()]
        return ca.vertcat(x[:3], -x[3 : self.nb], joints * ca.DM(sign))

    def _right(self) -> BoolArray:
        return np.array([leg not in self.legs for leg in self.robot.legs])


def _leg_joints(legs: IntArray) -> IntArray:
    """Indices of the joints of legs given by index."""
    return np.asarray(legs[:, None] * len(JOINTS) + np.arange(len(JOINTS))).ravel()


@lru_cache(maxsize=8)
def fold(robot: Robot, contact: Contact = "rolling", base: Base = "locked") -> FoldedModel:
    """Fold a robot on its mirror plane.

    Raises:
        InvalidInput: The legs do not come in pairs, left and right.
    """
    whole = base == "free"
    legs = robot.legs if whole else tuple(robot.legs[left] for left, _ in mirror(robot).pairs)
    half: Half = "own" if whole else "mean"
    nq = BASE_COORDINATES[base] + len(legs) * len(JOINTS)
    q, v, a = (ca.SX.sym(name, nq) for name in "qva")
    lam = ca.SX.sym("lam", 3, len(legs))
    lever = np.array([0.0, 0.0, -robot.foot_radius if contact == "rolling" else 0.0])
    gravity, at_rest = np.array(robot.model.gravity.linear), ca.SX.zeros(nq)
    forces, feet = newton_euler(robot, legs, (q, v, a), lam, gravity, lever, base, half)
    # Over an instant only M dv and the impulses count: no gravity, no velocity products.
    jump, _ = newton_euler(robot, legs, (q, at_rest, a), lam, np.zeros(3), lever, base, half)
    constant = robot.parameters.torque_constant
    nb, none = BASE_COORDINATES[base], ca.SX.zeros(3, len(legs))
    apart, _ = newton_euler(robot, legs, (q, v, a), none, gravity, lever, base, "difference")
    leap, _ = newton_euler(
        robot, legs, (q, at_rest, a), none, np.zeros(3), lever, base, "difference"
    )
    if whole:  # each leg is its own
        apart, leap = ca.SX.zeros(nq), ca.SX.zeros(nq)
    return FoldedModel(
        robot=robot,
        contact=contact,
        base=base,
        legs=legs,
        lever=lever,
        dynamics=ca.Function(
            "dynamics", [q, v, a, ca.vec(lam)], [_of_motors(robot, legs, forces, v)]
        ),
        impact=ca.Function("impact", [q, a, ca.vec(lam)], [jump]),
        asymmetry=ca.Function("asymmetry", [q, v, a], [apart[nb:] / constant]),
        jump_asymmetry=ca.Function("jump_asymmetry", [q, a], [leap[nb:]]),
        feet=ca.Function("feet", [q, v, a], _contact_motion(feet, lever)),
    )


def _of_motors(robot: Robot, legs: tuple[str, ...], forces: ca.SX, v: ca.SX) -> ca.SX:
    """Replace the joint torques among the forces by the commanded motor torques.

    The inverse of `Robot.joint_torques` in CasADi: friction added, over the torque constant.
    """
    n, parameters = len(legs) * len(JOINTS), robot.parameters
    damping = np.tile(parameters.damping, len(legs))
    coulomb = np.tile(parameters.coulomb, len(legs))
    rates = v[-n:]
    friction = ca.DM(damping) * rates + ca.DM(coulomb) * ca.tanh(rates / SLIDING)
    torques = (forces[-n:] + friction) / parameters.torque_constant
    return ca.vertcat(forces[:-n], torques)


def _contact_motion(feet: list[FrameMotion], lever: Array) -> list[ca.SX]:
    """Position, contact velocity and contact acceleration of the feet, each (3, feet).

    The velocity is that of the material point at the lowest point of the sphere. Its derivative
    has no centripetal term: the lever to the lowest point does not turn with the foot.
    """
    position = [foot.position for foot in feet]
    velocity = [foot.velocity + ca.cross(foot.omega, lever) for foot in feet]
    acceleration = [foot.acceleration + ca.cross(foot.alpha, lever) for foot in feet]
    return [ca.horzcat(*position), ca.horzcat(*velocity), ca.horzcat(*acceleration)]
