"""URDFs that other people write: faults are named, and what they declare is what is loaded."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import RobotSpec, load_robot
from pronk_pin.dynamics import stance_derivatives, stance_dynamics
from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.kinematics import (
    Contact,
    contact_bias,
    contact_jacobian,
    foot_positions,
    inverse_kinematics,
    leg_inverse_kinematics,
    leg_odometry,
)
from pronk_pin.parity import compare_models
from pronk_pin.robot import Robot
from pronk_pin.robot.formats import mujoco_spec

Write = Callable[..., Robot]


@pytest.fixture
def written(robot: Robot, tmp_path: Path) -> Write:
    """The A1 with text of its URDF replaced, once."""

    def build(old: str, new: str, *, name: str = "own.urdf", **spec: object) -> Robot:
        text = robot.urdf.decode()
        assert re.search(old, text, re.DOTALL), old
        path = tmp_path / name
        path.write_text(re.sub(old, new, text, count=1, flags=re.DOTALL))
        return load_robot(RobotSpec("own", str(path), **spec))

    return build


TRUNK_MASS = r'(<link name="trunk">.*?<mass value=)"[^"]+"'
HIP = r'(<joint name="FL_hip_joint".*?)'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (TRUNK_MASS, r'\1"-6"', "link trunk: its mass is negative, -6 kg"),
        (TRUNK_MASS, r'\1"6,0"', r'link trunk: <mass value="6,0">: give 1 finite number'),
        (TRUNK_MASS, r'\1"6 kg"', r'link trunk: <mass value="6 kg">'),
        (TRUNK_MASS, r'\1"1_0"', r'link trunk: <mass value="1_0">'),
        (TRUNK_MASS, r'\1"1e999"', r'link trunk: <mass value="1e999">'),
        (TRUNK_MASS, r'\1""', r'link trunk: <mass value="">'),
        (TRUNK_MASS, r'\1"nan"', r'<mass value="nan">'),
        (TRUNK_MASS + "/>", r'\1"6"/><!--', "not a usable URDF|damaged URDF"),
        (r'<mass value="6.0"/>', "", "link trunk: its inertial has no <mass>"),
        (r' ixx="[^"]+"', "", "link trunk: <inertia> has no ixx"),
        (r' ixy="[^"]+"', ' ixy="a"', r'link trunk: <inertia ixy="a">'),
        (r'(<link name="trunk">)', r"\1<inertial/>", "link trunk: it has 2 inertials"),
        (
            HIP + r'lower="[^"]+"',
            r'\1lower="2"',
            "joint FL_hip_joint: its lower limit, 2, is above",
        ),
        (
            HIP + r'lower="[^"]+" upper="[^"]+"',
            r'\1lower="0.1" upper="0.1"',
            "joint FL_hip_joint: both its limits are 0.1, so that it cannot move",
        ),
        (HIP + r'lower="[^"]+"', r'\1lower="low"', r'joint FL_hip_joint: <limit lower="low">'),
        (HIP + r'effort="[^"]+"', r'\1effort="-3"', "joint FL_hip_joint: its limits of effort"),
        (HIP + r'velocity="[^"]+"', r"\1", "joint FL_hip_joint: <limit> has no velocity"),
        (HIP + r"<limit[^>]*>", r"\1", "joint FL_hip_joint: it is revolute and has no <limit>"),
        (HIP + r'axis xyz="[^"]+"', r'\1axis xyz="0 0 0"', "joint FL_hip_joint: its axis is zero"),
        (HIP + r'xyz="[^"]+"', r'\1xyz="0.2 0.1"', r'joint FL_hip_joint: <origin xyz="0.2 0.1">'),
        (r'radius="0.02"', 'radius="2cm"', r'link FR_foot: <sphere radius="2cm">'),
        (r'radius="0.02"', 'radius="-0.02"', r'link FR_foot: <sphere radius="-0.02">: give what'),
        (
            r'(<collision>[^!]*?<box size=)"[^"]+"',
            r'\1"1 1"',
            r'link trunk: <box size="1 1">: give 3 finite',
        ),
        (HIP + "revolute", r"\1floating", "joint FL_hip_joint: it is floating"),
        (HIP + "revolute", r"\1planar", "joint FL_hip_joint: it is planar"),
        (
            HIP + "</joint>",
            r'\1<mimic joint="FR_hip_joint" multiplier="-1"/></joint>',
            "joint FL_hip_joint: it mimics another joint, which is not supported",
        ),
        (r'link name="base"', 'link name="world"', "a link is called world"),
    ],
)
def test_a_fault_is_named_with_its_link_or_joint(
    written: Write, old: str, new: str, message: str
) -> None:
    with pytest.raises(FileProblem, match=message):
        written(old, new)


@pytest.mark.parametrize(
    "visual",
    [
        "<geometry><box size='1 1'/></geometry>",
        "<geometry><capsule radius='1' length='1'/></geometry>",
        "<geometry><mesh filename='package://nowhere/lost.stl'/></geometry>",
        "<geometry><sphere radius='1'/></geometry><material name='unknown'/>",
        "",
    ],
)
def test_faults_of_what_is_only_seen_are_none_of_the_robot(
    written: Write, robot: Robot, visual: str
) -> None:
    own = written('(<link name="trunk">)', rf"\1<visual>{visual}</visual>")
    assert own.mass == robot.mass
    assert compare_models(own, mujoco_spec(own).compile(), states=2).agrees


def test_a_capsule_meets_the_ground_as_one(written: Write, robot: Robot) -> None:
    shape = "<collision><geometry><capsule radius='0.05' length='0.2'/></geometry></collision>"
    cone = "<collision><geometry><cone radius='0.05' length='0.2'/></geometry></collision>"
    own = written('(<link name="trunk">)', rf"\1{shape}{cone}")
    assert own.mass == robot.mass
    model = mujoco_spec(own).compile()
    assert model.ngeom == mujoco_spec(robot).compile().ngeom + 1
    size = model.geom_size[model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE]
    np.testing.assert_allclose(size[:, :2], [[0.05, 0.1]])


XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro" '


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (TRUNK_MASS, r'\1"${m}"'),
        ("</robot>", '<xacro:leg name="FL"/></robot>'),
        ("<robot (.*)</robot>", rf'<robot {XACRO}\1<xacro:leg name="FL"/></robot>'),
    ],
)
def test_xacro_is_recognised_with_the_command_that_expands_it(
    written: Write, old: str, new: str
) -> None:
    command = r"run 'xacro a1.urdf.xacro > a1_expanded.urdf'"
    with pytest.raises(FileProblem, match=f"this is xacro.*{command}"):
        written(old, new, name="a1.urdf.xacro")


def test_what_xacro_leaves_behind_is_no_fault(written: Write, robot: Robot) -> None:
    comment = "<!-- made by xacro, ${mass} -->"
    assert written("<robot ", f"{comment}<robot {XACRO}").mass == robot.mass


WORLD = '<link name="{0}"/><joint name="to_base" type="{1}"><parent link="{0}"/><child link="{2}"/>'


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"FL_foot_fixed"', '"FL_foot"'),
        ('"floating_base"', '"trunk"'),
        ('<robot name="a1"', "<robot"),
        ("(<robot )", "<?xml version='1.0' encoding='ISO-8859-1'?><!-- é -->\\1"),
    ],
    ids=["a joint as its foot", "a joint as the trunk", "no name", "in Latin 1"],
)
def test_names_and_letters_that_are_unusual_are_no_fault(
    robot: Robot, tmp_path: Path, old: str, new: str
) -> None:
    path = tmp_path / "own.urdf"
    text = robot.urdf.decode()
    text = text[text.index("<robot") :]
    assert re.search(old, text)
    path.write_bytes(re.sub(old, new, text).encode("latin-1"))
    own = load_robot(RobotSpec("own", str(path)))
    np.testing.assert_array_equal(own.standing, robot.standing)
    assert compare_models(own, mujoco_spec(own).compile(), states=2).agrees


@pytest.mark.parametrize("root", ["world", "odom"])
def test_what_a_floating_joint_ties_to_a_root_without_mass_is_the_base(
    written: Write, robot: Robot, root: str
) -> None:
    own = written("</robot>", WORLD.format(root, "floating", "base") + "</joint></robot>")
    assert own.joint_names == robot.joint_names
    np.testing.assert_array_equal(own.standing, robot.standing)
    assert compare_models(own, mujoco_spec(own).compile(), states=3).agrees


def test_a_robot_that_is_fixed_to_the_world_is_refused(written: Write) -> None:
    match = "link base is fixed to the link world by joint to_base"
    with pytest.raises(FileProblem, match=match):
        written("</robot>", WORLD.format("world", "fixed", "base") + "</joint></robot>")


@pytest.mark.parametrize(
    ("old", "new", "effort"),
    [
        (HIP + "revolute", r"\1continuous", 33.5),
        (HIP + '"revolute"(.*?)<limit[^>]*>', r'\1"continuous"\2', np.inf),
        (HIP + ' lower="[^"]+" upper="[^"]+"', r"\1", 33.5),
    ],
    ids=["continuous", "continuous without a limit", "no angles"],
)
def test_hinges_without_limits_turn_freely(
    written: Write, robot: Robot, old: str, new: str, effort: float
) -> None:
    own = written(old, new)
    assert (own.nq, own.nv) == (19, 18)
    assert (own.q_min[0], own.q_max[0], own.tau_max[0]) == (-np.inf, np.inf, effort)
    np.testing.assert_array_equal(own.q_min[1:], robot.q_min[1:])
    model = mujoco_spec(own).compile()

    assert not model.jnt_limited[model.joint("FL_hip_joint").id]
    parity = compare_models(own, model, states=5)
    assert not {row.what for row in parity.differences} - {"torque limits"}
    assert parity.bias is not None
    assert parity.bias < 1e-12
    feet = foot_positions(own, own.standing) + np.array([0.0, 0.01, 0.02])
    solution = inverse_kinematics(own, own.standing[:7], feet)
    assert solution.reached
    leg = leg_inverse_kinematics(own, feet[0] - own.standing[:3], leg="FL")
    np.testing.assert_allclose(leg.joints, solution.q[7:10], atol=1e-6)


FEET = r'(radius="0.01".*?<origin rpy="0 0 0" xyz=)"0 0 0"'


def with_places(robot: Robot, path: Path, *places: str) -> Robot:
    """The A1 with the spheres of its feet, in the order of the URDF, at some places."""
    parts = re.split(FEET, robot.urdf.decode(), flags=re.DOTALL)
    text = parts[0]
    for k, place in enumerate(places):
        text += f'{parts[2 * k + 1]}"{place}"{parts[2 * k + 2]}'
    path.write_text(text)
    return load_robot(RobotSpec("own", str(path)))


def test_the_sphere_of_a_foot_has_a_place(robot: Robot, tmp_path: Path) -> None:
    own = with_places(robot, tmp_path / "own.urdf", *["0.005 0 0.0125"] * 4)
    np.testing.assert_allclose(foot_positions(own, own.standing)[:, 2], own.foot_radius)
    lower = robot.standing[2] - own.standing[2]
    pitch = sum(robot.spec.standing[1:])
    assert lower == pytest.approx(0.0125 * np.cos(pitch) - 0.005 * np.sin(pitch))
    solution = leg_inverse_kinematics(
        own, foot_positions(own, own.standing)[1] - own.standing[:3], leg="FR"
    )
    np.testing.assert_allclose(solution.joints, own.spec.standing, atol=1e-12)
    model = mujoco_spec(own).compile()
    assert compare_models(own, model, states=3).agrees
    heavier = own.with_parameters(type(own.parameters)(payload=1.0))
    np.testing.assert_array_equal(heavier.standing, own.standing)


@pytest.mark.parametrize("contact", ["point", "rolling"])
def test_a_sphere_beside_its_link_is_one_whose_link_is_there(
    robot: Robot, tmp_path: Path, contact: Contact
) -> None:
    """The same robot, written in two ways."""
    text = robot.urdf.decode()
    own = with_places(robot, tmp_path / "own.urdf", *["0.005 0 0.0125"] * 4)
    for leg in robot.legs:
        joint = rf'(name="{leg}_foot_fixed".*?xyz=)"0 0 -0.2"'
        text = re.sub(joint, r'\1"0.005 0 -0.1875"', text, flags=re.DOTALL)
        link = rf'(<link name="{leg}_foot">.*?<inertial>)'
        text = re.sub(link, r'\1<origin xyz="-0.005 0 -0.0125"/>', text, flags=re.DOTALL)
    (tmp_path / "moved.urdf").write_text(text)
    same = load_robot(RobotSpec("own", str(tmp_path / "moved.urdf")))
    np.testing.assert_allclose(same.standing, own.standing, atol=1e-12)
    rng = np.random.default_rng(0)
    q = pin.integrate(own.model, own.standing, 0.3 * rng.normal(size=18))
    v, tau = rng.normal(size=18), rng.normal(size=12)
    found = [
        (
            contact_jacobian(each, q, contact=contact),
            contact_bias(each, q, v, contact=contact),
            leg_odometry(each, q, v, contact=contact),
            *stance_dynamics(each, q, v, tau, feet=("FL", "RR"), contact=contact)[:2],
            *stance_derivatives(each, q, v, tau, feet=("FL", "RR"), contact=contact)[:3],
        )
        for each in (own, same)
    ]
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-8 * max(1.0, np.abs(one).max()))


def test_feet_of_several_sizes_or_none_are_named(written: Write) -> None:
    with pytest.raises(InvalidInput, match=r"have the radii 0.02, 0.03, 0.02, 0.02 m"):
        written('radius="0.02"', 'radius="0.03"')
    assert written('radius="0.02"', 'radius="0.03"', foot_radius=0.025).foot_radius == 0.025


def test_a_foot_or_a_base_that_another_joint_moves_is_named(robot: Robot) -> None:
    path = str(robot.urdf_path)
    with pytest.raises(InvalidInput, match="foot FL_thigh is moved by joint FL_thigh_joint"):
        load_robot(RobotSpec("own", path, foot_pattern="{leg}_thigh"))
    with pytest.raises(InvalidInput, match="link FL_hip is moved by joint FL_hip_joint"):
        load_robot(RobotSpec("own", path, base_link="FL_hip"))


def test_inverse_kinematics_ends_whatever_comes_in(robot: Robot) -> None:
    """Hinges whose lower limit is above the upper one; a file that says so is refused."""
    model = robot.model.copy()
    model.lowerPositionLimit[7:] = 1.0
    model.upperPositionLimit[7:] = -1.0
    own = type(robot)(
        robot.spec,
        robot.urdf_path,
        robot.urdf,
        robot.package_dir,
        model,
        robot.foot_radius,
        robot.urdf_joint_names,
    )
    feet = foot_positions(robot, robot.standing) + np.array([0.0, 0.0, 0.05])
    assert not inverse_kinematics(own, robot.standing[:7], feet).reached
