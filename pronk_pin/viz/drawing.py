"""A scene in MeshCat's words: the messages that its viewer understands.

Each message is one msgpack blob. The live page gets them over a websocket, the replay holds them.
The viewer shares a geometry only within one message, and moves only what has a message of its own;
so every part is sent for every robot, and is small enough for that.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources
from string import Template

import meshcat.commands as mc
import meshcat.geometry as mg
import numpy as np
import umsgpack
from meshcat.path import Path as ScenePath
from scipy.spatial.transform import Rotation

from .._typing import Array
from .meshes import Mesh, Part, grid_faces
from .scene import GHOST_COLOR, GHOST_OPACITY, Color, Scene, Track, force_path

ROOT = "/meshcat/"
"""Path of everything that this package draws; the viewer's own things lie beside it."""

FORCE_COLOR: Color = (0.84, 0.37, 0.0)
"""Vermilion (Okabe and Ito): apart from the ghost's blue for readers with any colour vision."""

GROUND_COLORS: tuple[Color, Color] = ((0.92, 0.92, 0.91), (0.76, 0.77, 0.79))
"""The two kinds of tiles."""

TILE, MARGIN = 0.5, 6.0
"""Edge of a tile, and how far the ground reaches beyond the view's path [m]."""

_FLOAT32 = 0x17
# The viewer's msgpack extension for a Float32Array.


def setup_messages(scene: Scene) -> list[bytes]:
    """What is sent once: surroundings, robots and arrows, at the scene's beginning."""
    messages = [*_surroundings(), _pack(mc.SetObject(_ground(scene), path=_path("ground")))]
    for track in scene.tracks:
        messages += _robot(scene, track)
    return messages + frame_messages(scene, scene.start)


def frame_messages(scene: Scene, time: float) -> list[bytes]:
    """What moves, at a time [s] on the tracks' clock."""
    return [
        umsgpack.packb(
            {
                "type": "set_transform",
                "path": ROOT + path,
                # The viewer wants the matrix by columns.
                "matrix": _float32(pose.T),
            }
        )
        for path, pose in scene.transforms(time)
    ]


def animation_message(scene: Scene, *, fps: float) -> bytes:
    """The whole film in one message, which the viewer then plays and repeats by itself."""
    times = scene.times(fps)
    frames = [scene.transforms(float(time)) for time in times]
    elapsed = times - scene.start
    paths = [path for path, _ in frames[0]]
    poses = np.array([[pose for _, pose in frame] for frame in frames])  # (frames, paths, 4, 4)
    animations = [
        {
            "path": ROOT + path,
            # One frame a second, for the times are in seconds.
            "clip": {"fps": 1, "name": "default", "tracks": list(_keys(elapsed, poses[:, i]))},
        }
        for i, path in enumerate(paths)
    ]
    options = {"play": True, "repetitions": float("inf")}
    message = {"type": "set_animation", "animations": animations, "options": options, "path": ""}
    return bytes(umsgpack.packb(message))


def page(scene: Scene, script: str) -> str:
    """The HTML page of a scene.

    Args:
        scene: The scene, for the heading and the legend.
        script: `<script>` elements that load MeshCat's viewer, call the page's `createViewer()`
            and feed what that returns.
    """
    legend = []
    for track in scene.tracks:
        # The first part is the trunk, whose colour is the robot's to the eye.
        color = _css(_color(track, scene.appearance.parts[0]))
        text = _escape(f"{track.name}: {track.caption}" if track.caption else track.name)
        legend.append(f'<li><span style="background:{color}"></span>{text}</li>')
    if any(track.forces is not None for track in scene.tracks):
        text = f"ground reaction force, 0.1 m for {0.1 / scene.force_scale:.0f} N"
        legend.append(f'<li><span style="background:{_css(FORCE_COLOR)}"></span>{text}</li>')
    template = resources.files(__package__).joinpath("data/page.html").read_text(encoding="utf-8")
    return Template(template).substitute(
        title=_escape(scene.title or "pronk_pin"),
        caption=_escape(scene.caption),
        legend="\n".join(legend),
        script=script,
    )


def viewer_source() -> str:
    """MeshCat's viewer, one JavaScript file."""
    source = resources.files("meshcat").joinpath("viewer/dist/main.min.js")
    return source.read_text(encoding="utf-8")


def _keys(times: Array, poses: Array) -> Iterator[dict[str, object]]:
    """Key frames of one node from its poses, shape (frames, 4, 4)."""
    scale = np.linalg.norm(poses[:, :3, :3], axis=1)  # (frames, 3)
    rotation = Rotation.from_matrix(poses[:, :3, :3] / scale[:, None, :])
    yield _key("position", "vector3", times, poses[:, :3, 3])
    yield _key("quaternion", "quaternion", times, rotation.as_quat())
    if not np.allclose(scale, 1.0):
        yield _key("scale", "vector3", times, scale)


def _key(name: str, kind: str, times: Array, values: Array) -> dict[str, object]:
    return {"name": f".{name}", "type": kind, "times": _float32(times), "values": _float32(values)}


