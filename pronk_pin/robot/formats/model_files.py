"""Export of a robot with its parameters as MJCF and URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

from ...storage import write_file
from ..robot import Robot
from ..robot_spec import frame_id
from .urdf import link_inertia, mujoco_spec, set_body_inertia, set_link_inertia

_COULOMB_TIME = 0.002
"""Time constant of MuJoCo's joint friction [s]; its default of 0.02 s makes it a damper."""


def parametrised_spec(robot: Robot) -> mujoco.MjSpec:
    """`mujoco_spec` with the robot's parameters, and a torque motor at every joint."""
    spec = mujoco_spec(robot)
    set_body_inertia(spec.body(robot.spec.base_link), robot.model.inertias[1])
    by_joint = zip(
        robot.joint_names,
        robot.model.armature[-robot.nu :],
        robot.of_joint("damping"),
        robot.of_joint("coulomb"),
        robot.tau_max,
        strict=True,
    )
    for name, armature, damping, coulomb, limit in by_joint:
        joint = spec.joint(name)
        joint.armature, joint.damping, joint.frictionloss = armature, [damping, 0, 0], coulomb
        joint.solref_friction = [_COULOMB_TIME, 1]
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.gainprm = [robot.parameters.torque_constant] + [0] * 9
        motor.biasprm = [0] * 10
        motor.ctrlrange, motor.ctrllimited = [-limit, limit], True
    return spec


def write_mjcf(robot: Robot, path: Path | str, notes: Sequence[str] = ()) -> Path:
    """Write the robot as MJCF: inertias, rotors, friction, motors, and its collision shapes.

    Args:
        robot: The robot, with its parameters.
        path: The file.
        notes: Lines for a comment at its head.

    Raises:
        FileProblem: The file cannot be written.
    """
    spec = parametrised_spec(robot)
    spec.compile()
    return _write(path, spec.to_xml(), notes)


def write_urdf(robot: Robot, path: Path | str, notes: Sequence[str] = ()) -> Path:
    """Write the robot's URDF with its load in the trunk and the friction in `<dynamics>`.

    A URDF has no place for rotor inertia and torque constants: the notes should tell them. Rotor
    inertia is written as the attribute `armature` of `<dynamics>`, which readers that do not know
    it pass over.

    Args:
        robot: The robot, with its parameters.
        path: The file.
        notes: Lines for a comment at its head.

    Raises:
        FileProblem: The file cannot be written.
    """
    root = ElementTree.fromstring(robot.urdf)
    bare = robot.bare or robot
    added = _parameters(robot.model.inertias[1]) - _parameters(bare.model.inertias[1])
    link = _trunk_link(robot, root)
    frame = robot.model.frames[frame_id(robot.model, link.get("name", ""))].placement
    own = link_inertia(link)
    in_trunk = np.zeros(10) if own is None else _parameters(frame.act(own))
    if np.any(added):
        whole = pin.Inertia.FromDynamicParameters(in_trunk + added)
        set_link_inertia(link, frame.actInv(whole))
    values = {name: robot.of_joint(name) for name in ("damping", "coulomb", "armature")}
    elements = {element.get("name", ""): element for element in root.findall("joint")}
    for k, name in enumerate(robot.joint_names):
        joint = elements[name]
        dynamics = joint.find("dynamics")
        if dynamics is None:
            dynamics = ElementTree.SubElement(joint, "dynamics")
        for attribute, key in zip(("damping", "friction", "armature"), values, strict=True):
            dynamics.set(attribute, f"{values[key][k]:.6g}")
    ElementTree.indent(root)
    return _write(path, ElementTree.tostring(root, encoding="unicode"), notes)


def _trunk_link(robot: Robot, root: ElementTree.Element) -> ElementTree.Element:
    """The link that carries the load: the heaviest of the trunk, which may be a frame without
    mass, and what is fixed to it."""
    model, base = robot.model, robot.spec.base_link
    mover = model.frames[frame_id(model, base)].parentJoint

    def order(link: ElementTree.Element) -> tuple[float, bool]:
        own = link_inertia(link)
        return 0.0 if own is None else float(own.mass), link.get("name") == base

    fixed = [
        link
        for link in root.findall("link")
        if model.frames[frame_id(model, link.get("name", ""))].parentJoint == mover
    ]
    return max(fixed, key=order)


def _parameters(inertia: pin.Inertia) -> np.ndarray:
    """Mass, first moments and inertia about the frame's origin, shape (10,)."""
    return np.array(inertia.toDynamicParameters())


def _write(path: Path | str, document: str, notes: Sequence[str]) -> Path:
    """Write a document with a comment before it."""
    # "--" may not stand in a comment.
    comment = "\n".join(line.replace("--", "- -") for line in notes)
    text = f"<!--\n{comment}\n-->\n{document.rstrip()}\n" if notes else f"{document.rstrip()}\n"
    return write_file(path, text)
