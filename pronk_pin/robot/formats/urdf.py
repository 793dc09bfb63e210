"""Reading of the robot's URDF into MuJoCo, with a floating base as in Pinocchio's model.

MuJoCo reads a URDF as a robot bolted to the world, cannot read every kind of mesh, and refuses
inertias that no body can have. What comes out of here has, link by link, the masses and places of
the URDF all the same.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
import pinocchio as pin

from ...errors import FileProblem, InvalidInput
from ..robot import Robot
from ..urdf_document import numbers_of, placement_of, release_base

_WORLD = "pronk_pin_world"

_SOLIDS = {"box", "sphere", "cylinder", "capsule"}
"""Shapes that MuJoCo knows; a mesh may be missing, and is left out."""


def mujoco_spec(robot: Robot, *, collisions: bool = True) -> mujoco.MjSpec:
    """Read the robot's URDF into MuJoCo: a floating base, the fixed links fused.

    Compiled once, so that geometries are those of the fused bodies and every inertia stands in
    `inertia` and `iquat`; change it and compile it again. The base is the URDF's root link, as in
    Pinocchio, and bears the name `robot.spec.base_link`. Each body's frame is Pinocchio's joint
    frame. There are no actuators; the URDF's effort limits stand in the joints' `actfrcrange`.

    Args:
        robot: The robot.
        collisions: Keep the collision shapes that are boxes, spheres, cylinders or capsules.

    Raises:
        FileProblem: MuJoCo refuses the URDF.
    """
    root = ElementTree.fromstring(robot.urdf)
    _drop_shapes(root, collisions=collisions)
    try:
        release_base(root)
        base = _float_base(root)
        _merge_impossible_inertias(root)
    except InvalidInput as error:
        raise _refused(robot, error) from error
    try:
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
        inferred = spec.compiler.inertiafromgeom
        # A shape without an inertial has no mass; MuJoCo would take it for one of water.
        spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
        model = spec.compile()
    except Exception as error:
        raise _refused(robot, error) from error
    for body in spec.bodies[1:]:  # 0 is the world
        # In one form for every body, so that whoever adds a load finds what is there: links that
        # were fused with others have it already, the rest as the URDF's full matrix.
        compiled = model.body(body.name)
        body.inertia, body.iquat = compiled.inertia, compiled.iquat
        body.fullinertia, body.explicitinertial = np.full(6, np.nan), True
    for name, low in zip(robot.joint_names, robot.q_min, strict=True):
        if low == -np.inf:
            spec.joint(name).limited = mujoco.mjtLimited.mjLIMITED_FALSE
    spec.compiler.inertiafromgeom = inferred  # for what a scenario may put beside the robot
    # The trunk may hang from a root link by a fixed joint; fused, it goes by the root's name.
    spec.body(base).name = robot.spec.base_link
    return spec


def _refused(robot: Robot, error: Exception) -> FileProblem:
    return FileProblem(
        robot.urdf_path,
        f"MuJoCo refuses this URDF ({' '.join(str(error).split())})",
        "correct the link or joint it names",
    )


def _drop_shapes(root: ElementTree.Element, *, collisions: bool) -> None:
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        for shape in link.findall("collision"):
            kinds = {solid.tag for solid in shape.findall("geometry/*")}
            if not collisions or not kinds <= _SOLIDS:
                link.remove(shape)


def _float_base(root: ElementTree.Element) -> str:
    """Let the root link float, and return its name."""
    children = {joint.child for joint in map(_Joint, root.findall("joint"))}
    names = [link.get("name", "") for link in root.findall("link")]
    base = next((name for name in names if name not in children), "")
    if not base:
        raise InvalidInput("no link is the root of the others")
    # MuJoCo makes the root link the world, so that nothing below a fixed joint could move.
    ElementTree.SubElement(root, "link", name=_WORLD)
    joint = ElementTree.SubElement(root, "joint", name=f"{_WORLD}_to_base", type="floating")
    ElementTree.SubElement(joint, "parent", link=_WORLD)
    ElementTree.SubElement(joint, "child", link=base)
    return base


class _Joint:
    """A joint of a URDF: the links at its ends, its placement, and whether it is fixed."""

    def __init__(self, element: ElementTree.Element) -> None:
        parent, child = element.find("parent"), element.find("child")
        self.parent = "" if parent is None else parent.get("link", "")
        self.child = "" if child is None else child.get("link", "")
        self.fixed = element.get("type") == "fixed"
        self.placement = placement_of(element)


def _merge_impossible_inertias(root: ElementTree.Element) -> None:
    """Move inertias that MuJoCo refuses or leaves out to a link at the other end of a fixed joint.

    The base of the Go1 weighs a milligram and has an inertia without three positive principal
    moments; Bolt's feet have an inertia and no mass. Fused with the trunk or the shank, as both
    engines do with fixed joints, they harm nothing, but MuJoCo looks at each link before it fuses
    them.
    """
    links = {link.get("name", ""): link for link in root.findall("link")}
    fixed = [joint for joint in map(_Joint, root.findall("joint")) if joint.fixed]
    bearing = {joint.child: joint for joint in fixed}

    def depth(name: str) -> int:
        count = 0
        while name in bearing:
            name, count = bearing[name].parent, count + 1
        return count

    cause: dict[str, str] = {}
    for name in sorted(links, key=depth, reverse=True):  # what hangs from others comes first
        inertia = link_inertia(links[name])
        if inertia is None or _is_possible(inertia):
            continue
        if name in bearing:
            up = bearing[name]
            _move(links[name], links[up.parent], up.placement.act(inertia))
            cause.setdefault(up.parent, cause.get(name, name))
            continue
        for down in (joint for joint in fixed if joint.parent == name):
            inertia = _move(links[name], links[down.child], down.placement.actInv(inertia))
            if _is_possible(inertia):
                break
            inertia = down.placement.act(inertia)
            _move(links[down.child], links[name], inertia)
        if not _is_possible(inertia, tolerance=1e-9):
            raise InvalidInput(
                f"link {cause.get(name, name)}: its mass and inertia are none that a body can have"
            )


def _move(
    link: ElementTree.Element, neighbour: ElementTree.Element, moved: pin.Inertia
) -> pin.Inertia:
    """Give a link's inertia to a neighbour, in whose frame it is; returns what that has then."""
    other = link_inertia(neighbour)
    whole = moved if other is None else moved + other
    set_link_inertia(neighbour, whole)
    set_link_inertia(link, None)
    return whole


