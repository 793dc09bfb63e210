"""The Bezier form of a gait gives consistent whole-body motions."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait, GaitPhase, joint_references, load_library
from pronk_pin.robot import Robot


@pytest.fixture
def pitching(robot: Robot) -> Gait:
    """An arbitrary gait with pitch, which the shipped ones do not have."""
    rng = np.random.default_rng(0)

    def phase(name: str, feet: tuple[str, ...]) -> GaitPhase:
        joints, base, tau = (rng.normal(size=(n, 7)) for n in (12, 3, 12))
        return GaitPhase(name, feet, 0.2, joints, base, tau, rng.normal(size=(4, 3, 7)))

    return Gait(robot.name, 0.3, 0.34, (phase("stance", robot.legs), phase("flight", ())))


def test_velocity_and_acceleration_are_derivatives_of_the_motion(
    robot: Robot, pitching: Gait
) -> None:
    phase, h = pitching.stance, 1e-6
    s = np.array([0.3, 0.3 - h, 0.3 + h])
    motion = phase.motion(robot, s)
    step = 2 * h * phase.duration
    rate = pin.difference(robot.model, motion.q[1], motion.q[2]) / step
    np.testing.assert_allclose(motion.v[0], rate, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(
        motion.a[0], (motion.v[2] - motion.v[1]) / step, rtol=1e-6, atol=1e-4
    )
    np.testing.assert_allclose(motion.t, s * phase.duration)


def test_blend_is_linear_in_coefficients_and_durations(pitching: Gait) -> None:
    phases = tuple(
        GaitPhase(p.name, p.feet, 2 * p.duration, 2 * p.joints, 2 * p.base, 2 * p.tau, 2 * p.lam)
        for p in pitching.phases
    )
    double = Gait(pitching.robot, 0.6, 0.68, phases)
    middle = pitching.blend(double, 0.25)
    assert middle.duration == pytest.approx(1.25 * pitching.duration)
    assert (middle.speed, middle.apex) == pytest.approx((0.375, 0.425))
    np.testing.assert_allclose(middle.flight.joints, 1.25 * pitching.flight.joints)
    np.testing.assert_allclose(middle.stance.lam, 1.25 * pitching.stance.lam)


def test_a_phase_that_does_not_exist_is_named(pitching: Gait) -> None:
    with pytest.raises(InvalidInput, match="no phase 'trot'"):
        pitching.phase("trot")


def test_references_of_several_parts_are_those_of_each_to_the_bit() -> None:
    library, rng = load_library("a1"), np.random.default_rng(0)
    parts = [library.at(speed).flight for speed in rng.uniform(-0.5, 0.8, 5)]
    phases = [np.linspace(0.0, 1.0, count) for count in (7, 1, 200, 30, 2)]
    together = joint_references(parts, phases)
    for part, s, found in zip(parts, phases, together, strict=True):
        for mine, own in zip(found, part.joint_reference(s), strict=True):
            np.testing.assert_array_equal(mine, own)
