"""Each constraint of the gait problem measures what its name says, in its unit and at its place.

A gait that meets them all is changed in one number, by so much that the violation is known.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.gait import GaitProblem, GaitSolution, gait_problem, vertical_hop
from pronk_pin.gait.checks import UNITS
from pronk_pin.gait.optimisation.collocation import node_phases, transcribe
from pronk_pin.gait.optimisation.transcription import Violation
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot

Blocks = dict[str, Array]
P = np.array([0.3, 0.34])
"""Speed and apex of the solution."""


def violations(solution: GaitSolution, change: Callable[[Blocks], None]) -> dict[str, Violation]:
    """Violations of the solution once it has been changed."""
    program = transcribe(GaitProblem(solution.problem.robot, 0.0, apex=1.0))
    values = {name: block.copy() for name, block in program.unpack(solution.state.x).items()}
    change(values)
    return program.violations(program.pack(values), P)


def at(name: str, place: tuple[int | slice, ...], value: object) -> Callable[[Blocks], None]:
    """A change that puts a value at some place of a block."""

    def change(values: Blocks) -> None:
        values[name][place] = value

    return change


def by(name: str, place: tuple[int | slice, ...], value: float) -> Callable[[Blocks], None]:
    """A change that adds a value at some place of a block."""

    def change(values: Blocks) -> None:
        values[name][place] += value

    return change


ALL = slice(None)
CASES: dict[str, tuple[Callable[[Blocks], None], float, str]] = {
    "average speed": (by("flight.q", (-1, 0), 0.01), 0.01, "stride"),
    "apex height": (by("flight.q", (ALL, 1), 0.01), 0.01, "flight"),
    "dynamics": (by("flight.tau", (5, 1), 0.5), 0.5, "flight, node 5"),
    "collocation": (by("flight.q", (9, 3), 1e-3), 1e-3, "flight, interval 4"),
    "contact height": (by("stance.q", (0, 1), 1e-3), 1e-3, "stance, node 0"),
    "contact acceleration": (by("stance.a", (7, 0), 2.0), 2.0, "stance, node 7"),
    "touchdown contact": (by("stance.v", (0, 0), 0.1), 0.1, "touchdown of stance"),
    "phase continuity": (by("flight.q", (0, 4), 1e-3), 1e-3, "stance to flight"),
    "periodicity": (by("flight.q", (-1, 4), 1e-3), 1e-3, "flight to stance"),
    "stride duration": (by("stance.duration", (0, 0), -0.02), 0.02, "stride"),
    "phase durations": (at("flight.duration", (0, 0), 0.4), 0.05, "flight, node 0"),
    "hip limit": (at("stance.q", (5, 2), 0.15), 0.05, "stance, node 5"),
    "trunk height": (at("stance.q", (5, 1), 0.15), 0.05, "stance, node 5"),
    "unilateral contact": (at("stance.lam", (5, 2), -3.0), 3.0, "stance, node 5"),
    # 10 N along the ground, of which 0.6 x 10 N hold.
    "friction cone": (at("stance.lam", (5, slice(0, 3)), (6.0, 8.0, 10.0)), 4.0, "stance, node 5"),
    "impulse cone": (
        at("stance.impulse", (0, slice(3, 6)), (0.3, 0.4, 0.5)),
        0.2,
        "touchdown of stance",
    ),
}
"""Change, violation in its unit, and place, by the constraint."""


@pytest.mark.parametrize("name", CASES)
def test_a_violation_is_as_large_as_the_change_that_makes_it(
    solution: GaitSolution, name: str
) -> None:
    change, value, where = CASES[name]
    found = violations(solution, change)[name]
    assert found.value == pytest.approx(value, abs=2e-6)
    assert found.where == where


def test_limits_of_joints_are_those_of_the_robot(robot: Robot, solution: GaitSolution) -> None:
    limits = {
        "configuration limits": ("flight.q", 2 + 2, robot.q_max[2] + 0.25),  # after x, z: FL_calf
        "velocity limits": ("flight.v", 2 + 2, -robot.v_max[2] - 0.25),
        "torque limits": ("flight.tau", 2, -robot.tau_max[2] - 0.25),
    }
    for name, (block, column, beyond) in limits.items():
        change = at(block, (6, column), beyond)
        found = violations(solution, change)[name]
        assert found == Violation(pytest.approx(0.25), "flight, node 6"), name


def test_momentum_that_the_impulses_do_not_give_is_a_violation(solution: GaitSolution) -> None:
    """A foot's impulse that is 0.1 N s larger pushes the trunk up by as much on each side."""
    found = violations(solution, by("stance.impulse", (0, 2), 0.1))["touchdown impact"]
    assert found.value == pytest.approx(0.2, rel=1e-6)  # left and right


