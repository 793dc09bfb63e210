"""Dynamics agree with another engine, with their own derivatives, and with conservation laws."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import Robot, dynamics, load_robot
from pronk_pin._typing import Array
from pronk_pin.dynamics.derivatives import _implicit
from pronk_pin.dynamics.energetics import centroidal_momentum, kinetic_energy, potential_energy
from pronk_pin.errors import IntegrationFailed, InvalidInput, UnknownName
from pronk_pin.inverse_dynamics import inverse_dynamics
from pronk_pin.kinematics import foot_positions, foot_velocities, leg_inverse_kinematics
from pronk_pin.robot.conventions import to_mujoco

Draw = Callable[..., tuple[Array, Array, Array, Array]]

CONTACTS = ("point", "rolling")


def relative(value: Array, expected: Array) -> float:
    """Largest error relative to the largest expected entry."""
    return float(np.abs(value - expected).max() / np.abs(expected).max())


def mujoco_velocity_map(robot: Robot, q: Array) -> Array:
    """T with qvel = T v, by converting unit velocities."""
    columns = to_mujoco(robot, np.tile(q, (robot.nv, 1)), np.eye(robot.nv)).qvel
    assert columns is not None
    return columns.T


def test_mass_bias_and_jacobian_agree_with_mujoco(
    any_robot: Robot, any_states: Draw, any_mujoco_model: mujoco.MjModel
) -> None:
    robot, model = any_robot, any_mujoco_model
    q, v, _, _ = any_states(1000)
    # MuJoCo's accelerations where Pinocchio's are zero: the frames turn with the base.
    states = to_mujoco(robot, q, v, np.zeros_like(v))
    order = [model.joint(i).name for i in range(1, model.njnt)]
    assert order == list(robot.urdf_joint_names)
    knees = [model.joint(robot.spec.leg_joints(leg)[-1]) for leg in robot.legs]
    data, mass = mujoco.MjData(model), np.zeros((robot.nv, robot.nv))
    jacobian = np.zeros((3, robot.nv))
    for row, (q_row, v_row) in enumerate(zip(q, v, strict=True)):
        data.qpos[:], data.qvel[:] = states.qpos[row], states.qvel[row]
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, mass)
        change = mujoco_velocity_map(robot, q_row)
        bias = change.T @ (mass @ states.qacc[row] + data.qfrc_bias)
        assert relative(dynamics.mass_matrix(robot, q_row), change.T @ mass @ change) < 1e-12
        assert relative(dynamics.nonlinear_effects(robot, q_row, v_row), bias) < 1e-12
        ours = dynamics.contact_jacobian(robot, q_row).reshape(-1, 3, robot.nv)
        for place, knee, mine in zip(foot_positions(robot, q_row), knees, ours, strict=True):
            mujoco.mj_jac(model, data, jacobian, None, place, knee.bodyid[0])
            assert relative(mine, jacobian @ change) < 1e-12


def test_bias_forces_are_coriolis_and_gravity(robot: Robot, random_states: Draw) -> None:
    for q, v, _, _ in zip(*random_states(20), strict=True):
        parts = dynamics.coriolis_matrix(robot, q, v) @ v + dynamics.gravity(robot, q)
        assert relative(parts, dynamics.nonlinear_effects(robot, q, v)) < 1e-12
        assert relative(dynamics.nonlinear_effects(robot, q, 0 * v), dynamics.gravity(robot, q)) < (
            1e-12
        )


def test_motors_act_on_joints_only(robot: Robot) -> None:
    selection = dynamics.selection_matrix(robot)
    tau = np.arange(12.0)
    np.testing.assert_array_equal(selection @ tau, np.concatenate([np.zeros(6), tau]))


@pytest.mark.parametrize("contact", CONTACTS)
def test_contact_bias_is_the_rate_of_the_jacobian(
    robot: Robot, random_states: Draw, contact: str
) -> None:
    step = 1e-6
    for q, v, _, _ in zip(*random_states(10), strict=True):
        ahead, behind = (
            dynamics.contact_jacobian(
                robot, pin.integrate(robot.model, q, sign * step * v), contact=contact
            )
            @ v
            for sign in (1, -1)
        )
        bias = dynamics.contact_bias(robot, q, v, contact=contact)
        assert relative(bias, (ahead - behind) / (2 * step)) < 1e-6


def test_the_jacobian_is_the_derivative_of_the_feet(robot: Robot, random_states: Draw) -> None:
    step = 1e-6
    for q, _, _, _ in zip(*random_states(5), strict=True):
        columns = [
            foot_positions(robot, pin.integrate(robot.model, q, step * axis))
            - foot_positions(robot, pin.integrate(robot.model, q, -step * axis))
            for axis in np.eye(robot.nv)
        ]
        numeric = np.stack(columns, axis=-1).reshape(12, robot.nv) / (2 * step)
        assert relative(dynamics.contact_jacobian(robot, q), numeric) < 1e-7


def test_a_rolling_foot_rests_at_its_lowest_point(robot: Robot, random_states: Draw) -> None:
    down = np.array([0.0, 0.0, -robot.foot_radius])
    for q, v, _, _ in zip(*random_states(10), strict=True):
        rolling = dynamics.contact_jacobian(robot, q, contact="rolling") @ v
        pin.forwardKinematics(robot.model, robot.data, q, v)
        for leg, foot in enumerate(robot.foot_ids):
            world = pin.LOCAL_WORLD_ALIGNED
            motion = pin.getFrameVelocity(robot.model, robot.data, foot, world)
            lowest = motion.linear + np.cross(motion.angular, down)
            np.testing.assert_allclose(rolling[3 * leg : 3 * leg + 3], lowest, atol=1e-12)


def test_rows_follow_the_feet_asked_for(robot: Robot) -> None:
    every = dynamics.contact_jacobian(robot, robot.standing)
    some = dynamics.contact_jacobian(robot, robot.standing, feet=("RR", "FL"))
    np.testing.assert_array_equal(some, np.concatenate([every[9:], every[:3]]))
    assert dynamics.contact_jacobian(robot, robot.standing, feet=()).shape == (0, 18)


def test_flight_satisfies_the_equations_of_motion(robot: Robot, random_states: Draw) -> None:
    states = random_states(20)
    q, v, _, tau = states
    for row, a in enumerate(dynamics.flight_dynamics(robot, q, v, tau)):
        needed = dynamics.mass_matrix(robot, q[row]) @ a
        needed += dynamics.nonlinear_effects(robot, q[row], v[row])
        np.testing.assert_allclose(needed, np.r_[np.zeros(6), tau[row]], atol=1e-10)


@pytest.mark.parametrize("contact", CONTACTS)
def test_stance_solves_the_equations_of_the_paper(
    any_robot: Robot, any_states: Draw, contact: str
) -> None:
    robot, (q, v, _, tau) = any_robot, any_states(1000)
    for feet in (None, *((robot.legs[1], robot.legs[2]), (robot.legs[3],))):
        solution = dynamics.stance_dynamics(robot, q, v, tau, feet=feet, contact=contact)
        assert not solution.singular.any()
        for row in range(0, len(q), 1 if feet is None else 20):
            state = (robot, q[row], v[row])
            matrix, rhs = dynamics.stance_dae(*state, tau[row], feet=feet, contact=contact)
            a, lam = solution.a[row], solution.lam[row]
            dense = np.linalg.solve(matrix, rhs)
            assert relative(np.concatenate([a, lam]), dense) < 1e-9
            achieved = matrix[robot.nv :, : robot.nv] @ a - rhs[robot.nv :]
            assert np.abs(achieved).max() < 1e-9


def test_stance_without_feet_is_flight(robot: Robot, random_states: Draw) -> None:
    q, v, _, tau = random_states(5)
    stance = dynamics.stance_dynamics(robot, q, v, tau, feet=())
    np.testing.assert_allclose(stance.a, dynamics.flight_dynamics(robot, q, v, tau))
    assert stance.lam.shape == (5, 0)


@pytest.mark.parametrize("contact", CONTACTS)
def test_a_batch_of_stances_is_solved_like_its_rows(
    robot: Robot, crouches: Draw, contact: str
) -> None:
    q, v, _, tau = crouches(6)
    shaped = (x.reshape(2, 3, -1) for x in (q, v, tau))
    batch = dynamics.stance_dynamics(robot, *shaped, contact=contact)
    one = dynamics.stance_dynamics(robot, q[4], v[4], tau[4], contact=contact)
    np.testing.assert_array_equal(batch.a[1, 1], one.a)
    np.testing.assert_array_equal(batch.lam[1, 1], one.lam)
    assert batch.singular.shape == (2, 3)


@pytest.mark.parametrize("contact", CONTACTS)
def test_baumgarte_pulls_drifting_feet_back(robot: Robot, crouches: Draw, contact: str) -> None:
    kp, kd = 400.0, 40.0
    q, v, _, tau = (x[0] for x in crouches(1))
    a = dynamics.stance_dynamics(robot, q, v, tau, baumgarte=(kp, kd), contact=contact).a
    jacobian = dynamics.contact_jacobian(robot, q, contact=contact)
    achieved = jacobian @ a + dynamics.contact_bias(robot, q, v, contact=contact)
    wanted = -kd * jacobian @ v
    wanted[2::3] -= kp * (foot_positions(robot, q)[:, 2] - robot.foot_radius)
    np.testing.assert_allclose(achieved, wanted, atol=1e-9)


def stretched(robot: Robot) -> Array:
    """Legs straight below their hips: vertical forces can cancel without moving anything."""
    q = robot.standing.copy()
    for index, leg in enumerate(robot.legs):
        straight = np.hypot(0.0838, 0.4)
        hip = robot.model.jointPlacements[2 + 3 * index].translation
        target = hip - [0.0, 0.0, straight]
        q[7 + 3 * index : 10 + 3 * index] = leg_inverse_kinematics(robot, target, leg=leg).joints
    return q


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("moving", [False, True])
def test_a_singular_stance_says_so_and_stays_finite(
    robot: Robot, random_states: Draw, contact: str, moving: bool
) -> None:
    q, (_, v, _, tau) = stretched(robot), (x[0] for x in random_states(1))
    v = v * moving
    solution = dynamics.stance_dynamics(robot, q, v, tau, contact=contact)
    matrix, rhs = dynamics.stance_dae(robot, q, v, tau, contact=contact)
    assert solution.singular
    assert np.abs(solution.lam).max() < 1e4
    residual = matrix @ np.concatenate([solution.a, solution.lam]) - rhs
    assert np.abs(residual[:18]).max() < 1e-9
    if not moving:  # then the feet can keep their acceleration of zero
        assert np.abs(residual[18:]).max() < 1e-6
    after = dynamics.impact(robot, q, v, contact=contact)
    assert after.singular
    assert np.isfinite(after.v).all()


@pytest.mark.parametrize("contact", CONTACTS)
def test_a_plastic_impact_stops_the_feet_and_keeps_the_momentum(
    any_robot: Robot, any_states: Draw, contact: str
) -> None:
    robot, (q, v, _, _) = any_robot, any_states(1000)
    stances = (None, (robot.legs[1], robot.legs[2]), (robot.legs[3],))
    for row in range(len(q)):
        how = {"feet": stances[row % 3], "contact": contact}
        after = dynamics.impact(robot, q[row], v[row], **how)
        jacobian, mass = (
            dynamics.contact_jacobian(robot, q[row], **how),
            dynamics.mass_matrix(robot, q[row]),
        )
        change = after.v - v[row]
        assert np.abs(jacobian @ after.v).max() < 1e-10
        assert np.abs(mass @ change - jacobian.T @ after.impulse).max() < 1e-10
        assert after.v @ mass @ after.v <= v[row] @ mass @ v[row] * (1 + 1e-12)
        # The whole robot's linear momentum changes by the sum of the impulses.
        gained = centroidal_momentum(robot, q[row], change).linear
        np.testing.assert_allclose(gained, after.impulse.reshape(-1, 3).sum(axis=0), atol=1e-10)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 1.0])
def test_an_impact_never_creates_energy(
    robot: Robot, random_states: Draw, restitution: float
) -> None:
    for q, v, _, _ in zip(*random_states(20), strict=True):
        after = dynamics.impact(robot, q, v, restitution=restitution)
        mass = dynamics.mass_matrix(robot, q)
        before, left = v @ mass @ v, after.v @ mass @ after.v
        assert left <= before * (1 + 1e-12)
        if restitution == 1.0:
            assert left == pytest.approx(before, rel=1e-10)
        bounced = foot_velocities(robot, q, after.v)
        expected = -restitution * foot_velocities(robot, q, v)
        np.testing.assert_allclose(bounced, expected, atol=1e-10)


def central_differences(
    robot: Robot, function: Callable[..., tuple[Array, ...]], state: tuple[Array, Array, Array]
) -> list[Array]:
    """Derivatives of each result by q, v and tau: (first by q, first by v, ..., last by tau)."""
    q, v, tau = state
    step = 1e-6
    moves = {
        robot.nv: lambda d: (pin.integrate(robot.model, q, d), v, tau),
        -robot.nv: lambda d: (q, v + d, tau),
        robot.nu: lambda d: (q, v, tau + d),
    }
    blocks = []
    for size, move in moves.items():
        ends = [
            [function(*move(sign * step * axis)) for axis in np.eye(abs(size))] for sign in (1, -1)
        ]
        pairs = [zip(*end, strict=True) for end in ends]
        blocks.append(
            [
                (np.array(up) - np.array(down)).T / (2 * step)
                for up, down in zip(*pairs, strict=True)
            ]
        )
    return [block[k] for k in range(len(blocks[0])) for block in blocks]


def test_flight_derivatives_agree_with_differences(any_robot: Robot, any_states: Draw) -> None:
    for q, v, _, tau in zip(*any_states(5), strict=True):
        exact = dynamics.flight_derivatives(any_robot, q, v, tau)
        numeric = central_differences(
            any_robot, lambda *x: (dynamics.flight_dynamics(any_robot, *x),), (q, v, tau)
        )
        for name, mine, other in zip(exact._fields, exact, numeric, strict=True):
            assert relative(mine, other) < 1e-5, name


@pytest.mark.parametrize("contact", CONTACTS)
def test_stance_derivatives_agree_with_differences(
    any_robot: Robot, any_states: Draw, contact: str
) -> None:
    for row, (q, v, _, tau) in enumerate(zip(*any_states(6), strict=True)):
        feet = (None, any_robot.legs[1:], any_robot.legs[2:3])[row % 3]
        how = {"feet": feet, "contact": contact}
        exact = dynamics.stance_derivatives(any_robot, q, v, tau, **how)
        numeric = central_differences(
            any_robot,
            lambda *x, how=how: dynamics.stance_dynamics(any_robot, *x, **how)[:2],
            (q, v, tau),
        )
        assert not exact.singular
        for name, mine, other in zip(exact._fields[:-1], exact[:-1], numeric, strict=True):
            assert relative(mine, other) < 1e-5, name


def test_rolling_derivatives_become_those_of_points_for_small_feet(
    robot: Robot, random_states: Draw
) -> None:
    """Two ways to the same matrices: Pinocchio's for points, ours for spheres of no size."""
    points = load_robot(replace(robot.spec, foot_radius=0.0))
    q, v, _, tau = (x[0] for x in random_states(1))
    pinocchio, ours = (
        dynamics.stance_derivatives(robot, q, v, tau),
        _implicit(points, (q, v, tau), (0, 1, 2, 3), 0.0),
    )
    for mine, other in zip(ours[:-1], pinocchio[:-1], strict=True):
        assert relative(mine, other) < 1e-10


