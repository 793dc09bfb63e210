"""What is shown: robots that move, on a ground that passes under them.

A `Scene` is data. The live page and the one-file replay both draw what `Scene.transforms` says.

The view is a treadmill: it travels with the first solid robot, at that robot's position averaged
over about a stride, so that metres of motion stay in the picture and the ground scrolls. Robots
that lag or lead are seen to do so; the bounce within a stride stays visible too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .._typing import Array
from ..errors import InvalidInput
from ..gait import Gait
from ..robot import Robot
from .meshes import Appearance, appearance

Color = tuple[float, float, float]
"""Red, green and blue, each in [0, 1]."""

GHOST_COLOR: Color = (0.0, 0.45, 0.70)
"""Blue that readers with any colour vision tell from the robot's grey (Okabe and Ito)."""

GHOST_OPACITY = 0.35
"""Opacity of a ghost."""

VIEW_WINDOW = 0.6
"""Time over which the view averages the leader's position [s]: longer than a stride."""

_SMALLEST_ARROW = 1e-4
# A transform cannot shrink to nothing: the page takes it apart into rotation and scale.


@dataclass(frozen=True, eq=False)
class Track:
    """A robot's motion, and how it is shown.

    Attributes:
        name: What the page calls it; one name per scene.
        t: Times, increasing [s], shape (n,).
        q: Configurations in Pinocchio's layout, shape (n, 19).
        ghost: Shown translucent and in one colour, as references are.
        color: Colour in place of the URDF's; a ghost is blue without it.
        forces: Forces of the ground on the feet, in the world frame [N], shape (n, 4, 3); each is
            an arrow from the foot's lowest point.
        caption: A line about it for the legend.
    """

    name: str
    t: Array
    q: Array
    ghost: bool = False
    color: Color | None = None
    forces: Array | None = None
    caption: str = ""

    def __post_init__(self) -> None:
        for key in ("t", "q") if self.forces is None else ("t", "q", "forces"):
            object.__setattr__(self, key, np.asarray(getattr(self, key), dtype=float))
        n = len(np.atleast_1d(self.t))
        self._expect("t", (n,))
        self._expect("q", (n, 19))
        if self.forces is not None:
            self._expect("forces", (n, 4, 3))
        if n == 0 or np.any(np.diff(self.t) <= 0.0):
            raise InvalidInput(f"track '{self.name}': t must increase from one sample to the next")
        if not self.name or "/" in self.name:
            raise InvalidInput(f"a track's name must not be empty or hold a '/', as '{self.name}'")

    def _expect(self, key: str, shape: tuple[int, ...]) -> None:
        array = getattr(self, key)
        if array.shape != shape:
            raise InvalidInput(f"track '{self.name}': {key} is of shape {array.shape}, not {shape}")
        if not np.all(np.isfinite(array)):
            raise InvalidInput(f"track '{self.name}': {key} holds NaN or infinity; cut that part")

    def at(self, time: float) -> tuple[Array, Array | None]:
        """Configuration and forces at a time [s], interpolated; the ends are held.

        Returns:
            q, shape (19,), and the forces [N], shape (4, 3), or None.
        """
        k = int(np.clip(np.searchsorted(self.t, time), 1, max(len(self.t) - 1, 1)))
        before, after = k - 1, min(k, len(self.t) - 1)
        span = self.t[after] - self.t[before]
        w = float(np.clip((time - self.t[before]) / span, 0.0, 1.0)) if span > 0.0 else 0.0
        first, second = self.q[before], self.q[after].copy()
        if first[3:7] @ second[3:7] < 0.0:
            second[3:7] *= -1.0  # the same rotation, on the near side of the sphere
        q = (1.0 - w) * first + w * second
        q[3:7] /= np.linalg.norm(q[3:7])
        if self.forces is None:
            return q, None
        return q, (1.0 - w) * self.forces[before] + w * self.forces[after]


