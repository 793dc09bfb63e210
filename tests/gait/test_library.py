"""The shipped gaits are physical, and the library keeps and interpolates them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.dynamics import contact_jacobian, planar_rows
from pronk_pin.errors import FileProblem, InvalidInput, SpeedOutOfRange
from pronk_pin.gait import (
    SPEEDS,
    Gait,
    GaitLibrary,
    build_library,
    describe_gait,
    describe_library,
    load_library,
    load_style,
)
from pronk_pin.gait.library import SCHEMA, to_arrays
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import Robot
from pronk_pin.storage import write_arrays

S = np.linspace(0.0, 1.0, 101)
ENDS = np.array([0.0, 1.0])


@pytest.fixture(params=range(14), ids=lambda k: f"{SPEEDS[k]:+.1f}")
def gait(library: GaitLibrary, request: pytest.FixtureRequest) -> Gait:
    return library.gaits[request.param]


def test_the_speeds_are_the_papers(library: GaitLibrary) -> None:
    assert tuple(library.speeds) == SPEEDS == tuple(k / 10 for k in range(-5, 9))


def test_the_library_belongs_to_the_installed_robot(library: GaitLibrary, robot: Robot) -> None:
    assert library.metadata["urdf_sha256"] == robot.sha256


def test_every_audit_passes(library: GaitLibrary) -> None:
    assert len(library.audit) == len(library.gaits)
    for found in library.audit:
        assert found.passed, found.table()


def test_trunk_reaches_the_apex_and_keeps_the_speed(gait: Gait) -> None:
    height = np.concatenate([phase.base_reference(S)[0][:, 1] for phase in gait.phases])
    assert height.max() == pytest.approx(0.34, abs=1e-4)
    start = gait.stance.base_reference(ENDS)[0][0, 0]
    end = gait.flight.base_reference(ENDS)[0][1, 0]
    assert start == pytest.approx(0.0, abs=1e-12)
    assert (end - start) / gait.duration == pytest.approx(gait.speed, abs=1e-9)


def test_durations_give_the_papers_stride_rate(gait: Gait) -> None:
    assert gait.flight.duration >= 0.2 - 1e-9
    assert 2.0 <= 1.0 / gait.duration <= 4.0  # strides a second; the paper, section II.E


def test_motion_is_periodic_and_smooth_at_lift_off(gait: Gait) -> None:
    stance, flight = gait.stance.joint_reference(ENDS), gait.flight.joint_reference(ENDS)
    np.testing.assert_allclose(flight[0][1], stance[0][0], atol=1e-9)
    np.testing.assert_allclose(flight[0][0], stance[0][1], atol=1e-9)
    np.testing.assert_allclose(flight[1][0], stance[1][1], atol=1e-7)
    before, after = gait.stance.base_reference(ENDS), gait.flight.base_reference(ENDS)
    np.testing.assert_allclose(after[0][0], before[0][1], atol=1e-9)
    np.testing.assert_allclose(after[1][0], before[1][1], atol=1e-7)
    np.testing.assert_allclose(after[0][1, 1:], before[0][0, 1:], atol=1e-9)


def test_touchdown_stops_the_feet_by_a_plastic_impact(gait: Gait, robot: Robot) -> None:
    before, after = gait.flight.motion(robot, ENDS), gait.stance.motion(robot, ENDS)
    rows, q, v = planar_rows(robot), after.q[0], before.v[1]
    contact = "rolling"
    jacobian = contact_jacobian(robot, q, contact=contact)[:, rows]
    np.testing.assert_allclose(jacobian @ after.v[0, rows], 0.0, atol=1e-8)
    # Only impulses at the feet change the velocity, and the ground does not pull.
    jump = pin.crba(robot.model, robot.data, q)[np.ix_(rows, rows)] @ (after.v[0] - v)[rows]
    impulse, *_ = np.linalg.lstsq(jacobian.T, jump, rcond=None)
    np.testing.assert_allclose(jacobian.T @ impulse, jump, atol=1e-8)
    assert np.all(impulse[2::3] >= 0.0)


def test_standing_feet_push_within_the_friction_cone(gait: Gait, robot: Robot) -> None:
    lam = gait.stance.motion(robot, S).lam
    assert np.all(lam[..., 2] > 0.0)
    assert np.all(np.linalg.norm(lam[..., :2], axis=-1) <= 0.6 * lam[..., 2])
    assert np.all(gait.flight.motion(robot, S).lam == 0.0)


def test_feet_stand_on_the_ground_and_fly_above_it(gait: Gait, robot: Robot) -> None:
    standing = [foot_positions(robot, q)[:, 2] for q in gait.stance.motion(robot, S).q]
    flying = [foot_positions(robot, q)[:, 2] for q in gait.flight.motion(robot, S).q]
    np.testing.assert_allclose(standing, robot.foot_radius, atol=1e-5)
    assert np.min(flying) > robot.foot_radius - 2e-4  # the Bezier form, right at the ends
    assert np.min(flying[50]) > robot.foot_radius + 0.03


def test_joints_stay_within_their_limits(gait: Gait, robot: Robot) -> None:
    for phase in gait.phases:
        motion = phase.motion(robot, S)
        assert np.all((motion.q[:, 7:] > robot.q_min) & (motion.q[:, 7:] < robot.q_max))
        assert np.all(np.abs(motion.v[:, 6:]) < robot.v_max)
        assert np.all(np.abs(motion.tau) < robot.tau_max)


def test_both_sides_mirror_each_other(gait: Gait) -> None:
    for phase in gait.phases:
        joints, lam = phase.joints.reshape(4, 3, -1), phase.lam
        for left, right in ((0, 1), (2, 3)):
            np.testing.assert_allclose(joints[right], joints[left] * [[-1], [1], [1]], atol=1e-12)
            np.testing.assert_allclose(lam[right], lam[left] * [[1], [-1], [1]], atol=1e-9)


def test_bezier_form_obeys_the_equations_of_motion(gait: Gait, robot: Robot) -> None:
    """Within what the fits lose; the audit knows the optimised motion to 1e-10."""
    contact, rows = "rolling", planar_rows(robot)
    motion = gait.stance.motion(robot, S)
    for q, v, a, tau, lam in zip(motion.q, motion.v, motion.a, motion.tau, motion.lam, strict=True):
        force = pin.rnea(robot.model, robot.data, q, v, a).copy()
        force -= contact_jacobian(robot, q, contact=contact).T @ lam.ravel()
        force[6:] -= tau
        assert np.max(np.abs(force[rows])) < 1.0


def test_gaits_change_smoothly_with_speed(library: GaitLibrary) -> None:
    """One family: no jump of cost, torque or duration from a speed to the next."""
    bends = np.diff(library.metadata["cost"], n=2)
    assert np.all(bends > 0.0)
    assert bends.max() < 2.0 * bends.min()
    for name in ("joints", "tau"):
        curves = np.array([getattr(gait.stance, name) for gait in library.gaits])
        steps = np.abs(np.diff(curves, axis=0)).max(axis=(1, 2))
        assert steps.max() < 3.0 * np.median(steps)


def test_between_two_speeds_the_coefficients_are_interpolated(library: GaitLibrary) -> None:
    lower, middle, upper = (library.at(speed) for speed in (0.3, 0.325, 0.4))
    expected = 0.75 * lower.stance.joints + 0.25 * upper.stance.joints  # eq. (13)
    np.testing.assert_allclose(middle.stance.joints, expected)
    assert middle.speed == pytest.approx(0.325)


@pytest.mark.parametrize("speed", [-0.51, 0.81, np.nan])
def test_a_speed_outside_names_the_range(library: GaitLibrary, speed: float) -> None:
    with pytest.raises(SpeedOutOfRange, match=r"covers -0.5 to 0.8 m/s"):
        library.at(speed)


def test_saving_and_loading_changes_nothing(library: GaitLibrary, tmp_path: Path) -> None:
    again = GaitLibrary.load(library.save(tmp_path / "deep" / "copy.npz"))
    assert again.metadata == library.metadata
    assert again.audit == library.audit
    for mine, theirs in zip(again.gaits, library.gaits, strict=True):
        assert mine.speed == theirs.speed
        for a, b in zip(mine.phases, theirs.phases, strict=True):
            assert (a.name, a.feet, a.duration) == (b.name, b.feet, b.duration)
            np.testing.assert_array_equal(a.joints, b.joints)


SHIPPED = [("a1", "pronk", None), ("a1", "pronk", "sagittal"), ("a1", "bound", None)]
SHIPPED += [("go1", "pronk", None), ("go2", "pronk", None), ("a1", "trot", None)]


@pytest.mark.parametrize(("name", "kind", "base"), SHIPPED)
def test_every_shipped_library_is_proved_and_smooth(name: str, kind: str, base: str | None) -> None:
    """One family: the cost has no jump in speed or apex."""
    found = load_library(name, gait=kind, base=base)
    assert all(audit.passed for audit in found.audit)
    assert tuple(found.speeds) == load_style(kind).speeds
    for apex in found.apexes:
        bends = np.diff(found.at_apex(apex).metadata["cost"], n=2)
        assert np.all(bends > 0.0)
        assert bends.max() < 3.0 * bends.min()


@pytest.mark.parametrize(("name", "kind", "base"), SHIPPED)
def test_gaits_and_what_lies_between_them_nearly_obey_the_equations_of_motion(
    name: str, kind: str, base: str | None
) -> None:
    found = load_library(name, gait=kind, base=base)
    own, between = found.residual(0.3), found.residual(0.35)
    assert own.height < 5e-5
    assert own.moment < 3.0
    # What the interpolation adds is less than what the Bezier form loses.
    assert between.force < own.force + 1.0
    assert between.moment < own.moment + 0.1
    assert between.height < 2e-4


def test_bounding_stands_on_the_front_and_the_rear_in_turn(robot: Robot) -> None:
    bound = load_library("a1", gait="bound")
    assert (bound.speeds[0], bound.speeds[-1]) == (-0.2, 0.8)
    for gait in bound.gaits:
        feet = [phase.feet for phase in gait.phases]
        assert feet == [("FL", "FR"), (), ("RL", "RR"), ()]
        pitch = [phase.base_reference(S)[0][:, 2] for phase in gait.phases]
        assert np.max(pitch[0]) > 0.1 > -0.1 > np.min(pitch[2])  # nose down, then nose up
        for phase in gait.phases:
            motion = phase.motion(robot, S)
            swinging = [i for i, leg in enumerate(robot.legs) if leg not in phase.feet]
            assert np.all(motion.lam[:, swinging] == 0.0)
            heights = np.array([foot_positions(robot, q)[:, 2] for q in motion.q])
            assert np.min(heights[:, swinging]) > robot.foot_radius - 2e-4


def test_damaged_files_are_named(library: GaitLibrary, tmp_path: Path) -> None:
    path = library.save(tmp_path / "gaits.npz")
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(FileProblem, match=r"gaits.npz: damaged gait library.*gaits build"):
        GaitLibrary.load(path)
    with pytest.raises(FileProblem, match=r"absent.npz: missing.*gaits build"):
        GaitLibrary.load(tmp_path / "absent.npz")
    with pytest.raises(FileProblem, match=r"no such gait library is shipped.*gaits build"):
        load_library("a robot without gaits")


def test_numbers_that_are_not_finite_are_damage(library: GaitLibrary, tmp_path: Path) -> None:
    stance = library.gaits[0].stance
    broken = dataclasses.replace(stance, joints=np.full_like(stance.joints, np.nan))
    gait = dataclasses.replace(library.gaits[0], phases=(broken, library.gaits[0].flight))
    path = GaitLibrary((gait,)).save(tmp_path / "nan.npz")
    with pytest.raises(FileProblem, match="not finite"):
        GaitLibrary.load(path)


def scaled(gait: Gait, factor: float) -> Gait:
    stance = dataclasses.replace(gait.stance, joints=gait.stance.joints * factor)
    return dataclasses.replace(gait, phases=(stance, *gait.phases[1:]))


def test_an_audit_proves_the_motion_that_it_was_made_for_and_no_other(
    library: GaitLibrary,
) -> None:
    gaits = list(library.gaits)
    k = library.index(0.3)
    for factor in (1.05, 1.0 + 1e-15):
        changed = (*gaits[:k], scaled(gaits[k], factor), *gaits[k + 1 :])
        with pytest.raises(InvalidInput, match=r"gait at 0.3 m/s is not the one that was audited"):
            dataclasses.replace(library, gaits=changed)
    same = (*gaits[:k], scaled(gaits[k], 1.0), *gaits[k + 1 :])
    assert dataclasses.replace(library, gaits=same).sha256 == library.sha256
    with pytest.raises(ValueError, match="read-only"):
        gaits[k].stance.joints[0, 0] = 1.0


def test_a_file_whose_motion_was_changed_is_refused(library: GaitLibrary, tmp_path: Path) -> None:
    """Even where who changed it has sealed it again."""
    arrays = to_arrays(library)
    arrays["stance.joints"] = 1.05 * arrays["stance.joints"]
    path = write_arrays(tmp_path / "changed.npz", arrays, schema=SCHEMA)
    with pytest.raises(FileProblem, match=r"gait at -0.5 m/s is not the one that was audited"):
        GaitLibrary.load(path)


@pytest.mark.parametrize("name", ["robot", "speed", "apex", "phases"])
def test_everything_about_a_motion_is_in_its_digest(library: GaitLibrary, name: str) -> None:
    gait = library.gaits[0]
    stance, flight = gait.phases
    others = {
        "robot": ["b1"],
        "speed": [np.nextafter(gait.speed, 1.0)],
        "apex": [np.nextafter(gait.apex, 1.0)],
        "phases": [
            (dataclasses.replace(stance, **change), flight)
            for change in (
                {"name": "support"},
                {"feet": ("FL",)},
                {"duration": np.nextafter(stance.duration, 1.0)},
                {"lam": np.nextafter(stance.lam, 1e9)},
                {"base": stance.base[:, ::-1]},
            )
        ],
    }
    digests = [dataclasses.replace(gait, **{name: other}).sha256 for other in others[name]]
    assert len({gait.sha256, *digests}) == 1 + len(others[name])


def test_libraries_with_other_gaits_have_other_digests(library: GaitLibrary) -> None:
    whole = load_library()
    digests = {whole.at_apex(apex).sha256 for apex in whole.apexes} | {whole.sha256}
    assert len(digests) == 1 + len(whole.apexes)
    assert GaitLibrary(library.gaits, library.metadata).sha256 == library.sha256


def test_speeds_must_increase(library: GaitLibrary) -> None:
    with pytest.raises(InvalidInput, match="increasing speed"):
        GaitLibrary(library.gaits[::-1])


def test_build_goes_outward_and_repeats_the_shipped_gaits(
    library: GaitLibrary, robot: Robot, tmp_path: Path
) -> None:
    path = tmp_path / "two.npz"
    built = build_library(robot, [0.4, 0.3], path=path, workers=1, progress=False)
    saved = GaitLibrary.load(path)
    assert list(saved.speeds) == [0.3, 0.4]
    assert saved.metadata["problem"] == library.metadata["problem"]
    assert all(found.passed for found in built.audit)
    for gait in built.gaits:
        shipped = library.at(gait.speed)
        np.testing.assert_allclose(gait.stance.joints, shipped.stance.joints, atol=1e-5)


def test_nothing_to_build_or_to_describe_is_refused(library: GaitLibrary, robot: Robot) -> None:
    with pytest.raises(InvalidInput, match="at least one"):
        build_library(robot, [])
    with pytest.raises(InvalidInput, match="no audit"):
        describe_library(GaitLibrary(library.gaits))


def test_descriptions_show_every_gait(library: GaitLibrary) -> None:
    table = describe_library(library)
    assert len(table.splitlines()) == 2 + len(library.gaits) + 3
    assert table.endswith("\nAll 14 gaits pass all their checks.")
    assert "14 gaits, solved in" in table
    assert "FAILED" not in table
    assert "18-DoF residual" in describe_gait(library, 0.3)
    assert describe_gait(library, 0.3).endswith("\nThe gait passes all its checks.")
    assert "interpolated" in describe_gait(library, 0.35)


def test_descriptions_end_with_what_fails(library: GaitLibrary) -> None:
    good, *others = library.audit
    wrong = dataclasses.replace(good.checks[0], value=np.inf)
    failed = dataclasses.replace(good, checks=(wrong, *good.checks[1:]))
    library = GaitLibrary(library.gaits, library.metadata, (failed, *others))
    speed, apex = library.gaits[0].speed, library.gaits[0].apex
    verdict = f"1 of 14 gaits fail: {speed:+.2f} m/s at {apex:.3f} m."
    assert describe_library(library).splitlines()[-1] == verdict
    assert describe_gait(library, speed).endswith(f"\nThe gait fails: {wrong.name}.")
    assert describe_gait(library, 0.35).endswith(f"\n{verdict}")


def test_an_apex_between_two_is_no_part_of_a_library_but_can_be_interpolated() -> None:
    library = load_library("a1")
    with pytest.raises(InvalidInput, match=r"gaits show SPEED --apex 0\.33' interpolates"):
        library.at_apex(0.33)
    with pytest.raises(InvalidInput, match=r"choose one of: 0\.32, 0\.34, 0\.36$"):
        library.at_apex(0.5)
    assert library.at(0.3, 0.33).apex == pytest.approx(0.33)