def test_derivatives_of_a_singular_stance_are_finite_and_say_so(robot: Robot) -> None:
    q, zero = stretched(robot), np.zeros(18)
    derivatives = dynamics.stance_derivatives(robot, q, zero, np.zeros(12))
    assert derivatives.singular
    assert all(np.isfinite(block).all() for block in derivatives)


def test_a_flight_keeps_its_energy_and_falls_as_a_stone(any_robot: Robot, any_states: Draw) -> None:
    q, v, _, _ = (x[0] for x in any_states(1))
    flight = dynamics.simulate_phase(any_robot, q, v, np.zeros(12), duration=0.5, feet=())
    assert flight.energy_drift < 1e-8
    energy = kinetic_energy(any_robot, flight.q, flight.v) + potential_energy(any_robot, flight.q)
    assert np.abs(energy - energy[0]).max() < 1e-8
    momentum = centroidal_momentum(any_robot, flight.q, flight.v)
    spin = np.abs(momentum.angular - momentum.angular[0]).max()
    assert spin < 1e-8 * max(1.0, np.abs(momentum.angular[0]).max())
    lost = momentum.linear[0] - momentum.linear
    expected = any_robot.mass * any_robot.gravity * flight.t
    np.testing.assert_allclose(lost[:, 2], expected, atol=1e-8)
    assert flight.lam.shape == (101, 0)


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("baumgarte", [None, (400.0, 40.0)])
def test_a_simulated_stance_stays_on_its_feet(
    robot: Robot, crouches: Draw, contact: str, baumgarte: tuple[float, float] | None
) -> None:
    v = crouches(1).v[0]
    q = robot.standing
    v = dynamics.impact(robot, q, v, contact=contact).v
    hold = inverse_dynamics(robot, q, np.zeros(18), np.zeros(18), contact=contact).tau
    stance = dynamics.simulate_phase(
        robot, q, v, hold, duration=0.1, contact=contact, baumgarte=baumgarte
    )
    assert stance.foot_drift < 1e-9
    assert stance.contact_speed < 1e-8
    assert stance.energy_drift < 1e-8
    assert not stance.singular
    # It did move, as the acceleration says: the integral of the velocity is the way.
    assert np.abs(stance.q[-1] - q).max() > 1e-3
    middle = np.diff(stance.v, axis=0) / np.diff(stance.t)[:, None]
    np.testing.assert_allclose(middle, 0.5 * (stance.a[1:] + stance.a[:-1]), atol=0.05)


