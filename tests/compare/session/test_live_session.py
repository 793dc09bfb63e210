"""Robots that are taught, loaded and pushed while they go do what mechanics says."""

from __future__ import annotations

import resource
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from pronk_pin.compare import Experiment, Results
from pronk_pin.compare.metrics import stride_table
from pronk_pin.compare.session import LiveSession, LiveStride, Moment, live_robot
from pronk_pin.compare.session.live_clock import LiveClock
from pronk_pin.control import TorqueLibrary
from pronk_pin.errors import InvalidInput, SpeedOutOfRange, UnknownName


def session(*controllers: str, speed: float = 0.5, scenario: str = "nominal") -> LiveSession:
    return LiveSession(Experiment(controllers=controllers, scenarios=(scenario,)), speed=speed)


def strides(live: LiveSession, count: int) -> list[LiveStride]:
    """Strides of the first robot."""
    return live.stride(count)[0]


def calf(done: list[LiveStride]) -> float:
    """Mean error of the last strides [rad]."""
    return float(np.mean([stride.calf for stride in done[-4:]]))


def test_the_speed_follows_the_command() -> None:
    live = session("model")
    strides(live, 4)
    for speed in (0.2, -0.3, 0.7):
        live.set_speed(speed)
        done = strides(live, 12)
        assert np.mean([stride.speed for stride in done[-4:]]) == pytest.approx(speed, abs=0.06)
        assert done[-1].commanded == pytest.approx(speed)
        assert done[-1].upright


def test_the_error_shrinks_once_it_learns_and_comes_back_when_it_forgets() -> None:
    live = session("ilc")
    before = strides(live, 8)
    assert {stride.learning for stride in before} == {False}
    assert calf(before) > 0.08
    live.set_learning(True)
    learned = strides(live, 15)
    assert calf(learned) < 0.3 * calf(before)
    assert learned[-1].feedback_share < 0.4 < 0.9 < before[-1].feedback_share
    live.set_learning(False)
    assert calf(strides(live, 8)) < 0.4 * calf(before), "what was learned is played on"
    live.forget()
    assert calf(strides(live, 8)) == pytest.approx(calf(before), rel=0.1)


def test_the_error_grows_with_a_payload_and_shrinks_again() -> None:
    live = session("ilc", speed=0.3)
    live.set_learning(True)
    learned = calf(strides(live, 25))
    live.set_mismatches({"payload": 4.0, "coulomb": 1.0})
    loaded = strides(live, 3)
    assert max(stride.calf for stride in loaded) > 1.8 * learned
    assert calf(strides(live, 25)) < 0.6 * max(stride.calf for stride in loaded)
    assert live.scenario.payload == 4.0
    live.set_mismatches({})
    assert live.scenario == live.base_scenario


def test_a_push_in_the_air_gives_the_robot_its_impulse() -> None:
    impulse, rates = np.array([6.0, 0.0, 2.0]), []

    def look(robot: int, moment: Moment) -> None:
        world = live.robots[0].simulation.world
        if len(done) == 2 and 0.23 < moment.time - done[-1].time < 0.31:
            rates.append(world.base_rate[0] + [0.0, 9.81 * moment.time])  # less the fall
            assert not moment.forces.any()
            if len(rates) == 1:
                live.push(impulse)

    done: list[LiveStride] = []
    live = LiveSession(Experiment(controllers=("pd",)), on_moment=look)
    for _ in range(3):
        done += strides(live, 1)
    gained = np.array(rates) - rates[0]
    wanted = impulse[[0, 2]] / live.experiment.model.mass
    np.testing.assert_allclose(gained[6], wanted, atol=0.12)  # legs swing, too
    np.testing.assert_allclose(gained[3], 0.6 * wanted, atol=0.12)  # after 30 of 50 ms


