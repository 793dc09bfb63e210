"""The robot is read from its URDF, and complaints about it say what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import Robot, RobotSpec, load_robot
from pronk_pin.dynamics import stance_dynamics
from pronk_pin.errors import FileProblem, InvalidInput, UnknownName
from pronk_pin.inverse_dynamics import inverse_dynamics
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import ROBOTS


def test_the_a1_has_the_sizes_of_the_paper(robot: Robot) -> None:
    assert (robot.nq, robot.nv, robot.nu) == (19, 18, 12)
    assert robot.mass == pytest.approx(13.741)
    assert robot.gravity == pytest.approx(9.81)
    assert robot.foot_radius == pytest.approx(0.02)


def test_limits_come_from_the_urdf(robot: Robot) -> None:
    np.testing.assert_allclose(robot.tau_max, 33.5)
    np.testing.assert_allclose(robot.v_max, 21.0)
    assert (robot.q_min < robot.q_max).all()


def test_joints_and_feet_are_found_by_name(robot: Robot) -> None:
    assert robot.joint_names == tuple(robot.model.names[2:])
    assert sorted(robot.urdf_joint_names) == sorted(robot.joint_names)
    found = [robot.model.frames[index].name for index in robot.foot_ids]
    assert tuple(found) == robot.foot_names


def test_standing_puts_all_feet_on_the_ground(robot: Robot) -> None:
    np.testing.assert_allclose(foot_positions(robot, robot.standing)[:, 2], robot.foot_radius)


def test_base_pitch_becomes_a_rotation_about_y(robot: Robot) -> None:
    pitch = np.array([0.0, 0.3, -1.2])
    q = robot.q_from_base(np.ones((3, 3)), np.zeros((3, 12)), pitch=pitch)
    for row, angle in zip(q, pitch, strict=True):
        matrix = pin.Quaternion(row[3:7]).matrix()
        np.testing.assert_allclose(matrix, pin.rpy.rpyToMatrix(0.0, angle, 0.0), atol=1e-15)


def test_a_robot_is_loaded_once() -> None:
    robot = load_robot("a1")  # not the session's: other tests may have loaded many since
    assert load_robot("a1") is robot
    assert load_robot(replace(ROBOTS["a1"])) is robot


def test_an_unknown_robot_is_answered_with_the_known_ones() -> None:
    with pytest.raises(
        UnknownName, match="unknown robot 'spot'; choose one of: a1, anymal_c, b1, bolt"
    ):
        load_robot("spot")


def test_a_missing_urdf_is_named() -> None:
    with pytest.raises(FileProblem, match=r"nowhere\.urdf"):
        load_robot(RobotSpec("lost", "/nowhere.urdf"))
    with pytest.raises(FileProblem, match="pip install"):
        load_robot(RobotSpec("lost", "nowhere.urdf"))


def test_a_urdf_of_ones_own_is_read_from_its_path(robot: Robot) -> None:
    own = load_robot(RobotSpec("mine", str(robot.urdf_path)))
    assert own.name == "mine"
    assert own.sha256 == robot.sha256
    np.testing.assert_array_equal(own.standing, robot.standing)


def test_a_relative_path_is_the_file_that_is_there(
    robot: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine.urdf").write_bytes(robot.urdf)
    monkeypatch.chdir(tmp_path)
    specs = [RobotSpec("mine", urdf) for urdf in ("./mine.urdf", "mine.urdf")]
    monkeypatch.chdir("/")  # as that of a worker, or of who reads the results
    for spec in specs:
        assert load_robot(spec).urdf_path == tmp_path / "mine.urdf"
    assert RobotSpec("a1", "a1_description/urdf/a1.urdf").urdf == "a1_description/urdf/a1.urdf"


def test_what_pinocchio_says_of_a_urdf_is_part_of_the_one_line(
    robot: Robot, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "spherical.urdf"
    text = robot.urdf_path.read_text()
    path.write_text(text.replace('"revolute"', '"spherical"', 1))
    assert path.read_text() != text
    with pytest.raises(FileProblem, match=r"not a usable URDF \(Joint .* has no known type"):
        load_robot(RobotSpec("spherical", str(path)))
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("mass", ["nan", "-1", "1e308"])
def test_a_mass_that_no_link_can_have_is_refused(robot: Robot, tmp_path: Path, mass: str) -> None:
    path = tmp_path / "wrong.urdf"
    path.write_text(robot.urdf_path.read_text().replace('"6.0"', f'"{mass}"', 1))
    reasons = r'\((mass, inertia or place|<mass value="nan"|link trunk: its mass is negative)'
    with pytest.raises(FileProblem, match=reasons):
        load_robot(RobotSpec("wrong", str(path)))


def test_a_robot_is_the_urdf_that_was_read_whatever_becomes_of_the_file(
    robot: Robot, tmp_path: Path
) -> None:
    path = tmp_path / "own.urdf"
    path.write_bytes(robot.urdf)
    own = load_robot(RobotSpec("own", str(path)))
    path.write_text("")
    assert own.sha256 == robot.sha256


def test_a_damaged_urdf_is_named(tmp_path: Path) -> None:
    path = tmp_path / "broken.urdf"
    path.write_text("<robot name='half'><link")
    with pytest.raises(FileProblem, match=r"broken\.urdf: damaged URDF"):
        load_robot(RobotSpec("broken", str(path)))


def test_feet_without_a_sphere_need_a_radius(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "footless.urdf"
    text = robot.urdf_path.read_text()
    path.write_text(text.replace('<sphere radius="0.02"/>', '<box size="0.02 0.02 0.02"/>'))
    spec = RobotSpec("footless", str(path))
    with pytest.raises(InvalidInput, match="no collision sphere; give foot_radius"):
        load_robot(spec)
    assert load_robot(replace(spec, foot_radius=0.01)).foot_radius == 0.01


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot_stands_over_its_feet(name: str) -> None:
    robot = load_robot(name)
    assert (robot.q_min <= robot.standing[7:]).all()
    assert (robot.standing[7:] <= robot.q_max).all()
    feet = foot_positions(robot, robot.standing)
    np.testing.assert_allclose(feet[:, 2], robot.foot_radius)
    middle = pin.centerOfMass(robot.model, robot.data, robot.standing)
    beside = slice(0 if len(robot.legs) == 4 else 1, 2)  # a biped stands on a line
    assert (feet[:, beside].min(axis=0) < middle[beside]).all()
    assert (middle[beside] < feet[:, beside].max(axis=0)).all()


def test_a_biped_with_other_names_is_read_too(biped: Robot) -> None:
    assert (biped.nq, biped.nv, biped.nu) == (13, 12, 6)
    assert foot_positions(biped, biped.standing).shape == (2, 3)
    tau = np.zeros(6)
    stance = stance_dynamics(biped, biped.standing, np.zeros(12), tau)
    assert (stance.a.shape, stance.lam.shape) == ((12,), (6,))
    held = inverse_dynamics(biped, biped.standing, np.zeros(12), stance.a)
    assert held.feasible
    np.testing.assert_allclose(held.tau, tau, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "remedy"),
    [
        ({"joint_pattern": "{leg}-{joint}"}, "adapt joints, joint_pattern"),
        ({"legs": ("FR", "FL", "RL", "RR")}, "legs of the RobotSpec"),
        ({"foot_pattern": "{leg}_toe"}, "adapt foot_pattern"),
        ({"base_link": "torso"}, "adapt base_link"),
        ({"standing": (0.9, -1.8)}, "standing has 2 angles; give 3, .* or 12"),
        ({"foot_radius": -0.02}, "foot_radius=-0.02; give a number from 0 m on"),
    ],
)
def test_a_specification_that_does_not_fit_is_explained(
    change: dict[str, object], remedy: str
) -> None:
    with pytest.raises(InvalidInput, match=remedy):
        load_robot(replace(ROBOTS["a1"], **change))
