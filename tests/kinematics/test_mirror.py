"""Left and right by where the legs are, whatever they are called."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pronk_pin import Robot, RobotSpec, load_robot
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import build_library, gait_problem
from pronk_pin.kinematics import foot_positions, mirror, mirrored
from pronk_pin.robot import ROBOTS

PAIRS = {
    "a1": (("FL", "FR"), ("RL", "RR")),
    "solo12": (("FL", "FR"), ("HL", "HR")),
    "anymal_c": (("LF", "RF"), ("LH", "RH")),
    "hyq": (("lf", "rf"), ("lh", "rh")),
    "bolt": (("FL", "FR"),),
}


@pytest.mark.parametrize("name", PAIRS)
def test_pairs_come_from_the_front_to_the_rear_left_before_right(name: str) -> None:
    robot = load_robot(name)
    assert tuple((robot.legs[i], robot.legs[j]) for i, j in mirror(robot).pairs) == PAIRS[name]


@pytest.mark.parametrize("name", ROBOTS)
def test_mirrored_joints_put_the_feet_to_the_mirror_images_of_their_places(name: str) -> None:
    robot = load_robot(name)
    rng = np.random.default_rng(0)
    q = np.tile(robot.standing, (50, 1))
    q[:, :3] = 0.0
    q[:, 7:] += 0.3 * rng.standard_normal((50, robot.nu))
    image = q.copy()
    image[:, 7:] = mirrored(robot, q[:, 7:])
    wanted = foot_positions(robot, q)[:, mirror(robot).partner] * [1.0, -1.0, 1.0]
    # Some URDFs' left and right differ by tenths of a millimetre.
    np.testing.assert_allclose(foot_positions(robot, image), wanted, atol=1e-3)
    np.testing.assert_array_equal(mirrored(robot, mirrored(robot, q[:, 7:])), q[:, 7:])


def test_legs_without_a_mirror_image_are_refused_before_any_gait_is_sought(
    robot: Robot, tmp_path: Path
) -> None:
    urdf = robot.urdf.decode().replace('xyz="0.1805 -0.047 0"', 'xyz="0.05 -0.047 0"')
    assert urdf != robot.urdf.decode()
    path = tmp_path / "lame.urdf"
    path.write_text(urdf)
    lame = load_robot(RobotSpec("lame", str(path)))
    with pytest.raises(InvalidInput, match=r"no leg is the mirror image of F[LR]"):
        gait_problem(lame, 0.0)


def test_a_biped_has_no_rear_legs_for_a_bound() -> None:
    biped = load_robot("bolt")
    assert [phase.stands for phase in gait_problem(biped, 0.0).sequence] == [("front",), ()]
    with pytest.raises(InvalidInput, match=r"bolt has no rear legs, which rear stance needs"):
        gait_problem(biped, 0.0, gait="bound")


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            RobotSpec(
                "solo8",
                "solo_description/robots/solo.urdf",
                base_link="base_link",
                legs=("FL", "FR", "HL", "HR"),
                joints=("HFE", "KFE"),
                joint_pattern="{leg}_{joint}",
                foot_pattern="{leg}_FOOT",
                standing=(0.9, -1.8),
                foot_radius=0.016,
            ),
            "solo8: closed-form leg kinematics needs legs of three joints and no others, not FL",
        ),
        (
            RobotSpec(
                "arm",
                "anymal_b_simple_description/robots/anymal-kinova.urdf",
                base_link="base",
                legs=("LF", "LH", "RF", "RH"),
                joints=("HAA", "HFE", "KFE"),
                joint_pattern="{leg}_{joint}",
                foot_pattern="{leg}_FOOT",
                standing=(0.0, 0.9, -1.8, 0.0, -0.9, 1.8) * 2,
            ),
            "arm: closed-form leg kinematics needs legs of three joints and no others, not LF_HAA"
            ".*; make those of no leg fixed in the URDF: j2s6s200_joint_1, j2s6s200_joint_2",
        ),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_robots_that_no_gait_can_be_made_for_hear_why_before_the_solver_is_called(
    spec: RobotSpec, message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        gait_problem(load_robot(spec), 0.0)
    with pytest.raises(InvalidInput, match=message):
        build_library(load_robot(spec), (0.0,))
