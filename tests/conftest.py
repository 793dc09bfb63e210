"""What the tests share: the robot, random states of it, and the same robot in MuJoCo."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import mujoco
import numpy as np
import pytest

from pronk_pin import Robot, load_robot
from pronk_pin._typing import Array
from pronk_pin.robot import ROBOTS
from pronk_pin.robot.formats.urdf import mujoco_spec

os.environ.pop("COLUMNS", None)  # what is printed is as wide as it is, whatever the terminal


class States(NamedTuple):
    """Random states within the joint limits, at any attitude."""

    q: Array
    v: Array
    a: Array
    tau: Array


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot("a1")


@pytest.fixture(scope="session", params=[name for name, spec in ROBOTS.items() if spec.legs[2:]])
def any_robot(request: pytest.FixtureRequest) -> Robot:
    """Each of the robots with four legs that are known by name."""
    return load_robot(request.param)


@pytest.fixture(scope="session")
def biped() -> Robot:
    """Two legs, other names, feet without collision spheres."""
    return load_robot("bolt")


def draw_states(robot: Robot, n: int, *, seed: int = 0) -> States:
    """n random states of a robot."""
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=(n, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    joints = rng.uniform(robot.q_min, robot.q_max, size=(n, robot.nu))
    q = np.concatenate([rng.normal(size=(n, 3)), quaternion, joints], axis=-1)
    v, a = 2.0 * rng.normal(size=(2, n, robot.nv))
    return States(q, v, a, 5.0 * rng.normal(size=(n, robot.nu)))


def draw_crouches(robot: Robot, n: int, *, seed: int = 0) -> States:
    """n states near standing, where contacts are well conditioned and forces moderate."""
    rng = np.random.default_rng(seed)
    q = np.tile(robot.standing, (n, 1))
    q[:, 7:] += 0.1 * rng.normal(size=(n, robot.nu))
    v, a = rng.normal(size=(2, n, robot.nv))
    return States(q, 0.5 * v, a, 3.0 * rng.normal(size=(n, robot.nu)))


@pytest.fixture(scope="session")
def random_states(robot: Robot) -> Callable[..., States]:
    return partial(draw_states, robot)


@pytest.fixture(scope="session")
def crouches(robot: Robot) -> Callable[..., States]:
    return partial(draw_crouches, robot)


@pytest.fixture(scope="session")
def any_states(any_robot: Robot) -> Callable[..., States]:
    return partial(draw_states, any_robot)


@pytest.fixture(scope="session")
def any_crouches(any_robot: Robot) -> Callable[..., States]:
    return partial(draw_crouches, any_robot)


@pytest.fixture(scope="session")
def mujoco_model(robot: Robot) -> mujoco.MjModel:
    """The same URDF in MuJoCo, its trunk floating and without the meshes MuJoCo cannot read."""
    return mujoco_spec(robot, collisions=False).compile()


@pytest.fixture(scope="session")
def any_mujoco_model(any_robot: Robot) -> mujoco.MjModel:
    return mujoco_spec(any_robot, collisions=False).compile()
