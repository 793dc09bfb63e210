"""Visual geometry of the robot: what its URDF shows of each link."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pinocchio as pin

from ..._typing import Array
from ...errors import InvalidInput, PartNotShown, PronkError
from ...robot import Robot, check_shape, document_of, find_mesh, numbers_of, placement_of
from .mesh_files import Mesh, load_mesh, thin

SMALLEST = 0.005
"""Visuals smaller than this are left out [m]: the A1's URDF marks its frames with 1 mm boxes."""

_GREY = (0.9, 0.9, 0.9)
"""Of what the URDF gives no colour."""


@dataclass(frozen=True)
class Solid:
    """A shape that the page draws itself, about the origin.

    Attributes:
        kind: "box", "sphere", "cylinder", "capsule" or "cone".
        size: Edges of a box, radius of a sphere, else radius and length along z, that of a capsule
            without its round ends [m]. A cone's tip is at positive z.
    """

    kind: str
    size: tuple[float, ...]


Shape: TypeAlias = Mesh | Solid


@dataclass(frozen=True, eq=False)
class Part:
    """One visual of the robot.

    Attributes:
        name: Name of its link, and its number there, as Pinocchio names geometry objects.
        joint: Number of the joint that moves it, in Pinocchio's order; 1 is the floating base.
        placement: Its pose in the joint's frame, shape (4, 4).
        shape: Its surface in its own frame; parts of the same mesh share one.
        color: Red, green and blue of the URDF, each in [0, 1].
    """

    name: str
    joint: int
    placement: Array
    shape: Shape
    color: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Joint:
    """A hinge or a slide of the kinematic tree.

    Attributes:
        name: Its name.
        parent: Number of the joint that carries it, in Pinocchio's order; 1 is the floating base.
        placement: Its pose in the parent's frame where its angle is 0, shape (4, 4).
        axis: What it turns about or slides along, in its own frame, shape (3,).
        slides: Whether it is a slide.
    """

    name: str
    parent: int
    placement: Array
    axis: Array
    slides: bool = False


@dataclass(frozen=True, eq=False)
class Appearance:
    """The visuals of a robot, and the tree of joints that moves them.

    Attributes:
        robot: The robot.
        joints: The joints after the floating base; the number of the first is 2.
        parts: The visuals that are shown.
    """

    robot: Robot
    joints: tuple[Joint, ...]
    parts: tuple[Part, ...]

    def feet(self, q: Array) -> Array:
        """Centres of the feet in the world [m], shape (n, 4, 3), of configurations (n, 19)."""
        # Scratch memory of its own, for pages are drawn from threads.
        model, data = self.robot.model, self.robot.model.createData()
        centres = np.empty((len(q), len(self.robot.legs), 3))
        for row, configuration in enumerate(q):
            pin.framesForwardKinematics(model, data, configuration)
            centres[row] = [data.oMf[foot].translation for foot in self.robot.foot_ids]
        return centres


@lru_cache(maxsize=4)
def appearance(robot: Robot) -> Appearance:
    """The visuals of a robot, thinned out.

    One that cannot be shown, whose mesh is missing, say, is left out, with the warning
    `PartNotShown`.

    Raises:
        InvalidInput: A joint is of a kind that cannot be shown.
    """
    thinned: dict[tuple[Path, tuple[float, ...]], Mesh] = {}
    parts, missing = [], []
    for name, frame, visual, color in _visuals(robot):
        try:
            shape = _shape(robot, visual, thinned)
            if _extent(shape) <= SMALLEST:
                continue
            place = (frame.placement * placement_of(visual)).homogeneous
        except PronkError as error:
            missing.append((name, str(error)))
            continue
        parts.append(Part(name, int(frame.parentJoint), place, shape, color))
    if missing:
        warnings.warn(PartNotShown(robot.name, missing), stacklevel=2)
    return Appearance(robot, _joints(robot), tuple(parts))


def _visuals(
    robot: Robot,
) -> Iterator[tuple[str, pin.Frame, ElementTree.Element, tuple[float, float, float]]]:
    """Of each visual its name, its link's frame, its element, and its colour."""
    root = document_of(robot.urdf)
    colors: dict[str, tuple[float, float, float]] = {}
    for material in (*root.findall("material"), *root.findall("link/visual/material")):
        if (own := _color(material)) is not None:
            colors.setdefault(material.get("name", ""), own)  # the first of a name is its colour
    for link in root.findall("link"):
        name = link.get("name", "")
        frame = robot.model.frames[robot.model.getFrameId(name, pin.BODY)]
        for number, visual in enumerate(link.findall("visual")):
            named = [material.get("name", "") for material in visual.findall("material")]
            color = colors.get(named[0], _GREY) if named else _GREY
            yield f"{name}_{number}", frame, visual, color


def _color(material: ElementTree.Element) -> tuple[float, float, float] | None:
    """The colour of a material; None where it has none that can be read."""
    element = material.find("color")
    if element is None:
        return None
    try:
        r, g, b, _ = np.clip(numbers_of(element, "rgba", None, 4), 0.0, 1.0)
    except InvalidInput:
        return None
    return float(r), float(g), float(b)


def _joints(robot: Robot) -> tuple[Joint, ...]:
    """The tree of joints below the floating base."""
    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    found = []
    for index in range(2, model.njoints):
        motion = np.asarray(data.joints[index].S).reshape(6, -1)
        slides = bool(np.any(motion[:3]))
        if motion.shape[1] != 1 or (slides and np.any(motion[3:])):
            raise InvalidInput(
                f"joint {model.names[index]} of {robot.name} does not turn about one axis, or "
                "slide along one; no others can be shown"
            )
        place = model.jointPlacements[index].homogeneous
        axis = motion[:3, 0] if slides else motion[3:, 0]
        found.append(Joint(model.names[index], int(model.parents[index]), place, axis, slides))
    return tuple(found)


def _shape(
    robot: Robot, visual: ElementTree.Element, thinned: dict[tuple[Path, tuple[float, ...]], Mesh]
) -> Shape:
    """The shape of a visual; `thinned` remembers the meshes that several visuals share."""
    check_shape(visual)
    solid = next(iter(visual.findall("geometry/*")), None)
    if solid is None:
        raise InvalidInput("it has no geometry")
    if solid.tag == "box":
        x, y, z = numbers_of(solid, "size", None, 3)
        return Solid("box", (float(x), float(y), float(z)))
    if solid.tag in ("sphere", "cylinder", "capsule", "cone"):
        keys = ("radius",) if solid.tag == "sphere" else ("radius", "length")
        return Solid(solid.tag, tuple(float(numbers_of(solid, k, None, 1)[0]) for k in keys))
    if solid.tag != "mesh":
        raise InvalidInput(f"<{solid.tag}> is no shape that can be drawn")
    path = find_mesh(solid.get("filename", ""), robot.urdf_path, robot.package_dir)
    scale = numbers_of(solid, "scale", "1 1 1", 3)
    key = (path, tuple(scale))
    if key not in thinned:
        thinned[key] = thin(load_mesh(path, scale))
    return thinned[key]


def _extent(shape: Shape) -> float:
    """The longest edge of the box about a shape [m]."""
    if isinstance(shape, Mesh):
        return float(np.ptp(shape.vertices, axis=0).max())
    if shape.kind == "box":
        return max(shape.size)
    radius, *length = shape.size
    return max(2.0 * radius, sum(length) + (2.0 * radius if shape.kind == "capsule" else 0.0))
