"""Visual geometry of the robot, with meshes light enough for a page.

The A1's meshes have 216,000 triangles, most of them for screws. They are thinned out once in a
process by clustering vertices; a page with two robots then fits into two megabytes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import coal
import numpy as np
import pinocchio as pin

from ..._typing import Array, IntArray
from ...errors import FileProblem, InvalidInput
from ...robot import Robot

CELL = 0.005
"""Edge of the cells in which a mesh's vertices are merged [m]."""

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


@dataclass(frozen=True, eq=False)
class Part:
    """One visual of the robot.

    Attributes:
        name: Name of Pinocchio's geometry object.
        joint: Number of the joint that moves it, in Pinocchio's order; 1 is the floating base.
        placement: Its pose in the joint's frame, shape (4, 4).
        mesh: Its surface in its own frame; parts of the same shape share one.
        color: Red, green and blue of the URDF, each in [0, 1].
    """

    name: str
    joint: int
    placement: Array
    mesh: Mesh
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
        mesh = _surface(item, thinned)
        if np.ptp(mesh.vertices, axis=0).max() > SMALLEST:
            r, g, b = (float(c) for c in item.meshColor[:3])
            placement = item.placement.homogeneous
            parts.append(Part(item.name, int(item.parentJoint), placement, mesh, (r, g, b)))
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


def _surface(item: pin.GeometryObject, thinned: dict[tuple[str, tuple[float, ...]], Mesh]) -> Mesh:
    """The surface of a visual; `thinned` remembers the meshes that several visuals share."""
    shape = item.geometry
    if isinstance(shape, coal.Sphere):
        return sphere(shape.radius)
    if isinstance(shape, coal.Box):
        return box(2.0 * np.asarray(shape.halfSide))
    if not isinstance(shape, coal.BVHModelBase):
        raise InvalidInput(
            f"visual '{item.name}' is a {type(shape).__name__}; "
            "use meshes, boxes or spheres in the URDF"
        )
    key = (item.meshPath, tuple(item.meshScale))
    if key not in thinned:
        triangles = map(shape.tri_indices, range(shape.num_tris))
        faces = np.array([(t[0], t[1], t[2]) for t in triangles], dtype=np.intp)
        thinned[key] = thin(Mesh(np.array(shape.vertices(), dtype=float), faces))
    return thinned[key]


def sphere(radius: float, *, segments: int = 16) -> Mesh:
    """A sphere of that radius [m] about the origin, `segments` around its equator."""
    polar = np.linspace(0.0, np.pi, segments // 2 + 1)[:, None]
    around = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    ring = np.ones_like(around)
    points = (np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar) * ring)
    return Mesh(
        radius * np.stack(points, axis=-1).reshape(-1, 3), grid_faces(len(polar), len(ring))
    )


def box(size: Array) -> Mesh:
    """A box of that size [m], shape (3,), about the origin."""
    corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3, indexing="ij")).reshape(3, 8).T * size
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return Mesh(corners, np.array(faces, dtype=np.intp))


def grid_faces(rows: int, columns: int) -> IntArray:
    """Triangles between the neighbours of a rows x columns grid of vertices, shape (m, 3)."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    lower = corner + np.array([0, columns, 1])
    upper = corner + np.array([1, columns, columns + 1])
    return np.concatenate([lower, upper]).astype(np.intp)


def thin(mesh: Mesh, *, cell: float = CELL) -> Mesh:
    """Merge the vertices in each cell of a grid, and drop the triangles that vanish.

    The merged vertex lies where the squared distance to the planes of the triangles around is
    least (P. Lindstrom, Out-of-core simplification of large polygonal models, 2000); so edges and
    corners survive, which averaging would round off.

    Args:
        mesh: The mesh.
        cell: Edge of a cell [m].
    """
    keys = np.floor((mesh.vertices - mesh.vertices.min(axis=0)) / cell).astype(np.intp)  # (n, 3)
    _, cluster = np.unique(keys, axis=0, return_inverse=True)
    cluster = cluster.reshape(-1)  # (n,)
    vertices = _least_squares_vertices(mesh, cluster, cell)
    faces = cluster[mesh.faces]  # (m, 3)
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    used, faces = np.unique(faces[first], return_inverse=True)
    return Mesh(vertices[used], faces.reshape(-1, 3))


def _least_squares_vertices(mesh: Mesh, cluster: IntArray, cell: float) -> Array:
    """Closest point to the planes around each cluster [m], shape (clusters, 3)."""
    count = int(cluster.max()) + 1
    mean = np.zeros((count, 3))
    np.add.at(mean, cluster, mesh.vertices)
    mean /= np.bincount(cluster)[:, None]

    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)  # (m, 3), its length twice the area
    corner = cluster[mesh.faces]  # (m, 3)
    normal, corner, point = np.tile(normal, (3, 1)), corner.T.reshape(-1), np.tile(a, (3, 1))
    distance = np.sum(normal * (point - mean[corner]), axis=1)  # (3 m,)
    matrix, vector = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(matrix, corner, normal[:, :, None] * normal[:, None, :])
    np.add.at(vector, corner, normal * distance[:, None])
    # Directions that no plane fixes stay at the mean: a flat patch has two, an edge one.
    weight = 1e-2 * np.trace(matrix, axis1=1, axis2=2) + 1e-30
    offset = np.linalg.solve(matrix + weight[:, None, None] * np.eye(3), vector[..., None])[..., 0]
    vertices: Array = mean + np.clip(offset, -cell, cell)
    return vertices
