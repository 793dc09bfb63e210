"""Iterative learning laws: from the record of a stride to the feedforward of the next.

A law is a function with parameters and no state: what was learned so far is in the record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeVar

import numpy as np

from ..._checks import SHARE, Interval, instance_of, keep_reals, shown
from ..._typing import Array, IntArray
from ...errors import InvalidInput
from ...gait import Gait
from ..signals import (
    PAPER_A,
    PAPER_B,
    ControlContext,
    Gains,
    StrideRecord,
    ZeroPhaseFilter,
    look_ahead,
)
from .lifted import LiftedModel


class LearningLaw(Protocol):
    """A learning law `u_{k+1} = L(record_k)`: from a stride's record to the next feedforward.

    One that needs to know its robots has a method `bind(context)` too, from a `LawContext` to the
    law that is to be used for them.
    """

    def update(self, record: StrideRecord) -> Array:
        """Compute the next stride's feedforward on the phase grid [N m], shape (n, samples, 12)."""
        ...


@dataclass(frozen=True)
class LawContext(ControlContext):
    """What a learning law may be bound to.

    Attributes:
        part: Part of the stride that the law learns, one of `PARTS`.
        lifted_model: Linearises the stances of a gait under the controller; takes a second.
    """

    part: str
    lifted_model: Callable[[Gait], LiftedModel]


def bound(law: LearningLaw | None, context: LawContext) -> LearningLaw | None:
    """A law bound to the robots that it learns for, if it has a method `bind`.

    Raises:
        InvalidInput: It cannot learn there, or its `bind` returns no law.
    """
    bind = getattr(law, "bind", None)
    if bind is None:
        return law
    ready = bind(context)
    if ready is None:  # which would be a controller that does not learn
        raise InvalidInput(
            f"the law {type(law).__name__} of controller '{context.controller}' returned nothing "
            "from bind(context); let it return the law to use, such as itself"
        )
    return known_law(f"{context.controller}: bound law", ready)


SKIPPED = (
    *("", "not finite", "fallen", "too short", "too long", "duration unknown"),
    *("false touchdown", "contact lost", "tilted"),
)
"""Reasons for which a stride is not learned from; the first stands for none."""


@dataclass(frozen=True)
class StrideSelection:
    """Criteria for strides to learn from: finite, upright, and of about the right length.

    Attributes:
        shortest: Shortest stride, over the reference's duration.
        longest: Longest one.
        tilt: Largest angle between trunk and gait [rad]: where a trunk that is free to turn is
            further off, its attitude comes first.
    """

    shortest: float = 0.7
    longest: float = 1.4
    tilt: float = 0.15

    def __post_init__(self) -> None:
        checks = {
            "shortest": Interval(0, 1),
            "longest": Interval(1, 100),
            "tilt": Interval(0, np.pi, "rad"),
        }
        keep_reals(self, checks, "stride selection: ")

    def skipped(self, record: StrideRecord) -> IntArray:
        """Reasons for which strides are not learned from, as indices into `SKIPPED`, shape (n,)."""
        parts = (record.error, record.error_rate, record.feedback, record.feedforward)
        finite = np.all([np.isfinite(part).all(axis=(1, 2)) for part in parts], axis=0)
        duration = record.relative_duration
        checks = [
            ~finite,
            ~record.upright,
            duration < self.shortest,
            duration > self.longest,
            np.isnan(duration),
        ]
        return np.asarray(np.select(checks, range(1, len(checks) + 1), default=0), dtype=np.intp)


def delivered(record: StrideRecord) -> StrideRecord:
    """The record with the torques that the motors delivered; saturation cuts the feedback first.

    The paper's law stores the recorded torque; what the motors could not give is not in it.
    """
    feedback = record.feedback
    cut = np.clip(record.missing, -np.abs(feedback), np.abs(feedback))
    cut = np.where(cut * feedback < 0.0, cut, 0.0)
    feedforward_cut = record.missing - cut
    return replace(
        record, feedback=feedback + cut, feedforward=record.feedforward + feedforward_cut
    )


