from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pronk_pin._typing import Array, IntArray
from pronk_pin._workers import listening
from pronk_pin.compare import Results, Schedule, Simulation, load_scenario
from pronk_pin.compare.simulation.log import StrideLog
from pronk_pin.compare.simulation.quantities import LAST, STRIDE_QUANTITIES
from pronk_pin.compare.world import Motion
from pronk_pin.compare.world.scenario import Scenario
from pronk_pin.control import SAMPLES, ControllerSpec, Gains, load_controller
from pronk_pin.errors import InvalidInput
from pronk_pin.gait import Gait
from pronk_pin.robot import Robot

PD = load_controller("pd")


def finished(log: StrideLog, name: str) -> list[Array]:
    """A quantity of the strides that each robot has finished."""
    return [values[:n] for values, n in zip(log[name], log.count, strict=True)]


@pytest.fixture(scope="module")
def pronking(simulation: Callable[..., Simulation]) -> StrideLog:
    return simulation(PD, seconds=2.0).run()


def test_the_robots_stay_up_and_make_the_strides_of_their_gaits(
    pronking: StrideLog, gaits: list[Gait]
) -> None:
    for robot, gait in enumerate(gaits):
        assert pronking.count[robot] == pytest.approx(2.0 / gait.duration, abs=1.1)
        assert np.all(finished(pronking, "upright")[robot] == 1.0)
        duration = finished(pronking, "duration")[robot]
        np.testing.assert_allclose(duration, gait.duration, rtol=0.15)


def test_every_stance_lasts_as_long_as_planned(pronking: StrideLog, gaits: list[Gait]) -> None:
    for stance, gait in zip(finished(pronking, "stance"), gaits, strict=True):
        np.testing.assert_allclose(stance, gait.stance.duration, atol=0.0005)


def test_each_stride_begins_where_the_last_one_ended(pronking: StrideLog) -> None:
    starts, durations = finished(pronking, "start"), finished(pronking, "duration")
    for start, duration in zip(starts, durations, strict=True):
        assert start[0] == 0.0
        np.testing.assert_allclose(start[1:], (start + duration)[:-1], atol=1e-9)


def test_the_robots_jump_about_as_high_and_run_about_as_fast_as_their_gaits(
    pronking: StrideLog, gaits: list[Gait]
) -> None:
    for robot, gait in enumerate(gaits):
        assert finished(pronking, "apex")[robot].mean() == pytest.approx(gait.apex, abs=0.03)
        assert finished(pronking, "mean_speed")[robot][2:].mean() == pytest.approx(
            gait.speed, abs=0.2
        )


def test_the_same_seed_gives_the_same_strides_to_the_bit(
    simulation: Callable[..., Simulation],
) -> None:
    logs = [simulation(PD, seed=seed).run() for seed in (1, 1, 2)]
    for quantity in STRIDE_QUANTITIES:
        np.testing.assert_array_equal(logs[0][quantity.name], logs[1][quantity.name])
    same, other = (np.nan_to_num(log["peak_error"]) for log in logs[1:])
    assert np.any(same != other)


def test_every_controller_starts_from_the_same_postures(
    simulation: Callable[..., Simulation],
) -> None:
    starts = [simulation(load_controller(name)).world.joints for name in ("pd", "ilc-paper")]
    np.testing.assert_array_equal(*starts)


def test_the_steps_reported_add_up_to_the_schedule(simulation: Callable[..., Simulation]) -> None:
    reported: list[int] = []
    simulation(PD, seconds=1.2).run(reported.append)
    assert sum(reported) == 1200


def test_a_few_strides_of_learning_reduce_the_error(comparison: Results) -> None:
    strides = comparison.strides(comparison.find(controller="ilc"))
    calves = [str(name) for name in strides["joint"].to_numpy() if str(name).endswith("calf")]
    peak = strides["peak_error"].sel(joint=calves).mean("joint")
    for robot, learning in zip(peak.to_numpy(), strides["learning"].to_numpy(), strict=True):
        before, after = robot[learning == 0.0], robot[learning == 1.0]
        assert after[9:].max() < 0.5 * before[3:].min()


