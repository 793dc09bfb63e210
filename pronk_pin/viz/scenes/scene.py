"""Scenes: robots that move, on a ground that passes under them.

A `Scene` is data. The live page, the file, pictures and films all show what its `rows` say.

The view is a treadmill: it travels with the first solid robot, at that robot's position averaged
over about a stride, so that metres of motion stay in the picture and the ground scrolls. Robots
that lag or lead are seen to do so; the bounce within a stride stays visible too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..._checks import Interval, instance_of, none_or, real, sequence_of, shown, text
from ..._typing import Array, IntArray
from ...errors import InvalidInput
from ...robot import Robot, arrow_scale, as_numbers, as_robot
from .meshes import Appearance, appearance

Color = tuple[float, float, float]
"""Red, green and blue, each in [0, 1]."""

GHOST_COLOR: Color = (0.0, 0.45, 0.70)
"""Blue that readers with any colour vision tell from the robot's grey (Okabe and Ito)."""

SECOND_COLOR: Color = (0.90, 0.62, 0.0)
"""Orange (Okabe and Ito), for a second robot beside the first."""

VIEW_WINDOW = 0.6
"""Time over which the view averages the leader's position [s]: longer than a stride."""

CHANNELS = ("forces", "error", "torque", "feedforward")
"""Channels that a track may hold beside its configurations."""


class Mark(NamedTuple):
    """The beginning of a phase.

    Attributes:
        t: When it begins [s].
        stride: Number of the stride.
        phase: Name of the phase.
    """

    t: float
    stride: int
    phase: str


@dataclass(frozen=True, eq=False)
class History:
    """Errors of a robot over its whole run, of which a scene may show a part.

    Attributes:
        stride: Numbers of the strides, shape (n,).
        t: When they begin, on the clock of the track [s], shape (n,); not all are in the scene.
        errors: Peak errors in stance [rad], shape (n,), by the name of the joint.
        began: Number of the stride at which the learning began; None without learning.
    """

    stride: IntArray
    t: Array
    errors: Mapping[str, Array]
    began: int | None = None


