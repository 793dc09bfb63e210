"""The oscillation of learning: its algebra, and the prediction beside what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pronk_pin import load_robot
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.compare.studies import describe_stability, measure_stability
from pronk_pin.compare.studies.stability import _companion, _poles, _slowest_oscillation
from pronk_pin.control import load_controller
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library


def test_the_companion_matrix_has_the_growth_of_the_recursion() -> None:
    """u_{k+1} = A_0 u_k + A_1 u_{k-1}, run on, grows by the largest eigenvalue."""
    rng = np.random.default_rng(0)
    maps = [0.5 * rng.standard_normal((3, 3)), 0.3 * rng.standard_normal((3, 3))]
    growth = np.abs(np.linalg.eigvals(_companion(maps))).max()
    before, now = rng.standard_normal((2, 3))
    sizes = []
    for _ in range(400):
        before, now = now, maps[0] @ now + maps[1] @ before
        sizes.append(np.linalg.norm(now))
    assert (sizes[-1] / sizes[199]) ** (1 / 200) == pytest.approx(growth, rel=5e-3)


def test_the_poles_of_a_damped_oscillation_are_found() -> None:
    k = np.arange(30)
    values = 0.9**k * np.cos(2 * np.pi * k / 7) + 0.6**k
    assert _slowest_oscillation(_poles(values)) == pytest.approx((0.9, 7.0), rel=1e-6)
    assert np.isnan(_slowest_oscillation(np.array([0.9, -0.5]))).all()  # none oscillates


def test_what_would_be_learned_is_what_is_learned_next() -> None:
    """`Controller.learned` tells, without taking it, what the next touchdown takes."""
    told: list[tuple[np.ndarray, np.ndarray]] = []
    took: list[tuple[np.ndarray, np.ndarray]] = []
    simulation = Simulation(
        load_robot("a1"),
        [load_library("a1").at(speed) for speed in (0.0, 0.4)],
        replace(load_controller("ilc"), guard=None),
        load_scenario("nominal"),
        schedule=Schedule(startup=0.2, baseline=0.0, learning=2.5),
        rng=np.random.default_rng(0),
    )

    def before_stride(rows: np.ndarray) -> None:
        assert len(rows) == 2
        took.append(simulation.controller.memory)
        told.append(simulation.controller.learned())

    simulation.run(before_stride=before_stride)
    for known, then in zip(told[1:-1], took[2:], strict=True):
        np.testing.assert_array_equal(known[0], then[0])
        # A reference is not stretched by a fraction of a tick that nobody would see.
        np.testing.assert_allclose(known[1], then[1], rtol=0, atol=2e-5)


def test_a_controller_without_the_three_is_refused() -> None:
    with pytest.raises(InvalidInput, match="choose one that does, as 'ilc'"):
        measure_stability(load_controller("ilc-stance"), [0.8], load_scenario("nominal"))
    with pytest.raises(InvalidInput, match="couplings"):
        measure_stability(load_controller("ilc"), [0.8], load_scenario("nominal"), couplings=[1.5])


@pytest.mark.slow
def test_coupling_is_what_makes_payload_and_delay_grow() -> None:
    """Predicted from responses without learning, and measured by kicks: growth at 1, not at 0.6."""
    table = measure_stability(
        load_controller("ilc"), [0.8], load_scenario("payload+delay"), couplings=[1.0, 0.6]
    )
    full, damped = (row for _, row in table.iterrows())
    assert full["predicted"] > 1.0 > damped["predicted"]
    assert full["measured"] > 1.0 > damped["measured"]
    assert table["predicted"].to_numpy() == pytest.approx(table["measured"].to_numpy(), abs=0.06)
    assert ((table["predicted_period"] > 6) & (table["predicted_period"] < 10)).all()
    assert "0.8" in describe_stability(table)