def test_strides_are_marked_as_learning_from_the_end_of_practice_on(comparison: Results) -> None:
    ilc, pd = (comparison.strides(comparison.find(controller=name)) for name in ("ilc", "pd"))
    finished = ilc["start"].notnull()
    late = ilc["start"] > comparison.experiment.schedule.baseline - 1e-9
    assert ((ilc["learning"] == 1.0) == late).where(finished, True).all()
    assert late.any()
    assert not (pd["learning"] == 1.0).any()


def test_limp_robots_fall_and_that_is_a_result(simulation: Callable[..., Simulation]) -> None:
    limp = simulation(replace(PD, gains=Gains((0.0,) * 3, (0.0,) * 3)))
    log = limp.run()
    assert not limp.upright.any()
    for upright in finished(log, "upright"):
        assert upright.size
        assert upright[-1] == 0.0


def test_a_robot_that_is_pulled_down_falls_and_the_other_does_not(
    simulation: Callable[..., Simulation],
) -> None:
    feedforward = np.zeros((2, 2, SAMPLES, 12))
    feedforward[1, 0, :, 1::3], feedforward[1, 0, :, 2::3] = 200.0, -200.0  # folds the legs
    pulled = simulation(PD, feedforward=feedforward)
    pulled.run()
    assert pulled.upright.tolist() == [True, False]


@pytest.mark.parametrize("value", [np.nan, 1e15], ids=["not a number", "huge"])
def test_a_robot_that_leaves_the_finite_numbers_is_reported_and_disturbs_nobody(
    simulation: Callable[..., Simulation],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    value: float,
) -> None:
    monkeypatch.chdir(tmp_path)
    whole, struck = simulation(PD), simulation(PD)
    world, count = struck.world, iter(range(10_000))
    play = world.play

    def spoil(rows: IntArray, control: Array) -> Motion:
        if 1 in rows and next(count) in (0, 9):  # while it stands, and while it pronks
            world._state[1, world._rates] = value
        return play(rows, control)

    world.play = spoil  # type: ignore[method-assign]
    log, reference = struck.run(), whole.run()

    assert struck.upright.tolist() == [True, False]
    assert finished(log, "upright")[1][-1] == 0.0
    np.testing.assert_array_equal(log["peak_error"][0], reference["peak_error"][0])
    assert not list(tmp_path.iterdir())  # MuJoCo would leave a log file


def test_a_robot_below_the_height_of_its_gait_has_fallen(
    simulation: Callable[..., Simulation], gaits: list[Gait]
) -> None:
    watched = simulation(PD)
    watched.player.falls.floor = np.array([0.0, gaits[1].apex])
    watched.run()
    assert watched.upright.tolist() == [True, False]