@dataclass(frozen=True, eq=False)
class Track:
    """A robot's motion, and how it is shown.

    Attributes:
        name: What the page calls it; one name per scene.
        t: Times, increasing [s], shape (n,).
        q: Configurations in Pinocchio's layout, shape (n, 19).
        ghost: Shown translucent and in one colour, as references are.
        color: Colour in place of the URDF's; a ghost is blue without it.
        accent: Colour of its curves and of its entry in the legend; by default its colour.
        forces: Forces of the ground on the feet, in the world frame [N], shape (n, 4, 3); each is
            an arrow from the foot's lowest point. NaN where they are not known.
        error: Reference minus measured joint angles [rad], shape (n, 12); NaN where not known.
        torque: Torques of the motors [N m], shape (n, 12); NaN where not known.
        marks: The phases and strides, in the order of time.
        caption: A line about it for the legend.
        feedforward: What of the torque is feedforward [N m], shape (n, 12), for the plots.
        history: Errors over its whole run, for running numbers and the timeline.
    """

    name: str
    t: Array
    q: Array
    ghost: bool = False
    color: Color | None = None
    forces: Array | None = None
    error: Array | None = None
    torque: Array | None = None
    marks: Sequence[Mark] = ()
    caption: str = ""
    accent: Color | None = None
    feedforward: Array | None = None
    history: History | None = None

    def __post_init__(self) -> None:
        for key in ("t", "q", *self.channels):
            values = as_numbers(f"track {shown(self.name)}: {key}", getattr(self, key))
            object.__setattr__(self, key, values)
        if not text("name of a track", self.name):
            raise InvalidInput("a track needs a name; give one")
        if self.t.ndim != 1 or len(self.t) == 0 or np.any(np.diff(self.t) <= 0.0):
            raise InvalidInput(f"track '{self.name}': t must increase from one sample to the next")
        for key in ("t", "q"):
            if not np.all(np.isfinite(getattr(self, key))):
                raise InvalidInput(
                    f"track '{self.name}': {key} holds NaN or infinity; cut that part"
                )

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the `CHANNELS` that the track holds."""
        return tuple(key for key in CHANNELS if getattr(self, key) is not None)

    def check(self, robot: Robot) -> None:
        """Check the shapes against a robot.

        Raises:
            InvalidInput: One does not fit.
        """
        n = len(self.t)
        shapes = {
            "q": (n, robot.nq),
            "forces": (n, len(robot.legs), 3),
            "error": (n, robot.nu),
            "torque": (n, robot.nu),
            "feedforward": (n, robot.nu),
        }
        for key in ("q", *self.channels):
            shape = getattr(self, key).shape
            if shape != shapes[key]:
                raise InvalidInput(
                    f"track '{self.name}': {key} is of shape {shape}, not {shapes[key]}"
                )

    def moved(self, x: float = 0.0, y: float = 0.0) -> Track:
        """The same motion at another place [m]."""
        q = self.q.copy()
        q[:, :2] += [x, y]
        return replace(self, q=q)

    def at(self, times: Array) -> dict[str, Array]:
        """Configuration and channels at some times [s], interpolated; the ends are held.

        Args:
            times: Times, shape (m,).

        Returns:
            "q", shape (m, 19), and the channels there are, each flattened, shape (m, ...).
        """
        after = np.clip(np.searchsorted(self.t, times, side="right"), 1, max(len(self.t) - 1, 1))
        before, after = after - 1, np.minimum(after, len(self.t) - 1)
        span = self.t[after] - self.t[before]
        w = np.divide(times - self.t[before], span, out=np.zeros(len(times)), where=span > 0.0)
        w = np.clip(w, 0.0, 1.0)[:, None]
        first, second = self.q[before], self.q[after].copy()
        turned = np.sum(first[:, 3:7] * second[:, 3:7], axis=1) < 0.0
        second[turned, 3:7] *= -1.0  # the same rotation, on the near side of the sphere
        q = (1.0 - w) * first + w * second
        q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
        values_at = {"q": q}
        for key in self.channels:
            values = getattr(self, key).reshape(len(self.t), -1)
            values_at[key] = (1.0 - w) * values[before] + w * values[after]
        return values_at


_FORCE_SCALE = 0.0025
"""Length of a force arrow of the A1 [m/N]."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Robots, their motions and the ground.

    Attributes:
        robot: The robot; all tracks are motions of it.
        tracks: The motions, which share one clock; the view follows the first that is no ghost.
        title: Heading of the page.
        caption: A line below the heading.
        friction: Friction coefficient of the ground, for the cones; None without cones.
        force_scale: Length of a force arrow [m/N]; by default 0.1 m for 40 N of the A1, and of
            others by their size and weight.
        force_window: Time over which the forces are means [s], for the legend; 0 if they are not.
        slope: Slope of the ground, uphill in x where positive [rad]; motions are in its frame.
        payload: Mass on the trunk [kg], which is drawn as a cube of steel.
        payload_position: Where it is, in the trunk's frame [m].
        soft: Whether the ground is softer than usual, which is drawn by its colour.
    """

    robot: Robot
    tracks: Sequence[Track]
    title: str = ""
    caption: str = ""
    friction: float | None = None
    force_scale: float | None = None
    force_window: float = 0.0
    slope: float = 0.0
    payload: float = 0.0
    payload_position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    soft: bool = False

    def __post_init__(self) -> None:
        as_robot(self.robot)
        tracks = sequence_of(
            "tracks", self.tracks, lambda k, track: instance_of(k, track, Track), wanted="tracks"
        )
        for name in ("title", "caption"):
            text(name, getattr(self, name))
        names = [track.name for track in tracks]
        if not names or len(set(names)) < len(names):
            raise InvalidInput(f"a scene needs tracks of different names, not {names}")
        for track in self.tracks:
            track.check(self.robot)
        none_or(real, "friction", self.friction, Interval(0, 10, above=True, below=True))
        if self.force_scale is None:
            object.__setattr__(self, "force_scale", _FORCE_SCALE * arrow_scale(self.robot))

    @cached_property
    def appearance(self) -> Appearance:
        """The robot's visuals."""
        return appearance(self.robot)

    @property
    def start(self) -> float:
        """When the first track begins [s]."""
        return float(min(track.t[0] for track in self.tracks))

    @property
    def duration(self) -> float:
        """From the beginning of the first track to the end of the last [s]."""
        return float(max(track.t[-1] for track in self.tracks)) - self.start

    def times(self, fps: float) -> Array:
        """The instants of a film of this scene, on the tracks' clock [s], shape (frames,).

        Phases begin at instants of their own: between two frames a foot would touch down in the
        air, and a force would act before it does.
        """
        regular = self.start + np.arange(round(self.duration * fps) + 1) / fps
        begins = [mark.t for track in self.tracks for mark in track.marks]
        inside = [t for t in begins if regular[0] < t < regular[-1]]
        instants = np.unique(np.concatenate([regular, inside]))
        return instants[np.diff(instants, prepend=-np.inf) > 1e-7]

    @cached_property
    def leader(self) -> Track:
        """The track that the view follows."""
        return next((track for track in self.tracks if not track.ghost), self.tracks[0])

    @cached_property
    def _path(self) -> tuple[Array, Array]:
        """Times [s], shape (m,), and positions of the view [m], shape (m, 2)."""
        t = np.arange(self.leader.t[0], self.leader.t[-1] + 0.01, 0.01)
        path = np.stack([np.interp(t, self.leader.t, self.leader.q[:, i]) for i in (0, 1)])
        half = min(round(0.5 * VIEW_WINDOW / 0.01), len(t) - 1)
        # Odd reflection at the ends: a steady run is followed steadily from the first frame on.
        padded = np.pad(path, ((0, 0), (half, half)), mode="reflect", reflect_type="odd")
        window = np.full(2 * half + 1, 1.0 / (2 * half + 1))
        smooth = np.stack([np.convolve(row, window, mode="valid") for row in padded], axis=-1)
        # Robots side by side stand on both sides of the middle of the picture.
        solid = [track.q[0, 1] for track in self.tracks if not track.ghost]
        if solid:
            smooth[:, 1] += np.mean(solid) - self.leader.q[0, 1]
        return t, smooth

    def view(self, times: Array) -> Array:
        """Position of the view at some times [s]: x and y in the world [m], shape (m, 2)."""
        t, path = self._path
        return np.stack([np.interp(times, t, path[:, i]) for i in (0, 1)], axis=-1)

    def rows(self, times: Array) -> list[dict[str, Array]]:
        """Values of each track at some times [s], shape (m,).

        Returns:
            For each track what `Track.at` gives, and the centres of the feet in the world [m],
            "feet" (m, 12).
        """
        rows = []
        for track in self.tracks:
            row = track.at(times)
            row["feet"] = self.appearance.feet(row["q"]).reshape(len(times), -1)
            rows.append(row)
        return rows