def _is_possible(inertia: pin.Inertia, *, tolerance: float = 0.0) -> bool:
    """Whether MuJoCo takes an inertia as it is: none at all, or one that a body can have."""
    if inertia.mass == 0.0:
        return not np.any(inertia.inertia)
    low, middle, high = np.linalg.eigvalsh(inertia.inertia)  # ascending
    return bool(low > 1e-14 and low + middle >= high * (1.0 - tolerance))


def body_inertia(body: mujoco.MjsBody) -> pin.Inertia:
    """The inertia of a body of `mujoco_spec`, in the body's frame."""
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, np.array(body.iquat))
    axes = flat.reshape(3, 3)
    return pin.Inertia(float(body.mass), np.array(body.ipos), axes @ np.diag(body.inertia) @ axes.T)


def set_body_inertia(body: mujoco.MjsBody, inertia: pin.Inertia) -> None:
    """Set the inertia of a body of `mujoco_spec`, in the body's frame."""
    principal, axes = np.linalg.eigh(inertia.inertia)
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] *= -1.0
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, axes.ravel())
    body.mass, body.ipos = inertia.mass, inertia.lever
    body.inertia, body.iquat = principal, quaternion


def link_inertia(link: ElementTree.Element) -> pin.Inertia | None:
    """A link's inertia in the link's frame."""
    inertial = link.find("inertial")
    mass = None if inertial is None else inertial.find("mass")
    moments = None if inertial is None else inertial.find("inertia")
    if inertial is None or mass is None or moments is None:
        return None
    axes = ("xx", "xy", "xz", "yy", "yz", "zz")
    xx, xy, xz, yy, yz, zz = (numbers_of(moments, f"i{axis}", "0", 1)[0] for axis in axes)
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    weight = float(numbers_of(mass, "value", "0", 1)[0])
    try:
        own = pin.Inertia(weight, np.zeros(3), matrix)
    except (ValueError, RuntimeError) as error:
        raise InvalidInput(f"link {link.get('name')}: {error}") from error
    return placement_of(inertial).act(own)


def set_link_inertia(link: ElementTree.Element, inertia: pin.Inertia | None) -> None:
    before = link.find("inertial")
    if before is not None:
        link.remove(before)
    if inertia is None:
        return
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(repr(float(x)) for x in inertia.lever))
    ElementTree.SubElement(inertial, "mass", value=repr(float(inertia.mass)))
    moments = {
        f"i{'xyz'[row]}{'xyz'[column]}": repr(float(inertia.inertia[row, column]))
        for row in range(3)
        for column in range(row, 3)
    }
    ElementTree.SubElement(inertial, "inertia", moments)
