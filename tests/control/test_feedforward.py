from __future__ import annotations

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.compare.simulation.log import StrideLog
from pronk_pin.control import SAMPLES, load_controller
from pronk_pin.control.feedforward import model_feedforward
from pronk_pin.gait import Gait
from pronk_pin.robot import Robot


@pytest.fixture(scope="module")
def torque(robot: Robot, gaits: list[Gait]) -> Array:
    return model_feedforward(robot, gaits)


def test_the_models_torques_are_within_the_motors_limits(robot: Robot, torque: Array) -> None:
    assert torque.shape == (2, 2, SAMPLES, 12)
    assert np.all(np.abs(torque) < robot.tau_max)


def test_a_denser_grid_holds_the_same_torques(
    robot: Robot, gaits: list[Gait], torque: Array
) -> None:
    coarse = model_feedforward(robot, gaits, samples=(SAMPLES - 1) // 2 + 1)
    np.testing.assert_allclose(coarse, torque[:, :, ::2], atol=1e-5)


def test_where_the_model_is_right_its_torques_replace_the_feedback(
    robot: Robot, gaits: list[Gait], torque: Array
) -> None:
    def pronk(name: str, feedforward: Array | None) -> StrideLog:
        simulation = Simulation(
            robot,
            gaits,
            load_controller(name),
            load_scenario("ideal"),
            schedule=Schedule(baseline=3.0, learning=0.0, scatter=0.0),
            rng=np.random.default_rng(0),
            feedforward=feedforward,
        )
        return simulation.run()

    alone, helped = pronk("pd", None), pronk("model", torque)

    for joint in (1, 2):  # thigh, calf
        before, after = (log["rms_error"][:, 2:6, joint::3].mean() for log in (alone, helped))
        assert after < 0.25 * before
    assert alone["upright"][:, :6].all()
    assert helped["upright"][:, :6].all()
