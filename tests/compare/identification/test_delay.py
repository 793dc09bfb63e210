"""The delay of the motors is a shift of what they were told, found to a part of a tick."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from pronk_pin._typing import Array
from pronk_pin.compare.identification import TERMS
from pronk_pin.compare.identification.equations import DelayedEquations, Equations
from pronk_pin.compare.identification.estimate import Estimate, estimate
from pronk_pin.compare.identification.recording import PhaseRecording

NAMES = ("calf armature", "weak motors", "delay")
SYNTHETIC = tuple(term for term in TERMS if term.name in NAMES)
ARMATURE, WEAKNESS = 0.01, 0.1


def test_torques_of_late_motors_are_those_of_the_ticks_before() -> None:
    ticks, before, timestep = 7, 4, 0.001
    time = timestep * np.arange(-before, ticks + 1)
    told = np.multiply.outer(np.array([1.0, 2.0]), np.multiply.outer(time, np.ones(12)))
    zeros = np.zeros((2, ticks + 1, 12))
    phase = PhaseRecording(
        part="stance",
        joints=zeros,
        rates=zeros,
        torque=told[:, before:],
        before=told[:, :before],
        feedforward=zeros,
        base=zeros[..., :2],
        base_rate=zeros[..., :2],
        fall=zeros[:, 1:, :2],
        timestep=timestep,
    )
    for delay in (0.0, 0.001, 0.0024, 0.004):
        expected = told[:, before:-1] - delay * np.array([1.0, 2.0])[:, None, None]
        np.testing.assert_allclose(phase.torque_after(delay), expected, atol=1e-15)


def synthetic(delay: float, *, noise: float, seed: int = 0) -> Estimate:
    """An estimate from rows of one joint that swings, driven by motors so late [s]."""
    rng, strides = np.random.default_rng(seed), 12
    time = np.arange(0.0, 0.4, 0.004)
    shape = (strides, len(time))

    def told(late: float) -> Array:
        at = time - late
        return 8.0 * np.sin(25.0 * at) + 5.0 * np.cos(60.0 * at + 0.3) + 2.0 * np.sin(110.0 * at)

    acceleration = 300.0 * np.sin(31.0 * time + 0.2)
    needed = (1.0 - WEAKNESS) * told(delay) - ARMATURE * acceleration
    needed = needed + noise * rng.standard_normal(shape)
    heard = noise * rng.standard_normal(shape)
    delays = 0.001 * np.arange(22)
    torque = np.array([told(late) + heard for late in delays])[..., None]
    columns = np.zeros((*shape, len(SYNTHETIC)))
    columns[..., [term.name for term in SYNTHETIC].index("calf armature")] = acceleration
    rows = DelayedEquations(
        Equations(-needed, columns, np.full(len(time), 4)),
        CubicSpline(delays, np.repeat(torque, 2, axis=-1)),
        tuple(k for k, term in enumerate(SYNTHETIC) if term.of_torque),
        next(k for k, term in enumerate(SYNTHETIC) if term.column is None),
    )
    return estimate({0.0: rows}, SYNTHETIC, rng=rng, draws=200)


@pytest.mark.parametrize("delay", [0.0, 0.0034, 0.005, 0.0137])
def test_a_shift_is_found_to_a_part_of_a_tick(delay: float) -> None:
    value = synthetic(delay, noise=0.0).value
    found = {term.name: each for term, each in zip(SYNTHETIC, value, strict=True)}
    assert found["delay"] == pytest.approx(delay, abs=2e-6)
    assert found["weak motors"] == pytest.approx(WEAKNESS, abs=1e-3)
    assert found["calf armature"] == pytest.approx(ARMATURE, rel=1e-3)


def test_intervals_hold_the_shift_and_those_of_the_others_its_uncertainty() -> None:
    true = np.array(
        [{"delay": 0.0034, "weak motors": WEAKNESS}.get(t.name, ARMATURE) for t in SYNTHETIC]
    )
    inside = []
    for seed in range(40):
        low, high = synthetic(0.0034, noise=0.5, seed=seed).interval()
        inside.append((low <= true) & (true <= high))
        assert (high - low < 0.3 * np.array([t.scale for t in SYNTHETIC])).all()
    assert np.mean(inside, axis=0).min() >= 0.8
    assert np.mean(inside) >= 0.85


def test_the_column_of_the_delay_is_how_the_residual_falls_with_it() -> None:
    """By finite differences: where the residual is `y(d) - A(d) theta`, the row of the delay is
    `-dr/dd`, and with all unknowns at their values the linear rows leave the same residual."""
    rng, terms, delay = np.random.default_rng(0), 3, 2
    delays = 0.001 * np.arange(8)
    torque = CubicSpline(delays, rng.normal(size=(8, 2, 5, 2)))  # the torque, and one column
    rows = Equations(rng.normal(size=(2, 5)), rng.normal(size=(2, 5, terms)), np.zeros(5, int))
    delayed = DelayedEquations(rows, torque, of_torque=(1,), delay=delay)

    def residual(value: Array) -> Array:
        given = torque(value[delay])
        known = rows.A[..., 0] * value[0] + given[..., 1] * value[1]
        return np.asarray(rows.y + given[..., 0] - known)

    value, step = np.array([0.3, -0.7, 0.0034]), 1e-7
    at = delayed.at(value)
    late, early = (residual(value + shift * np.eye(terms)[delay]) for shift in (step, -step))
    np.testing.assert_allclose(at.A[..., delay], (early - late) / (2.0 * step), rtol=1e-6)
    np.testing.assert_allclose(at.y - at.A @ value, residual(value), atol=1e-12)
    given = delayed.given_delay(value[delay])
    assert given.A.shape == (2, 5, terms - 1)
    np.testing.assert_allclose(given.A[..., 1], torque(value[delay])[..., 1])
    np.testing.assert_allclose(given.y, rows.y + torque(value[delay])[..., 0])
