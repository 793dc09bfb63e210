"""DART, the engine of the example: what it refuses, its law of friction, and its answers beside
MuJoCo's. What it keeps as any engine does is in `test_engines.py`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import (
    Engine,
    Experiment,
    Schedule,
    load_engine,
    load_scenario,
    run_experiment,
)
from pronk_pin.control import Gains
from pronk_pin.errors import InvalidInput
from pronk_pin.robot import Robot

pytest.importorskip("dartpy")

ADDRESS = "dart_engine:engine"
IDEAL = load_scenario("ideal")


@pytest.fixture(scope="module")
def engine() -> Iterator[Engine]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(Path(__file__).parents[3] / "examples")
        yield load_engine(ADDRESS)


@pytest.mark.parametrize(
    ("scenario", "base", "named"),
    [
        ("nominal", "locked", "rotors (armature)"),
        ("ideal+rough", "locked", "ground_roughness"),
        ("ideal+steps", "locked", "step_height"),
        ("ideal+soft-ground", "locked", "ground_time_constant"),
        ("ideal+push", "locked", "push_impulse"),
        ("ideal", "free", "a free base"),
    ],
)
def test_what_it_cannot_do_is_named(
    engine: Engine, robot: Robot, scenario: str, base: str, named: str
) -> None:
    with pytest.raises(InvalidInput, match=f"DART cannot simulate {re.escape(named)}; leave"):
        engine.check(robot, load_scenario(scenario), base)
    with pytest.raises(InvalidInput, match=re.escape(named)):
        engine.world(robot, load_scenario(scenario), 1, base=base)


@pytest.mark.parametrize("share", [0.8, 1.2])
def test_friction_is_bound_by_what_a_ground_without_friction_would_bear(
    engine: Engine, robot: Robot, share: float
) -> None:
    """Stands on a slope below the friction angle; beyond, slides with mu times that force."""
    friction = 0.3
    scenario = replace(IDEAL, ground_friction=friction, slope=np.arctan(share * friction))
    world = engine.world(robot, scenario, 1, base="locked")
    world.reset(np.array([[0.0, robot.standing[2]]]), robot.standing[None, 7:])
    gains = Gains()
    for _ in range(600):
        torque = 5.0 * gains.proportional(12) * (robot.standing[7:] - world.joints)
        torque -= 2.0 * gains.derivative(12) * world.joint_rates
        q = np.concatenate([world.pose[0], world.joints[0]])
        v = np.concatenate([world.twist[0], world.joint_rates[0]])
        rate = world.base_rate[0, 0]
        force = world.step(torque).force[0, 0]
    if share < 1.0:
        assert abs(world.base_rate[0, 0]) < 1e-3
        return
    assert world.base_rate[0, 0] < rate - 1e-6  # it goes down, ever faster
    bound = friction * frictionless(robot, q, v, torque[0], scenario.gravity_vector)
    np.testing.assert_allclose(force[:, 0], bound, rtol=1e-4)
    assert (np.abs(force[:, 1]) < bound).all()


def frictionless(
    robot: Robot, q: Array, v: Array, torque: Array, gravity: tuple[float, ...]
) -> Array:
    """Normal forces that would stop the feet at the end of a step without friction [N], (4,)."""
    model, free, dt = robot.model.copy(), [0, 2, *range(6, 18)], IDEAL.timestep
    model.gravity.linear = np.array(gravity)
    data = model.createData()
    mass = pin.crba(model, data, q)
    mass = (np.triu(mass) + np.triu(mass, 1).T)[np.ix_(free, free)]
    driven = np.concatenate([np.zeros(2), torque]) - pin.nonLinearEffects(model, data, q, v)[free]
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    rising = np.array(
        [  # the lowest point of a foot is right below its centre
            pin.getFrameJacobian(model, data, foot, pin.LOCAL_WORLD_ALIGNED)[2, free]
            for foot in robot.foot_ids
        ]
    )
    coming = rising @ (v[free] + dt * np.linalg.solve(mass, driven))
    return np.asarray(np.linalg.solve(rising @ np.linalg.solve(mass, rising.T), -coming) / dt)


@pytest.mark.slow
def test_it_agrees_with_mujoco_that_feedforward_takes_most_of_the_error(
    engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 0.3 m/s: PD within 5 mrad, and what the model and practice leave within 10."""
    monkeypatch.syspath_prepend(Path(__file__).parents[3] / "examples")
    experiment = Experiment(
        speeds=(0.3,),
        controllers=("pd", "model", "ilc"),
        scenarios=("ideal", f"ideal+{ADDRESS}"),
        schedule=Schedule(baseline=5.0, learning=10.0),
    )
    results = run_experiment(experiment, tmp_path / "result", workers=1, progress=False)
    table = results.summary().query("metric == 'peak_error' and joint in ['thigh', 'calf']")
    peaks = table.pivot_table(index=["scenario", "controller"], columns="joint", values="value")
    mujoco, dart = peaks.loc["ideal"], peaks.loc["ideal+dart"]
    assert (np.abs(dart - mujoco).loc["pd"] < 5e-3).all()
    assert (np.abs(dart - mujoco) < 10e-3).all(axis=None)
    for feedforward in ("model", "ilc"):
        assert (dart.loc[feedforward] < 0.3 * dart.loc["pd"]).all()
