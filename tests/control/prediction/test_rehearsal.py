"""The planar model's own strides, beside the linear ones along its orbit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.control import (
    PDTypeILC,
    PlanarStrides,
    StrideRecord,
    StrideSettings,
    lifted_model,
    phase_grid,
)
from pronk_pin.control.prediction.rehearsal import rehearse
from pronk_pin.dynamics import Rotors
from pronk_pin.gait import load_library
from pronk_pin.robot import Robot

LIBRARY = load_library("a1")
ROTORS = Rotors(armature=0.01, damping=0.1)
SETTINGS = StrideSettings(share=0.0)


@dataclass(frozen=True)
class Constant:
    """A law that always answers the same feedforward."""

    feedforward: Array

    def update(self, record: StrideRecord) -> Array:
        return self.feedforward[None]


def begin_of(strides: PlanarStrides) -> StrideRecord:
    """The model's own stride under feedback alone."""
    error, rate = (curve[None] for curve in strides.stance_errors(strides.orbit()[0]))
    gains = strides.settings.gains
    feedback = gains.proportional(12) * error + gains.derivative(12) * rate
    return StrideRecord.of(error, rate, feedback, np.zeros_like(error))


def test_without_learning_the_strides_of_the_model_repeat(robot: Robot) -> None:
    strides = PlanarStrides(robot, LIBRARY.at(0.3), SETTINGS, ROTORS)
    errors = rehearse(strides, PDTypeILC(gain=0.0), begin_of(strides), 4)
    np.testing.assert_allclose(errors, np.broadcast_to(errors[0], errors.shape), atol=1e-4)


def test_small_feedforwards_do_what_the_lifted_model_says(robot: Robot) -> None:
    """In the first stride, and through the touchdown in the second and third."""
    gait = LIBRARY.at(0.0)
    strides = PlanarStrides(robot, gait, SETTINGS, ROTORS)
    model = lifted_model(robot, gait, SETTINGS, rotors=ROTORS)
    begin = begin_of(strides)
    small = np.zeros(model.shape)
    small[:, 1::3] = 0.02 * np.sin(np.pi * phase_grid())[:, None]
    small[:, 2::3] = -0.02
    rehearsed = rehearse(strides, Constant(small), begin, 3) - begin.error
    state, linear = np.zeros((1, len(model.A))), []
    for feedforward in (np.zeros_like(small), small, small):
        state = model.land(feedforward[None], begin, state)
        linear.append(model.stride(small[None], begin, state).error[0] - begin.error[0])
    for found, expected in zip(rehearsed[1:], linear, strict=True):
        assert np.abs(found - expected).max() < 0.1 * np.abs(expected).max()


@pytest.mark.parametrize("share", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("speed", [0.0, 0.5, 0.8])
def test_with_rotors_the_model_settles_with_little_and_with_all_of_the_torque(
    robot: Robot, speed: float, share: float
) -> None:
    settings = SETTINGS._replace(share=share)
    stance, flight, _ = PlanarStrides(robot, LIBRARY.at(speed), settings, ROTORS).orbit()
    assert stance.standing[len(stance.standing) // 2]
    planned = LIBRARY.at(speed).flight.duration / settings.timestep
    assert abs(len(flight.torques) / planned - 1.0) < 0.1


def test_a_practice_that_the_model_does_not_survive_ends_in_nan(robot: Robot) -> None:
    strides = PlanarStrides(robot, LIBRARY.at(0.0), SETTINGS, ROTORS)
    begin = begin_of(strides)
    up = np.zeros((161, 12))
    up[:, 2::3] = -60.0
    errors = rehearse(strides, Constant(up), begin, 3)
    assert np.isfinite(errors[0]).all()
    assert np.isnan(errors[-1]).all()
