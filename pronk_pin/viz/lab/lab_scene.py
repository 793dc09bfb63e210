"""What a live session looks like: a scene of its robots side by side, and rows of their moments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgb

from ..._typing import Array
from ...compare import Scenario
from ...compare.session import LiveSession, Moment
from ..figure_style import look
from ..player import row_bytes
from ..scenes import Scene, Track

ASIDE = 0.55
"""Distance of robots from each other [m]."""

_DARKEST = 0.22
"""Least of red, green and blue with which a surface still shows its shape."""

_ERROR, _USE = 0.1, 0.5
"""Ends of the colour scales: tracking error [rad], and torque over its limit."""

_AVERAGED = 1.5
"""Time over which robots are kept side by side [s], longer than what a push does to them."""


def lab_scene(session: LiveSession) -> Scene:
    """The robots as they stand, in the colours of their controllers, in the world as it is now."""
    robot, scenario = session.experiment.model, session.scenario
    q = robot.standing[None]
    tracks = []
    for number, spec in enumerate(session.controllers):
        style = look(spec.name)
        red, green, blue = (max(part, _DARKEST) for part in to_rgb(style.color))
        track = Track(
            style.label,
            np.zeros(1),
            q,
            color=(red, green, blue),
            forces=np.full((1, len(robot.legs), 3), 1e-3),
            error=np.full((1, robot.nu), _ERROR),  # which sets the ends of the scales
            torque=_USE * robot.tau_max[None],
        )
        tracks.append(track.moved(y=places(len(session.controllers))[number]))
    return Scene(
        robot,
        tracks,
        title="Practice, live",
        caption=f"{robot.name.upper()}, {scenario.name}",
        friction=scenario.ground_friction,
        slope=scenario.slope,
        payload=scenario.payload,
        payload_position=scenario.payload_position,
        soft=scenario.ground_time_constant > Scenario("usual").ground_time_constant,
    )


def places(count: int) -> Array:
    """Where robots stand to the side [m], the first on the far side, shape (count,)."""
    return np.asarray(ASIDE * (0.5 * (count - 1) - np.arange(count)), dtype=float)


class Treadmill:
    """Keeps robots side by side on the page, whose speeds differ by a little.

    Each is shown beside the mean of its own way, so that a push or a stumble is seen, and what it
    gains over minutes is not.

    Args:
        count: Number of robots.
    """

    def __init__(self, count: int) -> None:
        self._mean = np.full(count, np.nan)
        self._then = np.full(count, np.nan)
        self._places = places(count)

    def row(self, scene: Scene, moments: Sequence[Moment]) -> bytes:
        """One instant of all robots as the stream sends it."""
        rows = []
        for number, moment in enumerate(moments):
            way, elapsed = float(moment.q[0]), moment.time - self._then[number]
            if not 0.0 <= elapsed < 1.0:  # at first, and after a reset
                self._mean[number] = way
            else:
                share = 1.0 - np.exp(-elapsed / _AVERAGED)
                self._mean[number] += share * (way - self._mean[number])
            self._then[number] = moment.time
            q = moment.q[None].copy()
            q[0, :2] += [self._mean[0] - self._mean[number], self._places[number]]
            rows.append(
                {
                    "q": q,
                    "feet": scene.appearance.feet(q).reshape(1, -1),
                    "forces": moment.forces.reshape(1, -1),
                    "error": moment.error[None],
                    "torque": moment.torque[None],
                }
            )
        ahead = 0.0 if len(moments) == 0 else float(moments[0].q[0] - self._mean[0])
        view = np.array([self._mean[0] + min(max(ahead, 0.0), 2.0), 0.0])
        return row_bytes(scene, rows, view)
