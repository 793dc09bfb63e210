"""Scenes from gaits: what a library plans, with its contact forces and torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..._checks import Interval, instance_of, none_or, real, whole
from ...errors import InvalidInput
from ...gait import Gait, GaitLibrary
from ...robot import Robot, as_robot, load_robot
from .menu import Choice, Menu
from .scene import Mark, Scene, Track

SHOWN_SPEED = 0.5
"""Speed that is shown first [m/s], if none is asked for."""


_SAMPLING = Interval(1e-4, 1, "s")


def gait_scene(
    robot: Robot,
    gait: Gait,
    *,
    name: str = "gait",
    friction: float | None = None,
    strides: int = 12,
    dt: float = 0.005,
) -> Scene:
    """A gait over a few strides, with its contact forces and torques.

    Args:
        robot: The robot the gait is for.
        gait: The gait.
        name: What the page calls it.
        friction: Friction coefficient that it was made for; None without cones.
        strides: How many strides.
        dt: Time between samples [s].
    """
    strides, dt = whole("strides", strides, Interval(1, 1000)), real("dt", dt, _SAMPLING)
    as_robot(robot)
    instance_of("gait", gait, Gait)
    times, configurations, forces, torques, marks = [], [], [], [], []
    for stride in range(strides):
        begin = stride * gait.duration
        for phase in gait.phases:
            # The end of a phase is the beginning of the next one; each instant is shown once.
            s = np.linspace(0.0, 1.0, max(round(phase.duration / dt), 1), endpoint=False)
            motion = phase.motion(robot, s)
            q = motion.q.copy()
            q[:, 0] += stride * gait.speed * gait.duration
            marks.append(Mark(begin, stride, phase.name))
            times.append(begin + motion.t)
            configurations.append(q)
            forces.append(motion.lam)
            torques.append(motion.tau)
            begin += phase.duration
    track = Track(
        name=name,
        t=np.concatenate(times),
        q=np.concatenate(configurations),
        forces=np.concatenate(forces),
        torque=np.concatenate(torques),
        marks=marks,
        caption=", ".join(f"{phase.name} {phase.duration:.3f} s" for phase in gait.phases),
    )
    caption = f"{gait.speed:.2f} m/s, apex {gait.apex:.2f} m, {1.0 / gait.duration:.2f} strides/s"
    title = f"{robot.name.upper()} {name}"
    return Scene(robot, (track,), title=title, caption=caption, friction=friction)


def library_menu(
    library: GaitLibrary,
    *,
    speed: float | None = None,
    apex: float | None = None,
    robot: Robot | None = None,
) -> Menu:
    """The gaits of a library, to choose from by speed and apex.

    Args:
        library: The library.
        speed: Speed shown first [m/s]; one between those of the library is interpolated. By
            default the one nearest to 0.5.
        apex: Apex shown first [m]; by default the library's own.
        robot: The robot; by default the one that is known by the library's name.

    Raises:
        SpeedOutOfRange: The library does not cover the speed.
        ApexOutOfRange: The library does not cover the apex.
    """
    instance_of("library", library, GaitLibrary, "a GaitLibrary, as load_library() returns it")
    speed, apex = none_or(real, "speed", speed), none_or(real, "apex", apex)
    robot = load_robot(library.robot) if robot is None else as_robot(robot)
    kind = str(library.metadata.get("gait", "gait"))
    friction = library.metadata.get("problem", {}).get("friction")
    if speed is None:
        speed = float(library.speeds[np.argmin(np.abs(library.speeds - SHOWN_SPEED))])
    apex = library.apex if apex is None else apex
    library.at(speed, apex)

    def make(choice: Choice) -> Scene:
        gait = library.at(float(choice["speed [m/s]"]), float(choice["apex [m]"]))
        return gait_scene(robot, gait, name=kind, friction=friction)

    options = {
        "speed [m/s]": numbers([*library.speeds, speed]),
        "apex [m]": numbers([*library.apexes, apex]),
    }
    first = {"speed [m/s]": f"{speed:g}", "apex [m]": f"{apex:g}"}
    return Menu(make, options, first, options)


def numbers(values: Sequence[float]) -> list[str]:
    """Distinct values in order, as an option lists them."""
    return [f"{value:g}" for value in sorted({round(float(value), 9) for value in values})]


def nearest(values: Sequence[float], wanted: float, what: str) -> int:
    """Index of a value that must be among those given.

    Raises:
        InvalidInput: It is not.
    """
    index = int(np.argmin(np.abs(np.asarray(values) - wanted)))
    if abs(values[index] - wanted) > 1e-6:
        known = ", ".join(f"{v:g}" for v in values)
        raise InvalidInput(f"the result has no {what} {wanted:g}; choose one of: {known}")
    return index
