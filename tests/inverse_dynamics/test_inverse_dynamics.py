"""Torques and forces satisfy the equations, keep to cones and limits, and are the cheapest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from proxsuite import proxqp
from scipy.optimize import linprog, minimize

from pronk_pin import Robot, dynamics
from pronk_pin._typing import Array
from pronk_pin.errors import InvalidInput, UnknownName
from pronk_pin.gait.gait import Gait, GaitPhase
from pronk_pin.inverse_dynamics import (
    CONSTRAINT_COORDINATES,
    PLANAR_CONSTRAINT,
    InverseDynamics,
    distribute_wrench,
    feedforward,
    inverse_dynamics,
)
from pronk_pin.inverse_dynamics.force_problem import (
    FORCE_WEIGHT,
    ForceProblem,
    force_problem,
    saddle_point,
)
from pronk_pin.inverse_dynamics.qp import _Chain, cone_edges, cone_sides
from pronk_pin.robot.conventions import rotation_matrix

Draw = Callable[..., tuple[Array, Array, Array, Array]]

FRICTION = 0.6


def violation(
    robot: Robot,
    motion: tuple[Array, Array, Array],
    solution: InverseDynamics,
    *,
    feet: tuple[str, ...] | None = None,
    contact: str = "point",
    constraint: tuple[str, ...] = (),
) -> float:
    """Largest error of eq. (2) of the paper, from its own matrices, with the planar constraint's
    forces."""
    worst = 0.0
    for row, (q, v, a) in enumerate(zip(*motion, strict=True)):
        jacobian = dynamics.contact_jacobian(robot, q, feet=feet, contact=contact)
        wrench = np.zeros(6)
        wrench[[CONSTRAINT_COORDINATES.index(name) for name in constraint]] = solution.constraint[
            row
        ]
        into_trunk = rotation_matrix(q[3:7]).T
        applied = np.concatenate([into_trunk @ wrench[:3], into_trunk @ wrench[3:], np.zeros(12)])
        applied += dynamics.selection_matrix(robot) @ solution.tau[row]
        applied += jacobian.T @ solution.lam[row]
        needed = dynamics.mass_matrix(robot, q) @ a + dynamics.nonlinear_effects(robot, q, v)
        worst = max(worst, float(np.abs(needed - applied).max()))
    return worst


def assert_within(robot: Robot, solution: InverseDynamics, friction: float) -> None:
    """The circular cone and the torque limits hold to 1e-6."""
    lam = solution.lam.reshape(len(solution.lam), -1, 3)
    tangential = np.linalg.norm(lam[..., :2], axis=-1)
    assert (lam[..., 2] >= -1e-6).all()
    assert (tangential <= friction * lam[..., 2] + 1e-6).all()
    assert (np.abs(solution.tau) <= robot.tau_max + 1e-6).all()


@pytest.mark.parametrize("contact", ["point", "rolling"])
@pytest.mark.parametrize("standing", [(0, 1, 2, 3), (1, 2), (3, 0, 1), (3,)])
def test_the_acceleration_of_a_stance_can_be_explained(
    any_robot: Robot, any_states: Draw, contact: str, standing: tuple[int, ...]
) -> None:
    robot, (q, v, _, tau) = any_robot, any_states(1000)
    feet = tuple(robot.legs[leg] for leg in standing)
    a = dynamics.stance_dynamics(robot, q, v, tau, feet=feet, contact=contact).a
    solution = inverse_dynamics(robot, q, v, a, feet=feet, contact=contact)
    assert solution.residual.max() < 1e-9
    rows = slice(0, None, 20)
    some = InverseDynamics(*(part[rows] for part in solution))
    motion = (q[rows], v[rows], a[rows])
    assert violation(robot, motion, some, feet=feet, contact=contact) < 1e-9
    assert solution.feasible.all()
    # The torques that made the motion are one way to make it; ours are the cheapest.
    cost = np.linalg.norm(solution.tau, axis=-1)
    slack = np.sqrt(FORCE_WEIGHT) * np.abs(solution.lam).max()
    assert (cost <= np.linalg.norm(tau, axis=-1) + slack).all()


def test_no_constrained_forces_beat_the_closed_form_and_none_that_do_are_missed(
    robot: Robot, crouches: Draw
) -> None:
    """The warm chain of QPs against each QP on its own, from a cold start, to a finer accuracy."""
    q, v, a, _ = crouches(60)
    problem = force_problem(robot, (q, 0 * v, a), (0, 1, 2, 3), 0.0, ())
    solution = inverse_dynamics(robot, q, 0 * v, a, friction=0.5)
    conditions = saddle_point(problem)
    compared = 0
    for row in np.flatnonzero(solution.feasible):
        one = ForceProblem(*(part[[row]] for part in problem))
        terms = _Chain(one, conditions.matrix[[row]], conditions.rhs[[row]], 0.5, robot.tau_max)
        qp = proxqp.dense.QP(12, 6, 44)
        qp.settings.eps_abs, qp.settings.eps_rel, qp.settings.max_iter = 1e-11, 0.0, 5000
        qp.init(**terms._terms(0))
        qp.solve()
        np.testing.assert_allclose(solution.tau[row], one.torques(qp.results.x)[0], atol=2e-4)
        compared += 1
    assert compared > 20


def test_cones_and_limits_are_held(robot: Robot, crouches: Draw) -> None:
    q, v, _, noise = crouches(40)
    carrying = inverse_dynamics(robot, q, 0 * v, 0 * v).tau
    a = dynamics.stance_dynamics(robot, q, 0 * v, carrying + noise).a
    free = inverse_dynamics(robot, q, 0 * v, a)
    solution = inverse_dynamics(robot, q, 0 * v, a, friction=FRICTION)
    feasible = solution.feasible
    assert feasible.any()
    assert not feasible.all()
    rows = InverseDynamics(*(part[feasible] for part in solution))
    assert violation(robot, (q[feasible], 0 * v[feasible], a[feasible]), rows) < 1e-9
    assert_within(robot, solution, FRICTION)
    # Constraints only ever cost torque.
    costs = [np.linalg.norm(part.tau[feasible], axis=-1) for part in (free, solution)]
    assert (costs[1] >= costs[0] - 1e-3).all()
    assert (costs[1] > costs[0] + 1e-3).any()


def test_proxqp_finds_what_another_solver_finds(robot: Robot, crouches: Draw) -> None:
    q, v, a, _ = (x[2] for x in crouches(3))
    friction = 0.3
    solution = inverse_dynamics(robot, q, 0 * v, 0 * a, friction=friction)
    jacobian = dynamics.contact_jacobian(robot, q)
    needed = dynamics.gravity(robot, q)
    sides = cone_sides(friction, 4)

    def torques(lam: Array) -> Array:
        return np.asarray(needed[6:] - jacobian[:, 6:].T @ lam)

    reference = minimize(
        lambda lam: torques(lam) @ torques(lam) + FORCE_WEIGHT * lam @ lam,
        np.tile([0.0, 0.0, 33.7], 4),
        jac=lambda lam: -2.0 * jacobian[:, 6:] @ torques(lam) + 2.0 * FORCE_WEIGHT * lam,
        method="SLSQP",
        constraints=[
            {"type": "eq", "fun": lambda lam: jacobian[:, :6].T @ lam - needed[:6]},
            {"type": "ineq", "fun": lambda lam: -sides @ lam},
        ],
        options={"ftol": 1e-12, "maxiter": 500},
    )
    assert reference.success
    np.testing.assert_allclose(solution.tau, torques(reference.x), atol=1e-4)


def test_a_warm_start_changes_nothing(robot: Robot, crouches: Draw) -> None:
    q, v, a, _ = crouches(20)
    batch = inverse_dynamics(robot, q, v, a, friction=0.4, constraint=PLANAR_CONSTRAINT)
    for row in range(20):
        one = inverse_dynamics(
            robot, q[row], v[row], a[row], friction=0.4, constraint=PLANAR_CONSTRAINT
        )
        np.testing.assert_allclose(batch.tau[row], one.tau, atol=1e-6)
        assert batch.feasible[row] == one.feasible


def test_what_cannot_be_done_is_told_and_kept_within_the_limits(robot: Robot) -> None:
    a = np.zeros(18)
    a[0] = 20.0  # more than friction can push
    solution = inverse_dynamics(robot, robot.standing, np.zeros(18), a, friction=0.5)
    assert not solution.feasible
    assert solution.residual > 1.0
    assert np.isfinite(solution.tau).all()
    assert_within(robot, InverseDynamics(*(part[None] for part in solution)), 0.5)


def test_torque_limits_can_be_chosen(robot: Robot) -> None:
    state = robot.standing, np.zeros(18), np.zeros(18)
    plain = inverse_dynamics(robot, *state, friction=FRICTION)
    limit = np.abs(plain.tau).max() - 0.05
    limited = inverse_dynamics(robot, *state, friction=FRICTION, torque_limits=limit)
    assert limited.feasible
    assert np.abs(limited.tau).max() <= limit + 1e-6
    weak = inverse_dynamics(robot, *state, friction=FRICTION, torque_limits=1.0)
    assert not weak.feasible
    assert np.abs(weak.tau).max() <= 1.0 + 1e-6


def test_feasible_is_what_a_linear_program_says(robot: Robot, crouches: Draw) -> None:
    q, v, a, _ = crouches(30)
    a = 2.0 * a
    friction = 0.4
    solution = inverse_dynamics(robot, q, v, a, friction=friction)
    sides = cone_sides(friction, 4)
    for row in range(30):
        jacobian = dynamics.contact_jacobian(robot, q[row])
        needed = dynamics.mass_matrix(robot, q[row]) @ a[row]
        needed += dynamics.nonlinear_effects(robot, q[row], v[row])
        lever = jacobian[:, 6:].T
        program = linprog(
            np.zeros(12),
            A_ub=np.vstack([sides, lever, -lever]),
            b_ub=np.concatenate(
                [np.zeros(32), robot.tau_max + needed[6:], robot.tau_max - needed[6:]]
            ),
            A_eq=jacobian[:, :6].T,
            b_eq=needed[:6],
            bounds=(None, None),
        )
        assert solution.feasible[row] == (program.status == 0)


def mirrored_motion(robot: Robot) -> tuple[Array, Array, Array]:
    """A stride's worth of motion in the sagittal plane, left legs as right ones."""
    phase = np.linspace(0.0, 1.0, 11)[:, None]
    swing = 0.2 * np.sin(2 * np.pi * phase) * np.array([0.0, 1.0, -1.0])
    q = np.tile(robot.standing, (11, 1))
    q[:, 7:] += np.tile(swing, 4)
    v, a = np.zeros((11, 18)), np.zeros((11, 18))
    v[:, 0], a[:, 2] = 0.5, 12.0 * np.sin(np.pi * phase[:, 0])
    v[:, 6:], a[:, 6:] = np.tile(3.0 * swing, 4), np.tile(-20.0 * swing, 4)
    return q, v, a


