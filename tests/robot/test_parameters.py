"""A identified model is the same robot in MuJoCo, and every part of the package uses it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import ModelParameters, Robot, RobotSpec, load_robot
from pronk_pin._typing import Array
from pronk_pin.dynamics import (
    contact_jacobian,
    flight_derivatives,
    flight_dynamics,
    impact,
    mass_matrix,
    planar_derivatives,
    planar_impact,
    planar_rows,
    simulate_phase,
    stance_dae,
    stance_derivatives,
    stance_dynamics,
)
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import gait_problem, optimize_gait
from pronk_pin.gait.residual import missing_forces
from pronk_pin.inverse_dynamics import inverse_dynamics
from pronk_pin.robot.conventions import from_mujoco, to_mujoco
from pronk_pin.robot.formats.model_files import parametrised_spec, write_mjcf, write_urdf

Draw = Callable[..., tuple[Array, Array, Array, Array]]

PARAMETERS = ModelParameters(
    armature=(0.01, 0.02, 0.03),
    damping=(0.1, 0.2, 0.3),
    coulomb=(0.3, 0.2, 0.1),
    payload=2.5,
    payload_position=(0.1, 0.02, 0.08),
    trunk_shift=(0.01, -0.005, 0.002),
    torque_constant=0.9,
)


@pytest.fixture(scope="session")
def identified(any_robot: Robot) -> Robot:
    return any_robot.with_parameters(PARAMETERS)


@pytest.fixture(scope="session")
def identified_a1(robot: Robot) -> Robot:
    return robot.with_parameters(PARAMETERS)


def test_parameters_replace_those_before_and_go_again(robot: Robot) -> None:
    identified = robot.with_parameters(PARAMETERS)
    assert identified.mass == pytest.approx(robot.mass + 2.5)
    again = identified.with_parameters(ModelParameters(payload=1.0))
    assert again.mass == pytest.approx(robot.mass + 1.0)
    assert again.with_parameters(ModelParameters()) is robot
    assert robot.with_parameters(PARAMETERS) is identified
    assert len({robot.sha256, identified.sha256, again.sha256}) == 3


def test_a_payload_is_a_point_and_a_shift_moves_the_trunk_alone(robot: Robot) -> None:
    own = robot.model.inertias[1]
    place, shift = np.array(PARAMETERS.payload_position), np.array(PARAMETERS.trunk_shift)
    shifted = pin.Inertia(own.mass, own.lever + shift, own.inertia)
    expected = shifted + pin.Inertia(2.5, place, np.zeros((3, 3)))
    whole = robot.with_parameters(PARAMETERS).model.inertias[1]
    np.testing.assert_allclose(whole.toDynamicParameters(), expected.toDynamicParameters())
    lighter = robot.with_parameters(ModelParameters(payload=-1.0, payload_position=(0.1, 0, 0)))
    back = lighter.model.inertias[1] + pin.Inertia(1.0, np.array([0.1, 0, 0]), np.zeros((3, 3)))
    np.testing.assert_allclose(back.toDynamicParameters(), own.toDynamicParameters(), atol=1e-12)


def test_flight_agrees_with_mujoco_with_rotors_friction_motors_and_load(identified: Robot) -> None:
    model = parametrised_spec(identified).compile()
    # Coulomb friction is a constraint there: sliding fast, and stiff, it is the force it should be.
    model.opt.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT
    )
    data = mujoco.MjData(model)
    rng = np.random.default_rng(1)
    joints = [model.actuator(name).id for name in identified.joint_names]
    for _ in range(20):
        q = pin.integrate(
            identified.model, identified.standing, 0.2 * rng.standard_normal(identified.nv)
        )
        v = rng.standard_normal(identified.nv)
        v[6:] = np.where(v[6:] < 0.0, -1.0, 1.0) * (2.0 + np.abs(v[6:]))
        limit = identified.tau_max
        tau = np.clip(3.0 * rng.standard_normal(identified.nu), -limit, limit)
        state = to_mujoco(identified, q, v)
        data.qpos[:], data.qvel[:] = state.qpos, state.qvel
        data.ctrl[joints] = tau
        mujoco.mj_forward(model, data)
        ours = from_mujoco(identified, data.qpos, data.qvel, data.qacc).a
        expected = flight_dynamics(identified, q, v, tau)
        np.testing.assert_allclose(ours, expected, rtol=1e-4, atol=1e-3 * np.abs(expected).max())


def test_inverse_dynamics_asks_for_what_makes_the_motion(
    identified_a1: Robot, crouches: Draw
) -> None:
    q, v, _, tau = crouches(50)
    for feet in ((), None):
        a = stance_dynamics(identified_a1, q, v, tau, feet=feet).a
        answer = inverse_dynamics(identified_a1, q, v, a, feet=feet)
        assert answer.feasible.all()
        again = stance_dynamics(identified_a1, q, v, answer.tau, feet=feet).a
        np.testing.assert_allclose(again, a, atol=1e-6)
    np.testing.assert_allclose(
        inverse_dynamics(
            identified_a1, q, v, flight_dynamics(identified_a1, q, v, tau), feet=()
        ).tau,
        tau,
    )


def test_limits_are_those_of_the_torques_asked_for(robot: Robot, crouches: Draw) -> None:
    weak = robot.with_parameters(ModelParameters(torque_constant=0.5))
    q, v, a, _ = crouches(20)
    limit = 0.9 * np.abs(inverse_dynamics(weak, q, v, 0.0 * a).tau).max()
    answer = inverse_dynamics(weak, q, v, 0.0 * a, friction=0.6, torque_limits=limit)
    assert np.abs(answer.tau[answer.feasible]).max() <= limit + 1e-5


def test_stance_obeys_its_dae_and_the_impact_has_rotors(
    identified_a1: Robot, crouches: Draw
) -> None:
    q, v, _, tau = (rows[0] for rows in crouches(1))
    dae = stance_dae(identified_a1, q, v, tau)
    stance = stance_dynamics(identified_a1, q, v, tau)
    np.testing.assert_allclose(
        dae.matrix @ np.concatenate([stance.a, stance.lam]), dae.rhs, atol=1e-8
    )
    after, jacobian = impact(identified_a1, q, v), contact_jacobian(identified_a1, q)
    np.testing.assert_allclose(
        mass_matrix(identified_a1, q) @ (after.v - v), jacobian.T @ after.impulse, atol=1e-9
    )
    rotors = np.diag(mass_matrix(identified_a1, q) - mass_matrix(identified_a1.bare, q))[6:]
    np.testing.assert_allclose(rotors, np.tile(PARAMETERS.armature, 4))


@pytest.mark.parametrize("contact", ["flight", "point", "rolling"])
def test_derivatives_are_those_of_finite_differences(
    identified_a1: Robot, crouches: Draw, contact: str
) -> None:
    q, v, _, tau = (rows[0] for rows in crouches(1))

    def acceleration(q: Array, v: Array, tau: Array) -> Array:
        if contact == "flight":
            return flight_dynamics(identified_a1, q, v, tau)
        return stance_dynamics(identified_a1, q, v, tau, contact=contact).a  # type: ignore[arg-type]

    if contact == "flight":
        found = flight_derivatives(identified_a1, q, v, tau)
    else:
        found = stance_derivatives(identified_a1, q, v, tau, contact=contact)  # type: ignore[arg-type,assignment]
    step = 1e-6
    for k in range(18):
        d = step * np.eye(18)[k]
        by_q = acceleration(pin.integrate(identified_a1.model, q, d), v, tau)
        by_q -= acceleration(pin.integrate(identified_a1.model, q, -d), v, tau)
        by_v = acceleration(q, v + d, tau) - acceleration(q, v - d, tau)
        scale = np.abs(found.da_dq).max()
        np.testing.assert_allclose(by_q / (2 * step), found.da_dq[:, k], atol=1e-6 * scale)
        np.testing.assert_allclose(by_v / (2 * step), found.da_dv[:, k], atol=1e-6 * scale)
    for k in range(12):
        d = np.eye(12)[k]
        by_tau = acceleration(q, v, tau + d) - acceleration(q, v, tau - d)
        np.testing.assert_allclose(by_tau / 2.0, found.da_dtau[:, k], atol=1e-6 * scale)


def test_the_guided_derivatives_know_friction_and_motors(
    robot: Robot, identified_a1: Robot
) -> None:
    rng, step = np.random.default_rng(2), 1e-6
    q, v, tau = robot.standing, np.zeros(18), 3.0 * rng.standard_normal(12)
    v[6:] = 0.2 * rng.standard_normal(12)
    found = planar_derivatives(identified_a1, q, v, tau, contact="rolling")
    for k, row in enumerate(planar_rows(robot)):
        d = step * np.eye(18)[row]
        high, low = (
            planar_derivatives(identified_a1, q, v + sign * d, tau, contact="rolling").a
            for sign in (1.0, -1.0)
        )
        scale = np.abs(found.da_dv).max()
        np.testing.assert_allclose((high - low) / (2 * step), found.da_dv[:, k], atol=1e-6 * scale)


def test_a_simulation_accounts_for_what_friction_takes(identified_a1: Robot) -> None:
    tau = inverse_dynamics(
        identified_a1, identified_a1.standing, identified_a1.at_rest, identified_a1.at_rest
    ).tau
    run = simulate_phase(
        identified_a1, identified_a1.standing, identified_a1.at_rest, 0.8 * tau, duration=0.1
    )
    assert run.energy_drift < 1e-6
    assert np.abs(run.v[-1, 6:]).max() > 0.1


def test_a_gait_of_the_mended_model_obeys_its_equations(robot: Robot) -> None:
    identified = robot.with_parameters(
        ModelParameters((0.01,) * 3, (0.1,) * 3, (0.2,) * 3, 1.0, torque_constant=0.9)
    )
    solution = optimize_gait(gait_problem(identified, 0.3))
    rows = planar_rows(robot)
    for motion in solution.motions.values():
        assert np.abs(missing_forces(identified, motion, "rolling")[:, rows]).max() < 1e-6
        assert np.abs(missing_forces(robot, motion, "rolling")[:, rows]).max() > 1.0
    landing, stance = solution.motions["flight"].v[-1], solution.motions["stance"]
    after = planar_impact(identified, stance.q[0], landing[None, rows], contact="rolling")[0]
    np.testing.assert_allclose(after, stance.v[0, rows], atol=1e-6)


def test_written_models_are_read_as_the_same_robot(identified: Robot, tmp_path: Path) -> None:
    notes = ["identified -- by learning", "armature 0.01"]
    mjcf = write_mjcf(identified, tmp_path / "robot.xml", notes)
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    body = model.body(identified.spec.base_link)
    assert float(body.mass[0]) == pytest.approx(identified.model.inertias[1].mass, rel=1e-5)
    np.testing.assert_allclose(body.ipos, identified.model.inertias[1].lever, atol=1e-6)
    for name, value in zip(identified.joint_names, identified.of_joint("armature"), strict=True):
        assert float(model.joint(name).armature[0]) == pytest.approx(value, rel=1e-5)
        assert float(model.joint(name).frictionloss[0]) > 0.0
    assert "identified - - by learning" in mjcf.read_text()

    urdf = write_urdf(identified, tmp_path / "robot.urdf", notes)
    read = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    np.testing.assert_allclose(
        read.inertias[1].toDynamicParameters(),
        identified.model.inertias[1].toDynamicParameters(),
        atol=1e-9,
    )
    np.testing.assert_allclose(read.damping[6:], identified.of_joint("damping"))


def test_a_lighter_trunk_whose_mass_hangs_on_another_link_is_written_as_a_urdf_that_can_be_read(
    tmp_path: Path,
) -> None:
    """ANYmal B's base is a frame without inertia, and base_inertia is fixed to it."""
    names = RobotSpec(
        "anymal_b",
        "anymal_b_simple_description/robots/anymal.urdf",
        base_link="base",
        legs=("LF", "LH", "RF", "RH"),
        joints=("HAA", "HFE", "KFE"),
        joint_pattern="{leg}_{joint}",
        foot_pattern="{leg}_FOOT",
        standing=(0.0, 0.9, -1.8),
    )
    lighter = load_robot(names).with_parameters(ModelParameters(payload=-0.5))
    urdf = write_urdf(lighter, tmp_path / "lighter.urdf")
    read = load_robot(replace(names, urdf=str(urdf)))
    assert read.mass == pytest.approx(load_robot(names).mass - 0.5)
    np.testing.assert_allclose(
        read.model.inertias[1].toDynamicParameters(),
        lighter.model.inertias[1].toDynamicParameters(),
        atol=1e-9,
    )


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"armature": (-0.1, 0.0, 0.0)}, r"armature\[0\]=-0\.1; give a number from 0 to 1000"),
        ({"damping": (float("nan"), 0.0, 0.0)}, r"damping\[0\]=nan; give a number from 0 to 1000"),
        ({"torque_constant": 0.0}, r"torque_constant=0\.0; give a number above 0, up to 100"),
        ({"trunk_shift": (1.0, 2.0)}, r"trunk_shift=.* has 2 values; give numbers, 3 of them"),
    ],
)
def test_parameters_that_cannot_be_are_refused(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(InvalidInput, match=complaint):
        ModelParameters(**changes)


def test_parameters_must_fit_the_robot(robot: Robot) -> None:
    with pytest.raises(InvalidInput, match="armature has 2 values; give 3"):
        robot.with_parameters(ModelParameters(armature=(0.1, 0.1)))
    with pytest.raises(InvalidInput, match="leaves nothing of the trunk"):
        robot.with_parameters(ModelParameters(payload=-20.0))


def test_no_friction_fits_legs_of_any_number_of_joints() -> None:
    spec = RobotSpec(
        "solo",
        "solo_description/robots/solo.urdf",
        base_link="base_link",
        legs=("FL", "FR", "HL", "HR"),
        joints=("HFE", "KFE"),
        joint_pattern="{leg}_{joint}",
        foot_pattern="{leg}_FOOT",
        standing=(0.8, -1.6),
        foot_radius=0.016,
    )
    solo = load_robot(spec).with_parameters(ModelParameters(payload=1.0))
    np.testing.assert_array_equal(solo.of_joint("damping"), np.zeros(8))
    assert solo.mass == pytest.approx(load_robot(spec).mass + 1.0)