def anti_windup(learned: Array, record: StrideRecord, tau_max: Array) -> Array:
    """Limit the next feedforward [N m] to what the motors can deliver.

    Where they were at their limit in the last stride, nothing is added in that direction; and the
    memory never holds more than the limit.

    Args:
        learned: Feedforward of the law, shape (n, samples, 12).
        record: Record that it was learned from.
        tau_max: The motors' limits [N m], shape (12,).
    """
    before = record.feedforward
    further = (learned - before) * record.missing < -_CUT
    return np.clip(np.where(further, before, learned), -tau_max, tau_max)


_CUT = 1e-9
"""Product of torques [(N m)^2] below which a motor did not cut anything off."""


_GAIN = Interval(0, 2, below=True)
_DELTA = Interval(0, 1, below=True)
_RATE_GAIN = Interval(0, 1e3)


def _check_parts(law: str, owner: PDTypeILC | PaperILC | CurrentIterationILC) -> None:
    """The gains and the filter of a law."""
    if not isinstance(owner, CurrentIterationILC) and owner.gains is not None:
        instance_of(f"{law}: gains", owner.gains, Gains, "a Gains, or None for the robot's own")
    if not callable(owner.filter):
        raise InvalidInput(
            f"{law}: filter={shown(owner.filter)} is no filter; give a ZeroPhaseFilter, or a "
            "function of an array (n, samples, 12)"
        )


def known_law(name: str, law: object) -> LearningLaw | None:
    """A learning law, or None.

    Raises:
        InvalidInput: It is neither.
    """
    # Dictionaries and sets have an `update` too.
    other = isinstance(law, type | Mapping | set) or not callable(getattr(law, "update", None))
    if law is not None and other:
        raise InvalidInput(
            f"{name}={shown(law)} is no learning law; give an object with update(record), such as "
            "PDTypeILC(), or None"
        )
    return law  # type: ignore[return-value]


def learned_by(law: LearningLaw, record: StrideRecord, controller: str) -> Array:
    """What a law makes of a stride's record [N m], shape (n, samples, 12).

    Raises:
        InvalidInput: It answers something else, or what is not finite.
    """
    answer, wanted = law.update(record), record.feedforward.shape
    name = f"the law {type(law).__name__} of controller '{controller}'"
    if not isinstance(answer, np.ndarray) or answer.shape != wanted:
        shape = getattr(answer, "shape", None)
        what = shown(answer) if shape is None else f"an array of shape {shape}"
        raise InvalidInput(
            f"{name} answered {what} where {wanted} is expected; let its update(record) return an "
            "array of the shape of record.feedforward"
        )
    if answer.dtype.kind not in "iuf" or not np.isfinite(answer).all():
        raise InvalidInput(
            f"{name} answered torques that are not finite numbers; let its update(record) return "
            "finite ones, as record.error and record.feedforward are"
        )
    return answer


_Filtered = TypeVar("_Filtered", bound="FilteredLaw")


class FilteredLaw:
    """A law with a learning filter, which is looked at when the law is bound.

    Attributes:
        filter: The learning filter Q.
    """

    filter: ZeroPhaseFilter

    def bind(self: _Filtered, context: LawContext) -> _Filtered:
        """The law for a robot, with its gains; warns with `LeakyFilter` if constant torques do not
        pass its filter."""
        if isinstance(self.filter, ZeroPhaseFilter):  # it may be any function
            self.filter.warn()
        if isinstance(self, PDTypeILC | PaperILC) and self.gains is None:
            return replace(self, gains=Gains.of(context.robot))
        return self


@dataclass(frozen=True)
class PDTypeILC(FilteredLaw):
    """PD-type ILC on a memory that holds the feedforward only, with forgetting.

    `ff <- Q[(1 - leak) ff + gain (Kp e + rate_gain Kd e')(s + delta)]`

    Unlike the paper's law its memory holds no feedback torque, so that its learning gain is `gain`
    and not `1 + gain`.

    Attributes:
        gain: Learning gain; 0 to 1.
        leak: Part of the memory that is forgotten in each stride.
        delta: Look-ahead, as a part of the phase s from 0 to 1: how much later the error is read,
            since what a feedforward does takes a while to show in it.
        gains: Weights of the error and its rate, eq. (10); None for the robot's own gains, which
            the law gets when it is bound, and the paper's before.
        rate_gain: Weight of the error's rate beside that; 0 for a P-type law.
        filter: The learning filter Q.
    """

    gain: float = 0.5
    leak: float = 0.03
    delta: float = 0.06
    gains: Gains | None = None
    rate_gain: float = 1.0
    filter: ZeroPhaseFilter = field(default_factory=lambda: ZeroPhaseFilter.butterworth(3, 0.08))

    def __post_init__(self) -> None:
        checks = {"gain": _GAIN, "leak": SHARE, "delta": _DELTA, "rate_gain": _RATE_GAIN}
        keep_reals(self, checks, "a PD-type law: ")
        _check_parts("a PD-type law", self)

    def update(self, record: StrideRecord) -> Array:
        """See `LearningLaw.update`."""
        correction = _weighted_error(record, self.gains, self.delta, self.rate_gain)
        return self.filter((1.0 - self.leak) * record.feedforward + self.gain * correction)


