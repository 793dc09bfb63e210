from __future__ import annotations

import dataclasses
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pronk_pin.compare import (
    MISMATCHES,
    SCENARIOS,
    Scenario,
    Sensors,
    load_scenario,
    random_scenarios,
)
from pronk_pin.errors import InvalidInput, UnknownName
from pronk_pin.robot import load_robot


def different(scenario: Scenario, other: Scenario) -> set[str]:
    """Attributes in which two scenarios differ, but for their names."""
    mine, theirs = dataclasses.asdict(scenario), dataclasses.asdict(other)
    return {key for key in mine if mine[key] != theirs[key]} - {"name"}


def test_in_the_ideal_world_the_model_knows_everything() -> None:
    assert different(load_scenario("ideal"), Scenario("ideal")) == set()
    ideal = load_scenario("ideal")
    assert (ideal.armature, ideal.damping, ideal.coulomb, ideal.payload) == (0.0, 0.0, 0.0, 0.0)
    assert ideal.torque_constant == 1.0
    assert ideal.sensors.perfect


def test_the_rotor_is_felt_through_the_square_of_the_gear() -> None:
    rotors = load_scenario("nominal").by_joint("armature", load_robot())
    np.testing.assert_allclose(rotors, 0.000111842 * 81.0)


@pytest.mark.parametrize("name", MISMATCHES)
def test_each_of_the_laboratorys_mismatches_is_one_thing_in_the_nominal_world(name: str) -> None:
    assert len(different(load_scenario(name), load_scenario("nominal"))) == 1


def test_the_laboratory_has_nine_mismatches_or_more() -> None:
    assert len(set(MISMATCHES)) == len(MISMATCHES) >= 9


def test_every_scenario_is_known_by_its_own_name() -> None:
    assert all(name == scenario.name for name, scenario in SCENARIOS.items())


def test_an_unknown_scenario_is_refused_with_the_known_ones() -> None:
    for name in ("moon", "payload+moon", "random-1", "random-1-x"):
        with pytest.raises(UnknownName) as caught:
            load_scenario(name)
        assert str(caught.value).startswith(
            f"unknown scenario '{name.removeprefix('payload+')}'; choose one of: ideal, nominal, "
            "payload, "
        )
        assert str(caught.value).endswith("random-SEED-INDEX")


def test_a_composed_scenario_has_the_differences_of_its_parts() -> None:
    both, nominal = load_scenario("payload+slope"), load_scenario("nominal")
    assert different(both, nominal) == {"payload", "slope"}
    assert both.payload == load_scenario("payload").payload
    assert both.slope == load_scenario("slope").slope


def test_a_mismatch_without_a_world_is_one_of_the_nominal_world() -> None:
    assert load_scenario("nominal+payload") == load_scenario("payload")
    ideal = load_scenario("ideal+payload")
    assert different(ideal, load_scenario("ideal")) == {"payload"}
    assert ideal.name == "ideal+payload"


@pytest.mark.parametrize(
    ("typed", "short"),
    [
        ("slope+payload", "payload+slope"),
        ("nominal+delay+payload=3", "payload+delay"),
        ("payload=2.50", "payload=2.5"),
        ("ideal", "ideal"),
        ("gravity=1e1", "gravity=10"),
        ("random-0-1+delay", "random-0-1+delay"),
    ],
)
def test_a_scenario_bears_one_name_however_it_was_typed(typed: str, short: str) -> None:
    scenario = load_scenario(typed)
    assert scenario.name == short
    assert load_scenario(short) == scenario


def test_a_value_in_a_name_is_the_value_to_the_bit() -> None:
    value = 0.1 + 0.2
    scenario = load_scenario(f"payload={value!r}")
    assert load_scenario(scenario.name).payload == scenario.payload == value


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("payload+payload", "payload is in it twice"),
        ("payload+payload-front", "two parts of it change payload; keep one"),
        ("payload+ideal", "a world, as ideal, comes first in a name"),
        ("payload=heavy", "'payload=heavy' needs a number after '=', in kg, as in payload=3"),
        ("payload=nan", "needs a number after '='"),
        ("payload=", "needs a number after '='"),
        ("payload=-1", r"payload=-1\.0; give a number from 0 to 100 kg"),
        (
            "touchdown-jitter=0.0015",
            "touchdown_jitter must be a whole number of time steps",
        ),
        ("late-touchdown=-0.001", "touchdown_latency=-0.001; give a number from 0 to 0.05 s"),
        ("delay=0.0015", "delay must be a whole number of time steps of 0.001 s; 0.002 s is"),
    ],
)
def test_a_name_that_makes_no_world_is_refused(name: str, text: str) -> None:
    with pytest.raises(InvalidInput, match=text):
        load_scenario(name)


def test_sampled_worlds_are_known_by_seed_and_index_whatever_their_number() -> None:
    family = random_scenarios(4, 7)
    assert family[:2] == random_scenarios(2, 7)
    assert [load_scenario(scenario.name) for scenario in family] == list(family)
    assert len({scenario.payload for scenario in (*family, *random_scenarios(4, 8))}) == 8