def _surroundings() -> Iterator[bytes]:
    """Background and light; the viewer's own grid and axes are put away."""
    for name in ("/Grid", "/Axes", "/Lights/PointLightNegativeX", "/Lights/PointLightPositiveX"):
        yield _property(name, "visible", False)
    yield _property("/Background", "top_color", [0.86, 0.90, 0.94])
    yield _property("/Background", "bottom_color", [0.97, 0.97, 0.96])
    yield _property("/Lights/AmbientLight/<object>", "intensity", 0.4)
    yield _property("/Lights/FillLight/<object>", "intensity", 0.3)
    # A sun that throws shadows: what tells a robot in the air from one on the ground.
    frustum = {"left": -1.5, "right": 1.5, "top": 1.5, "bottom": -1.5, "near": 0.5, "far": 8.0}
    light = {
        "type": "DirectionalLight",
        "intensity": 0.5,
        "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.6, -1.2, 3.0, 1],
        "shadow": {
            "mapSize": [2048, 2048],
            "bias": -0.001,
            "camera": {"type": "OrthographicCamera", **frustum},
        },
    }
    message = {"type": "set_object", "path": f"{ROOT}sun", "object": {"object": light}}
    yield bytes(umsgpack.packb(message))


def _robot(scene: Scene, track: Track) -> Iterator[bytes]:
    """The parts of one robot, and its arrows."""
    opacity = GHOST_OPACITY if track.ghost else 1.0
    for part in scene.appearance.parts:
        path = f"{track.name}/{part.name}"
        yield _mesh(path, part.mesh, _color(track, part), opacity)
        if track.ghost:
            yield _property(f"{ROOT}{path}/<object>", "castShadow", False)
    if track.forces is not None:
        for leg in scene.robot.legs:
            yield _mesh(force_path(track, leg), _unit_arrow(), FORCE_COLOR, opacity)


def _color(track: Track, part: Part) -> Color:
    return track.color or (GHOST_COLOR if track.ghost else part.color)


def _mesh(path: str, mesh: Mesh, color: Color, opacity: float) -> bytes:
    material = mg.MeshPhongMaterial(
        color=_number(color),
        opacity=opacity,
        shininess=15,
        flatShading=True,
        side=0,  # outer faces only: half the work for a page without a graphics card
        # Where a ghost and the robot coincide the robot is in front, without speckles.
        polygonOffset=opacity < 1.0,
        polygonOffsetFactor=2.0,
        polygonOffsetUnits=2.0,
    )
    geometry = mg.TriangularMeshGeometry(mesh.vertices, mesh.faces)
    return _pack(mc.SetObject(mg.Mesh(geometry, material), path=_path(path)))


def _ground(scene: Scene) -> mg.Mesh:
    """A floor of tiles in two colours, under all of the view's path."""
    low, high = scene.travel
    low, high = np.floor((low - MARGIN) / TILE), np.ceil((high + MARGIN) / TILE)
    column, row = (index.reshape(-1) for index in np.mgrid[low[0] : high[0], low[1] : high[1]])
    corners = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    points = TILE * (np.stack([column, row], axis=-1)[:, None, :] + corners)  # (tiles, 4, 2)
    vertices = np.pad(points.reshape(-1, 2), ((0, 0), (0, 1)))
    faces = (4 * np.arange(len(column))[:, None, None] + grid_faces(2, 2)).reshape(-1, 3)
    odd = ((column + row) % 2).astype(int)
    colors = np.repeat(np.array(GROUND_COLORS)[odd], 4, axis=0)
    geometry = mg.TriangularMeshGeometry(vertices, faces, color=colors)
    return mg.Mesh(geometry, mg.MeshLambertMaterial(vertexColors=True))


def _unit_arrow(*, radius: float = 0.008, segments: int = 16) -> Mesh:
    """An arrow of length 1 along z; its length, not its width, is scaled."""
    profile = np.array([[0, 0], [radius, 0], [radius, 0.75], [2.5 * radius, 0.75], [0, 1]])
    angle = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    r, z = profile[:, :1], profile[:, 1:]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z + 0.0 * angle], axis=-1)
    return Mesh(points.reshape(-1, 3), grid_faces(len(profile), len(angle)))


def _path(name: str) -> ScenePath:
    return ScenePath(tuple(f"{ROOT}{name}".strip("/").split("/")))


def _pack(command: mc.SetObject) -> bytes:
    return bytes(umsgpack.packb(command.lower()))


def _property(path: str, name: str, value: object) -> bytes:
    message = {"type": "set_property", "path": path, "property": name, "value": value}
    return bytes(umsgpack.packb(message))


def _float32(array: Array) -> umsgpack.Ext:
    return umsgpack.Ext(_FLOAT32, np.ascontiguousarray(array, dtype="<f4").tobytes())


def _number(color: Color) -> int:
    r, g, b = (round(255 * c) for c in color)
    return (r << 16) + (g << 8) + b


def _css(color: Color) -> str:
    return f"#{_number(color):06x}"


def _escape(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
