"""The door for tick controllers: what they see, what they may answer, and how often."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from pronk_pin import load_robot
from pronk_pin._typing import Array, IntArray
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import (
    CONTROLLERS,
    ControlContext,
    Controller,
    ControllerSpec,
    FlightTiming,
    Gains,
    Observation,
    PDTypeILC,
    SetPoints,
)
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import load_library

SCHEDULE = Schedule(startup=0.1, baseline=0.8, learning=1.2)
KP, KD = (np.tile(gains, 4) for gains in (Gains().kp, Gains().kd))


@dataclass(frozen=True)
class OwnPD:
    """The PD law of the paper."""

    def command(self, observation: Observation) -> Array:
        error = observation.position - observation.joints
        rate = observation.velocity - observation.joint_rates
        return observation.feedforward + (KP * error + KD * rate)


@dataclass(frozen=True)
class OwnServo:
    """The same, left to the motor drivers."""

    period: float = 0.0

    def command(self, observation: Observation) -> SetPoints:
        return SetPoints(
            observation.position, observation.velocity, observation.feedforward, KP, KD
        )


def play(spec: ControllerSpec, scenario: str = "nominal", base: str = "locked") -> Simulation:
    library = load_library("a1", base=None if base == "locked" else "sagittal")
    simulation = Simulation(
        load_robot("a1"),
        [library.at(speed) for speed in (-0.3, 0.4)],
        spec,
        load_scenario(scenario),
        schedule=SCHEDULE,
        rng=np.random.default_rng(1),
        base=base,
    )
    simulation.run()
    return simulation


@lru_cache
def ours(law: PDTypeILC | None, scenario: str) -> Any:
    """Strides of the package's own PD, with that law on top."""
    return play(ControllerSpec("ours", law=law), scenario).strides


@pytest.mark.parametrize("scenario", ["nominal", "delay", "noise"])
@pytest.mark.parametrize("own", [OwnPD(), OwnServo()])
def test_a_pd_of_ones_own_is_pd(own: OwnPD | OwnServo, scenario: str) -> None:
    """Peak errors of every stride, with learning on top: the same motion, but for round-off."""
    for law in (None, PDTypeILC()):
        mine = play(ControllerSpec("mine", law=law, tick_controller=own), scenario)
        for name, atol in (("peak_error", 1e-5), ("feedback", 1e-3), ("feedforward", 1e-3)):
            np.testing.assert_allclose(
                mine.strides[name], ours(law, scenario)[name], rtol=0, atol=atol, err_msg=name
            )


@dataclass
class Watcher:
    """Keeps what it is shown and asked."""

    period: float = 0.0
    seen: list[Observation] = field(default_factory=list)
    restarted: list[IntArray] = field(default_factory=list)

    def reset(self, rows: IntArray) -> None:
        self.restarted.append(rows)

    def command(self, observation: Observation) -> SetPoints:
        self.seen.append(observation)
        return SetPoints(observation.position, observation.velocity, 0.0, KP, KD)


def test_what_is_observed() -> None:
    watcher = Watcher()
    simulation = play(ControllerSpec("mine", tick_controller=watcher, timing=FlightTiming()))
    loop = simulation.controller.tick_loop
    assert loop is not None
    np.testing.assert_array_equal(watcher.restarted[0], [0, 1])
    assert len(watcher.restarted) == 1
    assert loop.time.ticks == sum(len(seen.rows) for seen in watcher.seen)
    assert loop.time.seconds > 0.0
    parts = {seen.part for seen in watcher.seen}
    assert parts == {None, 0, 1}
    for seen in watcher.seen:
        m = len(seen.rows)
        assert seen.joints.shape == seen.acceleration.shape == seen.previous.shape == (m, 12)
        assert seen.load.shape == (m, 4)
        assert seen.phase.shape == (m,)
        assert seen.trunk is None
    stance = [seen for seen in watcher.seen if seen.part == 0 and 60 <= seen.tick < 90]
    loads = np.concatenate([seen.load.sum(axis=1) for seen in stance])
    assert loads.mean() > load_robot("a1").mass * 9.81  # it pushes itself off
    # Accelerations are the references' second differences.
    by_tick = {seen.tick: seen for seen in watcher.seen if seen.part == 0 and 0 in seen.rows}
    rows = [np.flatnonzero(by_tick[tick].rows == 0)[0] for tick in (60, 62)]
    rates = [by_tick[tick].velocity[row] for tick, row in zip((60, 62), rows, strict=True)]
    middle = by_tick[61]
    row = np.flatnonzero(middle.rows == 0)[0]
    np.testing.assert_allclose(
        middle.acceleration[row], (rates[1] - rates[0]) / 0.002, rtol=1e-2, atol=0.3
    )