@pytest.mark.parametrize("friction", [None, 0.8, 0.25])
@pytest.mark.parametrize("contact", ["point", "rolling"])
def test_left_and_right_share_a_symmetric_motion(
    robot: Robot, friction: float | None, contact: str
) -> None:
    motion = mirrored_motion(robot)
    solution = inverse_dynamics(
        robot, *motion, friction=friction, contact=contact, constraint=PLANAR_CONSTRAINT
    )
    assert solution.feasible.all()
    assert violation(robot, motion, solution, contact=contact, constraint=PLANAR_CONSTRAINT) < 1e-9
    legs = solution.tau.reshape(-1, 4, 3)
    mirror = np.array([-1.0, 1.0, 1.0])
    np.testing.assert_allclose(legs[:, [0, 2]], legs[:, [1, 3]] * mirror, atol=1e-6)


def test_the_guide_carries_the_trunk_that_is_off_centre(robot: Robot) -> None:
    rest = np.zeros(18)
    held = inverse_dynamics(robot, robot.standing, rest, rest, constraint=PLANAR_CONSTRAINT)
    trunk = robot.model.inertias[1]
    moment = trunk.mass * robot.gravity * trunk.lever[1]
    np.testing.assert_allclose(held.constraint[[0, 1, 3]], [0.0, moment, 0.0], atol=1e-9)
    alone = inverse_dynamics(robot, robot.standing, rest, rest)
    assert alone.constraint.shape == (0,)
    assert np.linalg.norm(held.tau) < np.linalg.norm(alone.tau)