@dataclass(frozen=True)
class PaperILC(FilteredLaw):
    """The paper's law: eq. (10), on the recorded total torque, with the printed filter.

    `ff <- Q[tau + (Kp e + Kd e')(s + delta)]` with `tau = ff + tau_b`, the recorded torque.

    The recorded torque already holds the feedback of the last stride, so the total learning gain
    is 2; only the filter's leak keeps the law from diverging.

    Attributes:
        delta: Look-ahead, as a part of the phase s from 0 to 1, into the error.
        gains: Feedforward gains, in the paper equal to the feedback gains; None as in `PDTypeILC`.
        filter: Zero-phase filter over recorded torques and errors.
    """

    delta: float = 0.06
    gains: Gains | None = None
    filter: ZeroPhaseFilter = field(default_factory=lambda: ZeroPhaseFilter(PAPER_B, PAPER_A))

    def __post_init__(self) -> None:
        keep_reals(self, {"delta": _DELTA}, "the paper's law: ")
        _check_parts("the paper's law", self)

    def update(self, record: StrideRecord) -> Array:
        """See `LearningLaw.update`."""
        torque = record.feedforward + record.feedback
        return self.filter(torque + _weighted_error(record, self.gains, self.delta))


@dataclass(frozen=True)
class CurrentIterationILC(FilteredLaw):
    """Current-iteration law: the feedback that acted in the stride becomes memory.

    `ff <- Q[(1 - leak) ff + gain tau_b(s + delta)]`

    The textbook's form is `u_k = w_k + C e_k` with `w_{k+1} = Q u_k`: the feedback of the present
    stride is part of the trial, and what it did is learned. No model and no second set of gains;
    also known as feedback-error learning.

    Attributes:
        gain: Part of the feedback torque that is taken over; 1 in the textbook.
        leak: Part of the memory that is forgotten in each stride.
        delta: Look-ahead, as a part of the phase s from 0 to 1, into the feedback.
        filter: The learning filter Q.
    """

    gain: float = 0.5
    leak: float = 0.005
    delta: float = 0.05
    filter: ZeroPhaseFilter = field(default_factory=lambda: ZeroPhaseFilter.butterworth(3, 0.04))

    def __post_init__(self) -> None:
        checks = {"gain": _GAIN, "leak": SHARE, "delta": _DELTA}
        keep_reals(self, checks, "a current-iteration law: ")
        _check_parts("a current-iteration law", self)

    def update(self, record: StrideRecord) -> Array:
        """See `LearningLaw.update`."""
        feedback = look_ahead(record.feedback, self.delta)
        return self.filter((1.0 - self.leak) * record.feedforward + self.gain * feedback)


def _weighted_error(
    record: StrideRecord, gains: Gains | None, delta: float, rate_gain: float = 1.0
) -> Array:
    """Kp e(s + delta) + rate_gain Kd e'(s + delta) [N m], shape (n, samples, 12)."""
    gains = Gains() if gains is None else gains
    error = look_ahead(record.error, delta, record.error_onward)
    rate = look_ahead(record.error_rate, delta, record.rate_onward)
    joints = error.shape[-1]
    return gains.proportional(joints) * error + (rate_gain * gains.derivative(joints)) * rate


FLIGHT_LAW = PDTypeILC(
    gain=0.8,
    leak=0.02,
    delta=0.08,
    # The error's rate would learn the vibration of the leg after lift-off.
    rate_gain=0.0,
    filter=ZeroPhaseFilter.butterworth(3, 0.04),
)
"""Law of the flight: P-type, against the gait's own flight, not the one turned for regulation."""
