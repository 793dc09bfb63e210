"""MJCF files, which MuJoCo reads after a look at what they include and how large they become."""

from __future__ import annotations

import contextlib
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np

from ...errors import FileProblem
from ...storage import LARGEST_FILE, check_file, damaged, read_xml, refuse_nan
from ..urdf_file import LARGEST_QUANTITY

_GIVE = "give the path of an MJCF, with the files it names beside it where its meshdir says"

_MOST_FILES = 100
"""Files beyond which an MJCF includes no more."""

_MOST_ELEMENTS = 100_000
"""Elements beyond which a model is not made, copies of `<replicate>` and their like counted."""

_MOST_NUMBERS = 10**8
"""Numbers beyond which no texture, height field or other array of a model is made."""

_LARGEST_MEMORY = 2**32
"""Memory beyond which no model gets what its `<size memory="..."/>` asks for [bytes]."""

_COUNTS = ("count", "width", "height", "nrow", "ncol", "dim")
"""Attributes that say how many, so that a short file may make a large model."""


def read_mjcf(path: Path) -> mujoco.MjSpec:
    """The MJCF as MuJoCo reads it, not compiled yet.

    Raises:
        FileProblem: It, or a file that it names, is missing, damaged or too large, or it is none.
    """
    check_mjcf(path)
    with loading(path):
        spec = mujoco.MjSpec.from_file(str(path))
    if spec.memory > _LARGEST_MEMORY:
        raise damaged(path, f"it asks for {spec.memory:.1e} bytes of memory", _GIVE, what="MJCF")
    return spec


def compile_mjcf(spec: mujoco.MjSpec, path: Path, remedy: str = _GIVE) -> mujoco.MjModel:
    """The model of an MJCF.

    Raises:
        FileProblem: MuJoCo cannot make it, or numbers of it are none of a robot.
    """
    with loading(path, remedy):
        model = spec.compile()
    named = {
        "mass": model.body_mass,
        "inertia": model.body_inertia,
        "place of a body": np.concatenate([model.body_pos, model.body_ipos]),
        "orientation of a body": np.concatenate([model.body_quat, model.body_iquat]),
        "place of a joint": model.jnt_pos,
        "axis of a joint": model.jnt_axis,
        "armature": model.dof_armature,
        "damping": model.dof_damping,
        "friction of a joint": model.dof_frictionloss,
    }
    for name, numbers in named.items():
        if not np.all(np.abs(numbers) < LARGEST_QUANTITY):
            raise damaged(path, f"a {name} is none of a robot", remedy, what="MJCF")
    if np.any(np.isnan(model.jnt_range)) or np.any(model.jnt_range[:, 0] > model.jnt_range[:, 1]):
        raise damaged(path, "limits of a joint are none", remedy, what="MJCF")
    return model


def drop_looks(spec: mujoco.MjSpec) -> None:
    """Delete meshes that have no part in an inertia, and what colours them: they may be missing."""
    used = set()
    inferred = spec.compiler.inertiafromgeom
    for geom in spec.geoms:
        geom.material = ""
        if geom.type not in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_SDF):
            continue
        weightless = geom.mass == 0.0 or (np.isnan(geom.mass) and geom.density == 0.0)
        given = inferred == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE or (
            inferred == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
            and geom.parent.explicitinertial
        )
        if weightless or given or geom.parent.name == "world":
            spec.delete(geom)
        else:
            used.add(geom.meshname)
    meshes = [mesh for mesh in spec.meshes if mesh.name not in used]
    for element in (*meshes, *spec.materials, *spec.textures, *spec.skins):
        spec.delete(element)


@contextlib.contextmanager
def loading(path: Path, remedy: str = _GIVE) -> Iterator[None]:
    """Around calls of MuJoCo, which names what it cannot load in errors of many kinds.

    Raises:
        FileProblem: It cannot.
    """
    try:
        yield
    except (Exception, MemoryError) as error:
        reason = " ".join(str(error).split())[:500]
        missing = "rror opening file" in reason or "not found" in reason
        raise FileProblem(
            path,
            f"MuJoCo cannot load it ({reason})",
            "put the meshes and files it names beside it, where its meshdir says"
            if missing
            else remedy,
        ) from error


def check_mjcf(path: Path) -> None:
    """Refuse what is no MJCF, or what MuJoCo would wait for or run out of memory with.

    Raises:
        FileProblem: It is so, or a file that it names.
    """
    root = read_xml(path, _GIVE, what="MJCF")
    if root.tag != "mujoco":
        raise damaged(path, f"it begins with <{root.tag}>", _GIVE, what="MJCF")
    seen, waiting, elements = {path.resolve()}, [(path, root)], 0
    folders = {path.parent}
    named: list[str] = []
    while waiting:
        place, tree = waiting.pop()
        elements += _size(place, tree)
        if elements > _MOST_ELEMENTS:
            raise damaged(path, "it makes a model of too many elements", _GIVE, what="MJCF")
        refuse_nan(tree, place, _GIVE, what="MJCF")  # of which MuJoCo warns, and goes on
        for element in tree.iter():
            if element.tag == "compiler":
                keys = ("meshdir", "texturedir", "assetdir")
                folders |= {path.parent / element.get(key, "") for key in keys}
            names = [value for key, value in element.items() if key.startswith("file")]
            if element.tag != "include":
                named += names
                continue
            for name in names:
                for folder in {path.parent, place.parent}:
                    found = folder / name
                    if not _exists(found):
                        continue  # MuJoCo says so
                    if found.resolve() in seen or len(seen) > _MOST_FILES:
                        reason = f"it includes {name} again"
                        raise damaged(place, reason, _GIVE, what="MJCF")
                    seen.add(found.resolve())
                    folders.add(found.parent)
                    waiting.append((found, read_xml(found, _GIVE, what="MJCF")))
                    break
    for name in set(named):
        for folder in folders:
            if _exists(folder / name):
                check_file(folder / name, _GIVE, limit=LARGEST_FILE)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except (OSError, ValueError):  # a name that no file can have
        return False


def _size(path: Path, root: ElementTree.Element) -> int:
    """How many elements come of a tree."""
    total, waiting = 0, [(root, 1)]
    while waiting:
        element, copies = waiting.pop()
        numbers = [
            int(number)
            for key in _COUNTS
            for number in re.findall(r"\d{1,18}", element.get(key, ""))
            if element.tag not in ("geom", "site", "default")
        ]
        count = math.prod(number for number in numbers if number)
        if element.tag == "size" or element.tag == "numeric":
            users = [v for k, v in element.items() if k == "size" or k.startswith("nuser")]
            count = max([int(float(v)) for v in users if re.fullmatch(r"\d{1,18}", v)], default=0)
        if count > _MOST_NUMBERS:
            raise damaged(path, f"<{element.tag}> of {count:.1e} parts", _GIVE, what="MJCF")
        makes = element.tag in ("replicate", "composite", "flexcomp")
        copies = min(copies * (max(count, 1) if makes else 1), 10**12)
        total += copies
        waiting += [(child, copies) for child in element]
    return total