def test_every_constraint_of_a_locked_trunk_has_its_case() -> None:
    others = {"configuration limits", "velocity limits", "torque limits", "touchdown impact"}
    of_a_free_trunk = {"roll limit", "yaw limit", "side step"}
    assert set(CASES) | others | of_a_free_trunk | {"foot clearance", "pitch limit"} == set(UNITS)


def test_feet_swing_as_high_as_the_clearance_asks(solution: GaitSolution) -> None:
    """Pinocchio's feet against `16 h s^2 (1 - s)^2`, with the robot 5 cm lower in the air."""
    robot, problem, drop = solution.problem.robot, solution.problem, 0.05
    found = violations(solution, by("flight.q", (slice(1, -1), 1), -drop))["foot clearance"]
    motion = solution.motions["flight"]
    height = foot_positions(robot, motion.q)[..., 2].min(axis=1) - drop - robot.foot_radius
    s = motion.t / motion.t[-1]
    lacking = (problem.clearance * 16.0 * s**2 * (1.0 - s) ** 2 - height)[1:-1]
    assert found.value == pytest.approx(lacking.max(), abs=1e-8)
    assert found.where == f"flight, node {1 + int(np.argmax(lacking))}"


def test_a_swing_through_several_phases_is_one_swing(robot: Robot) -> None:
    """A bound, all feet on the ground throughout: what is missing is the profile over the time from
    lift-off to touchdown, whatever the phases between."""
    problem = gait_problem(robot, 0.0, gait="bound").remeshed((6, 8, 10, 4))
    values = {name: block.copy() for name, block in vertical_hop(problem).items()}
    lasting = {"front stance": 0.1, "gathered flight": 0.15, "rear stance": 0.2}
    lasting["extended flight"] = 0.05
    for phase in problem.sequence:
        values[f"{phase.name}.duration"][:] = lasting[phase.name]
        q = values[f"{phase.name}.q"]
        q[:] = 0.0
        q[:, 1] = robot.standing[2]
        q[:, 3:] = np.tile(robot.standing[7:10], 2)
    program = transcribe(problem)
    found = program.violations(program.pack(values), np.array([0.0, problem.apex]))
    expected = []
    # The front legs swing from 0.1 s to the end of the stride, the rear ones round its end.
    for names in (
        ("gathered flight", "rear stance", "extended flight"),
        ("extended flight", "front stance", "gathered flight"),
    ):
        starts = np.cumsum([0.0, *(lasting[name] for name in names)])
        for name, start in zip(names, starts, strict=False):
            intervals = next(one.intervals for one in problem.sequence if one.name == name)
            s = (start + lasting[name] * node_phases(intervals)) / starts[-1]
            expected.append(problem.clearance * 16.0 * s**2 * (1.0 - s) ** 2)
    height = foot_positions(robot, robot.standing)[:, 2].min() - robot.foot_radius
    assert found["foot clearance"].value == pytest.approx(
        np.concatenate(expected).max() - height, abs=1e-6
    )
