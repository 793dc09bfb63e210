"""What learning learned is what MuJoCo's world has and the model lacks, and no more is claimed."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
import xarray as xr

from pronk_pin import ModelParameters, Robot, load_robot
from pronk_pin._typing import Array
from pronk_pin.cli import main
from pronk_pin.compare import (
    SCENARIOS,
    Experiment,
    Explanation,
    Scenario,
    Schedule,
    Simulation,
    describe,
    explain,
    load_scenario,
    random_scenarios,
    run_experiment,
)
from pronk_pin.compare.identification import TERMS, Term, explained, foreign, remarks
from pronk_pin.compare.identification.equations import (
    DelayedEquations,
    equations,
    ground_free,
    phase_forces,
)
from pronk_pin.compare.identification.estimate import estimate
from pronk_pin.compare.identification.model_terms import Motion, parameters
from pronk_pin.compare.identification.recording import PhaseRecording, recordings
from pronk_pin.compare.identification.shares import discrepancy
from pronk_pin.compare.identification.truth import true_parameters, truth
from pronk_pin.compare.simulation.dataset import to_dataset
from pronk_pin.compare.studies.identified_models import close_loop, format_loop
from pronk_pin.compare.world import mjcf_sha256
from pronk_pin.control import load_controller
from pronk_pin.dynamics import contact_jacobian
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library
from pronk_pin.robot.formats.urdf import mujoco_spec
from pronk_pin.viz.figures.explanation_figure import write_explanation_figure

COMBINED = Scenario(
    "combined", armature=0.015, damping=0.3, coulomb=0.3, payload=2.0, torque_constant=0.9
)
SPEEDS = (-0.4, 0.1, 0.6)
NOISE = {"tick_joints": 5e-4, "tick_joint_rates": 0.05, "tick_torque": 0.1}
"""Of encoders [rad, rad/s] and of the current [N m]."""
IMU = 0.3


def simulate_learning(
    scenario: Scenario,
    *,
    controller: str = "ilc",
    speeds: tuple[float, ...] = SPEEDS,
    slope: float = 0.0,
    seed: int = 0,
) -> xr.Dataset:
    """The strides of a short learning run, on a ground that may rise forwards [rad]."""
    robot, library = load_robot("a1"), load_library("a1")
    gaits = [library.at(speed) for speed in speeds]
    simulation = Simulation(
        robot,
        gaits,
        load_controller(controller),
        scenario,
        schedule=Schedule(baseline=1.5, learning=5.5),
        rng=np.random.default_rng(seed),
    )
    if slope:
        model = simulation.world.model
        floor = model.geom("floor").id
        model.geom_sameframe[floor] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
        model.geom_quat[floor] = [np.cos(slope / 2), 0.0, -np.sin(slope / 2), 0.0]
    attributes = {
        "robot": "a1",
        "base": "locked",
        "scenario": scenario.name,
        "controller": controller,
        "seed": seed,
        "scenario_parameters": scenario.to_json(),
        "timestep": scenario.timestep,
    }
    return to_dataset(simulation.run(), robot, gaits, attributes=attributes)


def with_noise(strides: xr.Dataset, rng: np.random.Generator) -> xr.Dataset:
    noisy = strides.copy(deep=True)
    for name, size in NOISE.items():
        noisy[name] = noisy[name] + size * rng.standard_normal(noisy[name].shape)
    return noisy


def explain_noisy(strides: xr.Dataset, *, seed: int = 1, **options: object) -> Explanation:
    rng = np.random.default_rng(seed)
    return explain(with_noise(strides, rng), imu_noise=IMU, rng=rng, **options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def learned_strides() -> xr.Dataset:
    return simulate_learning(COMBINED)


@pytest.fixture(scope="module")
def found(learned_strides: xr.Dataset) -> Explanation:
    return explain_noisy(learned_strides)


def true_values(scenario: Scenario) -> Array:
    by_name = truth(load_robot("a1"), scenario)
    return np.array([by_name[term.name] for term in TERMS])


def rows_of(robot: Robot, phases: tuple[PhaseRecording, ...]) -> DelayedEquations:
    forces = tuple(phase_forces(robot, phase, TERMS) for phase in phases)
    return equations(robot, forces, TERMS)


def random_motion(robot: Robot, n: int) -> Motion:
    rng = np.random.default_rng(0)
    q = robot.q_from_base(rng.standard_normal((n, 3)), robot.standing[7:] + np.zeros((n, 12)))
    q[:, 7:] += 0.2 * rng.standard_normal((n, 12))
    q[:, 3:7] = rng.standard_normal((n, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    v, a = rng.standard_normal((2, n, 18))
    v[:, 6:] = np.sign(v[:, 6:]) * (3.0 + np.abs(v[:, 6:]))
    return Motion(q, v, a, v[:, 6:], np.sign(v[:, 6:]), rng.standard_normal((n, 12)))


_OF_JOINTS = [term for term in TERMS if term.cause not in ("load", "delay")]


@pytest.mark.parametrize("term", _OF_JOINTS, ids=lambda term: term.name)
def test_a_column_is_what_the_mended_model_needs_more(robot: Robot, term: Term) -> None:
    motion, step = random_motion(robot, 5), 0.1
    identified, columns = (
        robot.with_parameters(parameters({term.name: step}, robot)),
        term.column(robot, motion),
    )
    for q, v, a, tau, column in zip(motion.q, motion.v, motion.a, motion.tau, columns, strict=True):
        difference = pin.rnea(identified.model, identified.data, q, v, a)
        difference = difference - pin.rnea(robot.model, robot.data, q, v, a)
        difference[6:] += tau - identified.joint_torques(tau, v[6:])
        np.testing.assert_allclose(column, difference / step, atol=1e-9)


def test_a_payload_is_a_mass_and_its_moments(robot: Robot) -> None:
    mass, place = 2.0, np.array([0.1, 0.0, 0.05])
    values = {"payload": mass, "trunk moment x": mass * place[0], "trunk moment z": mass * place[2]}
    identified = robot.with_parameters(parameters(values, robot))
    np.testing.assert_allclose(identified.parameters.payload_position, place)
    shifted = parameters({"trunk moment x": 0.1}, robot)
    assert shifted.payload == 0.0
    assert shifted.trunk_shift[0] == pytest.approx(0.1 / robot.model.inertias[1].mass)
    motion = random_motion(robot, 3)
    payload = next(term for term in TERMS if term.name == "payload")
    light = robot.with_parameters(ModelParameters(payload=0.1, payload_position=(0.0, 0.0, 0.0)))
    for q, v, a, column in zip(
        motion.q, motion.v, motion.a, payload.column(robot, motion), strict=True
    ):
        need = pin.rnea(light.model, light.data, q, v, a)
        need = need - pin.rnea(robot.model, robot.data, q, v, a)
        np.testing.assert_allclose(column, need / 0.1, atol=1e-9)


def test_moments_of_the_trunk_are_pinocchios_derivatives(robot: Robot) -> None:
    motion, step = random_motion(robot, 3), 1e-6
    for axis in (0, 2):
        term = next(t for t in TERMS if t.name == f"trunk moment {'xyz'[axis]}")
        columns = term.column(robot, motion)
        vector = robot.model.inertias[1].toDynamicParameters()
        vector[1 + axis] += step
        model = robot.model.copy()
        model.inertias[1] = pin.Inertia.FromDynamicParameters(vector)
        data = model.createData()
        for k in range(3):
            state = (motion.q[k], motion.v[k], motion.a[k])
            change = pin.rnea(model, data, *state) - pin.rnea(robot.model, robot.data, *state)
            np.testing.assert_allclose(columns[k], change / step, atol=1e-5)


def test_forces_on_the_feet_do_not_enter_the_balance(robot: Robot) -> None:
    motion = random_motion(robot, 5)
    balance = ground_free(robot, motion.q)
    for k in range(5):
        jacobian = contact_jacobian(robot, motion.q[k], contact="rolling")
        assert np.abs(balance[k] @ jacobian.T).max() < 1e-9


def test_with_the_true_parameters_nothing_is_left_of_mujocos_motion(
    robot: Robot, learned_strides: xr.Dataset
) -> None:
    true = true_values(COMBINED)
    for phases in recordings(learned_strides).values():
        rows = rows_of(robot, phases).at(true)
        rest = rows.y - rows.A @ true
        for group, most in ((0, 0.05), (1, 0.05), (3, 0.005), (4, 0.005)):
            mine = rows.group == group
            # The median: where a joint turns round, its direction is known to some ticks only.
            assert np.median(np.abs(rest[:, mine])) < most
            assert np.median(np.abs(rows.y[:, mine])) > 50.0 * most


def test_a_torque_stamped_a_tick_late_spoils_everything(
    robot: Robot, learned_strides: xr.Dataset
) -> None:
    late, true, rest = learned_strides.copy(), true_values(COMBINED), []
    late["tick_torque"] = learned_strides["tick_torque"].shift(tick=1).fillna(0.0)
    for strides in (learned_strides, late):
        phases = next(iter(recordings(strides).values()))
        rows = rows_of(robot, phases).at(true)
        mine = rows.group == 4
        rest.append(np.sqrt(np.mean((rows.y - rows.A @ true)[:, mine] ** 2)))
    assert rest[1] > 3.0 * rest[0]


def test_all_causes_at_once_are_found_through_sensor_noise(found: Explanation) -> None:
    table = found.table()
    error = (table["estimate"] - table["true"]).abs()
    for joint in ("thigh", "calf"):
        for name in ("armature", "damping", "Coulomb"):
            row = f"{joint} {name}"
            assert error[row] < 0.05 * table.loc[row, "true"], row
    assert error["payload"] < 0.1 * 2.0
    assert error["weak motors"] < 0.02 * 0.9
    assert list(table.index[~table["seen"]]) == ["trunk moment x", "trunk moment z"]


def test_what_was_found_fits_on_a_screen(found: Explanation) -> None:
    lines = repr(found).splitlines()
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 100
    assert any(line.split()[:2] == ["calf", "armature"] for line in lines)
    assert "<table>" in found._repr_html_()


def test_intervals_hold_the_truth(learned_strides: xr.Dataset, found: Explanation) -> None:
    """Over draws of the noise: in one of them all terms are off together."""
    inside = []
    for one in (found, *(explain_noisy(learned_strides, seed=seed) for seed in (2, 3))):
        seen = one.table()[lambda table: table["seen"]]
        inside += [(seen["low"] <= seen["true"]) & (seen["true"] <= seen["high"])]
    assert np.mean(inside) >= 0.8


@pytest.mark.parametrize(
    ("scenario", "most"),
    [
        (Scenario("payload", payload=3.0), {"payload": 0.02}),
        (Scenario("damping", damping=0.5), {"thigh damping": 0.02, "calf damping": 0.02}),
        (Scenario("motors", torque_constant=0.85), {"weak motors": 0.1}),
        (Scenario("rotors", armature=0.02), {"thigh armature": 0.03, "calf armature": 0.03}),
        (Scenario("rubs", coulomb=0.5), {"thigh Coulomb": 0.02, "calf Coulomb": 0.02}),
    ],
    ids=lambda value: value.name if isinstance(value, Scenario) else "",
)
def test_a_single_cause_is_read_and_no_other(scenario: Scenario, most: Mapping[str, float]) -> None:
    table = explain_noisy(simulate_learning(scenario)).table()
    for name, share in most.items():
        true = table.loc[name, "true"]
        assert abs(table.loc[name, "estimate"] - true) < share * true, name
    scale = np.array([term.scale for term in TERMS])
    quiet = table["seen"] & (table["true"] == 0.0)
    assert (table["estimate"].abs() / scale)[quiet].max() < 0.1


LATE = dataclasses.replace(COMBINED, name="late", delay=0.004)


@pytest.fixture(scope="module")
def late_strides() -> xr.Dataset:
    return simulate_learning(LATE)


def test_a_delay_is_a_shift_and_not_taken_for_load_or_damping(late_strides: xr.Dataset) -> None:
    found = explain_noisy(late_strides)
    table = found.table()
    for name in ("delay", "payload", "thigh damping", "calf damping"):
        assert table.loc[name, "estimate"] == pytest.approx(table.loc[name, "true"], rel=0.05), name
    assert table.loc["delay", "low"] < 0.004 < table.loc["delay", "high"]
    assert not foreign(found)


def test_late_motors_without_load_are_not_read_as_load() -> None:
    strides = simulate_learning(load_scenario("delay"))
    exact, noisy = explain(strides).table(), explain_noisy(strides).table()
    assert exact.loc["delay", "estimate"] == pytest.approx(0.004, abs=2e-5)
    assert exact.loc["payload", "estimate"] == pytest.approx(0.0, abs=0.03)
    assert noisy.loc["payload", "estimate"] == pytest.approx(0.0, abs=0.15)


def test_the_delays_share_is_what_was_told_and_not_played_yet(late_strides: xr.Dataset) -> None:
    found = explain(late_strides)
    whole = found.shares["learned"] - found.shares["model"]
    total = found.shares["torque"].sum("cause", skipna=False)
    np.testing.assert_allclose(total, whole, atol=1e-9)
    assert float(explained(found.shares).min()) > 0.99
    flight = found.shares.sel(part="flight")
    told = flight["learned"].isel(speed=0).transpose("phase", "joint").to_numpy()
    late = flight["torque"].sel(cause="delay").isel(speed=0).transpose("phase", "joint").to_numpy()
    ticks = flight["phase"].to_numpy() * float(flight["duration"].isel(speed=0)) / LATE.timestep
    before = np.stack([np.interp(ticks - 4.0, ticks, column) for column in told.T], axis=-1)
    seen = np.isfinite(told).all(axis=1) & np.isfinite(before).all(axis=1)
    assert seen.sum() > 10
    assert np.abs((late - (told - before))[seen]).max() < 0.05 * np.abs(late[seen]).max()


def test_with_the_true_delay_nothing_is_left_of_mujocos_motion(
    robot: Robot, late_strides: xr.Dataset
) -> None:
    true, early = true_values(LATE), true_values(LATE)
    early[[term.name for term in TERMS].index("delay")] = 0.0
    for phases in recordings(late_strides).values():
        rows = rows_of(robot, phases)
        rest, spoilt = ((at.y - at.A @ value) for value in (true, early) for at in [rows.at(value)])
        for group, most in ((0, 0.05), (3, 1e-6), (4, 1e-6)):  # along z knees stick in landing
            mine = rows.group == group
            assert np.median(np.abs(rest[:, mine])) < most
            assert np.median(np.abs(spoilt[:, mine])) > 10.0 * most


def foreign_mjcf(robot: Robot, path: Path) -> Path:
    """The robot with rotors, friction, and a heavier trunk that bears a box in front."""
    spec = mujoco_spec(robot)
    for name in robot.joint_names:
        joint = spec.joint(name)
        knee = name.endswith("calf_joint")
        joint.armature, joint.frictionloss = 0.02 if knee else 0.01, 0.25
        joint.damping = [0.7, *joint.damping[1:]]
    trunk = spec.body(robot.spec.base_link)
    trunk.mass += 1.0
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    body = next(each for each in root.iter("body") if each.get("name") == robot.spec.base_link)
    box = ElementTree.SubElement(body, "body", name="box", pos="0.1 0 0.05")
    ElementTree.SubElement(box, "inertial", pos="0 0 0", mass="0.5", diaginertia="1e-3 1e-3 1e-3")
    path.write_text(ElementTree.tostring(root, encoding="unicode"))
    return path


def test_the_truth_of_an_mjcf_is_its_own(robot: Robot, tmp_path: Path) -> None:
    path = foreign_mjcf(robot, tmp_path / "robot.xml")
    scenario = load_scenario("nominal+payload=2+delay=0.003", mjcf=str(path))
    true = truth(robot, scenario)
    rotor = robot.spec.rotors[0]
    for joint, armature in (("hip", 0.01), ("thigh", 0.01), ("calf", 0.02)):
        assert true[f"{joint} armature"] == pytest.approx(armature + rotor)
        assert true[f"{joint} damping"] == pytest.approx(0.7 + 0.1)
        assert true[f"{joint} Coulomb"] == pytest.approx(0.25 + 0.2)
    assert true["payload"] == pytest.approx(1.0 + 0.5 + 2.0)
    x, _, z = robot.model.inertias[1].lever
    assert true["trunk moment x"] == pytest.approx(1.0 * x + 0.5 * 0.1)
    assert true["trunk moment z"] == pytest.approx(1.0 * z + 0.5 * 0.05 + 2.0 * 0.06)
    assert true["delay"] == 0.003
    assert true["weak motors"] == 0.0


LEGS = Scenario(
    "legs",
    armature=(0.01, 0.015, 0.02),
    damping=(0.1, 0.2, 0.4),
    coulomb=(0.2, 0.3, 0.4),
    torque_constant=(1.0, 0.95, 0.9),
)


def test_the_truth_is_told_by_kind(robot: Robot) -> None:
    true = truth(robot, LEGS)
    for k, joint in enumerate(("hip", "thigh", "calf")):
        assert true[f"{joint} armature"] == pytest.approx(LEGS.armature[k])  # type: ignore[index]
        assert true[f"{joint} damping"] == pytest.approx(LEGS.damping[k])  # type: ignore[index]
        assert true[f"{joint} Coulomb"] == pytest.approx(LEGS.coulomb[k])  # type: ignore[index]
    assert [true[f"{joint} weak motors"] for joint in ("hip", "thigh", "calf")] == pytest.approx(
        [0.0, 0.05, 0.1]
    )
    assert true["weak motors"] == pytest.approx(0.05)
    one_leg = dataclasses.replace(LEGS, damping=(0.4,) * 3 + (0.0,) * 9)
    assert truth(robot, one_leg)["calf damping"] == pytest.approx(0.1)  # the mean over the legs
    assert "hip weak motors" not in truth(robot, COMBINED)


def test_joints_that_differ_by_kind_are_read_by_kind() -> None:
    """With motors alike the estimates of each kind are its own; with others a remark says so."""
    alike = explain(simulate_learning(dataclasses.replace(LEGS, torque_constant=0.9)), draws=20)
    table = alike.table()
    for kind in ("armature", "damping", "Coulomb"):
        for joint in ("thigh", "calf"):
            row = table.loc[f"{joint} {kind}"]
            assert row["estimate"] == pytest.approx(row["true"], rel=0.1)
    assert not [line for line in remarks(alike) if "motors are not all" in line]
    strides = simulate_learning(LEGS)
    differ = explain(strides, draws=2)
    said = next(line for line in remarks(differ) if "motors are not all as weak" in line)
    assert "0.000 in the hips, 0.050 in the thighs, 0.100 in the calfs" in said


def test_an_mjcf_that_is_gone_or_changed_leaves_the_truth_of_the_motors(
    robot: Robot, tmp_path: Path, learned_strides: xr.Dataset
) -> None:
    path = foreign_mjcf(robot, tmp_path / "robot.xml")
    scenario = dataclasses.replace(COMBINED, mjcf=str(path))
    strides = learned_strides.assign_attrs(
        scenario_parameters=scenario.to_json(), mjcf_sha256=mjcf_sha256(path)
    )
    assert true_parameters(robot, strides) == truth(robot, scenario)
    path.write_text(path.read_text().replace("0.7", "0.8"))
    motors = {"weak motors": pytest.approx(0.1), "delay": 0.0}
    assert true_parameters(robot, strides) == motors
    path.unlink()
    assert true_parameters(robot, strides) == motors
    assert true_parameters(robot, learned_strides.drop_attrs()) == {}
    lines = describe(explain(strides, draws=2)).splitlines()
    assert next(line for line in lines if line.startswith("payload")).split()[-2:] == ["-", "kg"]


def test_a_shifted_centre_of_mass_is_a_moment_of_the_trunk(robot: Robot) -> None:
    true = truth(robot, load_scenario("com-shift=0.02"))
    assert true["payload"] == 0.0
    assert true["trunk moment x"] == pytest.approx(0.02 * robot.model.inertias[1].mass)


def test_other_strides_as_instruments_take_the_noise_bias_away(
    robot: Robot, learned_strides: xr.Dataset
) -> None:
    rng = np.random.default_rng(5)
    loud = with_noise(with_noise(learned_strides, rng), rng)
    rows = {
        speed: rows_of(robot, phases)
        for speed, phases in recordings(loud, imu_noise=IMU, rng=rng).items()
    }
    true = true_values(COMBINED)
    errors = [
        np.abs(estimate(rows, TERMS, rng=rng, draws=5, others=others).value - true)
        for others in (True, False)
    ]
    hips = [k for k, term in enumerate(TERMS) if term.name == "hip armature"]
    assert (errors[0][hips] < 0.5 * errors[1][hips]).all()


def test_causes_add_up_and_explain_what_was_learned(found: Explanation) -> None:
    whole = found.shares["learned"] - found.shares["model"]
    total = found.shares["torque"].sum("cause", skipna=False)
    np.testing.assert_allclose(total, whole, atol=1e-9)
    assert float(np.sqrt((discrepancy(found.shares) ** 2).mean())) > 1.0
    assert float(explained(found.shares).min()) > 0.95
    np.testing.assert_allclose(found.share_table.sum("cause"), 1.0, atol=1e-9)
    # What only moves otherwise than the reference is not taken for physics that is missing.
    assert float(found.share_table.sel(cause="deviation", part="stance", joint="thigh")) > 0.05


def test_stance_alone_does_not_tell_load_from_weak_motors(learned_strides: xr.Dataset) -> None:
    alone = explain_noisy(learned_strides, parts=("stance",))
    names = {frozenset((TERMS[i].name, TERMS[j].name)) for i, j, _ in alone.confounding.pairs}
    assert frozenset(("payload", "weak motors")) in names
    text = " ".join(remarks(alone))
    assert "Not told apart: payload and weak motors" in text
    both = explain_noisy(learned_strides)
    assert "payload and weak motors" not in " ".join(remarks(both))
    assert alone.confounding.condition > 2.0 * both.confounding.condition


def test_hip_friction_is_not_told_apart_and_the_trunks_moments_not_seen(
    found: Explanation,
) -> None:
    text = " ".join(remarks(found))
    assert "Not told apart: hip damping and hip Coulomb" in text
    assert "swing the legs in the air" in text
    assert "Not seen in this motion: trunk moment x and trunk moment z" in text


def test_soft_ground_is_named_and_not_taken_for_friction() -> None:
    soft = dataclasses.replace(SCENARIOS["nominal"], name="soft", ground_time_constant=0.01)
    found = explain_noisy(simulate_learning(soft))
    assert "the ground gives way by" in " ".join(remarks(found))
    table = found.table()
    for name in ("thigh damping", "calf damping", "thigh Coulomb", "calf Coulomb"):
        assert table.loc[name, "estimate"] == pytest.approx(table.loc[name, "true"], rel=0.05)
    assert "gives way" not in " ".join(
        remarks(explain_noisy(simulate_learning(SCENARIOS["nominal"])))
    )


def test_a_slope_is_reported_and_not_taken_for_friction() -> None:
    slope = np.radians(3.0)
    found = explain_noisy(simulate_learning(SCENARIOS["nominal"], slope=slope))
    assert found.ground.slope == pytest.approx(slope, abs=np.radians(0.3))
    text = " ".join(remarks(found))
    assert "the ground rises by" in text
    assert "Unexplained: something that is none of the terms is at work" in text
    assert foreign(found)
    table = found.table()
    for name in ("thigh damping", "calf damping", "thigh Coulomb", "calf Coulomb"):
        assert table.loc[name, "estimate"] == pytest.approx(table.loc[name, "true"], rel=0.15)


def test_a_slope_along_which_the_trunk_is_held_is_felt_and_not_taken_for_friction() -> None:
    world = dataclasses.replace(COMBINED, name="slope", slope=0.05)
    found = explain_noisy(simulate_learning(world))
    assert found.ground.slope == pytest.approx(0.05, abs=0.002)
    assert "the ground rises by 2.9 degrees" in " ".join(remarks(found))
    assert not foreign(found)
    table = found.table()
    for name in ("thigh armature", "calf armature", "thigh Coulomb", "calf Coulomb", "payload"):
        assert table.loc[name, "estimate"] == pytest.approx(table.loc[name, "true"], rel=0.06), name
    # The slope's part of the weight, borne by four legs of which each knee carries its share.
    level = explain_noisy(simulate_learning(COMBINED))
    share = {one: one.share_table.sel(part="stance", cause="gravity") for one in (found, level)}
    assert abs(float(share[found].sel(joint="thigh"))) > 0.1
    assert float(np.abs(share[level]).max()) < 0.01


def test_another_gravity_is_felt_and_not_taken_for_load() -> None:
    world = dataclasses.replace(SCENARIOS["nominal"], name="moon", gravity=8.8)
    found = explain_noisy(simulate_learning(world))
    assert found.ground.gravity == pytest.approx(8.8, abs=0.02)
    assert found.ground.slope == pytest.approx(0.0, abs=0.005)
    assert "gravity is 8.80 m/s^2, and 9.81 in the model" in " ".join(remarks(found))
    assert found.table().loc["payload", "estimate"] == pytest.approx(0.0, abs=0.15)
    assert "gravity is" not in " ".join(
        remarks(explain_noisy(simulate_learning(SCENARIOS["nominal"])))
    )


def test_few_strides_at_one_speed_are_called_so(learned_strides: xr.Dataset) -> None:
    little = explain_noisy(learned_strides.isel(speed=[1], last=slice(-3, None)))
    text = " ".join(remarks(little))
    assert "Only 3 strides" in text
    assert "One speed only" in text
    assert "95 % interval" in describe(little)


def test_the_mended_gaits_beat_practice_where_nothing_was_practised(
    found: Explanation, learned_strides: xr.Dataset
) -> None:
    table = close_loop(
        found,
        learned_strides,
        speeds=(0.35,),
        scenarios=[COMBINED],
        controllers=("model", "ilc", "identified+gait"),
        schedule=Schedule(baseline=5.0, learning=4.0),
        progress=False,
    ).set_index("controller")
    assert table["upright"].all()
    for joint in ("thigh", "calf"):
        identified = table.loc["identified+gait", joint]
        assert identified < 0.012
        assert identified < 0.65 * table.loc["ilc", joint]  # after 11 strides of learning
        assert identified < 0.2 * table.loc["model", joint]
    assert "identified+gait" in format_loop(table.reset_index())


def test_the_command_prints_draws_and_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("identified", "ilc"),
        schedule=Schedule(baseline=1.0, learning=5.0),
    )
    folder = tmp_path / "result"
    results = run_experiment(experiment, folder, workers=1, progress=False)
    assert [cell.controller for cell in experiment.cells()] == ["ilc", "identified"]
    strides = results.strides(experiment.cells()[1])
    assert float(np.abs(strides["feedforward"]).max()) > 5.0
    files = [tmp_path / name for name in ("figure.png", "identified.urdf", "identified.xml")]
    options = zip(("--figure", "--write-urdf", "--write-mjcf"), map(str, files), strict=True)
    assert main(["explain", str(folder), *(word for pair in options for word in pair)]) == 0
    printed = capsys.readouterr().out
    assert "calf armature" in printed
    assert "From the last 12 strides at 2 speeds." in printed
    for file in files:
        assert file.stat().st_size > 1000
    joint = mujoco.MjModel.from_xml_path(str(files[2])).joint("FL_calf_joint")
    assert float(joint.armature[0]) == pytest.approx(load_robot().spec.rotors[0], rel=0.03)
    assert "95 % interval" in files[1].read_text()


def test_what_cannot_be_explained_is_refused(
    learned_strides: xr.Dataset, found: Explanation
) -> None:
    with pytest.raises(InvalidInput, match="has no ticks, which explain reads"):
        explain(learned_strides.drop_vars("tick_joints"))
    with pytest.raises(InvalidInput, match="no speed has 2 whole strides"):
        explain(learned_strides.isel(last=slice(-1, None)))
    with pytest.raises(InvalidInput, match="explain needs a locked base"):
        explain(learned_strides.assign_attrs(base="free"))
    with pytest.raises(InvalidInput, match="2 gaits for 3 speeds"):
        explain(learned_strides, gaits=[load_library("a1").at(v) for v in (0.1, 0.2)])
    with pytest.raises(InvalidInput, match=r"'txtt'; choose png, svg, pdf"):
        write_explanation_figure(found, Path("figure.txtt"))


@pytest.mark.slow
def test_intervals_hold_the_truth_in_nine_of_ten_random_worlds() -> None:
    rng, inside = np.random.default_rng(11), []
    for seed in range(50):
        armature, damping, coulomb, payload = rng.uniform(0.0, [0.02, 0.4, 0.4, 3.0])
        world = Scenario(
            f"random-{seed}",
            armature=armature,
            damping=damping,
            coulomb=coulomb,
            payload=payload,
            torque_constant=float(rng.uniform(0.85, 1.05)),
        )
        strides = with_noise(
            simulate_learning(world, speeds=(-0.4, -0.1, 0.2, 0.5, 0.8), seed=seed), rng
        )
        table = explain(strides, imu_noise=IMU, rng=rng, draws=200).table()
        seen = table[table["seen"]]
        inside.append(((seen["low"] <= seen["true"]) & (seen["true"] <= seen["high"])).mean())
    assert np.mean(inside) >= 0.9


@pytest.mark.slow
def test_intervals_hold_the_truth_in_sampled_worlds() -> None:
    """Slopes, soft and slippery ground and a shifted centre of mass, which are none of the terms,
    do not mislead those that are."""
    rng, tables = np.random.default_rng(11), []
    for seed, world in enumerate(random_scenarios(50, seed=0)):
        strides = simulate_learning(world, speeds=(-0.4, -0.1, 0.2, 0.5, 0.8), seed=seed)
        noisy = with_noise(strides, rng)
        tables.append(explain(noisy, imu_noise=IMU, rng=rng, draws=200).table())
    table = pd.concat(tables)
    table = table[table["seen"]]
    inside = (table["low"] <= table["true"]) & (table["true"] <= table["high"])
    assert inside.mean() >= 0.9
    by_term = inside.groupby(level="term").mean()
    assert by_term.min() >= 0.8, by_term


@pytest.mark.slow
@pytest.mark.parametrize("noisy", [False, True], ids=["exact", "noisy"])
def test_intervals_hold_the_truth_in_sampled_worlds_with_late_motors(noisy: bool) -> None:
    """As `benchmarks/explanation_coverage.py` has it, with shorter runs."""
    rng, tables = np.random.default_rng(12), []
    for seed in range(50):
        delay = 0.001 * (seed % 6)
        world = load_scenario(f"random-0-{seed}" + (f"+delay={delay:g}" if delay else ""))
        strides = simulate_learning(world, speeds=(-0.4, 0.0, 0.4, 0.8), seed=seed)
        if noisy:
            tables.append(explain(with_noise(strides, rng), imu_noise=IMU, rng=rng).table())
        else:
            tables.append(explain(strides).table())
    table = pd.concat(tables)
    table = table[table["seen"]]
    inside = (table["low"] <= table["true"]) & (table["true"] <= table["high"])
    assert inside.mean() >= 0.9
    assert inside.groupby(level="term").mean().min() >= 0.85
    error = (table["estimate"] - table["true"]).abs()
    known = table["true"] != 0.0
    near = (error <= 0.05 * table["true"].abs())[known].groupby(level="term").mean()
    for name in ("payload", "delay", "thigh damping", "calf damping"):
        assert near[name] >= (0.7 if noisy else 0.95), name


_NOMINAL = SCENARIOS["nominal"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "world",
    [
        _NOMINAL,
        SCENARIOS["payload"],
        dataclasses.replace(_NOMINAL, name="damping", damping=0.5),
        dataclasses.replace(_NOMINAL, name="rotors", armature=0.018),
        COMBINED,
    ],
    ids=lambda world: world.name,
)
def test_the_mended_gaits_keep_within_12_mrad_at_speeds_left_out(world: Scenario) -> None:
    strides = with_noise(
        simulate_learning(world, speeds=(-0.5, -0.1, 0.3, 0.8)), np.random.default_rng(3)
    )
    table = close_loop(
        explain(strides, imu_noise=IMU, rng=np.random.default_rng(4)),
        strides,
        speeds=(-0.45, -0.2, 0.05, 0.55, 0.75),
        scenarios=[world],
        controllers=("ilc", "identified+gait"),
        progress=False,
    )
    identified = table[table["controller"] == "identified+gait"]
    learned = table[table["controller"] == "ilc"]
    assert identified["upright"].all()
    assert identified[["thigh", "calf"]].to_numpy().max() < 0.012
    assert identified["calf"].mean() < learned["calf"].mean()


def test_the_weight_of_a_slope_is_what_its_world_asks_for_more(
    robot: Robot, learned_strides: xr.Dataset
) -> None:
    """Inverse dynamics under the world's gravity less that under the model's, with its sign."""
    slope, gravity = 0.1, 9.0
    world = dataclasses.replace(COMBINED, name="hill", slope=slope, gravity=gravity)
    strides = learned_strides.assign_attrs(scenario_parameters=world.to_json())
    phases = next(iter(recordings(strides).values()))
    tilted = robot.model.copy()
    tilted.gravity.linear = gravity * np.array([-np.sin(slope), 0.0, -np.cos(slope)])
    data, still = tilted.createData(), np.zeros(18)
    for phase in phases:
        found = phase_forces(robot, phase, TERMS)
        for tick in (20, 90):
            expected = [
                pin.rnea(tilted, data, q, still, still)
                - pin.rnea(robot.model, robot.data, q, still, still)
                for q in phase.of_ticks(found.motion.q)[:, tick]
            ]
            np.testing.assert_allclose(found.lean[tick], np.mean(expected, axis=0), atol=1e-9)
