"""URDF documents: what they declare, looked at before an engine reads them.

Engines leave out what they cannot read, and go on without it: a robot would be lighter, or stiff.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pinocchio as pin

from .._typing import Array
from ..errors import InvalidInput

_SIZES = {
    "sphere": (("radius", 1),),
    "cylinder": (("radius", 1), ("length", 1)),
    "capsule": (("radius", 1), ("length", 1)),
    "cone": (("radius", 1), ("length", 1)),
    "box": (("size", 3),),
}
"""Sizes of the shapes, and of how many numbers each is."""

_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

_AXES = ("revolute", "continuous", "prismatic")
"""Types of joints that move along or about an axis."""


def numbers_of(element: ElementTree.Element, key: str, default: str | None, count: int) -> Array:
    """The numbers of an attribute, shape (count,).

    Args:
        element: The element.
        key: The attribute.
        default: What it is where it is not given; None if it must be.
        count: How many numbers it holds.

    Raises:
        InvalidInput: There are others.
    """
    text = element.get(key, default)
    if text is None:
        raise InvalidInput(f"<{element.tag}> has no {key}")
    try:
        numbers = np.array([float(word) for word in text.split()])
    except ValueError:
        numbers = np.empty(0)
    if len(numbers) != count or not np.all(np.isfinite(numbers)) or "_" in text:
        raise InvalidInput(f'<{element.tag} {key}="{text}">: give {count} finite number(s)')
    return numbers


def placement_of(element: ElementTree.Element) -> pin.SE3:
    """The `origin` of an element; the identity where it has none.

    Raises:
        InvalidInput: It cannot be read.
    """
    origin = element.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    xyz, rpy = (numbers_of(origin, key, "0 0 0", 3) for key in ("xyz", "rpy"))
    return pin.SE3(pin.rpy.rpyToMatrix(rpy), xyz)


def is_xacro(root: ElementTree.Element) -> bool:
    """Whether a document is xacro, of which a URDF is made, macros and expressions unexpanded."""
    parts = [part for tag in ("link", "joint") for own in root.findall(tag) for part in own.iter()]
    values = [value for part in parts for value in part.attrib.values()]
    return any("${" in value or "$(" in value for value in values) or any(
        element.tag.startswith("{") and "xacro" in element.tag.partition("}")[0]
        for element in root.iter()
    )


def check_document(root: ElementTree.Element) -> None:
    """Check what a URDF says of its links and joints.

    Raises:
        InvalidInput: Something cannot be read, or no robot can have it; the link or the joint is
            named.
    """
    for link in root.findall("link"):
        with _naming("link", link):
            _check_inertial(link)
            for shape in link.findall("collision"):
                check_shape(shape)
    for joint in root.findall("joint"):
        with _naming("joint", joint):
            _check_joint(joint)


@contextmanager
def _naming(kind: str, element: ElementTree.Element) -> Iterator[None]:
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(f"{kind} {element.get('name', '')}: {error}") from error


def _check_inertial(link: ElementTree.Element) -> None:
    inertials = link.findall("inertial")
    if len(inertials) > 1:
        raise InvalidInput(f"it has {len(inertials)} inertials; leave one")
    for inertial in inertials:
        placement_of(inertial)
        for tag, keys in (("mass", ("value",)), ("inertia", _MOMENTS)):
            part = inertial.find(tag)
            if part is None:
                raise InvalidInput(f"its inertial has no <{tag}>")
            for key in keys:
                numbers_of(part, key, None, 1)
        if _mass(inertial) < 0.0:
            raise InvalidInput(f"its mass is negative, {_mass(inertial):g} kg")


def _mass(inertial: ElementTree.Element) -> float:
    return float(numbers_of(inertial.findall("mass")[0], "value", None, 1)[0])


def check_shape(shape: ElementTree.Element) -> None:
    """Check a `<collision>` or a `<visual>`.

    Raises:
        InvalidInput: A number of it cannot be read, or a size is none.
    """
    placement_of(shape)
    for solid in shape.findall("geometry/*"):
        for key, count in _SIZES.get(solid.tag, ()):
            if np.any(numbers_of(solid, key, None, count) <= 0.0):
                raise InvalidInput(f'<{solid.tag} {key}="{solid.get(key)}">: give what is above 0')
        if solid.tag == "mesh":
            numbers_of(solid, "scale", "1 1 1", 3)


def _check_joint(joint: ElementTree.Element) -> None:
    kind = joint.get("type", "")
    placement_of(joint)
    if kind == "floating":
        raise InvalidInput(
            "it is floating; only one between a root link without mass, as one called world, and "
            "the base may be"
        )
    if kind == "planar":
        raise InvalidInput("it is planar; a robot's joints are hinges, slides, or fixed")
    if kind not in _AXES:
        return
    if joint.find("mimic") is not None:
        raise InvalidInput(
            "it mimics another joint, which is not supported: it would move by itself; make it "
            "fixed, or take <mimic> away and give it a motor"
        )
    axis = joint.find("axis")
    if axis is not None and not np.any(numbers_of(axis, "xyz", "1 0 0", 3)):
        raise InvalidInput("its axis is zero")
    limit = joint.find("limit")
    if limit is None:
        if kind != "continuous":
            raise InvalidInput(f"it is {kind} and has no <limit>; give one, or make it continuous")
        return
    lower, upper, effort, velocity = (
        float(numbers_of(limit, key, default, 1)[0])
        for key, default in (("lower", "0"), ("upper", "0"), ("effort", None), ("velocity", None))
    )
    if lower > upper:
        raise InvalidInput(f"its lower limit, {lower:g}, is above its upper one, {upper:g}")
    if lower == upper and not _is_endless(joint):
        raise InvalidInput(
            f"both its limits are {lower:g}, so that it cannot move; make it fixed, or give limits"
        )
    if min(effort, velocity) < 0.0:
        raise InvalidInput("its limits of effort and velocity are none: one is negative")


def declared_mass(root: ElementTree.Element) -> float:
    """The sum of the masses of a checked URDF [kg]."""
    return float(sum(map(_mass, root.findall("link/inertial"))))


def release_base(root: ElementTree.Element) -> bool:
    """Take away a root link without mass to which a floating joint ties the robot.

    What it ties is the base, whether the file says so or not.

    Returns:
        Whether there was one.

    Raises:
        InvalidInput: The robot is fixed to a link called world, or has one that is none.
    """
    joints = [(joint, *_ends(joint)) for joint in root.findall("joint")]
    children = {child for _, _, child in joints}
    links = {link.get("name", ""): link for link in root.findall("link")}
    roots = [name for name in links if name not in children]
    hanging = [(joint, child) for joint, parent, child in joints if [parent] == roots]
    massless = all(_weighs_nothing(links[name]) for name in roots)
    if massless and [joint.get("type") for joint, _ in hanging] == ["floating"]:
        root.remove(hanging[0][0])
        root.remove(links.pop(roots[0]))
        return True
    if "world" in links:
        for joint, child in hanging:
            if roots == ["world"] and massless and joint.get("type") == "fixed":
                raise InvalidInput(
                    f"link {child} is fixed to the link world by joint {joint.get('name', '')}, "
                    "so that the robot could not move; take both away, or make the joint floating"
                )
        raise InvalidInput("a link is called world, which is not part of a robot; rename it")
    return False


def _ends(joint: ElementTree.Element) -> tuple[str, str]:
    """Parent and child link of a joint."""
    parent, child = joint.find("parent"), joint.find("child")
    return (
        "" if parent is None else parent.get("link", ""),
        "" if child is None else child.get("link", ""),
    )


def _weighs_nothing(link: ElementTree.Element) -> bool:
    masses = [element.get("value", "") for element in link.findall("inertial/mass")]
    return all(mass.strip() in ("0", "0.0", "0.") for mass in masses)


def endless_joints(root: ElementTree.Element) -> list[ElementTree.Element]:
    """The hinges without limits: continuous ones, and those whose limits have no angles.

    urdfdom takes an angle that is not given for 0, so that such a joint could not move at all.
    """
    return [joint for joint in root.findall("joint") if _is_endless(joint)]


def _is_endless(joint: ElementTree.Element) -> bool:
    limit = joint.find("limit")
    given = limit is not None and not {"lower", "upper"}.isdisjoint(limit.keys())
    return joint.get("type") == "continuous" or (joint.get("type") == "revolute" and not given)