def test_baumgarte_wins_back_what_has_drifted(robot: Robot) -> None:
    q = robot.standing.copy()
    q[2] += 1e-3  # the feet are a millimetre too high
    hold = inverse_dynamics(robot, q, np.zeros(18), np.zeros(18)).tau
    drifted = dynamics.simulate_phase(robot, q, np.zeros(18), hold, duration=0.2)
    returned = dynamics.simulate_phase(
        robot, q, np.zeros(18), hold, duration=0.2, baumgarte=(2500.0, 100.0)
    )
    heights = [
        foot_positions(robot, x.q[-1])[:, 2] - robot.foot_radius for x in (drifted, returned)
    ]
    assert np.abs(heights[0] - 1e-3).max() < 1e-6
    assert np.abs(heights[1]).max() < 1e-5


def test_torques_may_be_constant_sampled_or_a_function(robot: Robot, crouches: Draw) -> None:
    q, v, _, tau = (x[0] for x in crouches(1))
    ways = (tau, np.tile(tau, (5, 1)), lambda t: tau)
    ends = [dynamics.simulate_phase(robot, q, v, way, duration=0.05, feet=()).q[-1] for way in ways]
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-12)
    np.testing.assert_allclose(ends[2], ends[0], atol=1e-12)
    rising = np.array([0.0 * tau, tau])
    ramp = dynamics.simulate_phase(robot, q, v, rising, duration=0.05, feet=(), samples=3)
    np.testing.assert_allclose(ramp.tau, [0.0 * tau, 0.5 * tau, tau], atol=1e-14)


