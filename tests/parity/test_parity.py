"""Two models are the same robot where physics says so, and the table names what is not."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from pronk_pin import Robot, RobotSpec, load_robot
from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.parity import ROUND_OFF, SIX_DIGITS, Parity, compare_models
from pronk_pin.robot import ROBOTS
from pronk_pin.robot.formats.urdf import mujoco_spec

JOINT = "FR_thigh_joint"


@pytest.fixture
def spec(robot: Robot) -> mujoco.MjSpec:
    """The A1 in MuJoCo with a motor at every joint, to be changed."""
    spec = mujoco_spec(robot)
    for joint in robot.urdf_joint_names:
        motor = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
    return spec


def compare(robot: Robot, spec: mujoco.MjSpec) -> Parity:
    return compare_models(robot, spec.compile(), states=20)


def named(parity: Parity) -> set[tuple[str, str]]:
    """What differs, and where."""
    return {(row.what, row.where) for row in parity.differences}


@pytest.mark.parametrize("name", ROBOTS)
def test_both_engines_read_the_same_robot_from_a_urdf(name: str) -> None:
    robot = load_robot(name)
    parity = compare_models(robot, mujoco_spec(robot).compile(), states=300)
    assert parity.agrees
    assert not parity.differences
    for value in (parity.mass_matrix, parity.bias, parity.jacobian):
        assert value is not None
        assert value < 1e-12
    assert parity.tolerance == ROUND_OFF


@pytest.mark.parametrize("name", ROBOTS)
def test_an_mjcf_that_mujoco_saved_agrees_to_its_six_digits(name: str, tmp_path: Path) -> None:
    robot = load_robot(name)
    path = tmp_path / "saved.xml"
    path.write_text(mujoco_spec(robot).to_xml())
    parity = compare_models(robot, path, states=100)
    assert parity.agrees, parity.table()
    assert parity.tolerance == SIX_DIGITS
    assert not compare_models(robot, path, states=5, tolerance=ROUND_OFF).agrees


def test_an_mjcf_with_all_digits_is_judged_by_them(
    robot: Robot, spec: mujoco.MjSpec, tmp_path: Path
) -> None:
    path = tmp_path / "exact.xml"
    text = spec.to_xml()
    path.write_text(text.replace('mass="1.013"', f'mass="{1.013 * (1 + 1e-7)!r}"', 1))
    parity = compare_models(robot, path, states=5)
    assert parity.tolerance == ROUND_OFF
    assert ("mass", JOINT) in named(parity)


def test_a_model_agrees_with_itself_from_either_side(robot: Robot, spec: mujoco.MjSpec) -> None:
    model = spec.compile()
    for a, b in ((robot, robot), (model, model), (model, robot), (robot.urdf_path, robot)):
        parity = compare_models(a, b, states=10)
        assert parity.agrees, parity.table()
    feet = [row for row in compare_models(model, robot, states=1).rows if row.what == "foot radius"]
    assert [row.where for row in feet] == list(robot.foot_names)
    assert all(row.agrees for row in feet)


def heavier(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).parent.mass *= 1.001


def centre_moved(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).parent.ipos[2] += 1e-4


def inertia_larger(spec: mujoco.MjSpec) -> None:
    # Not MuJoCo's largest moment, which would break the triangle inequality.
    spec.joint(JOINT).parent.inertia[2] *= 1.01


def origin_moved(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).parent.pos[1] -= 1e-4


def axis_reversed(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).axis *= -1


def limit_wider(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).range[1] += 0.01


def limit_gone(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).limited = mujoco.mjtLimited.mjLIMITED_FALSE


def rotor(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).armature = 0.01


def geared_rotor(spec: mujoco.MjSpec) -> None:
    spec.actuator(JOINT).armature = 1e-4
    spec.actuator(JOINT).gear[0], spec.actuator(JOINT).gainprm[0] = 10.0, 0.1


def damped(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).damping[0] = 0.1


def rubbing(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).frictionloss = 0.2


def sprung(spec: mujoco.MjSpec) -> None:
    spec.joint(JOINT).stiffness[0] = 1.0


def servo(spec: mujoco.MjSpec) -> None:
    spec.actuator(JOINT).set_to_position(kp=100.0, kv=2.0)


def half_as_strong(spec: mujoco.MjSpec) -> None:
    spec.actuator(JOINT).gainprm[0] = 0.5


def weak_motor(spec: mujoco.MjSpec) -> None:
    spec.actuator(JOINT).forcerange = [-20.0, 20.0]


def unpowered(spec: mujoco.MjSpec) -> None:
    spec.delete(spec.actuator(JOINT))


def on_the_moon(spec: mujoco.MjSpec) -> None:
    spec.option.gravity = [0, 0, -1.62]


def small_foot(spec: mujoco.MjSpec) -> None:
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    calf = spec.joint("FR_calf_joint").parent
    next(geom for geom in calf.geoms if geom.type == sphere).size[0] = 0.015


Change = Callable[[mujoco.MjSpec], None]


@pytest.mark.parametrize(
    ("change", "what", "touches"),
    [
        (heavier, "mass", "Mh"),
        (centre_moved, "centre of mass", "Mh"),
        (inertia_larger, "inertia", "Mh"),
        (origin_moved, "joint origin", "MhJ"),
        (axis_reversed, "joint axis", "MhJ"),
        (limit_wider, "limits", ""),
        (limit_gone, "limits", ""),
        (rotor, "armature", "M"),
        (geared_rotor, "armature", "M"),
        (damped, "damping", ""),
        (rubbing, "friction", ""),
        (sprung, "stiffness", ""),
        (servo, "actuator", ""),
        (half_as_strong, "torque per control", ""),
        (weak_motor, "torque limits", ""),
        (unpowered, "actuator", ""),
        (on_the_moon, "gravity", "h"),
        (small_foot, "foot radius", ""),
    ],
)
def test_one_change_is_named_in_one_row_and_seen_where_it_acts(
    robot: Robot, spec: mujoco.MjSpec, change: Change, what: str, touches: str
) -> None:
    change(spec)
    parity = compare(robot, spec)
    where = {"gravity": "model", "foot radius": "FR_foot"}.get(what, JOINT)
    assert named(parity) == {(what, where)}
    assert not parity.agrees
    assert f"{what} " in parity.table()
    seen = ""
    for name, value in zip("MhJ", (parity.mass_matrix, parity.bias, parity.jacobian), strict=True):
        assert value is not None
        seen += name if value > ROUND_OFF else ""
    assert seen == touches


def test_differences_have_the_size_of_the_change(robot: Robot, spec: mujoco.MjSpec) -> None:
    mass = spec.joint(JOINT).parent.mass
    spec.joint(JOINT).parent.mass = mass + 0.05
    spec.actuator(JOINT).gear[0], spec.actuator(JOINT).armature = 10.0, 1e-4
    rows = {(row.what, row.where): row for row in compare(robot, spec).rows}
    assert rows["mass", JOINT].difference == pytest.approx(0.05)
    assert rows["armature", JOINT].b == pytest.approx(0.01)  # the rotor through its gear
    assert rows["torque per control", JOINT].b == pytest.approx(10.0)


def test_the_size_of_a_difference_of_m_is_that_of_a_rotor(
    robot: Robot, spec: mujoco.MjSpec
) -> None:
    """The rotor adds to one diagonal entry, the smallest over the states in relative terms."""
    spec.joint("FR_calf_joint").armature = 0.01
    entries = []
    model, data = robot.model, robot.model.createData()
    rng, limits = np.random.default_rng(1), np.stack([robot.q_min, robot.q_max])
    for _ in range(200):
        q = pin.neutral(model)
        q[7:] = rng.uniform(*limits)
        index = model.joints[model.getJointId("FR_calf_joint")].idx_v
        entries.append(pin.crba(model, data, q)[index, index])
    found = compare(robot, spec).mass_matrix
    assert found == pytest.approx(0.01 / min(entries), rel=1e-3)


def test_the_order_of_joints_is_shown_but_not_held_against_a_model(
    robot: Robot, tmp_path: Path
) -> None:
    """Pinocchio sorts the legs, MuJoCo takes them as they stand in the document."""
    parity = compare(robot, mujoco_spec(robot))
    row = next(row for row in parity.rows if row.what == "joint order")
    assert row.a == ", ".join(robot.joint_names)
    assert row.b == ", ".join(robot.urdf_joint_names) != row.a
    assert row.agrees is None
    assert parity.agrees
    assert str(row.b) in parity.table()


@pytest.mark.parametrize("drawn", [0.0, 0.3])
def test_bodies_with_other_frames_and_poses_are_the_same_robot(
    robot: Robot, drawn: float, tmp_path: Path
) -> None:
    """A calf whose frame is elsewhere and turned, drawn at an angle that its `ref` tells."""
    turn = pin.exp3(np.array([0.3, -0.5, 0.9]))
    shift = np.array([0.02, -0.03, 0.05])  # from the joint to the new frame, in the calf's axes
    spec = mujoco_spec(robot)
    calf, joint = spec.joint("FR_calf_joint").parent, spec.joint("FR_calf_joint")
    pose = pin.exp3(drawn * np.array([0.0, 1.0, 0.0]))

    def quaternion(matrix: np.ndarray) -> np.ndarray:
        return pin.Quaternion(matrix).coeffs()[[3, 0, 1, 2]]

    inertial = pin.Quaternion(*calf.iquat).matrix()
    calf.pos = np.array(calf.pos) + pose @ shift
    calf.quat = quaternion(pose @ turn)
    calf.ipos, calf.iquat = turn.T @ (calf.ipos - shift), quaternion(turn.T @ inertial)
    joint.pos, joint.axis = -turn.T @ shift, turn.T @ np.array([0.0, 1.0, 0.0])
    joint.ref = drawn
    for geom in calf.geoms:
        spec.delete(geom)
    foot = turn.T @ (np.array([0.0, 0.0, -0.2]) - shift)
    calf.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.02, 0, 0], pos=foot)
    model = spec.compile()

    parity = compare_models(robot, model, states=50)
    assert parity.agrees, parity.table()
    shown = next(
        row for row in parity.rows if (row.what, row.where) == ("angle as drawn", "FR_calf_joint")
    )
    assert shown.b == pytest.approx(drawn)


def test_another_zero_of_an_angle_is_a_difference(robot: Robot) -> None:
    spec = mujoco_spec(robot)
    spec.joint("FR_calf_joint").ref = 0.1
    parity = compare(robot, spec)
    assert ("angle as drawn", "FR_calf_joint") in named(parity)
    assert ("centre of mass", "FR_calf_joint") in named(parity)
    assert {where for _, where in named(parity)} == {"FR_calf_joint", "FR_foot"}
    assert parity.mass_matrix is not None
    assert parity.mass_matrix > 1e-3


def test_a_missing_joint_is_named_and_stops_the_comparison_of_dynamics(robot: Robot) -> None:
    spec = mujoco_spec(robot)
    spec.delete(spec.joint(JOINT))
    model = spec.compile()
    for parity in (compare_models(robot, model), compare_models(model, robot)):
        assert ("joint", JOINT) in named(parity)
        assert parity.mass_matrix is None
        assert f"has no {JOINT}" in parity.reason
        assert "Not the same robot." in parity.table()
        assert not parity.agrees


def test_a_trunk_that_does_not_float_gets_the_remedy(robot: Robot) -> None:
    spec = mujoco_spec(robot)
    spec.compiler.fusestatic = False
    trunk = spec.body("trunk")
    for joint in trunk.joints:
        spec.delete(joint)
    fixed = compare(robot, spec)
    assert named(fixed) == {("base", "trunk")}
    assert "fixed to the world; let it float, with <freejoint/>" in fixed.reason
    trunk.add_joint(name="x", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
    guided = compare(robot, spec)
    assert named(guided) == {("base", "trunk")}
    assert "held by x" in guided.table()


def test_a_urdf_bolted_to_the_world_is_told_apart(robot: Robot) -> None:
    """As MuJoCo reads a URDF by itself: the trunk melts into the world, its mass is lost."""
    text = re.sub(r"<(visual|collision)>.*?</\1>", "", robot.urdf_path.read_text(), flags=re.S)
    model = mujoco.MjSpec.from_string(text).compile()
    parity = compare_models(robot, model)
    assert ("base", "trunk") in named(parity)
    assert "fixed to the world" in parity.reason
    assert not {what for what, where in named(parity) if where != "trunk"}


def test_other_things_in_the_scene_are_not_the_robot(robot: Robot) -> None:
    spec = mujoco_spec(robot)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1])
    ball = spec.worldbody.add_body(pos=[3, 0, 1])
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0, 0])
    parity = compare(robot, spec)
    assert parity.agrees, parity.table()


def test_what_else_acts_on_a_robot_is_counted(robot: Robot) -> None:
    spec = mujoco_spec(robot)
    spec.body("FR_calf").gravcomp = 1.0
    equality = spec.add_equality(name1="FR_hip_joint", name2="FL_hip_joint")
    equality.type, equality.objtype = (
        mujoco.mjtEq.mjEQ_JOINT,
        mujoco.mjtObj.mjOBJ_JOINT,
    )
    assert named(compare(robot, spec)) == {
        ("bodies with gravity compensation", "model"),
        ("closed loops and other equality constraints", "model"),
    }


@pytest.mark.parametrize(
    ("actuators", "kind"),
    [
        ("<motor joint='j'/>", "motor"),
        ("<position joint='j' kp='50' kv='2'/>", "position servo, kp 50, kv 2"),
        ("<position joint='j' kp='50'/>", "position servo, kp 50, kv 0"),
        ("<velocity joint='j' kv='3'/>", "velocity servo, kv 3"),
        ("<intvelocity joint='j' kp='50' actrange='-1 1'/>", "general"),
        ("<general joint='j' gainprm='2' biastype='affine' biasprm='1 0 0'/>", "general"),
        ("<general joint='j' gainprm='2' biastype='affine' biasprm='0 -1 0'/>", "general"),
        ("<motor joint='j'/><damper joint='j' kv='1' ctrlrange='0 1'/>", "2 actuators"),
        ("<adhesion body='b' ctrlrange='0 1'/>", "none"),
    ],
)
def test_kinds_of_actuators_are_told_apart(robot: Robot, actuators: str, kind: str) -> None:
    text = f"""<mujoco><worldbody><body><freejoint/><geom size="1"/><body name="b">
        <joint name="j" actuatorfrcrange="-9 9"/><geom size="1"/></body></body></worldbody>
        <actuator>{actuators}</actuator></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    rows = {row.what: row for row in compare_models(model, model, states=1).rows}
    assert rows["actuator"].a == kind
    assert rows["torque limits"].a == (-9.0, 9.0)
    assert rows["actuators that act on no joint"].a == (1.0 if kind == "none" else 0.0)


