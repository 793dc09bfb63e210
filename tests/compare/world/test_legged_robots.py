"""Every legged robot of example-robot-data is the same in both engines, or is refused and why."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from pronk_pin.compare import build_model, load_scenario, mjcf_parity
from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.kinematics import foot_positions
from pronk_pin.parity import SIX_DIGITS, compare_models
from pronk_pin.robot import ROBOTS, Robot, RobotSpec, load_robot
from pronk_pin.robot.formats import body_inertia, mujoco_spec, write_mjcf, write_urdf

THREE = ("HAA", "HFE", "KFE")


def _anymal(name: str, urdf: str) -> RobotSpec:
    return RobotSpec(
        name,
        urdf,
        base_link="base",
        legs=("LF", "LH", "RF", "RH"),
        joints=THREE,
        joint_pattern="{leg}_{joint}",
        foot_pattern="{leg}_FOOT",
        standing=(0.0, 0.4, -0.8, 0.0, -0.4, 0.8) * 2,
    )


def _solo(
    name: str, urdf: str, legs: tuple[str, ...], foot: str, radius: float | None
) -> RobotSpec:
    return RobotSpec(
        name,
        urdf,
        base_link="base_link",
        legs=legs,
        joints=THREE[1:],
        joint_pattern="{leg}_{joint}",
        foot_pattern=foot,
        standing=(0.8, -1.6),
        foot_radius=radius,
    )


def _humanoid(
    name: str,
    urdf: str,
    joints: str,
    joint_pattern: str,
    foot: str,
    legs: tuple[str, ...] = ("left", "right"),
    base: str = "base_link",
) -> RobotSpec:
    """Its feet are no spheres: one about the ankle, to have a place for it."""
    return RobotSpec(
        name,
        urdf,
        base_link=base,
        legs=legs,
        joints=tuple(joints.split()),
        joint_pattern=joint_pattern,
        foot_pattern=foot,
        standing=(0.0,) * len(joints.split()),
        foot_radius=0.02,
    )


_LEG = "hip_pitch hip_roll hip_yaw knee ankle_pitch ankle_roll"
_ROMEO = "HipYaw HipRoll HipPitch KneePitch AnklePitch AnkleRoll"

LEGGED = [
    *ROBOTS.values(),
    RobotSpec("b1", "b1_description/urdf/b1.urdf"),
    RobotSpec("b1-z1", "b1_description/urdf/b1-z1.urdf"),
    RobotSpec("laikago", "laikago_description/urdf/laikago.urdf"),
    _anymal("anymal-b", "anymal_b_simple_description/robots/anymal.urdf"),
    _anymal("anymal-kinova", "anymal_b_simple_description/robots/anymal-kinova.urdf"),
    _anymal("anymal-c", "anymal_c_simple_description/urdf/anymal.urdf"),
    RobotSpec(
        "hyq",
        "hyq_description/robots/hyq_no_sensors.urdf",
        base_link="base_link",
        legs=("lf", "lh", "rf", "rh"),
        joints=("haa", "hfe", "kfe"),
        standing=(-0.2, 0.75, -1.5, -0.2, -0.75, 1.5) * 2,
    ),
    RobotSpec(
        "bolt",
        "bolt_description/robots/bolt.urdf",
        base_link="base_link",
        legs=("FL", "FR"),
        joints=THREE,
        joint_pattern="{leg}_{joint}",
        foot_pattern="{leg}_FOOT",
        foot_radius=0.01,
    ),
    _solo(
        "solo",
        "solo_description/robots/solo.urdf",
        ("FL", "FR", "HL", "HR"),
        "{leg}_FOOT",
        0.016,
    ),
    _solo(
        "quadruped",
        "quadruped_description/urdf/quadruped.urdf",
        ("BL", "BR", "FL", "FR"),
        "{leg}_contact",
        None,
    ),
    RobotSpec(
        "centauro",
        "centauro_description/urdf/centauro.urdf",
        base_link="pelvis",
        legs=("1", "2", "3", "4"),
        joints=("hip_yaw", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_yaw", "j_wheel"),
        joint_pattern="{joint}_{leg}",
        foot_pattern="wheel_{leg}",
        standing=(0.0,) * 6,
        foot_radius=0.078,
    ),
    _humanoid(
        "alexander",
        "alexander_description/urdf/alexander_v1.lowerBodyOnly.urdf",
        "HIP_X HIP_Z HIP_Y KNEE_Y ANKLE_Y ANKLE_X",
        "{leg}_{joint}",
        "{leg}_ANKLE_X",
        legs=("LEFT", "RIGHT"),
        base="PELVIS_LINK",
    ),
    *(
        _humanoid(
            f"g1{hands}",
            f"g1_description/urdf/g1_29dof{hands}_rev_1_0.urdf",
            _LEG,
            "{leg}_{joint}_joint",
            "{leg}_ankle_roll_link",
            base="pelvis",
        )
        for hands in ("", "_with_hand")
    ),
    *(
        _humanoid(
            name,
            f"simple_humanoid_description/urdf/{name}.urdf",
            joints,
            "{leg}LEG_{joint}",
            "{leg}LEG_ANKLE_R",
            legs=("L", "R"),
        )
        for name, joints in (
            ("simple_humanoid", "HIP_R HIP_P HIP_Y KNEE ANKLE_P ANKLE_R"),
            ("simple_humanoid_classical", "HIP_Y HIP_R HIP_P KNEE ANKLE_P ANKLE_R"),
        )
    ),
    *(
        _humanoid(
            f"talos_{kind}",
            f"talos_data/robots/talos_{kind}.urdf",
            "1 2 3 4 5 6",
            "leg_{leg}_{joint}_joint",
            "leg_{leg}_6_link",
        )
        for kind in ("full_v2", "full_v2_box", "reduced", "reduced_box", "reduced_corrected")
    ),
    _humanoid(
        "human",
        "human_description/robots/human.urdf",
        "hip_Z hip_X hip_Y knee_Z ankle_Z ankle_X",
        "{leg}_{joint}",
        "{leg}_foot",
        base="middle_pelvis",
    ),
    *(
        _humanoid(
            name,
            f"icub_description/robots/{name}.urdf",
            _LEG,
            "{leg}_{joint}",
            "{leg}_sole",
            legs=("l", "r"),
        )
        for name in ("icub", "icub_reduced")
    ),
    *(
        _humanoid(
            name,
            f"romeo_description/urdf/{name}.urdf",
            _ROMEO,
            "{leg}{joint}" + end,
            "{leg}AnkleRoll" + end,
            legs=("L", "R"),
        )
        for name, end in (("romeo", ""), ("romeo_small", ""), ("romeo_laas_small", "_joint"))
    ),
]

_NO_BODY = "its mass and inertia are none that a body can have"

REFUSED = {
    "human": "mass and inertia of moving bodies .*left_upperleg_virtual",
    "icub": f"link head: {_NO_BODY}",
    "icub_reduced": f"link l_wrist_1: {_NO_BODY}",
    "romeo": "joint LFinger12: it mimics another joint",
    "romeo_small": f"link RShoulderYawLink: {_NO_BODY}",
    "romeo_laas_small": f"link LShoulderYaw_link: {_NO_BODY}",
    "talos_full_v2": "joint gripper_left_inner_double_joint: it mimics another joint",
    "talos_full_v2_box": "joint gripper_left_inner_double_joint: it mimics another joint",
}
"""What cannot be simulated, and why."""

OTHER_FEET = {
    "centauro": "would not stand on the sphere of foot wheel_1 alone",
    "g1": "would not stand on the sphere of foot left_ankle_roll_link alone",
    "g1_with_hand": "would not stand on the sphere of foot left_ankle_roll_link alone",
    "talos_reduced_box": "would not stand on the sphere of foot leg_left_6_link alone",
}
"""What stands on wheels, boxes, or several spheres a foot."""

SIMULATED = [spec for spec in LEGGED if spec.name not in REFUSED]


@pytest.mark.parametrize("spec", SIMULATED, ids=lambda spec: spec.name)
def test_what_is_simulated_is_what_pinocchio_reads(spec: RobotSpec) -> None:
    robot = load_robot(spec)
    bodies = mujoco_spec(robot)
    for index, name in enumerate((spec.base_link, *robot.joint_names), start=1):
        body = bodies.body(name) if index == 1 else bodies.joint(name).parent
        wanted = robot.model.inertias[index].toDynamicParameters()
        largest = np.abs(wanted).max()
        np.testing.assert_allclose(
            body_inertia(body).toDynamicParameters(), wanted, rtol=0, atol=1e-12 * largest
        )
    parity = compare_models(robot, bodies.compile(), states=5)
    different = {row.what for row in parity.differences}
    assert different <= ({"foot centre", "foot radius"} if spec.name in OTHER_FEET else set())
    for value in (parity.mass_matrix, parity.bias, parity.jacobian):
        assert value is not None
        assert value < 1e-12


@pytest.mark.parametrize("spec", SIMULATED, ids=lambda spec: spec.name)
def test_it_stands_on_its_feet(spec: RobotSpec) -> None:
    robot = load_robot(spec)
    if spec.name in OTHER_FEET:
        with pytest.raises(InvalidInput, match=OTHER_FEET[spec.name]):
            build_model(robot, load_scenario("ideal"))
        return
    model = build_model(robot, load_scenario("ideal"), base="free")
    assert model.body_mass.sum() == pytest.approx(robot.mass, rel=1e-12)
    data = mujoco.MjData(model)
    data.qpos[2] = robot.standing[2]
    for name, angle in zip(robot.joint_names, robot.standing[7:], strict=True):
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_kinematics(model, data)
    heights = [data.geom(foot).xpos[2] - model.geom(foot).size[0] for foot in robot.foot_names]
    np.testing.assert_allclose(heights, 0.0, atol=1e-9)
    np.testing.assert_allclose(foot_positions(robot, robot.standing)[:, 2], robot.foot_radius)


@pytest.mark.parametrize("spec", SIMULATED, ids=lambda spec: spec.name)
def test_what_is_written_is_the_same_robot(spec: RobotSpec, tmp_path: Path) -> None:
    robot = load_robot(spec)
    parity = mjcf_parity(robot, write_mjcf(robot, tmp_path / "robot.xml"))
    assert parity.mass_matrix is not None
    assert parity.mass_matrix < SIX_DIGITS
    urdf = write_urdf(robot, tmp_path / "robot.urdf")
    own = load_robot(replace(spec, urdf=str(urdf)))
    assert own.model.inertias.tolist() == robot.model.inertias.tolist()
    np.testing.assert_array_equal(own.standing, robot.standing)


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_simulated_is_refused_with_its_reason(name: str) -> None:
    spec = next(spec for spec in LEGGED if spec.name == name)
    with pytest.raises(FileProblem, match=REFUSED[name]):
        build_model(load_robot(spec), load_scenario("ideal"))


_BOX = """
  <link name="box">
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>{inertial}
  </link>
  <joint name="box_joint" type="fixed"><parent link="{parent}"/><child link="box"/></joint>
</robot>"""


@pytest.mark.parametrize("parent", ["trunk", "FL_calf"])
@pytest.mark.parametrize("mass", [0.0, 1e-3])
def test_geometry_has_no_mass(robot: Robot, tmp_path: Path, parent: str, mass: float) -> None:
    """MuJoCo's own reader takes the box for one of water, 1 kg."""
    moments = "ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'"
    inertial = f"<inertial><mass value='{mass}'/><inertia {moments}/></inertial>" if mass else ""
    path = tmp_path / "box.urdf"
    end = _BOX.format(parent=parent, inertial=inertial)
    path.write_text(robot.urdf.decode().replace("</robot>", end))
    own = load_robot(RobotSpec("box", str(path)))
    assert own.mass == pytest.approx(robot.mass + mass, rel=1e-12)
    model = build_model(own, load_scenario("ideal"), base="free")
    assert model.body_mass.sum() == pytest.approx(own.mass, rel=1e-12)
    parity = compare_models(own, mujoco_spec(own).compile(), states=5)
    assert parity.agrees, parity.table()
