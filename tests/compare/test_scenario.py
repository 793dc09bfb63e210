from __future__ import annotations

import dataclasses
import math

import pytest

from pronk_pin.compare import SCENARIOS, Scenario, load_scenario
from pronk_pin.errors import InvalidInput, UnknownName


def test_in_the_ideal_world_the_model_knows_everything() -> None:
    ideal = load_scenario("ideal")
    assert (ideal.armature, ideal.damping, ideal.coulomb, ideal.payload) == (0.0, 0.0, 0.0, 0.0)
    assert ideal.torque_constant == 1.0


def test_the_rotor_is_felt_through_the_square_of_the_gear() -> None:
    assert load_scenario("nominal").armature == pytest.approx(0.000111842 * 81.0)


def test_the_other_worlds_differ_from_the_nominal_one_in_one_thing_each() -> None:
    nominal = dataclasses.asdict(load_scenario("nominal"))
    for name in ("payload", "weak-motors", "soft-ground"):
        other = dataclasses.asdict(load_scenario(name))
        assert len({key for key in nominal if other[key] != nominal[key]} - {"name"}) == 1


def test_every_scenario_is_known_by_its_own_name() -> None:
    assert all(name == scenario.name for name, scenario in SCENARIOS.items())


def test_an_unknown_scenario_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownName) as caught:
        load_scenario("moon")
    assert str(caught.value) == (
        "unknown scenario 'moon'; choose one of: ideal, nominal, payload, weak-motors, soft-ground"
    )


@pytest.mark.parametrize("quantity", ["armature", "damping", "coulomb", "payload"])
@pytest.mark.parametrize("value", [-0.1, math.nan])
def test_what_cannot_be_negative_is_refused(quantity: str, value: float) -> None:
    with pytest.raises(InvalidInput, match=f"'mine': {quantity} must not be negative"):
        Scenario("mine", **{quantity: value})


@pytest.mark.parametrize("quantity", ["torque_constant", "ground_friction", "timestep"])
def test_what_must_be_positive_is_refused_at_zero(quantity: str) -> None:
    with pytest.raises(InvalidInput, match=f"'mine': {quantity} must be positive"):
        Scenario("mine", **{quantity: 0.0})


@pytest.mark.parametrize("value", [0.0019, math.nan])
def test_a_contact_stiffer_than_the_time_step_allows_is_refused(value: float) -> None:
    with pytest.raises(InvalidInput, match=r"below two time steps \(0.002 s\) is unstable"):
        Scenario("mine", ground_time_constant=value)
