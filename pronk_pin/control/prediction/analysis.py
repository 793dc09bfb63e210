"""Convergence analysis of learning laws along a gait, by linear algebra and without a simulation.

A law and the lifted model together are one affine iteration of the feedforward u and the state x at
touchdown, `z_{k+1} = T z_k + c`. Its operator is found by asking the law itself, so that any law
that is affine in the record can be analysed. Terms follow Bristow, Tharayil and Alleyne 2006.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from ..._typing import Array
from ...kinematics import mirror, mirrored
from ...robot import Robot
from ..learning import LearningLaw, LiftedModel
from ..signals import StrideRecord

GAIN_ERRORS = (0.7, 1.3)
"""Strengths of the motors, over the model's, for which stability is asked."""
DELAYS = (2, 5, 10)
"""Delays of the feedforward, in samples of the phase grid, for which stability is asked."""
_POWERS = 7

Basis: TypeAlias = scipy.sparse.csr_array
"""Columns that span some feedforwards; each has few entries."""


class QuasiStatic(NamedTuple):
    """The law on a quasi-static joint, which needs the torque d and rests at `Kp e = d - ff`.

    There the law is `ff <- memory (ff + gain Kp e)`, so that the error obeys
    `e_{k+1} - e_inf = memory (1 - gain) (e_k - e_inf)` and
    `e_inf = (1 - memory) / (1 - memory (1 - gain)) e_0`.
    """

    memory: float
    """Share of a constant feedforward that is kept: the DC gain of the filter, less the leak."""
    gain: float
    """Total learning gain: feedback torque added to the memory, before the filter."""

    @property
    def multiplier(self) -> float:
        """Factor that a stride puts on the error's distance from its limit; stable within 1."""
        return self.memory * (1.0 - self.gain)

    @property
    def left(self) -> float:
        """Share of the error that remains in the limit."""
        return (1.0 - self.memory) / (1.0 - self.multiplier)


@dataclass(frozen=True)
class Analysis:
    """Stability, transient growth, limit and robustness of a law along a gait, by the model.

    Attributes:
        quasi_static: The law alone, on a joint that moves slowly.
        radius: Spectral radius of the iteration: below 1 it is stable.
        stride_radius: The same with every stride beginning in the same state, as textbooks have it.
        largest_gain: Largest singular value of the textbook's iteration of the feedforward: below 1
            it comes closer to its limit with every stride.
        transient: Largest norm that powers of the iteration reach, feedforward to feedforward.
        limit: RMS of the error in the limit over that at the beginning, of hip, thigh and calf;
            NaN where the iteration is unstable.
        with_gain_error: Spectral radius by the strength of the motors over the model's.
        with_delay: Spectral radius by the delay of the feedforward [samples of the phase grid].
    """

    quasi_static: QuasiStatic
    radius: float
    stride_radius: float
    largest_gain: float
    transient: float
    limit: Array
    with_gain_error: dict[float, float]
    with_delay: dict[int, float]


def analyze(
    law: LearningLaw,
    model: LiftedModel,
    begin: StrideRecord | None = None,
    *,
    robot: Robot | None = None,
) -> Analysis:
    """Analyse the iteration of a law along a gait: stability, limit and robustness.

    Only what is the same on the left and on the right is looked at, since pronking is; and a law's
    treatment of strides is assumed affine, which limits of the motors are not.

    Args:
        law: The law; one that needs a model has been given it.
        model: The lifted model of the gait.
        begin: The stride at which the learning begins; `model.planned` by default.
        robot: The robot, whose left and right are known by it; without one all feedforwards count.
    """
    begin = model.planned if begin is None else begin
    basis = symmetric_basis(*model.shape, robot)
    operator = iteration(law, model, basis)
    size = basis.shape[1]
    within_stride = iteration(law, model.within_a_stride, basis)
    radius = _radius(operator)
    limit = np.full(3, np.nan)
    if radius < 1.0:
        limit = _by_joint(_limit(law, model, begin, operator, basis)) / _by_joint(begin.error)
    return Analysis(
        quasi_static=quasi_static(law, model),
        radius=radius,
        stride_radius=_radius(within_stride),
        largest_gain=_norm(within_stride),
        transient=_transient(operator, size),
        limit=limit,
        with_gain_error={
            factor: _radius(iteration(law, model.scaled(factor), basis)) for factor in GAIN_ERRORS
        },
        with_delay={
            delay: _radius(iteration(law, model.delayed(delay), basis)) for delay in DELAYS
        },
    )


def predict(law: LearningLaw, model: LiftedModel, begin: StrideRecord, strides: int) -> Array:
    """Predict the errors of the strides of learning by the lifted model [rad].

    Args:
        law: The law.
        model: The lifted model of the gait.
        begin: The last stride before learning, of one robot.
        strides: How many strides of learning.

    Returns:
        Shape (strides + 1, samples, joints), the first that of `begin`.
    """
    errors, record, state = [begin.error[0]], begin, np.zeros((1, len(model.A)))
    for _ in range(strides):
        feedforward = law.update(record)
        state = model.land(record.feedforward, begin, state)
        record = model.stride(feedforward, begin, state)
        errors.append(record.error[0])
    return np.array(errors)