def test_a_guide_of_all_coordinates_holds_a_robot_in_the_air(
    robot: Robot, random_states: Draw
) -> None:
    q, v, a, _ = random_states(5)
    solution = inverse_dynamics(robot, q, v, a, feet=(), constraint=CONSTRAINT_COORDINATES)
    assert solution.feasible.all()
    assert violation(robot, (q, v, a), solution, feet=(), constraint=CONSTRAINT_COORDINATES) < 1e-9


def test_a_batch_of_any_shape_is_taken(robot: Robot, crouches: Draw) -> None:
    shaped = (x.reshape(2, 3, -1) for x in crouches(6)[:3])
    solution = inverse_dynamics(
        robot, *shaped, friction=FRICTION, constraint=("yaw",), feet=("FL", "RR")
    )
    shapes = [part.shape for part in solution]
    assert shapes == [(2, 3, 12), (2, 3, 6), (2, 3, 1), (2, 3), (2, 3)]


def hop(robot: Robot) -> Gait:
    """Standing for 0.2 s, then hanging in the air for 0.2 s, at constant posture."""
    joints = np.repeat(robot.standing[7:, None], 3, axis=1)
    base = np.repeat([[0.0], [robot.standing[2]], [0.0]], 3, axis=1)
    zero = {"tau": np.zeros((12, 3)), "lam": np.zeros((4, 3, 3))}
    stance = GaitPhase("stance", robot.legs, 0.2, joints, base, **zero)
    fall = base.copy()  # a parabola: second difference of the coefficients g T^2 / 2
    fall[1] += [0.0, 0.25 * 9.81 * 0.2**2, 0.0]
    return Gait(robot.name, 0.0, 0.3, (stance, GaitPhase("flight", (), 0.2, joints, fall, **zero)))


