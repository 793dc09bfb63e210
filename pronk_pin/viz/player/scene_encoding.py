"""A scene in the page's words: what `data/player.js` draws, see `packing` for the form."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex

from ..._typing import Array
from ...kinematics import foot_positions
from ...robot import Robot
from ..figure_style import SEQUENTIAL
from ..scenes import GHOST_COLOR, History, Scene, Track
from .packing import pack

FPS = 60.0
"""Frames kept for each second; the page interpolates between them."""

_ERROR_STEPS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
_USE_STEPS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
# Ends of the colour scales [rad], [of the limit].


_USUAL_LENGTH = 0.45
"""Distance of front and rear feet of a robot that the camera is set for [m]."""

_USUAL_HEIGHT = 0.36
"""Height of a standing trunk up to which the camera need not step back [m]."""


def robot_blob(scene: Scene) -> bytes:
    """Static part of a scene for the page: shapes, joints, names, colours."""
    look, robot = scene.appearance, scene.robot
    shapes = list(dict.fromkeys(part.shape for part in look.parts))
    names = [joint.name for joint in look.joints]
    return pack(
        {
            "name": robot.name,
            "joints": [
                {
                    "parent": joint.parent,
                    "placement": _matrix(joint.placement),
                    "axis": joint.axis.tolist(),
                    "slides": joint.slides,
                }
                for joint in look.joints
            ],
            "parts": [
                {
                    "name": part.name,
                    "joint": part.joint,
                    "placement": _matrix(part.placement),
                    "shape": shapes.index(part.shape),
                    "color": to_hex(part.color),
                }
                for part in look.parts
            ],
            "shapes": [vars(shape) for shape in shapes],
            "jointNames": [name.removesuffix("_joint") for name in names],
            "shown": _shown_joint(robot),
            "legs": list(robot.legs),
            "footRadius": robot.foot_radius,
            "size": _size(robot),
            "torqueLimits": robot.tau_max.tolist(),
            "scale": [to_hex(c) for c in colormaps[SEQUENTIAL](np.linspace(0.0, 1.0, 32))],
        }
    )


def film_blob(scene: Scene, *, fps: float = FPS) -> bytes:
    """Moving part of a scene for the page: its tracks over its duration."""
    times = scene.times(fps)
    rows = scene.rows(times)
    return pack(
        {
            "title": scene.title,
            "caption": scene.caption,
            "start": scene.start,
            "times": (times - scene.start)[:, None],
            "view": scene.view(times),
            "friction": scene.friction,
            "forceScale": scene.force_scale,
            "forceWindow": scene.force_window,
            "slope": scene.slope,
            "payload": scene.payload,
            "payloadPosition": list(scene.payload_position),
            "soft": scene.soft,
            "errorScale": _end(scene, rows, "error", _ERROR_STEPS),
            "useScale": _end(scene, rows, "torque", _USE_STEPS),
            "tracks": [_track(track, row) for track, row in zip(scene.tracks, rows, strict=True)],
        }
    )


def stream_row(scene: Scene, time: float) -> bytes:
    """One instant as the stream sends it, see `row_bytes`."""
    times = np.array([time])
    return row_bytes(scene, scene.rows(times), scene.view(times)[0])


def row_bytes(scene: Scene, rows: list[dict[str, Array]], view: Array) -> bytes:
    """One instant: 32-bit floats, first the view, then of each track q, feet and its channels."""
    values = [view]
    for track, row in zip(scene.tracks, rows, strict=True):
        values += [row[key][0] for key in ("q", "feet", *track.channels)]
    return np.concatenate(values).astype("<f4").tobytes()


def _track(track: Track, row: dict[str, Array]) -> dict[str, Any]:
    color = track.color or (GHOST_COLOR if track.ghost else None)
    accent = track.accent or color
    return {
        "name": track.name,
        "ghost": track.ghost,
        "color": to_hex(color) if color else None,
        "accent": to_hex(accent) if accent else None,
        "history": _history(track.history),
        "caption": track.caption,
        "marks": [list(mark) for mark in track.marks],
        "channels": list(track.channels),
        **row,
    }


def _history(history: History | None) -> dict[str, Any] | None:
    """Strides of a whole run, with errors to the tenth of a milliradian; None where not finite."""
    if history is None:
        return None
    return {
        "stride": history.stride.tolist(),
        "t": [round(float(t), 4) for t in history.t],
        "errors": {
            joint: [round(float(e), 4) if np.isfinite(e) else None for e in values]
            for joint, values in history.errors.items()
        },
        "began": history.began,
    }


def _end(
    scene: Scene, rows: list[dict[str, Array]], key: str, steps: tuple[float, ...]
) -> float | None:
    """End of a colour scale: the least step that covers nearly all of what is shown."""
    limit = scene.robot.tau_max if key == "torque" else 1.0
    shown = [np.abs(row[key]) / limit for row in rows if key in row]
    if not shown or np.all(np.isnan(np.concatenate(shown))):
        return None
    most = float(np.nanpercentile(np.concatenate(shown), 99.5))
    return next((step for step in steps if step >= most), steps[-1])


def _matrix(pose: Array) -> list[float]:
    """A pose by columns, as three.js takes it."""
    return [float(value) for value in pose.T.ravel()]


def _size(robot: Robot) -> float:
    """How much farther the camera stands than from the A1: for tall robots, and for long ones."""
    length = float(np.ptp(foot_positions(robot, robot.standing)[:, 0]))
    return max(1.0, float(robot.standing[2]) / _USUAL_HEIGHT, length / _USUAL_LENGTH)


def _shown_joint(robot: Robot) -> int:
    """The joint that the plots begin with: the last of the first leg, the calf."""
    last = robot.spec.leg_joints(robot.legs[0])[-1]
    return int(robot.joint_names.index(last))
