"""The laws on a quasi-static plant, where each multiplies the error by a number known by hand.

A joint that needs the torque d, and gets `ff + Kp e`, rests at the error `e = (d - ff) / Kp`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import (
    SAMPLES,
    CurrentIterationILC,
    Gains,
    LearningLaw,
    LiftedModel,
    ModelBasedILC,
    NormOptimalILC,
    PaperILC,
    PDTypeILC,
    PlantInversionILC,
    StrideRecord,
    StrideSelection,
    ZeroPhaseFilter,
    anti_windup,
    phase_grid,
)
from pronk_pin.errors import InvalidInput

KP = Gains().proportional(12)
LOAD = 6.0 * np.linspace(-1.0, 1.0, 12)  # [N m]
SHAPE = (1, SAMPLES, 12)


def stride(feedforward: Array) -> StrideRecord:
    """A stride of the quasi-static plant under a feedforward."""
    error = (LOAD - feedforward) / KP
    return StrideRecord.of(error, np.zeros(SHAPE), KP * error, feedforward)


def simulate_learning(law: LearningLaw, strides: int) -> Array:
    """Errors before each of some strides, over the error without feedforward; shape (strides,)."""
    record, shares = stride(np.zeros(SHAPE)), []
    for _ in range(strides):
        shares.append(record.error[0, SAMPLES // 2, -1] * KP[-1] / LOAD[-1])
        record = stride(law.update(record))
    return np.array(shares)


@pytest.mark.parametrize("gain", [0.15, 0.5, 1.0, 1.5])
def test_without_forgetting_each_stride_leaves_one_minus_the_gain_of_the_error(gain: float) -> None:
    shares = simulate_learning(PDTypeILC(gain=gain, leak=0.0), 8)
    np.testing.assert_allclose(shares, (1.0 - gain) ** np.arange(8), atol=1e-6)


def test_forgetting_leaves_the_predicted_error() -> None:
    gain, leak = 0.3, 0.1
    shares = simulate_learning(PDTypeILC(gain=gain, leak=leak), 60)
    assert shares[-1] == pytest.approx(leak / (gain + leak), rel=1e-6)


def test_the_default_law_keeps_six_percent_of_a_steady_error_within_8_strides() -> None:
    assert simulate_learning(PDTypeILC(), 9)[8] < 0.06


def test_the_papers_law_with_an_exact_filter_only_turns_the_error_around() -> None:
    shares = simulate_learning(PaperILC(filter=ZeroPhaseFilter.butterworth(3, 0.1)), 9)
    np.testing.assert_allclose(shares, (-1.0) ** np.arange(9), atol=1e-5)


def test_the_printed_filter_holds_the_papers_law_at_78_percent_reduction() -> None:
    shares = simulate_learning(PaperILC(), 60)
    assert np.all(np.abs(shares[1:]) < 1.0)
    # Fixed point of ff <- 0.64 (2 d - ff).
    assert shares[-1] == pytest.approx(1.0 - 1.28 / 1.64, abs=1e-6)


def test_an_error_is_answered_earlier_by_the_look_ahead() -> None:
    s = phase_grid()
    bump = np.exp(-(((s - 0.5) / 0.1) ** 2))[None, :, None] * np.ones(12)
    record = StrideRecord.of(bump, np.zeros(SHAPE), np.zeros(SHAPE), np.zeros(SHAPE))
    peak = s[np.argmax(PDTypeILC(delta=0.1).update(record)[0, :, 0])]
    assert peak == pytest.approx(0.4, abs=0.01)


def test_the_rate_of_the_error_is_weighted_with_the_derivative_gains() -> None:
    ones, none = np.ones(SHAPE), np.zeros(SHAPE)
    learned = PDTypeILC(gain=0.5, leak=0.0).update(StrideRecord.of(none, ones, none, none))
    np.testing.assert_allclose(learned[0, 80], 0.5 * Gains().derivative(12), rtol=1e-6)


@pytest.mark.parametrize("settings", [{"gain": 2.0}, {"leak": 1.1}, {"delta": -0.1}])
def test_a_law_that_cannot_work_is_refused(settings: dict[str, float]) -> None:
    with pytest.raises(InvalidInput, match=r"a PD-type law: .*; give a number from 0"):
        PDTypeILC(**settings)


def test_only_finite_strides_of_about_the_right_length_are_worth_learning_from() -> None:
    duration = np.array([0.6, 0.75, 1.0, 1.35, 1.5, np.inf, np.nan, 1.0])
    error = np.zeros((8, SAMPLES, 12))
    error[7, 3, 4] = np.nan
    record = replace(StrideRecord.of(error, error, error, error), relative_duration=duration)
    usable = StrideSelection().skipped(record) == 0
    assert usable.tolist() == [False, True, True, True, False, False, False, False]


TOY = 20  # samples of a one-joint plant


def toy(rng: np.random.Generator) -> LiftedModel:
    """A causal plant of one joint, whose answers fade."""
    answer = np.tril(0.8 ** np.abs(np.subtract.outer(np.arange(TOY), np.arange(TOY))))
    torque = rng.normal(size=(TOY, 1))
    return LiftedModel.with_resets(answer, np.zeros_like(answer), gains=Gains(), torque=torque)


def errors(law: ModelBasedILC, model: LiftedModel, strides: int) -> Array:
    """Norms of the error of the toy's strides, the first without feedforward."""
    begin = record = model.planned
    bound, norms = law.with_models([model]), [np.linalg.norm(begin.error)]
    for _ in range(strides):
        record = model.stride(bound.update(record), begin, np.zeros((1, 0)))
        norms.append(np.linalg.norm(record.error))
    return np.array(norms)


