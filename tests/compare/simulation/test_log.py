"""The logs, filled by hand: of two robots, whose trunks move along straight lines."""

from __future__ import annotations

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare.simulation.log import StrideLog, TickLog
from pronk_pin.compare.simulation.quantities import LAST, SAMPLES
from pronk_pin.compare.world import Motion
from pronk_pin.control import SAMPLES as CONTROL_SAMPLES
from pronk_pin.control import Gains, StrideRecord, Tape, phase_grid
from pronk_pin.gait import Gait
from pronk_pin.robot import load_robot

DT = 0.001
SHAPE = (1, CONTROL_SAMPLES, 12)
ROW = np.array([1])
YES = np.array([True])
STANCE, FLIGHT = 160, 201


def ticks(length: int, z: Array, *, joint: float = 0.0) -> TickLog:
    """A phase of the second robot that moves 1 mm along x in a tick; nothing behind its end."""
    log = TickLog(2, 400, load_robot())
    log.base[1], log.joints[1] = 99.0, 99.0  # what lies behind the end must not be read
    log.base[1, :length, 0], log.base[1, :length, 1] = 1e-3 * np.arange(length), z
    log.joints[1, :length], log.feedforward[1], log.feedback[1] = joint, 3.0, 2.0
    return log


def length(of: int) -> Array:
    return np.array([of])


def stride(log: StrideLog, k: int = 0, *, left: float = 9.0) -> None:
    """One stride of the second robot: 0.361 s, and the trunk where the test says."""
    error = np.zeros(SHAPE)
    error[0, :, 5] = 0.1 * np.sin(2.0 * np.pi * phase_grid())
    record = StrideRecord.of(error, 0.0 * error, 2.0 * error, 3.0 * error)
    log.begin(ROW, np.array([1.0]), YES, remaining=np.array([left]))
    down = ticks(STANCE, np.full(STANCE, 0.3), joint=float(k))
    log.stance(ROW, record, down, length(STANCE))
    height = 0.34 - 0.1 * np.linspace(-1.0, 1.0, FLIGHT) ** 2
    flight = StrideRecord.of(0.5 * error, error, 2.0 * error, 3.0 * error)
    log.flight(ROW, flight, ticks(FLIGHT, height, joint=k + 0.5), length(FLIGHT))
    log.end(
        ROW,
        np.array([0.4]),
        np.array([0.2]),
        YES,
        np.array([3]),
        tilt=0.1,
        heading=0.2,
        flight_reference=0.21,
    )


@pytest.fixture
def log(gaits: list[Gait]) -> StrideLog:
    log = StrideLog(gaits, duration=10.0, timestep=DT)
    stride(log)
    return log


def test_a_stride_goes_from_touchdown_to_touchdown(log: StrideLog) -> None:
    expected = {
        "start": 1.0,
        "duration": 0.4,
        "stance": 0.16,
        "mean_speed": 0.5,
        "apex": 0.34,
        "upright": 1.0,
        "learning": 1.0,
        "skipped": 3.0,
        "tilt": 0.1,
        "heading": 0.2,
        "flight_reference": 0.21,
    }
    assert {name: log[name][1, 0] for name in expected} == pytest.approx(expected)


def test_the_felt_peak_is_that_of_the_record_and_the_peak_that_of_the_ticks(
    log: StrideLog, gaits: list[Gait]
) -> None:
    assert log["felt_peak_error"][1, 0, 5] == pytest.approx(0.1, rel=1e-3)
    assert np.all(np.delete(log["felt_peak_error"][1, 0], 5) == 0.0)
    s = np.minimum(np.arange(STANCE) * DT / gaits[1].stance.duration, 1.0)
    reference = gaits[1].stance.joint_reference(s)[0]  # every joint stood at 0
    np.testing.assert_allclose(log["peak_error"][1, 0], np.abs(reference).max(axis=0), rtol=1e-3)
    rms = np.sqrt(np.mean(reference**2, axis=0))
    np.testing.assert_allclose(log["rms_error"][1, 0], rms, rtol=1e-3, atol=1e-9)


def test_curves_of_both_parts_are_kept_on_the_coarser_grid(log: StrideLog) -> None:
    sine = 0.1 * np.sin(2.0 * np.pi * phase_grid(SAMPLES))
    for name, scale in (("error", 1.0), ("feedback", 2.0), ("feedforward", 3.0)):
        np.testing.assert_allclose(log[name][1, 0, 0, :, 5], scale * sine, atol=1e-6)
    np.testing.assert_allclose(log["error"][1, 0, 1, :, 5], 0.5 * sine, atol=1e-6)


def test_the_trunks_path_is_kept_at_the_phases_of_the_reference(log: StrideLog) -> None:
    s = phase_grid(SAMPLES)
    np.testing.assert_allclose(log["base"][1, 0, 1, :, 0], 0.2 * s, atol=1e-6)
    np.testing.assert_allclose(log["base"][1, 0, 0, :, 0], np.minimum(0.16 * s, 0.159), atol=1e-6)


def test_the_other_robot_has_no_stride_yet(log: StrideLog) -> None:
    assert log.count.tolist() == [0, 1]
    assert np.isnan(log["duration"][0]).all()
    assert np.isnan(log["error"][0]).all()


def test_a_full_log_keeps_its_size(gaits: list[Gait]) -> None:
    log = StrideLog(gaits, duration=0.5, timestep=DT)
    for k in range(20):
        stride(log, k)
    assert log.count[1] == log["start"].shape[1] - 1


