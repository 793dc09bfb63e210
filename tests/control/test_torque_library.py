from __future__ import annotations

import numpy as np
import pytest

from pronk_pin.control import SAMPLES, TorqueLibrary
from pronk_pin.errors import InvalidInput, SpeedOutOfRange

SPEEDS = np.array([-0.1, 0.0, 0.3])


@pytest.fixture
def learned() -> TorqueLibrary:
    torque = np.random.default_rng(0).normal(size=(3, 2, SAMPLES, 12))
    return TorqueLibrary(SPEEDS, torque, np.zeros_like(torque))


def test_practised_speeds_get_what_was_learned_there(learned: TorqueLibrary) -> None:
    np.testing.assert_array_equal(learned.at(SPEEDS), learned.torque)


def test_speeds_between_get_a_mixture_of_their_neighbours(learned: TorqueLibrary) -> None:
    expected = 2.0 / 3.0 * learned.torque[1] + 1.0 / 3.0 * learned.torque[2]
    np.testing.assert_allclose(learned.at(np.array([0.1]))[0], expected)


def test_a_speed_that_was_not_practised_is_refused(learned: TorqueLibrary) -> None:
    with pytest.raises(SpeedOutOfRange) as caught:
        learned.at(np.array([0.0, 0.31]))
    assert (caught.value.speed, caught.value.lowest, caught.value.highest) == (0.31, -0.1, 0.3)


def test_strides_are_averaged_and_missing_ones_left_out() -> None:
    torque = np.zeros((2, 3, 2, SAMPLES, 12))
    torque[:, 0], torque[:, 1], torque[:, 2] = 1.0, 3.0, 5.0
    torque[1, 2] = np.nan
    library = TorqueLibrary.from_strides(np.array([0.0, 0.1]), torque)
    np.testing.assert_allclose(library.torque[:, 1, 0, 0], [3.0, 2.0])
    np.testing.assert_allclose(library.spread[:, 1, 0, 0], [np.std([1.0, 3.0, 5.0]), 1.0])


def test_speeds_must_increase() -> None:
    torque = np.zeros((2, 2, SAMPLES, 12))
    with pytest.raises(InvalidInput, match="must increase"):
        TorqueLibrary(np.array([0.1, 0.1]), torque, torque)


def test_every_speed_needs_a_torque() -> None:
    torque = np.zeros((2, 2, SAMPLES, 12))
    with pytest.raises(InvalidInput, match="one torque and one spread for each speed"):
        TorqueLibrary(SPEEDS, torque, torque)
