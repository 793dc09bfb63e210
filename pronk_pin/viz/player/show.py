"""Three lines to see a posture or a motion of one's own."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._typing import Array
from ...errors import InvalidInput
from ...robot import Robot, as_numbers, as_q
from ..scenes import SECOND_COLOR, Scene, Track
from .live import LiveServer, serve

_LAYOUT = "give (t, q), or an object with t and q, such as a Motion or a PhaseSimulation"


def show(
    robot: Robot,
    q: npt.ArrayLike,
    *,
    forces: npt.ArrayLike | None = None,
    friction: float | None = None,
    title: str = "",
    port: int | None = None,
    open_browser: bool = True,
) -> LiveServer:
    """Show a robot on a page, and return at once; `display` of what is returned moves it.

    Args:
        robot: The robot.
        q: Configuration in Pinocchio's layout, shape (19,).
        forces: Forces of the ground on the feet, in the world frame [N], shape (4, 3), drawn as
            arrows; with them, `display` wants them too.
        friction: Friction coefficient of the ground; with forces, their cones are drawn.
        title: Heading of the page.
        port: Port of the page; without it a free one is found.
        open_browser: Open the page in the default browser; not in a notebook, which shows it.

    Returns:
        The page, which ends with its `close` or with the process.

    Raises:
        InvalidInput: q or the forces are of another shape.
        PortUnavailable: The port is in use or forbidden.
    """
    configuration = as_q(robot, q)
    if configuration.ndim != 1:
        raise InvalidInput(
            f"q has shape {configuration.shape}; show one posture, and play a motion"
        )
    lam = None if forces is None else as_numbers("forces", forces)[None]
    track = Track(robot.name, np.zeros(1), configuration[None], forces=lam)
    scene = Scene(robot, (track,), title=title or robot.name.upper(), friction=friction)
    return _page(scene, port, open_browser)


def play(
    robot: Robot,
    trajectory: Any,
    reference: Any = None,
    *,
    beside: Any = None,
    friction: float | None = None,
    title: str = "",
    port: int | None = None,
    open_browser: bool = True,
    block: bool | None = None,
    duration: float | None = None,
) -> LiveServer | None:
    """Play a motion on a page with controls.

    A trajectory is a pair (t, q) of times [s], shape (n,), and configurations, shape (n, 19); or an
    object or a mapping with `t` and `q`, and perhaps `lam`, forces of the ground on all feet in
    the world frame [N], and `tau`, torques [N m]: a `Motion` of a gait, for example.

    Other arguments are those of `show`.

    Args:
        trajectory: The motion.
        reference: A motion to compare it with, shown as a translucent ghost.
        beside: A motion to show half a metre beside it.
        block: Wait for Ctrl-C; by default so in a script, and not in an interactive session.
        duration: End after this time [s] instead of waiting for Ctrl-C.

    Returns:
        The page, which ends with its `close` or with the process; None if it was waited for.

    Raises:
        InvalidInput: A trajectory is not one of this robot.
        PortUnavailable: The port is in use or forbidden.
    """
    tracks = [track_of(robot, trajectory, "robot")]
    if reference is not None:
        tracks.append(track_of(robot, reference, "reference", ghost=True))
    if beside is not None:
        second = track_of(robot, beside, "beside", color=SECOND_COLOR)
        tracks.append(second.moved(y=0.55))
    scene = Scene(robot, tracks, title=title or robot.name.upper(), friction=friction)
    if block or (block is None and not _interactive()):
        serve(scene, port=port, open_browser=open_browser, duration=duration)
        return None
    return _page(scene, port, open_browser)


def track_of(robot: Robot, trajectory: Any, name: str, **looks: Any) -> Track:
    """A trajectory of `play` as a track of that name, with further attributes of the `Track`."""
    if isinstance(trajectory, Track):
        return trajectory
    if isinstance(trajectory, tuple) and len(trajectory) == 2:
        trajectory = {"t": trajectory[0], "q": trajectory[1]}
    t, q = _entry(trajectory, "t"), _entry(trajectory, "q")
    if t is None or q is None:
        raise InvalidInput(f"a {type(trajectory).__name__} is no trajectory; {_LAYOUT}")
    q = as_q(robot, q)
    if q.ndim != 2 or t.shape != q.shape[:1]:
        raise InvalidInput(f"t has shape {t.shape} and q {q.shape}; expected (n,), (n, {robot.nq})")
    lam, tau = _entry(trajectory, "lam"), _entry(trajectory, "tau")
    shape = (len(t), len(robot.legs), 3)
    # Some hold the forces of the standing feet alone, without saying which those are.
    forces = None if lam is None or lam.size != np.prod(shape) else lam.reshape(shape)
    if tau is not None and tau.shape != (len(t), robot.nu):
        tau = None
    return Track(name, t, q, forces=forces, torque=tau, **looks)


def _entry(trajectory: Any, name: str) -> Array | None:
    found = (
        trajectory.get(name) if isinstance(trajectory, Mapping) else getattr(trajectory, name, None)
    )
    return None if found is None else as_numbers(name, found)


def _page(scene: Scene, port: int | None, open_browser: bool) -> LiveServer:
    server = LiveServer(scene, port=port)
    if not _notebook():
        print(f"{scene.title} is at {server.url}", flush=True)
        if open_browser:
            webbrowser.open(server.url)
    return server


def _notebook() -> bool:
    """Whether what is returned is shown by a notebook."""
    shell = sys.modules.get("IPython")
    active = shell.get_ipython() if shell is not None else None
    return active is not None and "IPKernelApp" in active.config


def _interactive() -> bool:
    return hasattr(sys, "ps1") or sys.flags.interactive == 1 or _notebook()