@pytest.mark.parametrize("name", ["startup", "baseline", "learning", "scatter"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_a_schedule_needs_finite_durations(name: str, value: float) -> None:
    with pytest.raises(InvalidInput, match=f"schedule: {name}=.*; give a number from 0 to "):
        Schedule(**{name: value})


def test_a_schedule_needs_time_for_a_stride() -> None:
    with pytest.raises(InvalidInput) as caught:
        Schedule(baseline=0.2, learning=0.1)
    assert str(caught.value) == (
        "baseline and learning of 0.2 + 0.1 s are too short for a stride; "
        "make them 1 s or more together"
    )


def test_without_start_up_and_practice_the_robots_learn_from_the_first_stride_on(
    simulation: Callable[..., Simulation],
) -> None:
    learner = simulation(ControllerSpec("mine", law=load_controller("ilc").law))
    learner.schedule = Schedule(startup=0.0, baseline=0.0, learning=1.5)
    log = learner.run()
    for learning in finished(log, "learning"):
        assert np.all(learning[1:] == 1.0)
    assert learner.controller.feedforward.any()


@pytest.mark.parametrize("scenario", ["nominal", "delay", "delay=0.001"])
@pytest.mark.parametrize("name", ["pd", "ilc"])
def test_many_ticks_at_once_and_tick_by_tick_give_the_same_motion_over_three_seconds(
    robot: Robot, gaits: list[Gait], name: str, scenario: str
) -> None:
    world = load_scenario(scenario)
    one, other = (learned_strides(robot, gaits, name, world, chunked=way) for way in (True, False))
    assert_same_motion(one, other)


@pytest.mark.parametrize("scenario", ["nominal", "delay", "noise"])
def test_threads_that_share_the_robots_give_the_same_motion(
    robot: Robot, gaits: list[Gait], scenario: str
) -> None:
    world = load_scenario(scenario)
    one, other = (
        learned_strides(robot, gaits, "ilc", world, threads=threads) for threads in (1, 2)
    )
    assert_same_motion(one, other)


@pytest.mark.parametrize(("threads", "base"), [(0, "locked"), (2, "free")])
def test_threads_need_a_locked_base(
    robot: Robot, gaits: list[Gait], threads: int, base: str
) -> None:
    with pytest.raises(InvalidInput, match="threads must be"):
        Simulation(
            robot,
            gaits,
            load_controller("pd"),
            load_scenario("nominal"),
            schedule=Schedule(),
            rng=np.random.default_rng(0),
            threads=threads,
            base=base,
        )


def learned_strides(
    robot: Robot,
    gaits: list[Gait],
    name: str,
    world: Scenario,
    *,
    chunked: bool = True,
    threads: int = 1,
) -> StrideLog:
    """Three seconds, with learning half of the time."""
    simulation = Simulation(
        robot,
        gaits,
        load_controller(name),
        world,
        schedule=Schedule(baseline=1.5, learning=1.5),
        rng=np.random.default_rng(0),
        chunked=chunked,
        threads=threads,
    )
    return simulation.run()


def assert_same_motion(one: StrideLog, other: StrideLog) -> None:
    """At every tick of the last strides."""
    assert np.array_equal(one.count, other.count)
    ticks, others = one.ticks(), other.ticks()
    for name, values in ticks.items():
        assert np.isfinite(values).any()
        np.testing.assert_array_equal(np.isnan(values), np.isnan(others[name]))
    for quantity, tolerance in (("joints", 1e-6), ("base", 1e-6), ("joint_rates", 1e-4)):
        name = f"tick_{quantity}"
        np.testing.assert_allclose(ticks[name], others[name], atol=tolerance)


def test_the_ticks_kept_are_those_of_the_last_strides(pronking: StrideLog) -> None:
    ticks = pronking.ticks()
    kept = min(LAST, int(pronking.count.min()))
    for k in range(2):
        base, rate = (ticks[name][k, -kept:] for name in ("tick_base", "tick_base_rate"))
        length = np.isfinite(base[..., 0]).sum(axis=-1)  # (strides, parts)
        total = (length.sum(axis=1) * 0.001)[-3:]
        np.testing.assert_allclose(total, finished(pronking, "duration")[k][-3:], atol=1e-9)
        for stride in range(kept - 1):
            end = length[stride, 1] - 1  # one tick before the next touchdown
            step = base[stride, 1, end] + 0.001 * rate[stride + 1, 0, 0]
            np.testing.assert_allclose(base[stride + 1, 0, 0], step, atol=1e-6)
        force = ticks["tick_force"][k, -kept:]
        assert np.nanmax(np.abs(force[:, 1, 40:120])) == 0.0  # in the middle of flight
        assert np.all(np.nanmedian(force[:, 0, 20:100, :, 2], axis=(0, 1)) > 20.0)  # feet stand


def test_whoever_listens_is_told_of_the_steps_of_all_robots(
    simulation: Callable[..., Simulation],
) -> None:
    told: list[int] = []
    with listening(told.append):
        simulation(PD, seconds=1.2).run()
    assert sum(told) == 2 * 1200
    assert len(told) > 1  # while it went on