def test_near_the_end_the_last_strides_are_kept_tick_by_tick(gaits: list[Gait]) -> None:
    log = StrideLog(gaits, duration=10.0, timestep=DT)
    for k in range(LAST + 5):
        stride(log, k, left=0.4 * (LAST + 4 - k))
    kept = log.ticks()
    last = np.arange(5.0, LAST + 5.0)
    np.testing.assert_array_equal(kept["tick_joints"][1, :, 0, 0, 3], last)
    np.testing.assert_array_equal(kept["tick_joints"][1, :, 1, FLIGHT - 1, 3], last + 0.5)
    assert kept["tick_joints"].shape[3] == FLIGHT
    assert np.isnan(kept["tick_joints"][1, :, 0, STANCE:]).all()
    np.testing.assert_allclose(kept["tick_torque"][1, :, 1], 5.0)
    assert np.isnan(kept["tick_joints"][0]).all()


def test_far_from_the_end_no_ticks_are_kept(log: StrideLog) -> None:
    assert np.isnan(log.ticks()["tick_joints"]).all()


def test_a_tick_log_holds_the_motion_and_what_the_tape_asked_for() -> None:
    log, rows, rng = TickLog(3, 50, load_robot()), np.array([0, 2]), np.random.default_rng(0)
    states = rng.normal(size=(2, 20, 28))
    force, finite = rng.normal(size=(2, 20, 4, 3)), np.ones((2, 20), dtype=bool)
    joints, rates = states[..., :12], states[..., 12:24]
    pose, twist = rng.normal(size=(2, 20, 7)), rng.normal(size=(2, 20, 6))
    base, base_rate = states[..., 24:26], states[..., 26:]
    motion = Motion(base, base_rate, joints, rates, force, finite, None, pose, twist)
    reference, feedforward = rng.normal(size=(2, 2, 25, 12))
    tape = Tape(feedforward, reference, 0.0 * reference, np.full(2, 25), begin=5)
    limit, gains = np.full(12, 20.0), Gains()

    log.write(rows, 5, motion)
    log.torques(rows, tape, gains, limit, 25)
    phase = log.phase(rows, np.array([25, 24]), sensed=5)

    np.testing.assert_array_equal(phase.joints[:, 5:], joints)
    np.testing.assert_array_equal(log.force[rows, 5:25], force)
    np.testing.assert_array_equal(log.pose[rows, 5:25], pose)
    np.testing.assert_array_equal(phase.twist[:, 5:], twist)
    asked = feedforward[:, 5:] + gains.proportional(12) * (reference[:, 5:] - joints)
    asked -= gains.derivative(12) * rates
    np.testing.assert_allclose((phase.feedback + phase.feedforward)[:, 5:], asked)
    given = phase.feedback + phase.feedforward + phase.missing
    np.testing.assert_allclose(given[:, 5:], np.clip(asked, -20.0, 20.0), atol=1e-12)
    assert not log.joints[1].any()
    assert not phase.joints[:, :5].any()


def test_the_last_ticks_of_a_phase_become_the_first_of_the_next() -> None:
    log, rows = TickLog(2, 50, load_robot()), np.arange(2)
    log.joints[:] = np.arange(50.0)[:, None]
    log.rewind(rows, np.array([30, 41]), 2)
    np.testing.assert_array_equal(log.joints[:, :2, 0], [[30.0, 31.0], [41.0, 42.0]])


def test_robots_whose_parts_last_differently_are_logged_each_to_its_own_end(
    gaits: list[Gait],
) -> None:
    """Both at once: what lies behind the end of the shorter part is none of it."""
    log, both = StrideLog(gaits, duration=10.0, timestep=DT), np.arange(2)
    lengths = {"stance": np.array([150, 120]), "flight": np.array([200, 170])}
    record = StrideRecord.of(*np.zeros((4, 2, CONTROL_SAMPLES, 12)))
    log.begin(both, np.ones(2), np.array([True, True]), remaining=np.array([9.0, 0.1]))
    for part, ends in lengths.items():
        made = TickLog(2, 400, load_robot(), turns=False)
        t = np.arange(400.0)
        made.base[..., 0] = 1e-3 * t
        for row, end in enumerate(ends):
            # It rises until the part ends, and beyond that still.
            made.base[row, :, 1], made.joints[row] = 0.3 + 1e-4 * (row + 1) * t, 0.01 * row
            made.joints[row, end:] = 7.0
        (log.stance if part == "stance" else log.flight)(both, record, made, ends)
    log.end(both, np.array([0.4, 0.3]), np.array([0.2, 0.3]), np.ones(2, bool), np.zeros(2))
    last = lengths["flight"] - 1
    np.testing.assert_allclose(log["apex"][:, 0], 0.3 + 1e-4 * np.array([1, 2]) * last)
    np.testing.assert_allclose(log["stance"][:, 0], DT * lengths["stance"])
    np.testing.assert_allclose(log["mean_speed"][:, 0], [0.5, 1.0])
    for row, gait in enumerate(gaits):
        ticks = min(int(lengths["stance"][row]), round(gait.stance.duration / DT))
        s = np.arange(ticks) * DT / gait.stance.duration
        error = gait.stance.joint_reference(np.minimum(s, 1.0))[0] - 0.01 * row
        peak = np.abs(error).max(axis=0)
        np.testing.assert_allclose(log["peak_error"][row, 0], peak, rtol=1e-6)
        at_end = log["base"][row, 0, 1, -1]
        planned = min(gait.flight.duration / DT, last[row])
        np.testing.assert_allclose(at_end, [1e-3 * planned, 0.3 + 1e-4 * (row + 1) * planned])
    kept = log.ticks()["tick_joints"]
    assert np.isnan(kept[0]).all()  # far from the end of the simulation
    assert int(np.isfinite(kept[1, -1, 0, :, 0]).sum()) == 120
