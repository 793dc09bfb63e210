"""The analysis against brute force, on toys and on the paper's law."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import (
    Gains,
    LiftedModel,
    NormOptimalILC,
    PaperILC,
    PlantInversionILC,
    ZeroPhaseFilter,
)
from pronk_pin.control.learning.lifted import LiftedModel as Model
from pronk_pin.control.prediction.analysis import (
    _radius,
    analyze,
    iteration,
    predict,
    quasi_static,
    symmetric_basis,
)

SAMPLES = 60


def toy() -> Model:
    """A causal plant of three joints whose strides begin where the last ones ended."""
    rng = np.random.default_rng(0)
    size = 3 * SAMPLES
    answer = np.kron(
        np.tril(0.8 ** np.abs(np.subtract.outer(*[np.arange(SAMPLES)] * 2))), np.eye(3)
    )
    return LiftedModel(
        angle=answer,
        rate=np.zeros((size, size)),
        angle_start=0.1 * rng.normal(size=(size, 2)),
        rate_start=np.zeros((size, 2)),
        A=np.diag([0.5, -0.3]),
        B=0.01 * rng.normal(size=(2, size)),
        gains=Gains(),
        torque=rng.normal(size=(SAMPLES, 3)),
    )


def test_powers_of_the_operator_are_what_the_strides_do() -> None:
    model = toy()
    law = NormOptimalILC(change=1.0, effort=0.1, splines=None).with_models([model])
    operator = iteration(law, model, symmetric_basis(SAMPLES, 3))
    none = model.record(*np.zeros((3, 3 * SAMPLES)))
    u = np.random.default_rng(1).normal(size=(1, SAMPLES, 3))
    state = np.zeros((1, 2))
    expected = np.linalg.matrix_power(operator, 5) @ np.concatenate([u.reshape(-1), state[0]])
    for _ in range(5):
        record = model.stride(u, none, state)
        state = model.land(u, none, state)
        u = law.update(record)
    np.testing.assert_allclose(np.concatenate([u.reshape(-1), state[0]]), expected, atol=1e-9)


def test_the_limit_is_where_many_strides_end() -> None:
    model = toy()
    law = NormOptimalILC(change=1.0, effort=0.1, splines=None).with_models([model])
    found = analyze(law, model)
    assert found.radius < 1.0
    last = predict(law, model, model.planned, 300)[-1]
    share = np.sqrt((last**2).mean(0) / (model.planned.error[0] ** 2).mean(0))
    np.testing.assert_allclose(found.limit, share, rtol=1e-4)


def test_the_radius_of_plant_inversion_is_known_by_hand() -> None:
    model = toy().within_a_stride
    law = PlantInversionILC(gain=0.3, cutoff=1e-6, splines=None, horizon=1).with_models([model])
    found = analyze(law, model)
    assert found.stride_radius == pytest.approx(0.7)
    assert found.with_gain_error[1.3] == pytest.approx(1.0 - 0.3 * 1.3)


def test_the_papers_law_has_a_gain_of_2_and_lives_by_its_filters_leak() -> None:
    still = np.zeros((12 * 161, 12 * 161))  # only the law is asked
    plant = LiftedModel.with_resets(still, still, gains=Gains(), torque=np.zeros((161, 12)))
    printed = quasi_static(PaperILC(), plant)
    assert printed.memory == pytest.approx(0.64, abs=1e-3)
    assert printed.gain == pytest.approx(2.0, abs=1e-3)
    assert 1.0 - printed.left == pytest.approx(0.78, abs=0.005)  # of the error taken away
    exact = quasi_static(PaperILC(filter=ZeroPhaseFilter.butterworth(3, 0.1)), plant)
    assert exact.multiplier == pytest.approx(-1.0, abs=0.01)


def test_the_radius_is_found_where_all_eigenvalues_are_as_large() -> None:
    """The Arnoldi iteration does not converge on a permutation."""
    assert _radius(0.9 * np.roll(np.eye(200), 1, axis=0)) == pytest.approx(0.9)
