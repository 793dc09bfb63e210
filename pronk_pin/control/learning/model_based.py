"""Model-based learning laws: plant inversion and norm-optimal ILC, on the lifted model.

A feedforward moves the errors of its own stride and, through the touchdown, those of the strides
that follow. A law that knows only the first response works against the second; so the laws here
weigh the responses of several strides. And a gait's model is wrong at high frequencies, where the
response is weak and an inverse is large; so the feedforward is made of a few B-splines a joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from ..._checks import SHARE, Interval, keep_reals, none_or, whole
from ..._typing import Array
from ...errors import InvalidInput
from ..signals import StrideRecord
from .laws import LawContext
from .lifted import LiftedModel

SPLINES = 12
"""Number of B-splines a joint; 12 reach up to about five oscillations in a stance."""
_DEGREE = 3


class ErrorResponse(NamedTuple):
    """Response of the errors of the strides ahead to changes of the feedforward in a basis."""

    basis: Array
    """Feedforwards, orthonormal columns, shape (size, m)."""
    strides: Array
    """Decrease of the errors of the first, second, ... stride, shape (horizon, size, m)."""

    @classmethod
    def of(cls, model: LiftedModel, *, splines: int | None, horizon: int) -> ErrorResponse:
        """Compute the response of a model, `G_j = angle P + angle_start X_j`, in a basis P.

        X_j is the state at the j-th touchdown: `X_{j+1} = A X_j + B P`, `X_1 = 0`.
        `splines=None` takes every sample as it is.
        """
        samples, joints = model.shape
        curves = np.eye(samples) if splines is None else spline_basis(samples, splines)
        basis = np.asarray(np.kron(curves, np.eye(joints)), dtype=float)
        state = np.zeros((len(model.A), basis.shape[1]))
        direct, touchdown, responses = model.angle @ basis, model.B @ basis, []
        for _ in range(horizon):
            responses.append(direct + model.angle_start @ state)
            state = model.A @ state + touchdown
        return cls(basis, np.asarray(np.stack(responses), dtype=float))


@lru_cache
def spline_basis(samples: int, splines: int) -> Array:
    """Orthonormal columns that span the cubic B-splines over the phase, (samples, splines)."""
    inner = np.linspace(0.0, 1.0, splines - _DEGREE + 1)
    knots = np.concatenate([[0.0] * _DEGREE, inner, [1.0] * _DEGREE])
    curves = BSpline.design_matrix(np.linspace(0.0, 1.0, samples), knots, _DEGREE).toarray()
    return np.asarray(np.linalg.qr(curves)[0])


@dataclass(frozen=True)
class ModelBasedILC:
    """A learning law that needs the lifted model of each robot's gait, which `bind` asks for.

    Attributes:
        splines: B-splines a joint that make up the feedforward; None for one a sample.
        horizon: Number of strides ahead whose responses to a change are weighed.
        responses: The models' responses, one for each robot; empty until `bind`
            or `with_models`.
    """

    splines: int | None = field(default=SPLINES, kw_only=True)
    horizon: int = field(default=3, kw_only=True)
    responses: tuple[ErrorResponse, ...] = field(
        default=(), repr=False, compare=False, kw_only=True
    )

    def __post_init__(self) -> None:
        prefix = "a model-based law: "
        whole(f"{prefix}horizon", self.horizon, Interval(1, 100))
        none_or(whole, f"{prefix}splines", self.splines, Interval(_DEGREE + 1, 1000))

    def bind(self, context: LawContext) -> ModelBasedILC:
        """Bind the law to the models of a controller's robots.

        Raises:
            InvalidInput: The trunks may turn, or the law is to learn the flight: the models know
                neither.
        """
        if context.base != "locked":
            raise InvalidInput(
                f"controller '{context.controller}' has a law with a model that counts on a level "
                "trunk; use another controller, or base 'locked'"
            )
        if context.part != "stance":
            raise InvalidInput(
                f"controller '{context.controller}' has a law with a model of the stance as that "
                f"of the {context.part}; use another one, such as PDTypeILC(), or None"
            )
        return self.with_models([context.lifted_model(gait) for gait in context.gaits])

    def with_models(self, models: Sequence[LiftedModel]) -> ModelBasedILC:
        """The law with the models of its robots, in the order of `StrideRecord.robot`."""
        responses = tuple(
            ErrorResponse.of(model, splines=self.splines, horizon=self.horizon) for model in models
        )
        return replace(self, responses=responses)

    def update(self, record: StrideRecord) -> Array:
        """See `LearningLaw.update`."""
        learned = np.empty_like(record.feedforward)
        for robot in np.unique(record.robot):
            if robot >= len(self.responses):
                raise InvalidInput(
                    f"{type(self).__name__} knows the models of {len(self.responses)} robots and "
                    f"is asked for robot {robot}; give it theirs by `with_models(models)`"
                )
            rows = np.flatnonzero(record.robot == robot)
            errors = record.error[rows].reshape(len(rows), -1)
            memory = record.feedforward[rows].reshape(len(rows), -1)
            amounts = self._next(int(robot), errors, memory @ self.responses[robot].basis)
            learned[rows] = (amounts @ self.responses[robot].basis.T).reshape(learned[rows].shape)
        return learned

    def _next(self, robot: int, errors: Array, memory: Array) -> Array:
        """Next feedforwards in the basis (k, m), from errors (k, size) and the last ones."""
        raise NotImplementedError


@dataclass(frozen=True)
class PlantInversionILC(ModelBasedILC):
    """Plant-inversion ILC: the change that would have undone the errors of all strides ahead.

    `ff <- (1 - leak) ff + gain G^+ e`, with G the mean response over the horizon, whose singular
    values below `cutoff` times the largest are not inverted.

    Attributes:
        gain: Learning gain; 0 to 1. With a horizon of 1, 1 converges in one stride where every
            stride begins in the same state and the model is right.
        cutoff: Weakest direction that is inverted, over the strongest.
        leak: Part of the memory that is forgotten in each stride.
    """

    gain: float = 0.5
    cutoff: float = 0.1
    leak: float = 0.0
    inverses: tuple[Array, ...] = field(default=(), repr=False, compare=False, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        checks = {
            "gain": Interval(0, 2, below=True),
            "cutoff": Interval(0, 1, above=True, below=True),
            "leak": SHARE,
        }
        keep_reals(self, checks, "plant inversion: ")

    def with_models(self, models: Sequence[LiftedModel]) -> PlantInversionILC:
        """See `ModelBasedILC.with_models`."""
        bound = super().with_models(models)
        inverses = tuple(
            np.linalg.pinv(response.strides.mean(axis=0), rcond=self.cutoff)
            for response in bound.responses
        )
        return replace(self, responses=bound.responses, inverses=inverses)

    def _next(self, robot: int, errors: Array, memory: Array) -> Array:
        change = errors @ self.inverses[robot].T
        return np.asarray((1.0 - self.leak) * memory + self.gain * change)


@dataclass(frozen=True)
class NormOptimalILC(ModelBasedILC):
    """Norm-optimal ILC: the least sum of squares of errors, change and feedforward, by the model.

    The next feedforward minimises `mean |e_j|^2 + change |ff - ff_last|^2 + effort |ff|^2` for the
    predicted errors e_j of the strides ahead in which it is kept (Gunnarsson and Norrlof 2001;
    several strides ahead: predictive, as in Amann, Owens and Rogers 1998). In closed form
    `ff <- ff + (G^T G + (change + effort) 1)^-1 (G^T e - effort ff)`, means over the horizon.

    Attributes:
        change: Weight of the change of the feedforward [rad^2/(N m)^2]: slower, but more robust.
        effort: Weight of the feedforward itself [rad^2/(N m)^2]: what does not help is forgotten.
    """

    change: float = 3e-5
    effort: float = 1e-7
    steps: tuple[tuple[Array, Array], ...] = field(
        default=(), repr=False, compare=False, kw_only=True
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        weight = Interval(0, 1e12, "rad^2/(N m)^2")
        keep_reals(self, {"change": weight, "effort": weight}, "a norm-optimal law: ")
        if not self.change + self.effort > 0.0:
            raise InvalidInput(
                "a norm-optimal law needs one weight that is positive; "
                f"got change={self.change:g}, effort={self.effort:g}"
            )

    def with_models(self, models: Sequence[LiftedModel]) -> NormOptimalILC:
        """See `ModelBasedILC.with_models`."""
        bound, steps = super().with_models(models), []
        for response in bound.responses:
            square = np.mean([G.T @ G for G in response.strides], axis=0)
            inverse = np.linalg.inv(square + (self.change + self.effort) * np.eye(len(square)))
            steps.append((inverse @ response.strides.mean(axis=0).T, self.effort * inverse))
        return replace(self, responses=bound.responses, steps=tuple(steps))

    def _next(self, robot: int, errors: Array, memory: Array) -> Array:
        by_error, by_memory = self.steps[robot]
        return np.asarray(memory + errors @ by_error.T - memory @ by_memory.T)