@dataclass(frozen=True, eq=False)
class Scene:
    """Robots, their motions and the ground.

    Attributes:
        robot: The robot; all tracks are motions of it.
        tracks: The motions, which share one clock; the view follows the first that is no ghost.
        title: Heading of the page.
        caption: A line below the heading.
        force_scale: Length of a force arrow [m/N].
    """

    robot: Robot
    tracks: Sequence[Track]
    title: str = ""
    caption: str = ""
    force_scale: float = 0.0025

    def __post_init__(self) -> None:
        names = [track.name for track in self.tracks]
        if not names or len(set(names)) < len(names):
            raise InvalidInput(f"a scene needs tracks of different names, not {names}")

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
        """The instants of a film of this scene, on the tracks' clock [s], shape (frames,)."""
        return self.start + np.arange(round(self.duration * fps) + 1) / fps

    @cached_property
    def leader(self) -> Track:
        """The track that the view follows."""
        return next((track for track in self.tracks if not track.ghost), self.tracks[0])

    @cached_property
    def _view(self) -> tuple[Array, Array]:
        """Times [s], shape (m,), and positions of the view [m], shape (m, 2)."""
        t = np.arange(self.leader.t[0], self.leader.t[-1] + 0.01, 0.01)
        path = np.stack([np.interp(t, self.leader.t, self.leader.q[:, i]) for i in (0, 1)])
        half = min(round(0.5 * VIEW_WINDOW / 0.01), len(t) - 1)
        # Odd reflection at the ends: a steady run is followed steadily from the first frame on.
        padded = np.pad(path, ((0, 0), (half, half)), mode="reflect", reflect_type="odd")
        window = np.full(2 * half + 1, 1.0 / (2 * half + 1))
        return t, np.stack([np.convolve(row, window, mode="valid") for row in padded], axis=-1)

    def view(self, time: float) -> Array:
        """Where the view is at a time [s]: x and y in the world [m], shape (2,)."""
        t, path = self._view
        return np.array([np.interp(time, t, path[:, i]) for i in (0, 1)])

    @property
    def travel(self) -> tuple[Array, Array]:
        """Lowest and highest x and y that the view reaches [m], each of shape (2,)."""
        path = self._view[1]
        return path.min(axis=0), path.max(axis=0)

    def transforms(self, time: float) -> list[tuple[str, Array]]:
        """Where everything is at a time [s] on the tracks' clock.

        Returns:
            Paths, and poses in the frame of the view, shape (4, 4); those of arrows are scaled.
        """
        shift = np.append(-self.view(time), 0.0)
        ground = np.eye(4)
        ground[:3, 3] = shift
        found = [("ground", ground)]
        for track in self.tracks:
            q, forces = track.at(time)
            poses, feet = self.appearance.place(q)
            poses[:, :3, 3] += shift
            for part, pose in zip(self.appearance.parts, poses, strict=True):
                found.append((f"{track.name}/{part.name}", pose))
            if forces is None:
                continue
            contacts = feet + shift - [0.0, 0.0, self.robot.foot_radius]
            for leg, contact, force in zip(self.robot.legs, contacts, forces, strict=True):
                found.append((force_path(track, leg), arrow(contact, self.force_scale * force)))
        return found


def force_path(track: Track, leg: str) -> str:
    """Path of the arrow of a leg's contact force."""
    return f"{track.name}/force {leg}"


def arrow(origin: Array, vector: Array) -> Array:
    """Transform that takes the unit arrow along z to an arrow from a point.

    Args:
        origin: Where it begins [m], shape (3,).
        vector: Where it ends, from there [m], shape (3,).

    Returns:
        Rotation with its third column scaled, and translation, shape (4, 4).
    """
    length = max(float(np.linalg.norm(vector)), _SMALLEST_ARROW)
    z = vector / length if length > _SMALLEST_ARROW else np.array([0.0, 0.0, 1.0])
    # Any direction across will do: an arrow is round.
    x = np.cross([0.0, 1.0, 0.0] if abs(z[1]) < 0.9 else [1.0, 0.0, 0.0], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    # An arrow without length loses its width too, or a disc would remain of it.
    width = min(1.0, length / 0.01)
    pose[:3, 0], pose[:3, 1], pose[:3, 2] = width * x, width * np.cross(z, x), length * z
    pose[:3, 3] = origin
    return pose


def gait_scene(robot: Robot, gait: Gait, *, strides: int = 6, dt: float = 0.005) -> Scene:
    """A gait over a few strides, with its contact forces.

    Args:
        robot: The robot the gait is for.
        gait: The gait.
        strides: How many strides.
        dt: Time between samples [s].
    """
    times, configurations, forces = [], [], []
    for stride in range(strides):
        begin = stride * gait.duration
        for phase in gait.phases:
            # The end of a phase is the beginning of the next one; each instant is shown once.
            s = np.linspace(0.0, 1.0, max(round(phase.duration / dt), 1), endpoint=False)
            motion = phase.motion(robot, s)
            q = motion.q.copy()
            q[:, 0] += stride * gait.speed * gait.duration
            times.append(begin + motion.t)
            configurations.append(q)
            forces.append(motion.lam)
            begin += phase.duration
    track = Track(
        name="gait",
        t=np.concatenate(times),
        q=np.concatenate(configurations),
        forces=np.concatenate(forces),
        caption=", ".join(f"{phase.name} {phase.duration:.3f} s" for phase in gait.phases),
    )
    caption = f"{gait.speed:.2f} m/s, apex {gait.apex:.2f} m, {1.0 / gait.duration:.2f} strides/s"
    return Scene(robot, (track,), title=f"{robot.name.upper()} gait", caption=caption)
