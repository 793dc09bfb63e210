"""Meshes out of files, whole, and light enough for a page.

The A1's meshes have 216,000 triangles, most of them for screws. They are thinned out once in a
process; a page with two robots then fits into two megabytes.
"""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import coal
import fast_simplification
import numpy as np

from ..._typing import Array, IntArray
from ...errors import FileProblem
from ...storage import LARGEST_FILE, check_file, damaged, parse_xml, read_bytes, read_text, reading

MOST_TRIANGLES = 2000
"""Triangles that a mesh is thinned out to, as far as that leaves its shape."""

_REMEDY = "put a mesh in its place, or take it out of the URDF"

_PRIMITIVES = ("triangles", "polylist", "polygons", "trifans", "tristrips")
"""What COLLADA calls sets of faces, of one material each."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: Vertices [m], shape (n, 3).
        faces: Indices of the vertices of each triangle, shape (m, 3).
    """

    vertices: Array
    faces: IntArray


def load_mesh(path: Path, scale: Array) -> Mesh:
    """Read a mesh, of all materials that it has.

    Coal counts the vertices of each material from 0, though it has them one after the other: all
    faces but those of the first would be between vertices of the first.

    Args:
        path: The file, in one of the formats of Assimp.
        scale: Factors along its axes, shape (3,).

    Raises:
        FileProblem: It is missing or cannot be read.
    """
    check_file(path, _REMEDY, limit=LARGEST_FILE)
    mesh = _read(path, scale)
    if not len(mesh.faces):
        raise damaged(path, "it has no faces", _REMEDY, what="mesh")
    if _whole(mesh):
        return mesh
    kind = path.suffix.lower()
    with reading(path, _REMEDY, what="mesh"):
        if kind == ".dae":
            mesh = _joined(_by_material(path, scale))
        elif kind == ".obj":
            mesh = _read_obj(path, scale)
    if not _whole(mesh):
        reason = "its faces are not between its own vertices"
        raise damaged(path, reason, _REMEDY, what="mesh")
    return mesh


def _read(path: Path, scale: Array) -> Mesh:
    """A mesh as Coal reads it."""
    try:
        model = coal.MeshLoader(coal.NODE_TYPE.BV_OBBRSS).load(str(path), scale)
    except Exception as error:  # of many kinds
        reason = f"not a mesh that can be read ({' '.join(str(error).split())[:200]})"
        raise FileProblem(path, reason, _REMEDY) from error
    triangles = map(model.tri_indices, range(model.num_tris))
    faces = np.array([(t[0], t[1], t[2]) for t in triangles], dtype=np.intp).reshape(-1, 3)
    return Mesh(np.array(model.vertices(), dtype=float).reshape(-1, 3), faces)


def _whole(mesh: Mesh) -> bool:
    """Whether there are faces at all vertices, as Assimp leaves no others."""
    return len(np.unique(mesh.faces)) == len(mesh.vertices)


def _joined(meshes: Iterator[Mesh]) -> Mesh:
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.intp)], 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def _by_material(path: Path, scale: Array) -> Iterator[Mesh]:
    """The meshes of a COLLADA file, each read from a document that has no other."""
    root = parse_xml(read_bytes(path, _REMEDY), path, _REMEDY, what="mesh")
    for element in root.iter():
        space, _, element.tag = element.tag.rpartition("}")
    root.set("xmlns", space.lstrip("{"))
    meshes = root.findall(".//library_geometries/geometry/mesh")
    parts = [(mesh, part) for mesh in meshes for part in mesh if part.tag in _PRIMITIVES]
    for mesh, part in parts:
        mesh.remove(part)
    with tempfile.TemporaryDirectory() as folder:
        for mesh, part in parts:
            mesh.append(part)
            own = Path(folder) / "part.dae"
            own.write_bytes(ElementTree.tostring(root))
            mesh.remove(part)
            read = _read(own, scale)
            # Where the scene has it several times, it is there as often, one after the other.
            size = int(read.faces.max(initial=0)) + 1
            copies, rest = divmod(len(read.vertices), size)
            if rest or len(read.faces) % copies:
                raise ValueError("a part of it has vertices without faces")
            copy = np.repeat(np.arange(copies), len(read.faces) // copies)
            yield Mesh(read.vertices, read.faces + size * copy[:, None])


def _read_obj(path: Path, scale: Array) -> Mesh:
    """A Wavefront file, whatever its groups and materials."""
    vertices, faces = [], []
    for line in read_text(path, _REMEDY).splitlines():
        word, *values = line.split() or [""]
        if word == "v":
            vertices.append([float(value) for value in values[:3]])
        elif word == "f":
            corners = [int(value.partition("/")[0]) for value in values]
            corners = [k - 1 if k > 0 else k + len(vertices) for k in corners]
            faces += [[corners[0], *corners[k : k + 2]] for k in range(1, len(corners) - 1)]
    used, index = np.unique(np.array(faces, dtype=np.intp), return_inverse=True)
    return Mesh(scale * np.array(vertices)[used], index.reshape(-1, 3))


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