def quasi_static(law: LearningLaw, model: LiftedModel) -> QuasiStatic:
    """Memory and gain of the law for constant records, at mid-stance and for the calf."""
    shape = (1, *model.shape)
    none, ones = np.zeros(shape), np.ones(shape)
    stiffness = model.gains.proportional(shape[2])
    middle = (0, shape[1] // 2, shape[2] - 1)
    memory = float(law.update(StrideRecord.of(none, none, none, ones))[middle])
    added = float(law.update(StrideRecord.of(ones / stiffness, none, ones, none))[middle])
    return QuasiStatic(memory, added / memory if memory != 0.0 else np.inf)


def iteration(law: LearningLaw, model: LiftedModel, basis: Basis) -> Array:
    """Matrix T of the iteration `z_{k+1} = T z_k + c` of z = (u, x), u in an orthonormal basis.

    One column at a time the law is asked for its answer to a unit of u or x, less that to zero.
    What the model makes of a unit is a column of its matrices, so nothing is multiplied.

    Args:
        law: The law.
        model: The lifted model.
        basis: Columns that span the feedforwards, sparse, shape (samples * joints, m).

    Returns:
        Shape (m + states, m + states).
    """
    rows, size = basis.shape
    none = np.zeros((1, rows))
    learned_from_none = law.update(model.record(none, none, none)).reshape(1, -1)
    units = (
        -np.vstack([(model.angle @ basis).T, model.angle_start.T]),
        -np.vstack([(model.rate @ basis).T, model.rate_start.T]),
        np.vstack([basis.T.toarray(), np.zeros((len(model.A), rows))]),
    )
    learned = []
    for part in np.array_split(np.arange(size + len(model.A)), max(1, len(units[0]) // 128)):
        record = _all_of_robot_0(model.record(*(unit[part] for unit in units)))
        learned.append((law.update(record).reshape(len(part), -1) - learned_from_none) @ basis)
    landed = np.vstack([(model.B @ basis).T, model.A.T])
    return np.asarray(np.hstack([np.vstack(learned), landed]).T, dtype=float)


def symmetric_basis(samples: int, joints: int, robot: Robot | None = None) -> Basis:
    """Orthonormal basis of the left-right symmetric feedforwards, shape (samples * joints, m).

    Joints of mirror images turn alike or in opposite senses, as hips do. Without a robot, every
    feedforward.
    """
    if robot is None:
        return scipy.sparse.eye_array(samples * joints, format="csr")
    images = mirrored(robot, np.eye(joints))  # of each joint
    left = [3 * leg + joint for leg, _ in mirror(robot).pairs for joint in range(3)]
    sides = np.sqrt(0.5) * (np.eye(joints) + images)[left].T
    return scipy.sparse.kron(scipy.sparse.eye_array(samples), sides, format="csr")


def _all_of_robot_0(record: StrideRecord) -> StrideRecord:
    record.robot[:] = 0
    return record


def _limit(
    law: LearningLaw, model: LiftedModel, begin: StrideRecord, operator: Array, basis: Array
) -> Array:
    """Errors at the fixed point `z = (1 - T)^-1 c` of the iteration, (samples, joints)."""
    start = np.concatenate([basis.T @ begin.feedforward.reshape(-1), np.zeros(len(model.A))])
    updated = basis.T @ law.update(begin).reshape(-1)
    change = np.concatenate([updated, np.zeros(len(model.A))]) - start
    z = np.linalg.solve(np.eye(len(operator)) - operator, change)  # from the beginning on
    size = basis.shape[1]
    feedforward = begin.feedforward + (basis @ z[:size]).reshape(begin.feedforward.shape)
    return np.asarray(model.stride(feedforward, begin, z[None, size:]).error)


def _by_joint(error: Array) -> Array:
    """RMS over the stance and the legs, of hip, thigh and calf."""
    square = (error.reshape(-1, error.shape[-1]) ** 2).mean(axis=0)
    return np.asarray(
        np.sqrt(square.reshape(-1, 3).mean(axis=0) if square.size % 3 == 0 else square)
    )


def _radius(operator: Array) -> float:
    if len(operator) < 200:
        return float(np.abs(np.linalg.eigvals(operator)).max())
    start = np.random.default_rng(0).standard_normal(len(operator))
    try:
        largest = scipy.sparse.linalg.eigs(
            operator, k=4, ncv=60, v0=start, tol=1e-6, return_eigenvectors=False, maxiter=300
        )
    except scipy.sparse.linalg.ArpackNoConvergence:  # a law without a filter: many are alike
        largest = np.linalg.eigvals(operator)
    return float(np.abs(largest).max())


def _norm(operator: Array) -> float:
    """Largest singular value."""
    if len(operator) < 200:
        return float(np.linalg.norm(operator, 2))
    start = np.random.default_rng(0).standard_normal(len(operator))
    square = scipy.sparse.linalg.LinearOperator(
        operator.shape, matvec=lambda u: operator.T @ (operator @ u), dtype=float
    )
    try:
        (largest,) = scipy.sparse.linalg.eigsh(
            square, k=1, ncv=40, v0=start, tol=1e-9, return_eigenvectors=False
        )
    except scipy.sparse.linalg.ArpackNoConvergence:
        return float(np.linalg.norm(operator, 2))
    return float(np.sqrt(largest))


def _transient(operator: Array, size: int) -> float:
    """Largest 2-norm of the powers 1, 2, 4, ... 64 of the operator, from u to u."""
    largest, power = 0.0, operator
    for k in range(_POWERS):
        power = power @ power if k else power
        largest = max(largest, _norm(power[:size, :size]))
    return largest