def test_after_a_reset_the_strides_are_the_same_to_the_bit() -> None:
    live = session("pd", "ilc", scenario="delay+noise")

    def run() -> list[list[LiveStride]]:
        live.set_learning(True)
        first = live.stride(5)
        live.push([3.0, 0.0, 0.0])
        return [[*a, *b] for a, b in zip(first, live.stride(4), strict=True)]

    once = run()
    live.reset()
    assert run() == once
    assert once[0] != once[1]


def test_a_skill_is_handed_from_one_robot_to_another(tmp_path: Path) -> None:
    live = session("ilc", "model+ilc")
    live.set_learning(True, robot=0)
    learned = calf(live.stride(20)[0])
    live.skill(0).save(tmp_path / "skill.npz")
    live.reset()
    naive = calf(live.stride(6)[0])
    live.load_skill(0, TorqueLibrary.load(tmp_path / "skill.npz"))
    assert calf(live.stride(6)[0]) < 0.5 * naive
    assert learned < 0.5 * naive
    few = np.zeros((1, 2, 161, 6))
    wrong = TorqueLibrary(np.zeros(1), few, few, np.ones(1))
    with pytest.raises(InvalidInput, match="load one that it has learned"):
        live.load_skill(0, wrong)


def test_each_controller_keeps_what_the_robot_has_learned_under_it() -> None:
    live = session("ilc")
    live.set_learning(True)
    learned = calf(strides(live, 15))
    live.set_controller(0, "pd")
    unaided = calf(strides(live, 6))
    live.set_controller(0, "model")
    model = calf(strides(live, 6))
    live.set_controller(0, "ilc")
    assert max(learned, calf(strides(live, 5))) < 0.5 * model < 0.45 * unaided


@pytest.mark.parametrize(
    "values", [{"delay": 0.004}, {"slope": 0.05}, {"soft-ground": 0.01}, {"armature": 0.02}]
)
def test_a_world_that_changes_amid_the_run_leaves_the_robot_its_motion(
    values: dict[str, float],
) -> None:
    moments: list[Moment] = []
    live = LiveSession(
        Experiment(controllers=("ilc",)), on_moment=lambda robot, moment: moments.append(moment)
    )
    live.set_learning(True)
    strides(live, 12)
    x, count = moments[-1].q[0], len(moments)
    live.set_mismatches(values)
    assert all(stride.upright for stride in strides(live, 15))
    steps = np.diff([moment.q[0] for moment in moments[count - 1 :]])
    assert moments[count].q[0] - x == pytest.approx(0.005, abs=0.006), "it goes on where it was"
    assert np.abs(steps).max() < 0.02
    assert live.mismatches == values


def test_what_it_cannot_do_is_said() -> None:
    live = session("pd", "ilc")
    with pytest.raises(SpeedOutOfRange):
        live.set_speed(3.0)
    with pytest.raises(InvalidInput, match="another robot has the controller 'ilc'"):
        live.set_controller(0, "ilc")
    with pytest.raises(UnknownName):
        live.set_controller(0, "ilc-norm-optimal")
    with pytest.raises(UnknownName):
        live.set_mismatches({"wind": 1.0})
    with pytest.raises(InvalidInput):
        live.set_mismatches({"payload": -1.0})
    with pytest.raises(InvalidInput, match="robot"):
        live.forget(2)
    with pytest.raises(InvalidInput, match="push"):
        live.push([1e9, 0.0, 0.0])
    with pytest.raises(InvalidInput, match="3 or fewer"):
        session("pd", "model", "ilc", "model+ilc")
    with pytest.raises(InvalidInput, match="nothing is recorded"):
        live.save()
    with pytest.raises(InvalidInput, match="within running"):
        live.step()


