"""Scenes from results: the robot as it was simulated, beside its reference."""

from __future__ import annotations

import numpy as np
import xarray as xr

from .._typing import Array
from ..compare import Results
from ..errors import InvalidInput
from ..gait import Gait, load_library
from ..robot import Robot, load_robot
from .scene import Scene, Track

BEFORE, AFTER = 3, 9
"""Strides of a practice scene before and after the learning is switched on."""


def practice_scene(
    results: Results,
    *,
    speed: float | None = None,
    controller: str | None = None,
    scenario: str | None = None,
) -> Scene:
    """The strides around the moment at which learning starts; the last ones without learning.

    Args:
        results: The results folder.
        speed: Desired speed [m/s]; by default the one nearest to 0.5.
        controller: By default "ilc", or the first there is.
        scenario: By default the first.

    Raises:
        InvalidInput: The result holds no such speed, controller or scenario, or no finished stride.
    """
    experiment = results.experiment
    if controller is None:
        controller = "ilc" if "ilc" in experiment.controllers else experiment.controllers[0]
    strides = results.strides(results.find(controller=controller, scenario=scenario))
    speeds = strides["speed"].to_numpy()
    wanted = 0.5 if speed is None else speed
    index = int(np.argmin(np.abs(speeds - wanted)))
    if speed is not None and abs(speeds[index] - speed) > 1e-6:
        known = ", ".join(f"{v:g}" for v in speeds)
        raise InvalidInput(f"the result has no speed {speed:g} m/s; choose one of: {known}")
    robot = load_robot(experiment.robot)
    gait = load_library(experiment.robot).at(float(speeds[index]))
    mine = _window(strides.isel(speed=index))
    mine = mine.assign(start=mine["start"] - mine["start"][0])  # the scene's clock starts at 0
    learned = mine["start"].to_numpy()[mine["learning"].to_numpy() == 1]
    began = f"; learning starts after {learned[0]:.1f} s" if learned.size else ""
    return Scene(
        robot,
        [_measured(robot, mine, controller), _planned(robot, mine, gait)],
        title=f"{robot.name.upper()} pronking at {gait.speed:g} m/s",
        caption=f"{controller}, scenario {strides.attrs['scenario']}{began}",
    )


def _window(strides: xr.Dataset) -> xr.Dataset:
    """A dozen strides around the start of learning, or the last ones."""
    count = int(strides["count"])
    if count == 0:
        raise InvalidInput(f"no stride was finished at {float(strides['speed']):g} m/s")
    learning = np.flatnonzero(strides["learning"].to_numpy()[:count] == 1)
    first = learning[0] - BEFORE if learning.size else count - BEFORE - AFTER
    first = max(int(first), 0)
    return strides.isel(stride=slice(first, min(first + BEFORE + AFTER, count)))


def _clock(strides: xr.Dataset, k: int) -> tuple[Array, Array]:
    """Times of the samples of stance and flight of a stride [s], as far as each lasted."""
    one = strides.isel(stride=k)
    start, stance, duration = (float(one[name]) for name in ("start", "stance", "duration"))
    planned = strides["planned_duration"].to_numpy()
    down, up = (one["phase"].to_numpy() * length for length in planned)
    return start + down[down < stance], start + stance + up[up < duration - stance]


def _measured(robot: Robot, strides: xr.Dataset, name: str) -> Track:
    """The robot as simulated."""
    times, base, joints = [], [], []
    measured = (strides["reference"] - strides["error"]).transpose("stride", "part", "phase", ...)
    for k in range(strides.sizes["stride"]):
        for part, clock in enumerate(_clock(strides, k)):
            one = {"stride": k, "part": part, "phase": slice(len(clock))}
            times.append(clock)
            base.append(strides["base"].isel(one).to_numpy())
            joints.append(measured.isel(one).to_numpy())
    return _track(robot, name, times, base, joints, ghost=False)


def _planned(robot: Robot, strides: xr.Dataset, gait: Gait) -> Track:
    """The gait, put down where the robot touches down at the beginning of each stride."""
    times, base, joints = [], [], []
    for k in range(strides.sizes["stride"]):
        one = strides.isel(stride=k)
        x = float(one["base"][0, 0, 0])
        for phase, clock in zip((gait.stance, gait.flight), _clock(strides, k), strict=True):
            begin = clock[0]
            s = np.minimum((clock - begin) / phase.duration, 1.0)
            position = phase.base_reference(s)[0][:, :2] + [x, 0.0]
            times.append(clock)
            base.append(position)
            joints.append(phase.joint_reference(s)[0])
    return _track(robot, "reference", times, base, joints, ghost=True)


def _track(
    robot: Robot, name: str, times: list[Array], base: list[Array], joints: list[Array], ghost: bool
) -> Track:
    position = np.concatenate(base)
    xyz = np.column_stack([position[:, 0], np.zeros(len(position)), position[:, 1]])
    q = robot.q_from_base(xyz, np.concatenate(joints))
    return Track(name, np.concatenate(times), q, ghost=ghost)
