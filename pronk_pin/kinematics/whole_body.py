"""Inverse kinematics of the whole body, by damped Gauss-Newton steps within the joint limits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pinocchio as pin
from proxsuite import proxqp

from .._checks import POSITIVE, Interval, real, whole
from .._typing import Array
from ..robot import NB, Robot, as_array, as_numbers, as_one, as_q, leg_indices
from .contacts import jacobian_at

_DAMPING = (1e-12, 1e-8, 1e-5, 1e-3, 1e-1, 10.0)
"""Dampings of a step that are tried in turn until one brings the targets nearer."""
_ACCURACY = 1e-12
_MOST_ITERATIONS = (1000, 50)
"""Outer and inner iterations of the QP of a step, which takes about ten; contradictory limits would
have it go on for minutes."""
_STALLED = 1e-12
"""Relative decrease of the cost below which nothing more is to be gained."""


class WholeBodySolution(NamedTuple):
    """Configuration with trunk and feet at their targets, or as near as can be."""

    q: Array
    """Configuration, shape (19,), within the joint limits."""
    reached: bool
    """Whether every target is met to the tolerance."""
    base_error: Array
    """Remaining error of the trunk's pose: the translation [m] and rotation [rad] to its target,
    in the trunk's frame, shape (6,); zero where the trunk is free."""
    foot_errors: Array
    """Remaining errors of the feet's positions, in the world [m], shape (feet, 3)."""
    iterations: int
    """Steps that were taken."""


class _Task(NamedTuple):
    """The targets, checked."""

    base: pin.SE3 | None
    feet: Array
    legs: tuple[int, ...]
    weight: float

    def errors(self, robot: Robot, q: Array) -> tuple[Array, Array]:
        """Twist from the trunk to its target (6,), and vectors from feet to targets (feet, 3)."""
        pin.framesForwardKinematics(robot.model, robot.data, q)
        places = [robot.data.oMf[robot.foot_ids[leg]].translation for leg in self.legs]
        apart = self.feet - np.reshape(places, (-1, 3))
        if self.base is None:
            return np.zeros(NB), apart
        return np.array(pin.log6(robot.data.oMi[1].actInv(self.base)).vector), apart

    def cost(self, errors: tuple[Array, Array]) -> float:
        """Weighted sum of squared errors that the steps reduce."""
        base, feet = errors
        return float(self.weight * base @ base + np.sum(feet**2))


def inverse_kinematics(
    robot: Robot,
    base: npt.ArrayLike | None,
    feet: npt.ArrayLike,
    *,
    legs: Iterable[str] | None = None,
    initial: npt.ArrayLike | None = None,
    base_weight: float = 1.0,
    tolerance: float = 1e-9,
    iterations: int = 100,
) -> WholeBodySolution:
    """Configuration with the trunk at a pose and the feet at positions, within the joint limits.

    Each step minimises |J d - e|^2 with a little damping, subject to the joint limits, by ProxQP.
    Targets that cannot be met together are met as nearly as can be (a local minimum), and
    `reached` is false. For legs of three joints, `leg_inverse_kinematics` is exact and quicker;
    this one serves any legs, free trunks, and limits.

    Args:
        robot: The robot.
        base: Pose of the trunk in the world: position [m] and quaternion xyzw, shape (7,); None
            to leave it free.
        feet: Centres of the feet in the world [m], shape (legs, 3).
        legs: Legs whose feet are placed, in the order of `feet`; all if None.
        initial: Configuration to start from, shape (19,); which knees bend which way is decided
            here. By default the standing posture, with its trunk at the pose.
        base_weight: Weight of the trunk's error against the feet's, where not all can be met.
        tolerance: Largest error that counts as reached [m, rad].
        iterations: Most steps.

    Raises:
        InvalidInput: A wrong shape, NaN, a quaternion that is not normalised, or a weight,
            tolerance or number of steps that makes no sense.
        UnknownName: There is no such leg.
    """
    indices = leg_indices(robot, legs)
    targets = as_numbers("feet", feet)
    if targets.size % 3 == 0:
        targets = targets.reshape(-1, 3)
    targets = as_array("feet", targets, 3, (len(indices),))
    base_weight = real("base_weight", base_weight, POSITIVE)
    tolerance = real("tolerance", tolerance, POSITIVE)
    iterations = whole("iterations", iterations, Interval(1, 1_000_000))
    q = robot.standing.copy() if initial is None else as_one("initial", as_q(robot, initial)).copy()
    pose = None
    if base is not None:
        wanted = robot.standing.copy()
        wanted[: NB + 1] = as_array("base", base, NB + 1, ())
        as_q(robot, wanted)
        pose = pin.XYZQUATToSE3(wanted[: NB + 1])
        if initial is None:
            q = wanted
    q[NB + 1 :] = np.clip(q[NB + 1 :], robot.q_min, robot.q_max)
    return _descend(robot, _Task(pose, targets, indices, base_weight), q, tolerance, iterations)


def _descend(
    robot: Robot, task: _Task, q: Array, tolerance: float, iterations: int
) -> WholeBodySolution:
    """Iterate until the targets are reached or come no nearer."""
    qp = proxqp.dense.QP(robot.nv, 0, robot.nu)
    qp.settings.eps_abs, qp.settings.eps_rel = _ACCURACY, 0.0
    qp.settings.max_iter, qp.settings.max_iter_in = _MOST_ITERATIONS
    errors, taken = task.errors(robot, q), 0
    while taken < iterations and not _reached(errors, tolerance):
        improved = _step(robot, task, q, errors, qp)
        if improved is None:
            break
        q, errors = improved
        taken += 1
    return WholeBodySolution(q, _reached(errors, tolerance), *errors, taken)


def _step(
    robot: Robot, task: _Task, q: Array, errors: tuple[Array, Array], qp: proxqp.dense.QP
) -> tuple[Array, tuple[Array, Array]] | None:
    """A configuration nearer to the targets, with its errors; None where there is none."""
    base, feet = errors
    jacobian = jacobian_at(robot, q, task.legs, 0.0)
    hessian, gradient = jacobian.T @ jacobian, -jacobian.T @ feet.ravel()
    if task.base is not None:
        # log6 of a small motion is that motion: near the target, its Jacobian is the identity.
        hessian[:NB, :NB] += task.weight * np.eye(NB)
        gradient[:NB] -= task.weight * base
    joints = q[NB + 1 :]
    rows = np.eye(robot.nu, robot.nv, k=NB)
    before = task.cost(errors)
    for damping in _DAMPING:
        qp.init(
            hessian + damping * np.eye(robot.nv),
            gradient,
            None,
            None,
            rows,
            robot.q_min - joints,
            robot.q_max - joints,
        )
        qp.solve()
        moved = np.array(pin.integrate(robot.model, q, np.array(qp.results.x)))
        moved[NB + 1 :] = np.clip(moved[NB + 1 :], robot.q_min, robot.q_max)
        after = task.errors(robot, moved)
        if task.cost(after) < before * (1.0 - _STALLED):
            return moved, after
    return None


def _reached(errors: tuple[Array, Array], tolerance: float) -> bool:
    return all(float(np.abs(error).max(initial=0.0)) <= tolerance for error in errors)