def test_a_recording_is_a_results_folder(tmp_path: Path) -> None:
    live = session("pd", "ilc")
    live.stride(3)
    live.record(tmp_path / "drive")
    live.set_learning(True)
    live.stride(6)
    live.set_speed(0.2)
    told = live.stride(8)
    with pytest.raises(InvalidInput, match="save it first"):
        live.set_mismatches({"payload": 1.0})
    results = live.save()
    again = Results.load(tmp_path / "drive")
    assert again.experiment == results.experiment
    assert again.provenance["finished"]
    for robot, name in enumerate(("pd", "ilc")):
        cell = again.find(controller=name)
        assert again.has(cell)
        kept = again.strides(cell)
        np.testing.assert_allclose(kept["mean_speed"][0, -8:], [s.speed for s in told[robot]])
        assert kept["commanded"][0, -1] == pytest.approx(0.2)
        table = stride_table(kept).iloc[-8:]
        for column in ("calf", "thigh", "feedback_share"):
            np.testing.assert_allclose(table[column], [getattr(s, column) for s in told[robot]])
    assert set(again.summary()["controller"]) == {"pd", "ilc"}
    live.set_mismatches({"payload": 1.0})  # which may change again


def test_a_recording_ends_where_there_is_no_more_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live_robot, "LONGEST_RECORDING", 3.0)
    live = session("pd")
    strides(live, 30)  # more than there is room for, which nobody reads
    live.record(tmp_path / "drive")
    told = strides(live, 40)
    results = live.save()
    kept = results.strides(results.find(controller="pd"))
    count = int(kept["count"][0])
    assert 3.0 < float(kept["start"][0, count - 1]) < 10.0
    first = [stride.speed for stride in told[:count]]
    np.testing.assert_allclose(kept["mean_speed"][0, :count], first)
    assert told[-1].number == 69, "the session's own numbers go on"
    times = np.diff([stride.time for stride in told])
    assert times.min() > 0.3
    assert times.max() < 0.4


@pytest.mark.slow
def test_ten_minutes_take_no_more_memory_than_three() -> None:
    live = session("ilc")
    live.set_learning(True)
    done = strides(live, 500)
    unit = 1 if sys.platform == "darwin" else 1024  # [bytes]
    before = unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    while done[-1].time < 600.0:
        live.set_mismatches({"payload": 3.0 if done[-1].number % 2 else 1.0})
        done = strides(live, 100)
    assert unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 8e6
    assert done[-1].upright
    assert calf(done) < 0.05