def test_plant_inversion_needs_one_stride_where_the_model_is_right() -> None:
    model = toy(np.random.default_rng(0))
    norms = errors(PlantInversionILC(gain=1.0, cutoff=1e-6, splines=None, horizon=1), model, 1)
    assert norms[1] < 1e-10 * norms[0]


def test_plant_inversion_diverges_where_the_plant_is_more_than_twice_the_model() -> None:
    model = toy(np.random.default_rng(0))
    law = PlantInversionILC(gain=1.0, cutoff=1e-6, splines=None, horizon=1).with_models([model])
    for factor, grows in ((1.9, False), (2.1, True)):
        plant = model.scaled(factor)
        begin = plant.planned
        after = plant.stride(law.update(begin), begin, np.zeros((1, 0)))
        assert (np.linalg.norm(after.error) > np.linalg.norm(begin.error)) == grows


def test_the_norm_optimal_law_converges_monotonically() -> None:
    norms = errors(
        NormOptimalILC(change=0.5, effort=0.0, splines=None, horizon=1),
        toy(np.random.default_rng(1)),
        60,
    )
    assert np.all(np.diff(norms) < 0.0)
    assert norms[-1] < 1e-3 * norms[0]


def test_the_norm_optimal_law_minimises_what_it_says() -> None:
    model, change, effort = toy(np.random.default_rng(2)), 0.3, 0.2
    begin = model.planned
    law = NormOptimalILC(change=change, effort=effort, splines=None, horizon=1).with_models([model])
    u = law.update(begin).reshape(-1)
    gradient = -model.angle.T @ (begin.error.reshape(-1) - model.angle @ u) + (change + effort) * u
    np.testing.assert_allclose(gradient, 0.0, atol=1e-9)


def test_a_model_based_law_without_its_models_says_what_to_do() -> None:
    with pytest.raises(InvalidInput, match=r"give it theirs by `with_models\(models\)`"):
        NormOptimalILC().update(toy(np.random.default_rng(0)).planned)


def test_the_current_iteration_law_takes_over_what_the_feedback_did() -> None:
    shares = simulate_learning(CurrentIterationILC(gain=0.5, leak=0.0), 6)
    np.testing.assert_allclose(shares, 0.5 ** np.arange(6), atol=1e-6)


def test_the_memory_never_holds_more_than_the_motor_can_give() -> None:
    none = np.zeros(SHAPE)
    record = StrideRecord.of(none, none, none, none)
    held = anti_windup(np.full(SHAPE, 50.0), record, np.full(12, 33.5))
    np.testing.assert_array_equal(held, 33.5)


def carried(rng: np.random.Generator) -> LiftedModel:
    """The toy whose touchdown does once more, and by half more, what a feedforward did."""
    own = toy(rng)
    return replace(
        own,
        angle_start=1.5 * own.angle,
        rate_start=np.zeros_like(own.angle),
        A=np.zeros_like(own.angle),
        B=np.eye(TOY),
    )


def test_only_a_law_that_looks_ahead_is_stable_where_the_touchdown_outdoes_the_stride() -> None:
    model = carried(np.random.default_rng(4))
    begin, left = model.planned, {}
    for horizon in (1, 4):
        law = NormOptimalILC(change=0.01, splines=None, horizon=horizon).with_models([model])
        record, state = begin, np.zeros((1, TOY))
        for _ in range(20):
            learned = law.update(record)
            state = model.land(record.feedforward, begin, state)
            record = model.stride(learned, begin, state)
        left[horizon] = np.linalg.norm(record.error) / np.linalg.norm(begin.error)
    assert left[1] > 10.0
    assert left[4] < 0.1


def test_a_feedforward_of_splines_has_no_chatter() -> None:
    rng = np.random.default_rng(5)
    answer = np.eye(3 * SAMPLES)
    model = LiftedModel.with_resets(
        answer, np.zeros_like(answer), gains=Gains(), torque=rng.normal(size=(SAMPLES, 3))
    )
    learned = NormOptimalILC().with_models([model]).update(model.planned)[0, :, 0]
    power = np.abs(np.fft.rfft(learned)) ** 2
    assert power[16:].sum() < 0.01 * power.sum()


def test_a_law_of_too_few_splines_is_refused() -> None:
    with pytest.raises(InvalidInput, match="splines=3; give a whole number from 4"):
        NormOptimalILC(splines=3)
