"""Visual geometry of the robot, with meshes light enough for a page.

The A1's meshes have 216,000 triangles, most of them for screws. They are thinned out once in a
process; a page with two robots then fits into two megabytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import coal
import fast_simplification
import numpy as np
import pinocchio as pin

from ..._typing import Array, IntArray
from ...errors import FileProblem, InvalidInput
from ...robot import Robot

MOST_TRIANGLES = 2000
"""Triangles that a mesh is thinned out to, as far as that leaves its shape."""

SMALLEST = 0.005
"""Visuals smaller than this are left out [m]: the A1's URDF marks its frames with 1 mm boxes."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: Vertices [m], shape (n, 3).
        faces: Indices of the vertices of each triangle, shape (m, 3).
    """

    vertices: Array
    faces: IntArray


@dataclass(frozen=True)
class Solid:
    """A shape that the page draws itself, about the origin.

    Attributes:
        kind: "box", "sphere" or "cylinder".
        size: Edges of a box, radius of a sphere, radius and length along z of a cylinder [m].
    """

    kind: str
    size: tuple[float, ...]


Shape: TypeAlias = Mesh | Solid


@dataclass(frozen=True, eq=False)
class Part:
    """One visual of the robot.

    Attributes:
        name: Name of Pinocchio's geometry object.
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
    """A revolute joint of the kinematic tree.

    Attributes:
        name: Its name.
        parent: Number of the joint that carries it, in Pinocchio's order; 1 is the floating base.
        placement: Its pose in the parent's frame where its angle is 0, shape (4, 4).
        axis: What it turns about, in its own frame, shape (3,).
    """

    name: str
    parent: int
    placement: Array
    axis: Array


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

    Raises:
        FileProblem: A mesh that the URDF names is missing or cannot be read.
        InvalidInput: A visual or a joint is of a kind that cannot be shown.
    """
    try:
        model = pin.buildGeomFromUrdf(
            robot.model,
            str(robot.urdf_path),
            pin.GeometryType.VISUAL,
            package_dirs=[str(robot.package_dir)],
        )
    except (ValueError, RuntimeError) as error:
        remedy = "check the meshes beside the URDF"
        raise FileProblem(
            robot.urdf_path, f"a visual cannot be loaded ({error})", remedy
        ) from error
    thinned: dict[tuple[str, tuple[float, ...]], Mesh] = {}
    parts = []
    for item in model.geometryObjects:
        item.geometry.computeLocalAABB()
        extent = item.geometry.aabb_local
        if np.max(extent.max_ - extent.min_) > SMALLEST:
            r, g, b = (float(c) for c in item.meshColor[:3])
            place, shape = item.placement.homogeneous, _shape(item, thinned)
            parts.append(Part(item.name, int(item.parentJoint), place, shape, (r, g, b)))
    return Appearance(robot, _joints(robot), tuple(parts))


def _joints(robot: Robot) -> tuple[Joint, ...]:
    """The tree of joints below the floating base."""
    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    found = []
    for index in range(2, model.njoints):
        motion = np.asarray(data.joints[index].S).reshape(6, -1)
        if motion.shape[1] != 1 or np.any(motion[:3]):
            raise InvalidInput(
                f"joint {model.names[index]} of {robot.name} does not turn about one axis; "
                "only revolute joints can be shown"
            )
        place = model.jointPlacements[index].homogeneous
        found.append(Joint(model.names[index], int(model.parents[index]), place, motion[3:, 0]))
    return tuple(found)


def _shape(item: pin.GeometryObject, thinned: dict[tuple[str, tuple[float, ...]], Mesh]) -> Shape:
    """The shape of a visual; `thinned` remembers the meshes that several visuals share."""
    shape = item.geometry
    if isinstance(shape, coal.Sphere):
        return Solid("sphere", (shape.radius,))
    if isinstance(shape, coal.Box):
        return Solid("box", tuple((2.0 * shape.halfSide).tolist()))
    if isinstance(shape, coal.Cylinder):
        return Solid("cylinder", (shape.radius, 2.0 * shape.halfLength))
    if not isinstance(shape, coal.BVHModelBase):
        raise InvalidInput(
            f"visual '{item.name}' is a {type(shape).__name__}; "
            "use meshes, boxes, spheres or cylinders in the URDF"
        )
    key = (item.meshPath, tuple(item.meshScale))
    if key not in thinned:
        triangles = map(shape.tri_indices, range(shape.num_tris))
        faces = np.array([(t[0], t[1], t[2]) for t in triangles], dtype=np.intp)
        thinned[key] = thin(Mesh(np.array(shape.vertices(), dtype=float), faces))
    return thinned[key]


def thin(mesh: Mesh, *, most: int = MOST_TRIANGLES) -> Mesh:
    """Merge the vertices of a mesh where that changes its surface least, to so many triangles.

    By quadric error (M. Garland and P. Heckbert, Surface simplification, 1997), so that edges and
    corners survive; what would lose its shape keeps more triangles.
    """
    # Files often have a vertex once for each face around it, and a seam would count as an edge.
    vertices, index = np.unique(mesh.vertices.round(9), axis=0, return_inverse=True)
    faces = index.reshape(-1)[mesh.faces].astype(np.int32)
    faces = faces[(np.diff(np.sort(faces)) > 0).all(axis=1)]  # the others have no area
    target = min(most, len(faces))
    return Mesh(*fast_simplification.simplify(vertices, faces, target_count=target, agg=3))
