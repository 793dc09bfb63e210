"""What is scaled from the A1, beside what a specification gives."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.control import ControllerSpec, Gains
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import gait_problem
from pronk_pin.robot import (
    ROBOTS,
    RobotSpec,
    feedback_gains,
    length_scale,
    load_robot,
    motor_constants,
    scaled_length,
    size,
)


def twice_as_large(tmp_path: Path) -> str:
    """The A1's URDF with all lengths doubled, eight times the mass and 32 times the inertia."""
    root = ElementTree.fromstring(load_robot().urdf)
    for element in root.iter():
        factor = {"mass": 8.0, "inertia": 32.0}.get(element.tag, 2.0)
        for key, value in element.items():
            if key in ("xyz", "radius", "length", "size") or element.tag in ("mass", "inertia"):
                numbers = [repr(factor * float(word)) for word in value.split()]
                element.set(key, " ".join(numbers))
    path = tmp_path / "large.urdf"
    path.write_text(ElementTree.tostring(root, encoding="unicode"))
    return str(path)


def test_a_robot_of_twice_the_size_has_gains_motors_and_gaits_to_match(tmp_path: Path) -> None:
    small, large = load_robot(), load_robot(RobotSpec("large", twice_as_large(tmp_path)))
    own, its = size(large), size(small)
    np.testing.assert_allclose(np.divide(own, its), [8.0, 2.0, 2.0])
    kp, kd = feedback_gains(large)
    np.testing.assert_allclose(kp, np.multiply(16.0, (35.0, 60.0, 90.0)), rtol=5e-3)
    np.testing.assert_allclose(kd, 8.0 * 2.0**1.5 * np.array([1.0, 6.0, 2.0]), rtol=5e-3)
    motors = motor_constants(large)
    np.testing.assert_allclose(motors.rotors, np.multiply(32.0, small.spec.rotors), rtol=5e-3)
    np.testing.assert_allclose(motors.coulomb, 16.0 * 0.2, rtol=5e-3)
    problem, beside = gait_problem(large, 0.3), gait_problem(small, 0.3)
    assert (problem.apex, problem.clearance) == (2 * beside.apex, 2 * beside.clearance)
    assert problem.stride[0] == pytest.approx(2.0**0.5 * beside.stride[0], abs=1e-3)
    assert problem.torque_weight == pytest.approx(beside.torque_weight / 16.0**2, rel=1e-2)


def test_robots_of_the_a1s_size_have_its_gains_and_its_gaits() -> None:
    for name in ("a1", "go1", "go2"):
        robot = load_robot(name)
        assert Gains.of(robot) == Gains()
        assert length_scale(robot) == 1.0
        assert gait_problem(robot, 0.0).options() == gait_problem(load_robot(), 0.0).options()


def test_what_a_specification_gives_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\nurdf = "a1_description/urdf/a1.urdf"\nkp = [1.0, 2.0, 3.0]\n'
        "kd = [0.1, 0.2, 0.3]\napex = 0.31\nrotors = [0.001, 0.002, 0.003]\n"
        "torque_limits = [5.0, 6.0, 7.0]\nvelocity_limits = [8.0, 9.0, 10.0]\n"
    )
    robot = load_robot(path)
    gains = ControllerSpec("stiff", stiffness=4.0).gains_of(robot)
    assert gains == Gains((4.0, 8.0, 12.0), (0.2, 0.4, 0.6))
    assert ControllerSpec("own", gains=Gains()).gains_of(robot) == Gains()
    assert scaled_length(robot, 0.34) == 0.31
    assert motor_constants(robot).rotors == (0.001, 0.002, 0.003)
    np.testing.assert_array_equal(robot.tau_max, [5.0, 6.0, 7.0] * 4)
    np.testing.assert_array_equal(robot.v_max, [8.0, 9.0, 10.0] * 4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"kp": (35.0, 60.0)}, "kp has 2 values; give 3, one for each joint of a leg, or none"),
        ({"kd": (1.0, -6.0, 2.0)}, r"kd\[1\]=-6.0"),
        ({"apex": 0.0}, r"apex=0\.0"),
        ({"kp": (0.0, 60.0, 90.0)}, r"kp\[0\]=0\.0"),
        ({"legs": ()}, "legs must name at least one, and none of them twice"),
        ({"legs": ("FL", "FL")}, "legs must name at least one, and none of them twice"),
        ({"torque_limits": (0.0, 1.0, 1.0)}, r"torque_limits\[0\]=0\.0"),
    ],
)
def test_wrong_numbers_are_refused_with_what_is_wanted(
    changes: dict[str, object], message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        replace(ROBOTS["a1"], **changes)  # type: ignore[arg-type]


def test_an_apex_at_which_the_robot_stands_is_refused_with_one_that_will_do() -> None:
    with pytest.raises(InvalidInput, match=r"the b1 stands at 0\.475 m already; give more, as 0.6"):
        gait_problem(load_robot("b1"), 0.0, apex=0.34)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"standing": (0.0, 52.0, -103.0)},  # degrees
            "a1 cannot stand with FL_thigh_joint at 52 rad: its limits are -1.0472 and 4.18879 rad",
        ),
        ({"standing": (0.0, 3.5, -1.0)}, "stands with its trunk at -0.328 m, below its feet"),
        ({"apex": 0.2}, "a1 stands at 0.269 m already; give more, and correct the apex of its"),
    ],
)
def test_a_specification_that_nothing_can_stand_by_is_refused_before_the_solver(
    changes: dict[str, object], message: str
) -> None:
    robot = load_robot(replace(ROBOTS["a1"], **changes))  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match=message):
        gait_problem(robot, 0.0)