def test_feedforward_covers_stance_and_flight(robot: Robot) -> None:
    result = feedforward(
        robot, hop(robot), samples=7, friction=FRICTION, constraint=PLANAR_CONSTRAINT
    )
    rest = np.zeros(18)
    static = inverse_dynamics(
        robot, robot.standing, rest, rest, friction=FRICTION, constraint=PLANAR_CONSTRAINT
    )
    assert result.feasible.all()
    np.testing.assert_array_equal(result.s, np.linspace(0, 1, 7))
    np.testing.assert_allclose(result.stance, np.tile(static.tau, (7, 1)), atol=1e-9)
    np.testing.assert_allclose(result.lam, np.tile(static.lam.reshape(4, 3), (7, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(result.lam[..., 2].sum(axis=-1), robot.mass * robot.gravity)
    np.testing.assert_allclose(result.flight, 0.0, atol=1e-9)  # all of it falls freely


def test_wrong_arguments_are_refused_with_a_remedy(robot: Robot) -> None:
    state = robot.standing, np.zeros(18), np.zeros(18)
    with pytest.raises(InvalidInput, match=r"a has shape \(12,\) where \(18,\)"):
        inverse_dynamics(robot, *state[:2], np.zeros(12))
    with pytest.raises(InvalidInput, match=r"friction=0\.0; give a positive number"):
        inverse_dynamics(robot, *state, friction=0.0)
    with pytest.raises(InvalidInput, match="torque_limits must be one or 12 positive"):
        inverse_dynamics(robot, *state, friction=0.5, torque_limits=[1.0, 2.0])
    with pytest.raises(UnknownName, match="constraint coordinate 'heave'"):
        inverse_dynamics(robot, *state, constraint=("heave",))
    with pytest.raises(InvalidInput, match="name each once"):
        inverse_dynamics(robot, *state, constraint=("y", "y"))
    with pytest.raises(InvalidInput, match="samples=1; give a whole number from 2 to 100000"):
        feedforward(robot, hop(robot), samples=1)


def test_forces_within_cones_are_the_same_to_the_bit_wherever_their_memory_lies() -> None:
    rng = np.random.default_rng(0)
    arms = rng.uniform(-0.3, 0.3, (20, 4, 3))
    nominal = np.tile([5.0, 0.0, 30.0], (20, 4, 1))
    wrench = rng.normal(0.0, [60.0, 60.0, 20.0, 8.0, 8.0, 8.0], (20, 6))
    seen, kept = set(), []
    for size in rng.integers(1, 3000, 40):
        kept.append(np.empty(int(size)))  # moves what is allocated next
        forces = distribute_wrench(arms, wrench, nominal, friction=0.4)
        seen.add(forces.tobytes())
    assert len(seen) == 1
    side = np.hypot(forces[..., 0], forces[..., 1])
    assert np.all(side <= 0.4 * forces[..., 2] + 1e-9)


def test_edges_of_the_pyramids_are_where_their_sides_meet() -> None:
    sides, edges = cone_sides(0.6, 2), cone_edges(0.6, 2)
    gap = sides @ edges  # (16, 16): 0 on two sides of its own pyramid, below on the others
    assert np.all(gap < 1e-12)
    assert np.all((np.abs(gap) < 1e-12).sum(axis=0) == 2 + 8)