def wait_for(condition: Callable[[], bool], seconds: float = 20.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it never came to that"
        time.sleep(0.01)


def test_it_goes_in_real_time_and_stops_when_asked() -> None:
    done: list[list[LiveStride]] = [[], []]
    moments: list[Moment | None] = [None, None]
    live = LiveSession(
        Experiment(controllers=("pd", "ilc")),
        on_stride=lambda robot, stride: done[robot].append(stride),
        on_moment=lambda robot, moment: moments.__setitem__(robot, moment),
    )
    with live.running(rate=2.0):
        began = time.monotonic()
        wait_for(lambda: all(len(each) > 5 for each in done))
        assert done[0][5].time == pytest.approx(2.0 * (time.monotonic() - began), abs=1.0)
        live.pause()
        time.sleep(0.1)
        paused = [len(each) for each in done], moments[0]
        time.sleep(0.3)
        assert ([len(each) for each in done], moments[0]) == paused
        live.step()
        wait_for(lambda: live.clock.paused)
        assert [len(each) for each in done] == [count + 1 for count in paused[0]]
        live.push([5.0, 0.0, 0.0])
        live.reset()
        live.pause(False)
        wait_for(lambda: all(each[-1].number == 1 for each in done))
    assert live.clock.slipped < 0.2
    first = [stride for stride in done[0] if stride.number == 0]
    assert first[0] == first[1], "after a reset it begins as it began"
    live.reset()
    assert live.stride()[0][0] == first[0], "in real time it goes as it does at once"


def test_who_waits_for_a_touchdown_is_answered_when_it_pauses_and_let_go_when_it_ends() -> None:
    live = session("pd")
    with ThreadPoolExecutor(1) as other:
        with live.running(rate=0.02):  # the first touchdown is half a minute away
            waits = other.submit(live.skill, 0)
            time.sleep(0.2)
            assert not waits.done()
            live.pause()
            assert waits.result(timeout=2.0).robot == "a1"
            live.pause(False)
            waits = other.submit(live.skill, 0)
            time.sleep(0.2)
        with pytest.raises(InvalidInput, match="ended before"):
            waits.result(timeout=2.0)


def test_what_was_before_a_recording_is_not_in_it(tmp_path: Path) -> None:
    done: list[LiveStride] = []
    live = LiveSession(
        Experiment(controllers=("pd",)), on_stride=lambda _robot, stride: done.append(stride)
    )
    with live.running(rate=10.0):
        wait_for(lambda: len(done) > 3)
        live.pause()
        live.record(tmp_path / "drive")
        with pytest.raises(InvalidInput, match="no stride was recorded yet"):
            live.save()
        assert live.recording is None
    assert not (tmp_path / "drive").exists()


def test_a_push_from_before_a_reset_does_not_come_after_it() -> None:
    done: list[LiveStride] = []
    held, go = threading.Event(), threading.Event()

    def finished(_robot: int, stride: LiveStride) -> None:
        done.append(stride)
        if len(done) == 2:  # between strides it takes no push
            held.set()
            go.wait(5.0)

    live = LiveSession(Experiment(controllers=("pd",)), on_stride=finished)
    with live.running(rate=5.0):
        assert held.wait(10.0)
        live.push([5.0, 0.0, 0.0])
        live.reset()
        go.set()
        wait_for(lambda: len(done) > 3)
    assert done[2:4] == done[:2]


def test_a_skill_of_another_robot_is_refused_by_name() -> None:
    other = LiveSession(Experiment(robot="go1", controllers=("ilc",)))
    with pytest.raises(InvalidInput, match=r"is of go1.*this is a1"):
        session("ilc").load_skill(0, other.skill(0))


def test_a_clock_that_robots_cannot_follow_goes_back_to_them() -> None:
    clock = LiveClock()
    clock.paused = False
    clock.set(5.0)
    clock.wait(1.0, threading.Event())
    assert clock.now == pytest.approx(1.0, abs=0.2)
    assert clock.slipped == pytest.approx(4.0, abs=0.2)


def test_a_skill_over_conditions_is_refused_and_so_are_numbers_beyond_all_scenarios() -> None:
    session = LiveSession(Experiment(controllers=("ilc",)), speed=0.3)
    flat = session.skill(0)
    hills = TorqueLibrary.joined([flat, flat], {"slope": np.array([0.0, 0.1])})
    with pytest.raises(InvalidInput, match="over slope, too"):
        session.load_skill(0, hills)
    session.load_skill(0, hills.in_conditions({"slope": 0.1}))
    with pytest.raises(InvalidInput, match="payload"):
        session.set_mismatches({"payload": 1e300})


def test_a_touchdown_is_late_by_what_the_flight_lasted_longer_than_its_reference() -> None:
    session = LiveSession(Experiment(controllers=("pd",)), speed=0.3)
    told = session.stride(4)[0][-1].touchdown
    log = session.robots[0].simulation.strides
    last = 0, int(log.count[0]) - 1
    lasted = log["duration"][last] - log["stance"][last]
    assert told == pytest.approx(lasted - log["flight_reference"][last], abs=0.001)
    assert told < -0.002  # without feedforward a robot does not jump as high as it should


def test_the_stride_before_a_skill_is_loaded_is_not_learned_from() -> None:
    session = LiveSession(Experiment(controllers=("ilc",)), speed=0.3)
    session.stride(2)
    nothing = session.skill(0)
    session.set_learning(True)
    session.stride(4)
    session.load_skill(0, nothing)
    session.stride(1)
    log = session.robots[0].simulation.strides
    played = log["feedforward"][0, : int(log.count[0])]
    assert np.abs(played[-2]).max() > 1.0
    assert np.all(played[-1] == 0.0)
