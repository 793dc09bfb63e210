"""Whatever is passed in: the right answer, or an error that says what to do. Never NaN."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pronk_pin import dynamics, inverse_dynamics, kinematics, load_robot
from pronk_pin._typing import Array
from pronk_pin.dynamics import energetics
from pronk_pin.errors import InvalidInput, PronkError
from pronk_pin.robot import ROBOTS, conventions

SOME = settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))

NAMES = st.sampled_from(sorted(ROBOTS))

# What each function takes, in its order; q is (nq,), v and a are (nv,), tau and joints (nu,).
FUNCTIONS: dict[str, tuple[Callable[..., Any], tuple[str, ...]]] = {
    "mass_matrix": (dynamics.mass_matrix, ("q",)),
    "coriolis_matrix": (dynamics.coriolis_matrix, ("q", "v")),
    "gravity": (dynamics.gravity, ("q",)),
    "nonlinear_effects": (dynamics.nonlinear_effects, ("q", "v")),
    "contact_jacobian": (dynamics.contact_jacobian, ("q",)),
    "contact_bias": (dynamics.contact_bias, ("q", "v")),
    "flight_dynamics": (dynamics.flight_dynamics, ("q", "v", "tau")),
    "stance_dynamics": (dynamics.stance_dynamics, ("q", "v", "tau")),
    "stance_dae": (dynamics.stance_dae, ("q", "v", "tau")),
    "impact": (dynamics.impact, ("q", "v")),
    "flight_derivatives": (dynamics.flight_derivatives, ("q", "v", "tau")),
    "stance_derivatives": (dynamics.stance_derivatives, ("q", "v", "tau")),
    "inverse_dynamics": (inverse_dynamics.inverse_dynamics, ("q", "v", "a")),
    "foot_positions": (kinematics.foot_positions, ("q",)),
    "foot_velocities": (kinematics.foot_velocities, ("q", "v")),
    "leg_odometry": (kinematics.leg_odometry, ("q", "v")),
    "leg_angle": (kinematics.leg_angle, ("tau",)),
    "to_mujoco": (conventions.to_mujoco, ("q", "v", "a", "tau")),
    "from_mujoco": (conventions.from_mujoco, ("q", "v", "a", "tau")),
    "to_paper": (conventions.to_paper, ("tau",)),
    "from_paper": (conventions.from_paper, ("tau",)),
    "kinetic_energy": (energetics.kinetic_energy, ("q", "v")),
    "potential_energy": (energetics.potential_energy, ("q",)),
    "centroidal_momentum": (energetics.centroidal_momentum, ("q", "v")),
    "mechanical_power": (energetics.mechanical_power, ("v", "tau")),
}
BATCHED = {
    "flight_dynamics",
    "stance_dynamics",
    "inverse_dynamics",
    "foot_positions",
    "foot_velocities",
    "leg_odometry",
    "leg_angle",
    "to_mujoco",
    "from_mujoco",
    "to_paper",
    "from_paper",
    "kinetic_energy",
    "potential_energy",
    "centroidal_momentum",
    "mechanical_power",
}


def numbers(size: int, bound: float) -> st.SearchStrategy[Array]:
    return hnp.arrays(float, size, elements=st.floats(-bound, bound))


@st.composite
def states(draw: st.DrawFn) -> tuple[str, dict[str, Array]]:
    """A robot and a state of it, anything but outlandish, corners included."""
    name = draw(NAMES)
    robot = load_robot(name)
    quaternion = draw(numbers(4, 1.0).filter(lambda x: np.linalg.norm(x) > 1e-3))
    share = draw(hnp.arrays(float, robot.nu, elements=st.floats(0.0, 1.0)))
    joints = robot.q_min + share * (robot.q_max - robot.q_min)
    q = np.concatenate([draw(numbers(3, 10.0)), quaternion / np.linalg.norm(quaternion), joints])
    nv, nu = robot.nv, robot.nu
    vectors = {"v": numbers(nv, 20.0), "a": numbers(nv, 100.0), "tau": numbers(nu, 40.0)}
    return name, {"q": q} | {key: draw(strategy) for key, strategy in vectors.items()}


def has_an_order_of_the_paper(name: str) -> bool:
    return len(load_robot(name).legs) == 4


def leaves(result: Any) -> list[Array]:
    """The numbers of a result."""
    return [np.asarray(part) for part in (result if isinstance(result, tuple) else (result,))]


@pytest.mark.parametrize("function", FUNCTIONS)
@SOME
@given(state=states())
def test_every_state_has_a_finite_answer(function: str, state: tuple[str, dict[str, Any]]) -> None:
    name, arrays = state
    call, needs = FUNCTIONS[function]
    assume(has_an_order_of_the_paper(name) or not function.endswith("paper"))
    result = call(load_robot(name), *(arrays[key] for key in needs))
    assert all(np.isfinite(part).all() for part in leaves(result))


@pytest.mark.parametrize("function", sorted(BATCHED))
@SOME
@given(first=states(), seed=st.integers(0, 99))
def test_a_batch_is_its_rows(function: str, first: tuple[str, dict[str, Any]], seed: int) -> None:
    name, arrays = first
    robot, (call, needs) = load_robot(name), FUNCTIONS[function]
    assume(has_an_order_of_the_paper(name) or not function.endswith("paper"))
    rng = np.random.default_rng(seed)
    other = {key: x * rng.uniform(0.5, 1.0) for key, x in arrays.items()}
    other["q"] = robot.standing
    batch = [np.stack([arrays[key], other[key]]) for key in needs]
    whole = leaves(call(robot, *batch))
    for row in range(2):
        one = leaves(call(robot, *(x[row] for x in batch)))
        for many, single in zip(whole, one, strict=True):
            scale = max(1.0, float(np.abs(single).max(initial=0.0)))
            np.testing.assert_allclose(many[row], single, rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("function", FUNCTIONS)
@SOME
@given(state=states(), data=st.data())
def test_every_broken_state_is_refused_with_a_remedy(
    function: str, state: tuple[str, dict[str, Any]], data: st.DataObject
) -> None:
    name, arrays = state
    call, needs = FUNCTIONS[function]
    assume(has_an_order_of_the_paper(name) or not function.endswith("paper"))
    which = data.draw(st.sampled_from(needs))
    broken = np.array(arrays[which])
    how = data.draw(st.sampled_from(["nan", "inf", "short", "long", "deep", "words", "norm"]))
    value: Any = broken
    if how in ("nan", "inf"):
        broken[data.draw(st.integers(0, len(broken) - 1))] = float(how)
    elif how == "short":
        value = broken[:-1]
    elif how == "long":
        value = np.append(broken, 0.0)
    elif how == "deep":  # a batch where the others are none, or where none is taken
        if function in BATCHED and len(needs) == 1:
            return
        value = broken[None]
    elif how == "words":
        value = ["a word"] * len(broken)
    elif which == "q":
        broken[3:7] *= data.draw(st.sampled_from([0.0, 0.5, 1.0 + 1e-5, 2.0]))
    else:
        return
    given_arrays = [value if key == which else arrays[key] for key in needs]
    with pytest.raises(InvalidInput) as caught:
        call(load_robot(name), *given_arrays)
    assert isinstance(caught.value, PronkError)
    assert len(str(caught.value)) > 20


@SOME
@given(state=states())
def test_conversions_lose_nothing(state: tuple[str, dict[str, Any]]) -> None:
    name, arrays = state
    robot = load_robot(name)
    there = conventions.to_mujoco(robot, *arrays.values())
    back = conventions.from_mujoco(robot, *there)
    for before, after in zip(arrays.values(), back, strict=True):
        scale = max(1.0, float(np.abs(before).max()), float(np.abs(arrays["v"]).max()) ** 2)
        np.testing.assert_allclose(after, before, rtol=0, atol=1e-14 * scale)
    if not has_an_order_of_the_paper(name):
        return
    tau = arrays["tau"]
    mine = conventions.from_paper(robot, conventions.to_paper(robot, tau))
    np.testing.assert_array_equal(mine, tau)


@SOME
@given(state=states())
def test_an_impact_takes_energy_and_stops_the_feet(state: tuple[str, dict[str, Any]]) -> None:
    name, arrays = state
    robot, q, v = load_robot(name), arrays["q"], arrays["v"]
    after = dynamics.impact(robot, q, v)
    before = float(energetics.kinetic_energy(robot, q, v))
    assert float(energetics.kinetic_energy(robot, q, after.v)) <= before * (1 + 1e-9) + 1e-9
    if not after.singular:
        speed = dynamics.contact_jacobian(robot, q) @ after.v
        scale = max(1.0, float(np.abs(after.impulse).max()))
        assert np.abs(speed).max() < 1e-9 * scale
