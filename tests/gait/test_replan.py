"""Gaits planned again for a robot with rotors."""

import numpy as np
import pytest

from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library, replan
from pronk_pin.robot import load_robot, with_rotors


def test_gaits_are_planned_with_the_rotors_and_without_they_are_the_shipped_ones() -> None:
    """Speeds and heights stay; with rotors the equations hold for the robot that has them only."""
    robot, library = load_robot("a1"), load_library("a1")
    gaits = [library.at(speed) for speed in (0.3,)]
    again, same = replan(with_rotors(robot), gaits), replan(robot, gaits)
    s = np.linspace(0.0, 1.0, 41)
    for gait, planned, unchanged in zip(gaits, again, same, strict=True):
        assert (planned.speed, planned.apex) == pytest.approx((gait.speed, gait.apex))
        joints = gait.stance.joint_reference(s)[0]
        np.testing.assert_allclose(unchanged.stance.joint_reference(s)[0], joints, atol=2e-3)
        assert np.abs(planned.stance.joint_reference(s)[0] - joints).max() > 5e-3


def test_the_rotors_are_those_of_the_datasheet() -> None:
    assert with_rotors(load_robot("a1")).parameters.armature == (0.000111842 * 9.0**2,) * 3
    with pytest.raises(InvalidInput, match="rotors of solo12 are not known"):
        with_rotors(load_robot("solo12"))