def test_a_slow_controller_is_asked_at_its_own_rate() -> None:
    """50 Hz: one question in twenty ticks, whatever the parts of the stride; set points hold."""
    watcher = Watcher(period=0.02)
    loop = play(ControllerSpec("mine", tick_controller=watcher)).controller.tick_loop
    assert loop is not None
    asked = np.bincount(np.concatenate([seen.rows for seen in watcher.seen]), minlength=2)
    assert loop.time.ticks / asked.sum() == pytest.approx(20, rel=0.02)
    fast = play(ControllerSpec("mine", tick_controller=OwnServo()))
    slow = play(ControllerSpec("mine", tick_controller=OwnServo(period=0.02)))
    last = [each.strides["peak_error"][:, 2].mean() for each in (fast, slow)]
    assert last[1] > 1.3 * last[0]  # set points that are up to 20 ms old


def test_trunks_that_may_turn_are_observed_and_left_to_the_tick_controller() -> None:
    watcher = Watcher()
    play(ControllerSpec("mine", tick_controller=watcher), base="free")
    trunks = [seen.trunk for seen in watcher.seen]
    assert all(trunk is not None and trunk.pose.shape[1] == 7 for trunk in trunks)
    assert max(float(np.abs(trunk.twist).max()) for trunk in trunks if trunk is not None) > 0.1


@dataclass(frozen=True)
class Answers:
    """Answers what it is told to."""

    answer: object
    period: float = 0.0

    def command(self, observation: Observation) -> Array:
        return self.answer  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("own", "words"),
    [
        (Answers(np.zeros(3)), r"answers ndarray of shape \(3,\); let it answer torques of shape"),
        (Answers(None), "answers NoneType"),
        (Answers(np.full((2, 12), np.nan)), "not finite at tick 0 of part None"),
        (Answers(SetPoints(np.zeros(5))), "do not broadcast to"),
        (Answers(np.zeros((2, 12)), period=0.0015), "period must be a whole number of time steps"),
        (Answers(np.zeros((2, 12)), period=-0.01), "period must be a whole number of time steps"),
    ],
)
def test_what_it_answers_is_checked_and_its_name_told(own: Answers, words: str) -> None:
    with pytest.raises(InvalidInput, match=words) as told:
        play(ControllerSpec("mine", tick_controller=own))
    assert "the tick controller Answers of controller 'mine'" in str(told.value)


class Bindable:
    """Is bound to nothing that commands."""

    def bind(self, context: ControlContext) -> object:
        assert context.robot.name == "a1"
        return object()


def test_what_is_no_tick_controller_is_refused() -> None:
    for wrong in (3, OwnPD, object()):
        with pytest.raises(InvalidInput, match="is no tick controller; give an object with"):
            ControllerSpec("mine", tick_controller=wrong)  # type: ignore[arg-type]
    gaits = [load_library("a1").at(0.3)]
    spec = ControllerSpec("mine", tick_controller=Bindable())  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match=r"has no command\(observation\); add it"):
        Controller(load_robot("a1"), gaits, spec, timestep=0.001)
    assert CONTROLLERS["pd"].tick_controller is None


def test_torques_are_clipped_to_the_limits() -> None:
    simulation = play(ControllerSpec("mine", tick_controller=Answers(np.full((2, 12), 1e4))))
    loop = simulation.controller.tick_loop
    assert loop is not None
    np.testing.assert_array_equal(loop.previous.max(axis=0), load_robot("a1").tau_max)
