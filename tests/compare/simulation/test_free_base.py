from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import xarray as xr

from pronk_pin.compare import (
    Experiment,
    MujocoWorld,
    Schedule,
    build_model,
    load_scenario,
    run_cell,
)
from pronk_pin.compare.metrics import by_joint
from pronk_pin.control import AttitudeEstimator, Balance
from pronk_pin.errors import UnknownName
from pronk_pin.robot import Robot
from pronk_pin.robot.conventions import to_mujoco

BASES = ("sagittal", "free")


def pronked(
    base: str, controller: str, baseline: float, learning: float, **more: object
) -> xr.Dataset:
    schedule = Schedule(baseline=baseline, learning=learning)
    experiment = Experiment(base=base, controllers=(controller,), schedule=schedule, **more)  # type: ignore[arg-type]
    return run_cell(experiment.cells()[0])


def finished(strides: xr.Dataset, name: str) -> xr.DataArray:
    return strides[name].where(strides["stride"] < strides["count"])


def last_strides(strides: xr.Dataset, name: str, joint: str) -> np.ndarray:
    """An error's mean over the legs and the last 15 strides, at each speed."""
    error = by_joint(strides[name]).sel(joint=joint)
    counts = strides["count"].to_numpy()
    return np.array(
        [error.isel(speed=k, stride=slice(n - 15, n)).mean() for k, n in enumerate(counts)]
    )


def test_pose_and_velocity_of_a_free_trunk_are_in_pinocchios_layout(robot: Robot) -> None:
    world = MujocoWorld(robot, load_scenario("ideal"), 1, base="free")
    rng = np.random.default_rng(0)
    q = robot.standing.copy()
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.5)).coeffs()
    v = rng.standard_normal(18)
    names = [world.model.joint(k).name for k in range(1, world.model.njnt)]
    state = to_mujoco(robot, q, v, joints=names)
    world._state[0, 1:] = np.concatenate([state.qpos, state.qvel])
    np.testing.assert_allclose(world.pose[0], q[:7], atol=1e-12)
    np.testing.assert_allclose(world.twist[0], v[:6], atol=1e-12)


def test_a_pitching_trunk_is_a_free_one_that_does_not_roll(robot: Robot) -> None:
    worlds = [MujocoWorld(robot, load_scenario("ideal"), 1, base=base) for base in BASES]
    rng = np.random.default_rng(1)
    legs = robot.standing[7:].reshape(4, 3) * np.array([0.0, 1.0, 1.0])
    rates = np.tile(rng.standard_normal((2, 1, 3)) * [0.0, 1.0, 1.0], (1, 2, 1)).reshape(1, 12)
    for world in worlds:
        world.reset(np.array([[0.0, 1.0]]), legs.reshape(1, 12), joint_rates=rates, pitch=-0.2)
        for _ in range(50):
            world.step(np.zeros((1, 12)))
    # The trunk's centre of mass is 4 mm off the mirror plane: nearly the same, not quite.
    np.testing.assert_allclose(worlds[0].pose, worlds[1].pose, atol=2e-3)
    np.testing.assert_allclose(worlds[0].twist, worlds[1].twist, atol=5e-2)


def test_a_free_robot_in_the_air_keeps_its_angular_momentum(robot: Robot) -> None:
    world = MujocoWorld(robot, load_scenario("ideal"), 1, base="free")
    world.reset(np.array([[0.0, 2.0]]), robot.standing[None, 7:], pitch=0.2)
    rng = np.random.default_rng(2)
    momenta = []
    for _ in range(60):
        q = np.concatenate([world.pose[0], world.joints[0]])
        v = np.concatenate([world.twist[0], world.joint_rates[0]])
        pin.computeCentroidalMomentum(robot.model, robot.data, q, v)
        momenta.append(robot.data.hg.angular.copy())
        world.step(2.0 * rng.standard_normal((1, 12)))
    np.testing.assert_allclose(momenta, np.zeros((60, 3)), atol=2e-3)


@pytest.mark.parametrize("base", BASES)
def test_a_robot_whose_trunk_may_turn_stays_up_and_straight(base: str) -> None:
    strides = pronked(base, "model", 2.0, 0.0, speeds=(0.4,))
    assert finished(strides, "upright").min() == 1.0
    assert np.abs(finished(strides, "tilt")).max() < 0.15
    assert np.degrees(np.abs(finished(strides, "heading")).max()) < 5.0
    assert strides["attitude"].sel(rotation="pitch").mean() == pytest.approx(-0.2, abs=0.05)


def test_a_robot_that_only_has_an_imu_stays_up_and_straight() -> None:
    strides = pronked("free", "ilc-imu", 2.0, 1.0, speeds=(0.4,), scenarios=("noise",))
    assert finished(strides, "upright").min() == 1.0
    assert np.abs(finished(strides, "tilt")).max() < 0.15
    assert np.degrees(np.abs(finished(strides, "heading")).max()) < 5.0


def test_a_robot_that_only_has_an_imu_does_not_see_its_true_attitude(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One that takes itself for turned to the left turns to the right."""
    level = AttitudeEstimator.__init__

    def turned(
        self: AttitudeEstimator, spec: object, attitude: np.ndarray, *more: object, **rest: object
    ) -> None:
        level(self, spec, attitude @ pin.rpy.rpyToMatrix(0.0, 0.0, 0.1), *more, **rest)  # type: ignore[arg-type]

    monkeypatch.setattr(AttitudeEstimator, "__init__", turned)
    strides = pronked("free", "ilc-imu", 1.5, 0.0, speeds=(0.4,), scenarios=("ideal",))
    assert finished(strides, "heading").min() < -0.05


def test_a_robot_that_is_thrown_over_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    rolling = np.array([0.0, 0.0, 60.0, 0.0, 0.0, -60.0] * 2)[None]  # left against right
    monkeypatch.setattr(Balance, "torque", lambda self, *_: rolling)
    strides = pronked("free", "model", 2.0, 0.0, speeds=(0.4,))
    assert finished(strides, "upright").min() == 0.0


def test_an_unknown_base_is_refused_with_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="sagittal"):
        Experiment(base="flying")


@pytest.mark.slow
@pytest.mark.parametrize("base", BASES)
def test_at_all_speeds_robots_stay_up_and_straight_on_the_models_feedforward(base: str) -> None:
    strides = pronked(base, "model", 30.0, 0.0)
    assert finished(strides, "upright").min() == 1.0
    assert np.degrees(np.abs(finished(strides, "heading")).max()) < 5.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "after", "most"),
    # The model's feedforward leaves less to learn: at one speed of 14 more than half of it stays.
    [("pd", "ilc", 0.5), ("model", "model+ilc", 0.6)],
)
@pytest.mark.parametrize("base", BASES)
def test_learning_halves_the_errors_at_all_speeds_of_robots_whose_trunks_may_turn(
    base: str, before: str, after: str, most: float
) -> None:
    plain, learned = pronked(base, before, 10.0, 0.0), pronked(base, after, 10.0, 30.0)
    assert finished(learned, "upright").min() == 1.0
    assert np.degrees(np.abs(finished(learned, "heading")).max()) < 5.0
    for name in ("peak_error", "rms_error"):
        for joint in ("thigh", "calf"):
            ratio = last_strides(learned, name, joint) / last_strides(plain, name, joint)
            assert ratio.max() < most
            assert np.median(ratio) < 0.5


def test_mujoco_knows_the_three_bases(robot: Robot) -> None:
    sizes = [
        build_model(robot, load_scenario("ideal"), base=base).nv for base in ("locked", *BASES)
    ]
    assert sizes == [14, 15, 18]
