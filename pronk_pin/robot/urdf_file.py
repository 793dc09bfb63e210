"""URDF files: the document, and Pinocchio's model of it, read once and of the same bytes."""

from __future__ import annotations

import contextlib
import os
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from ..errors import FileProblem, InvalidInput
from ..storage import LARGEST_DOCUMENT, damaged, parse_xml, read_bytes, refuse_nan
from .urdf_document import (
    check_document,
    declared_mass,
    endless_joints,
    is_xacro,
    release_base,
)

_CHECK = "check the file"

LARGEST_QUANTITY = 1e6
"""Masses [kg], lengths [m] and inertias [kg m^2] beyond which nothing is a robot."""


class Urdf(NamedTuple):
    """A URDF.

    Attributes:
        data: The bytes of the file.
        root: The document, without a root link to which the base is tied by a floating joint.
        model: Pinocchio's model with a floating base.
    """

    data: bytes
    root: ElementTree.Element
    model: pin.Model


def document_of(data: bytes) -> ElementTree.Element:
    """The document of a URDF that was read, as `Urdf.root`."""
    root = ElementTree.fromstring(data)
    release_base(root)
    return root


def find_mesh(address: str, urdf: Path, package_dir: Path) -> Path:
    """The file that the address of a mesh means.

    That of a package is sought in a folder of its name above the URDF, or beside one of these, in
    `package_dir`, and where `ROS_PACKAGE_PATH` and `AMENT_PREFIX_PATH` say.

    Args:
        address: The address, as it stands in the URDF.
        urdf: The URDF.
        package_dir: Another folder with packages in it.

    Raises:
        FileProblem: There is no such file.
    """
    scheme, separator, rest = address.partition("://")
    if not separator or scheme == "file":
        places = [urdf.parent / (rest if separator else address)]
        remedy = "put it there"
    else:
        package, _, rest = rest.partition("/")
        ros, ament = (
            [Path(entry) for entry in os.environ.get(name, "").split(os.pathsep) if entry]
            for name in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
        )
        packages = [folder for folder in (*urdf.parents, *ros) if folder.name == package]
        packages += [folder / package for folder in (*urdf.parents, package_dir, *ros)]
        packages += [folder / "share" / package for folder in ament]
        places = [folder / rest for folder in packages]
        remedy = (
            f"put it into a folder named {package} above the URDF or beside one of these, or that "
            "folder's place into ROS_PACKAGE_PATH"
        )
    for place in places:
        with contextlib.suppress(OSError, ValueError):  # a name that no file can have
            if place.is_file():
                return place
    raise FileProblem(urdf, f"mesh {address} is not there", remedy)


def read_urdf(path: Path) -> Urdf:
    """Read a URDF.

    Raises:
        FileProblem: It cannot be read, is none, or has numbers that are none of a robot.
    """
    data = read_bytes(path, _CHECK, limit=LARGEST_DOCUMENT)
    try:
        root = parse_xml(data, path, _CHECK, what="URDF")
    except FileProblem as error:
        if b"<xacro:" in data:  # a prefix that nothing declares
            raise _xacro(path) from error
        raise
    if is_xacro(root):
        raise _xacro(path)
    refuse_nan(root, path, _CHECK, what="URDF")  # a mass of NaN is taken for none
    try:
        release_base(root)
        check_document(root)
    except InvalidInput as error:
        raise FileProblem(path, f"not a usable URDF ({error})", _CHECK) from error
    said: list[str] = []
    try:
        endless = endless_joints(root)
        with _overheard(said):
            model = pin.buildModelFromXML(_mechanism(root), pin.JointModelFreeFlyer())
        if said:  # it goes on without the link's inertia, say
            raise ValueError("and leaves that out")
    except Exception as error:
        reason = " ".join([*said[:1], *str(error).split()])[:500]
        raise FileProblem(path, f"not a usable URDF ({reason})", _CHECK) from error
    for joint in endless:
        _set_endless(model, joint)
    _check_numbers(path, model)
    declared, loaded = declared_mass(root), pin.computeTotalMass(model)
    if abs(loaded - declared) > 1e-9 * declared:
        reason = f"its links weigh {declared:.6g} kg, of which Pinocchio reads {loaded:.6g}"
        raise damaged(path, reason, _CHECK, what="URDF")
    return Urdf(data, root, model)


def _xacro(path: Path) -> FileProblem:
    expanded = path.name.removesuffix(".xacro").removesuffix(".urdf") + "_expanded.urdf"
    return FileProblem(
        path,
        "this is xacro, of which a URDF is made",
        f"run 'xacro {path.name} > {expanded}' (of ROS, or of 'pip install xacro'), and give that",
    )


def _mechanism(root: ElementTree.Element) -> str:
    """The document without shapes and colours, whose faults are none of the mechanism; continuous
    joints are revolute ones, so that q has an angle for each."""
    mechanism = ElementTree.Element(root.tag, {"name": "robot", **root.attrib})
    for link in root.findall("link"):
        own = ElementTree.SubElement(mechanism, "link", link.attrib)
        own.extend(link.findall("inertial"))
    for joint in root.findall("joint"):
        if joint.get("type") != "continuous":
            mechanism.append(joint)
            continue
        own = ElementTree.SubElement(mechanism, "joint", {**joint.attrib, "type": "revolute"})
        own.extend(joint)
        if joint.find("limit") is None:
            ElementTree.SubElement(own, "limit", effort="0", velocity="0")
    return ElementTree.tostring(mechanism, encoding="unicode")


def _set_endless(model: pin.Model, joint: ElementTree.Element) -> None:
    """Take away the limits that a joint has not."""
    own = model.joints[model.getJointId(joint.get("name", ""))]
    model.lowerPositionLimit[own.idx_q], model.upperPositionLimit[own.idx_q] = -np.inf, np.inf
    if joint.find("limit") is None:
        model.effortLimit[own.idx_v] = model.velocityLimit[own.idx_v] = np.inf


@contextlib.contextmanager
def _overheard(said: list[str]) -> Iterator[None]:
    """Keep what a library in C++ calls errors on stderr: they are part of our error's one line."""
    with contextlib.ExitStack() as stack:
        try:
            kept = stack.enter_context(tempfile.TemporaryFile())
            stderr = os.dup(2)
        except OSError:  # no room, or no stderr: it is not worth an error
            yield
            return
        stack.callback(os.close, stderr)
        os.dup2(kept.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(stderr, 2)
            kept.seek(0)
            lines = kept.read().decode(errors="replace").splitlines()
            errors = [line.removeprefix("Error:") for line in lines if line.startswith("Error:")]
            said += [" ".join(line.split()) for line in errors]


def _check_numbers(path: Path, model: pin.Model) -> None:
    for name, inertia, placement in zip(
        model.names, model.inertias, model.jointPlacements, strict=True
    ):
        numbers = np.concatenate(
            [[inertia.mass], inertia.lever, inertia.inertia.ravel(), placement.homogeneous.ravel()]
        )
        if not np.all(np.abs(numbers) < LARGEST_QUANTITY) or inertia.mass < 0.0:
            reason = f"mass, inertia or place of joint {name} and its link are none of a robot"
            raise damaged(path, reason, _CHECK, what="URDF")
    limits = (model.lowerPositionLimit, model.upperPositionLimit)
    for bounds in (*limits, model.velocityLimit, model.effortLimit):
        if np.any(np.isnan(bounds)):
            raise damaged(path, "a joint's limit is not a number", _CHECK, what="URDF")