@pytest.mark.parametrize(
    ("moment", "message"),
    [("0.1", r"MuJoCo refuses this URDF .*FR_hip"), ("-1", "inertia should be positive")],
)
def test_an_inertia_that_no_body_can_have_is_named(
    robot: Robot, tmp_path: Path, moment: str, message: str
) -> None:
    """Where no fixed joint ties the link to another; the base of the Go1 is tied to the trunk."""
    path = tmp_path / "impossible.urdf"
    path.write_text(robot.urdf_path.read_text().replace('"0.000469246"', f'"{moment}"', 1))
    own = load_robot(RobotSpec("impossible", str(path)))
    with pytest.raises(FileProblem, match=message):
        mujoco_spec(own)


def test_xacro_is_told_from_a_urdf(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "a1.urdf.xacro"
    path.write_text(robot.urdf.decode().replace("</robot>", "<xacro:leg/></robot>"))
    with pytest.raises(FileProblem, match="this is xacro"):
        compare_models(robot, path)


def test_a_limit_of_no_torque_is_one(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "limp.urdf"
    path.write_text(robot.urdf.decode().replace('effort="33.5"', 'effort="0"'))
    rows = compare_models(robot, path, states=2).rows
    assert {row.b for row in rows if row.what == "torque limits"} == {(0.0, 0.0)}


def test_urdfs_are_compared_without_knowing_their_feet(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "other.urdf"
    path.write_text(robot.urdf_path.read_text().replace('velocity="21"', 'velocity="30"', 1))
    parity = compare_models(robot.urdf_path, path, states=10)
    assert [what for what, _ in named(parity)] == ["velocity limit"]
    assert parity.jacobian == 0.0


def test_friction_and_damping_of_a_urdf_are_both_engines_rows() -> None:
    robot = load_robot("go1")
    rows = compare(robot, mujoco_spec(robot)).rows
    for what, value in (("damping", 0.01), ("friction", 0.2)):
        found = {(row.a, row.b) for row in rows if row.what == what}
        assert found == {(value, value)}


def test_states_are_drawn_from_the_generator(robot: Robot, spec: mujoco.MjSpec) -> None:
    model = spec.compile()

    def bias(seed: int) -> float | None:
        return compare_models(robot, model, states=3, rng=np.random.default_rng(seed)).bias

    assert bias(1) == bias(1) != bias(2)


def test_the_full_table_has_every_row(robot: Robot, spec: mujoco.MjSpec) -> None:
    heavier(spec)
    parity = compare(robot, spec)
    short, full = parity.table(), parity.table(full=True)
    assert "torque limits" not in short
    assert "torque limits" in full
    marked = [line for line in full.splitlines() if line.endswith("differs")]
    assert len([line for line in marked if line.startswith("mass ")]) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco><worldbody>", r"damaged \(no element found"),
        ("<html/>", "neither a URDF nor an MJCF"),
        ("<robot name='half'/>", "not a usable URDF"),
        ("<mujoco><worldbody><body><geom/></body></worldbody></mujoco>", "MuJoCo cannot load it"),
        (
            "<mujoco><asset><mesh name='m' file='trunk.obj'/></asset><worldbody><body><joint/>"
            "<geom type='mesh' mesh='m'/></body></worldbody></mujoco>",
            "trunk.obj.*put the meshes and files it names beside it",
        ),
    ],
)
def test_unreadable_files_are_named_with_the_remedy(
    robot: Robot, tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "bad.xml"
    path.write_text(text)
    with pytest.raises(FileProblem, match=rf"bad\.xml: .*{message}"):
        compare_models(robot, path)


def test_missing_files_and_folders_are_named(robot: Robot, tmp_path: Path) -> None:
    for path in (tmp_path / "nowhere.xml", tmp_path):
        with pytest.raises(FileProblem, match="give the path of a URDF or an MJCF"):
            compare_models(robot, path)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("<body><geom size='1'/></body>", "nothing in it has a joint"),
        (
            "<body><freejoint/><geom size='1'/><body><joint type='ball'/><geom size='1'/></body>"
            "</body>",
            "only robots of hinges and slides",
        ),
    ],
)
def test_what_is_no_robot_is_refused(robot: Robot, body: str, message: str) -> None:
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    with pytest.raises(InvalidInput, match=message):
        compare_models(robot, model)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"states": 0}, "states=0; give a whole number from 1 to 1000000"),
        ({"states": 1.5}, "whole number"),
        ({"tolerance": -1.0}, "from 0 on"),
        ({"tolerance": float("nan")}, "from 0 on"),
    ],
)
def test_options_out_of_range_are_refused(
    robot: Robot, options: dict[str, float], message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        compare_models(robot, robot, **options)
    with pytest.raises(InvalidInput, match="is no model; give a Robot"):
        compare_models(robot, 3)


def test_a_comparison_comes_back_from_its_text(robot: Robot, spec: mujoco.MjSpec) -> None:
    endless = spec.joint(JOINT)
    endless.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    parity = compare(robot, spec)
    limits = next(row for row in parity.differences if row.what == "limits")
    assert limits.b == (-np.inf, np.inf)
    text = parity.to_json()
    assert "Infinity" not in text
    assert "NaN" not in text
    back = Parity.from_json(text)
    assert back.table(full=True) == parity.table(full=True)
    for one, other in zip(back.rows, parity.rows, strict=True):  # NaN equals nothing
        assert repr(one) == repr(other)
    with pytest.raises(InvalidInput, match="this is not a comparison of models"):
        Parity.from_json('{"rows": [{}]}')
