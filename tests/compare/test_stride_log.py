"""The log of strides, filled by hand: two robots whose trunks move along straight lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare.record import SAMPLES, StrideLog
from pronk_pin.control import SAMPLES as CONTROL_SAMPLES
from pronk_pin.control import PhaseLog, StrideRecord, phase_grid
from pronk_pin.gait import Gait

DT = 0.001
SHAPE = (1, CONTROL_SAMPLES, 12)
ROW = np.array([1])
CONTACT = np.full((1, 12), 0.04)


def phase(ticks: int, *, felt: int = 0) -> PhaseLog:
    joints = np.repeat(np.arange(ticks + 10.0)[None, :, None], 12, axis=2)
    return PhaseLog(joints, joints, joints, joints, 0.0 * joints, np.array([ticks]), felt)


def trunk(ticks: int, z: Array) -> Array:
    path = np.full((1, ticks + 10, 2), 99.0)  # what lies behind the end must not be read
    path[0, :ticks, 0], path[0, :ticks, 1] = np.arange(ticks), z
    return path


@pytest.fixture
def log(gaits: list[Gait]) -> StrideLog:
    """One stride of the second robot: 0.4 s and 0.2 m long."""
    log = StrideLog(gaits, duration=10.0, timestep=DT)
    error = np.zeros(SHAPE)
    error[0, :, 5] = 0.1 * np.sin(2.0 * np.pi * phase_grid())
    record = replace(
        StrideRecord.of(error, 0.0 * error, 2.0 * error, 3.0 * error), contact_error=CONTACT
    )
    log.open(ROW, 1.0, np.array([0.7]), learning=True)
    log.stance(ROW, record, phase(160, felt=2), trunk(160, np.full(160, 0.3)))
    height = 0.34 - 0.1 * np.linspace(-1.0, 1.0, 201) ** 2
    log.flight(ROW, phase(201), trunk(201, height))
    assert log.close(ROW, 1.4, np.array([0.9]), np.array([True])) == pytest.approx(0.4)
    log.judge(ROW, np.array([3]))
    return log


def test_a_stride_goes_from_touchdown_to_touchdown(log: StrideLog) -> None:
    stride = {name: values[1, 0] for name, values in log.scalars.items()}
    assert stride == pytest.approx(
        {
            "start": 1.0,
            "duration": 0.4,
            "stance": 0.16,
            "speed": 0.5,
            "apex": 0.34,
            "upright": 1.0,
            "learning": 1.0,
            "skipped": 3.0,
        }
    )


def test_the_errors_of_a_sine_are_its_amplitude_and_that_over_root_two(log: StrideLog) -> None:
    assert log.peak_error[1, 0, 5] == pytest.approx(0.1, rel=1e-3)
    assert log.rms_error[1, 0, 5] == pytest.approx(0.1 / np.sqrt(2.0), rel=1e-2)
    assert np.all(np.delete(log.peak_error[1, 0], 5) == 0.0)


def test_the_contact_error_is_the_larger_of_before_and_after_it_was_felt(log: StrideLog) -> None:
    assert log.contact_error[1, 0, 5] == log.peak_error[1, 0, 5]
    assert np.all(np.delete(log.contact_error[1, 0], 5) == 0.04)


def test_curves_are_kept_on_the_coarser_grid(log: StrideLog) -> None:
    sine = 0.1 * np.sin(2.0 * np.pi * phase_grid(SAMPLES))
    for name, scale in (("error", 1.0), ("feedback", 2.0), ("feedforward", 3.0)):
        np.testing.assert_allclose(log.curves[name][1, 0, :, 5], scale * sine, atol=1e-6)
    np.testing.assert_allclose(log.curves["flight"][1, 0, :, 0], np.linspace(0, 200, SAMPLES))


def test_the_trunks_path_is_kept_over_the_time_that_each_phase_lasted(log: StrideLog) -> None:
    np.testing.assert_allclose(log.base["flight"][1, 0, :, 0], np.linspace(0.0, 200.0, SAMPLES))
    np.testing.assert_allclose(log.base["stance"][1, 0, [0, -1], 0], [2.0, 159.0])


def test_the_other_robot_has_no_stride_yet(log: StrideLog) -> None:
    assert log.count.tolist() == [0, 1]
    assert np.isnan(log.scalars["duration"][0]).all()
    assert np.isnan(log.curves["error"][0]).all()


def test_a_full_log_keeps_its_size(gaits: list[Gait]) -> None:
    log = StrideLog(gaits, duration=0.5, timestep=DT)
    for k in range(20):
        log.open(ROW, float(k), np.zeros(1), learning=False)
        log.close(ROW, k + 1.0, np.zeros(1), np.array([True]))
    assert log.count[1] == log.scalars["start"].shape[1] - 1