def test_a_sampled_world_is_what_it_was_and_its_motors_and_sensors_are_off_besides() -> None:
    sampled = load_scenario("random-0-3")
    assert (sampled.armature, sampled.slope) == (0.009397292506141113, -0.02623944394288679)
    family = random_scenarios(200, 0)
    assert load_scenario("noise+late-touchdown+touchdown-jitter").touchdown_latency == 0.003
    for name, most in (("delay", 4), ("touchdown_latency", 3), ("touchdown_jitter", 4)):
        assert {round(1000 * getattr(each, name), 9) for each in family} == set(range(most + 1))
    noise = [each.sensors.rate_noise for each in family]
    assert 0.0 <= min(noise) < max(noise) <= 0.025


@pytest.mark.parametrize(("n", "seed"), [(0, 0), (1, -1)])
def test_no_sampled_world_and_no_negative_seed(n: int, seed: int) -> None:
    with pytest.raises(
        InvalidInput,
        match=r"(n=0; give a whole number from 1|seed=-1; give a whole number from 0) to",
    ):
        random_scenarios(n, seed)


@pytest.mark.parametrize(
    "name",
    [
        "nominal",
        "payload-front",
        "slope",
        "steps",
        "push",
        "push-side",
        "late-touchdown",
        "touchdown-jitter",
    ],
)
def test_what_the_compiled_model_expresses_is_affine(name: str) -> None:
    assert load_scenario(name).affine


@pytest.mark.parametrize("name", ["delay", "noise", "slow-motors"])
def test_what_lies_between_command_and_torque_is_not_affine(name: str) -> None:
    assert not load_scenario(name).affine
    assert not load_scenario(f"{name}+payload").affine


@pytest.mark.parametrize(
    "quantity", ["armature", "damping", "coulomb", "payload", "delay", "step_height"]
)
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_what_cannot_be_negative_is_refused(quantity: str, value: float) -> None:
    with pytest.raises(InvalidInput, match=f"'mine': {quantity}=.*; give a number from 0 to "):
        Scenario("mine", **{quantity: value})


@pytest.mark.parametrize(
    "quantity",
    ["torque_constant", "ground_friction", "timestep", "gravity", "step_length", "push_duration"],
)
def test_what_must_be_positive_is_refused_at_zero(quantity: str) -> None:
    with pytest.raises(
        InvalidInput,
        match=rf"'mine': {quantity}=0\.0; give a number (above 0, up to|from [0-9.e-]+ to) ",
    ):
        Scenario("mine", **{quantity: 0.0})


def test_a_contact_stiffer_than_the_time_step_allows_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"below two time steps \(0.002 s\) is unstable"):
        Scenario("mine", ground_time_constant=0.0019)
    with pytest.raises(InvalidInput, match="ground_time_constant=nan; give a number above 0"):
        Scenario("mine", ground_time_constant=math.nan)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"slope": 0.6}, r"slope=0\.6; give a number from -0\.5 to 0\.5 rad"),
        ({"slope": math.nan}, r"slope=nan; give a number from -0\.5 to 0\.5 rad"),
        ({"step_height": 0.2}, "half as high as they are long"),
        ({"full_torque_speed": 20.0, "no_load_speed": 10.0}, "less than no_load_speed"),
        ({"full_torque_speed": 20.0, "no_load_speed": 20.0}, "less than no_load_speed"),
        ({"push_duration": 5.0}, "shorter than push_period"),
        (
            {"payload_position": (0.0, 1.0)},
            "payload_position=.* has 2 values; give numbers, 3 of them",
        ),
        (
            {"com_shift": (0.0, 0.0, math.nan)},
            r"com_shift\[2\]=nan; give a number from -0\.5 to 0\.5 m",
        ),
        ({"seed": -1}, "seed=-1; give a whole number from 0"),
    ],
)
def test_a_world_that_cannot_be_is_refused(wrong: dict[str, Any], text: str) -> None:
    with pytest.raises(InvalidInput, match=f"scenario 'mine': .*{text}"):
        Scenario("mine", **wrong)


def test_gravity_leans_back_on_a_slope_and_keeps_its_size() -> None:
    scenario = replace(load_scenario("nominal"), slope=0.1, gravity=9.0)
    x, y, z = scenario.gravity_vector
    assert (x, y, z) == pytest.approx((-9.0 * math.sin(0.1), 0.0, -9.0 * math.cos(0.1)))


def test_noise_may_be_scaled_by_name() -> None:
    twice, once = load_scenario("noise=2").sensors, load_scenario("noise").sensors
    assert twice == once.scaled(2.0) != Sensors()


def test_a_scenario_comes_back_from_its_text() -> None:
    for scenario in (load_scenario("payload=2+noise+slow-motors+slope"), random_scenarios(1, 3)[0]):
        assert Scenario.from_json(scenario.to_json()) == scenario
    with pytest.raises(InvalidInput, match="this is not a scenario"):
        Scenario.from_json("{}")
