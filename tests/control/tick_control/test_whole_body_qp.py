"""The whole-body QP beside computed torque, and where cones and limits bind."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from pronk_pin import load_robot
from pronk_pin._typing import Array
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import load_controller
from pronk_pin.control.tick_control.computed_torque import State
from pronk_pin.control.tick_control.level_robot import TRUNK, LevelRobot, cheapest_forces
from pronk_pin.control.tick_control.whole_body_qp import Terms, WholeBodyQP, solve
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait, load_library
from pronk_pin.robot import Robot, with_rotors

WIDE = 1e6
"""A limit or a coefficient of friction that binds nowhere."""


class Case(NamedTuple):
    """Robots in the middle of their stance, whose legs are a little beside their places."""

    terms: Terms
    torque: Array
    """Of computed torque [N m], shape (n, 12)."""


@pytest.fixture(scope="module")
def case(robot: Robot, gaits: list[Gait]) -> Case:
    model, s, rng = LevelRobot(with_rotors(robot)), np.array([0.4]), np.random.default_rng(1)
    motions = [gait.stance.motion(robot, s) for gait in gaits]
    q, v, a = (np.concatenate([getattr(each, x) for each in motions]) for x in "qva")
    joints, rates = q[:, 7:], v[:, 6:]
    wanted = a[:, [0, 2, *range(6, 18)]] + rng.normal(0.0, 10.0, (len(q), 14))
    levers, standing = model.levers(joints), np.ones((len(q), 4), dtype=bool)
    terms = Terms.of(model, wanted, State(joints, rates, levers, standing), levers)
    needed = model.forces(joints, rates, wanted)
    held = np.einsum("mlij,mli->mlj", levers, cheapest_forces(levers, needed, standing))
    return Case(terms, needed[:, TRUNK:] - held.reshape(-1, 12))


def test_where_nothing_binds_the_qp_gives_the_torques_of_computed_torque(case: Case) -> None:
    """Although it holds the feet at rest, which computed torque leaves to the ground."""
    for k, torque in enumerate(case.torque):
        answer = solve(case.terms, k, WIDE, np.full(12, WIDE))
        assert answer is not None
        np.testing.assert_allclose(answer, torque, atol=2e-2)


def test_the_closed_forms_forces_hold_the_feet_at_rest_under_these_torques(case: Case) -> None:
    """Forward dynamics: with them J a + sigma is zero, and the trunk's equations hold."""
    terms = case.terms
    forces = terms.consistent_forces()
    for k, torque in enumerate(case.torque):
        driven = np.concatenate([np.zeros(TRUNK), torque]) + terms.jacobian[k].T @ forces[k]
        a = np.linalg.solve(terms.mass[k], driven - terms.rest[k])
        np.testing.assert_allclose(terms.jacobian[k] @ a + terms.bias[k], 0.0, atol=1e-4)


def test_limits_and_cones_that_bind_are_kept_to(case: Case) -> None:
    for k, torque in enumerate(case.torque):
        limit = np.full(12, 0.9 * np.abs(torque).max())
        answer = solve(case.terms, k, 0.6, limit)
        assert answer is not None
        assert (np.abs(answer) <= limit + 1e-5).all()
        assert np.abs(answer).max() == pytest.approx(limit[0], abs=1e-4)
        force = forces_of(case.terms, k, answer)
        assert (np.hypot(force[:, 0], force[:, 1]) <= 0.6 * force[:, 2] + 1e-3).all()


def forces_of(terms: Terms, k: int, torque: Array) -> Array:
    """Forces of feet at rest under torques at the joints [N], shape (4, 3)."""
    jacobian, mass = terms.jacobian[k], terms.mass[k]
    driven = np.concatenate([np.zeros(TRUNK), torque]) - terms.rest[k]
    spread = np.linalg.solve(mass, np.column_stack([jacobian.T, driven]))
    slip = jacobian @ spread[:, -1] + terms.bias[k]
    return -np.linalg.solve(jacobian @ spread[:, :-1], slip).reshape(4, 3)


def test_without_a_solution_it_says_so(case: Case) -> None:
    """Motors without strength cannot keep feet down that the wanted motion lifts."""
    terms = case.terms
    light = Terms(**{**terms.__dict__, "rest": terms.rest - 500.0 * np.eye(14)[1]})
    assert solve(light, 0, 0.6, np.full(12, 1e-3)) is None


def test_friction_is_positive() -> None:
    with pytest.raises(InvalidInput, match="whole-body QP: friction"):
        WholeBodyQP(friction=0.0)


def test_the_same_run_is_the_same_to_the_bit() -> None:
    """Whatever lies in memory beside it: the torques of three runs with noise."""
    torques, keep = [], []
    for size in (10, 3331, 777):
        keep.append([bytearray(size + k) for k in range(200)])
        simulation = Simulation(
            load_robot("a1"),
            [load_library("a1").at(0.3)],
            load_controller("whole-body-qp"),
            load_scenario("noise"),
            schedule=Schedule(startup=0.1, baseline=1.0, learning=0.0),
            rng=np.random.default_rng(0),
        )
        torques.append(simulation.run()["feedback"].tobytes())
        loop = simulation.controller.tick_loop
        assert loop is not None
        assert loop.controller.solved[0] > 10  # type: ignore[attr-defined]
    assert torques[0] == torques[1] == torques[2]