def test_a_simulation_that_cannot_be_is_refused(robot: Robot) -> None:
    q, v, tau = robot.standing, np.zeros(18), np.zeros(12)
    with pytest.raises(InvalidInput, match=r"duration=0\.0; give a positive number \[s\]"):
        dynamics.simulate_phase(robot, q, v, tau, duration=0.0)
    with pytest.raises(InvalidInput, match="samples=1; give a whole number from 2 to 1000000"):
        dynamics.simulate_phase(robot, q, v, tau, duration=1.0, samples=1)
    with pytest.raises(InvalidInput, match=r"tau\(t\) holds NaN"):
        dynamics.simulate_phase(robot, q, v, lambda t: tau * np.nan, duration=0.1)
    with pytest.raises(InvalidInput, match=r"tau has shape \(1, 12\)"):
        dynamics.simulate_phase(robot, q, v, tau[None], duration=0.1)


def test_a_hopeless_simulation_ends_with_a_word(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pronk_pin.dynamics.phase_simulation._EVALUATIONS", 500)
    huge = np.full(12, 1e9)
    with pytest.raises(IntegrationFailed, match=r"stopped at .* shorten the duration"):
        dynamics.simulate_phase(robot, robot.standing, np.zeros(18), huge, duration=1.0, feet=())


@pytest.mark.parametrize("part", ["q", "v", "tau"])
def test_nan_is_found_wherever_it_hides(robot: Robot, crouches: Draw, part: str) -> None:
    """The quick look at single states must not miss what the full check would find."""
    q, v, _, tau = (x[0] for x in crouches(1))
    clean = {"q": q, "v": v, "tau": tau}
    functions: dict[str, tuple[Callable[..., object], ...]] = {
        "q": (dynamics.mass_matrix, dynamics.gravity, dynamics.contact_jacobian),
        "qv": (
            dynamics.coriolis_matrix,
            dynamics.nonlinear_effects,
            dynamics.contact_bias,
            dynamics.impact,
            lambda *x: dynamics.impact(*x, feet=("RR",)),
        ),
        "qvtau": (
            dynamics.flight_dynamics,
            dynamics.stance_dynamics,
            lambda *x: dynamics.stance_dynamics(*x, feet=("RR",)),
            lambda *x: dynamics.stance_dynamics(*x, contact="rolling"),
            dynamics.stance_derivatives,
            dynamics.flight_derivatives,
        ),
    }
    for names, group in functions.items():
        if part not in names:
            continue
        for value in (np.nan, np.inf):
            for index in range(len(clean[part])):
                broken = {name: x.copy() for name, x in clean.items() if name in names}
                broken[part][index] = value
                for function in group:
                    with pytest.raises(InvalidInput, match=r"NaN|norm"):
                        function(robot, *broken.values())


def test_wrong_arguments_are_refused_with_a_remedy(robot: Robot) -> None:
    q, v, tau = robot.standing, np.zeros(18), np.zeros(12)
    with pytest.raises(InvalidInput, match=r"v has shape \(12,\) where \(18,\) is expected"):
        dynamics.flight_dynamics(robot, q, tau, tau)
    with pytest.raises(InvalidInput, match=r"tau has shape \(12,\) where \(2, 12\)"):
        dynamics.stance_dynamics(robot, np.tile(q, (2, 1)), np.zeros((2, 18)), tau)
    with pytest.raises(InvalidInput, match="one state at a time"):
        dynamics.mass_matrix(robot, q[None])
    with pytest.raises(InvalidInput, match="NaN"):
        dynamics.nonlinear_effects(robot, q, v * np.nan)
    with pytest.raises(InvalidInput, match="normalise it first"):
        dynamics.impact(robot, 1.1 * q, v)
    with pytest.raises(InvalidInput, match="from 0 to 1"):
        dynamics.impact(robot, q, v, restitution=1.5)
    with pytest.raises(InvalidInput, match="0 or positive"):
        dynamics.stance_dynamics(robot, q, v, tau, baumgarte=(-1.0, 0.0))
    with pytest.raises(InvalidInput, match=r"baumgarte has shape \(1,\)"):
        dynamics.stance_dynamics(robot, q, v, tau, baumgarte=(1.0,))
    with pytest.raises(InvalidInput, match="name each leg once"):
        dynamics.contact_jacobian(robot, q, feet=("FL", "FL"))
    with pytest.raises(UnknownName, match="unknown leg 'LF'; choose one of: FL, FR, RL, RR"):
        dynamics.contact_jacobian(robot, q, feet=("LF",))
    with pytest.raises(UnknownName, match="choose one of: point, rolling"):
        dynamics.contact_bias(robot, q, v, contact="sliding")


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("feet", [None, (1,), (0, 2)])
def test_feet_leave_an_impact_as_fast_as_the_restitution_says(
    robot: Robot, random_states: Draw, contact: str, feet: tuple[int, ...] | None
) -> None:
    """J v+ = -e J v of the feet that hit, and the impulses alone change the momentum."""
    legs = None if feet is None else [robot.legs[leg] for leg in feet]
    for restitution in (0.0, 0.4, 1.0):
        for q, v, _, _ in zip(*random_states(5), strict=True):
            how = {"feet": legs, "contact": contact}
            after = dynamics.impact(robot, q, v, restitution=restitution, **how)
            jacobian = dynamics.contact_jacobian(robot, q, **how)
            np.testing.assert_allclose(jacobian @ after.v, -restitution * jacobian @ v, atol=1e-9)
            given = dynamics.mass_matrix(robot, q) @ (after.v - v)
            np.testing.assert_allclose(given, jacobian.T @ after.impulse, atol=1e-9)
