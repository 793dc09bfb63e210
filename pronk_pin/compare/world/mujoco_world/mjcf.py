"""Robots from other MJCF files in place of our URDF: a truth that the model was not made of.

What is taken of the file is the robot: its bodies, inertias, joints with their limits, armature,
damping and friction, and its feet. The scenario adds to that as it does to the URDF. Not taken are
actuators (torque motors take their place: the gains of a position servo go, damping that stands in
the joints stays), sensors, keyframes, the file's own ground, and its options. Contact parameters,
too, are the scenario's, whose ground it is.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ...._checks import path as known_path
from ....errors import InvalidInput
from ....parity import SIX_DIGITS, Parity, compare_models
from ....robot import Robot, as_robot
from ....robot.formats import check_mjcf, compile_mjcf, drop_looks, loading, read_mjcf
from ....storage import from_text, read_bytes, sha256

_FREE, _HINGE = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_HINGE


def mjcf_spec(robot: Robot, path: Path | str, *, actuators: bool = False) -> mujoco.MjSpec:
    """The robot of an MJCF as `mujoco_spec` gives that of a URDF: floating, alone, no actuators.

    Its trunk bears the name `robot.spec.base_link`, and every inertia stands in `inertia` and
    `iquat`. Meshes, and shapes that touch nothing, are left out: a mesh is read only where a body
    has no other inertia than that of its shapes.

    Args:
        robot: The robot that it should be; joints are matched by name.
        path: The MJCF.
        actuators: Keep its actuators.

    Raises:
        FileProblem: It is missing, or MuJoCo cannot read it.
        InvalidInput: It lacks a joint or has another one, or its trunk does not float.
    """
    as_robot(robot)
    path = known_path("path", path).expanduser()
    spec = read_mjcf(path)
    trunk = _trunk(spec, robot, path)
    _keep_the_robot(spec, trunk)
    for actuator in [] if actuators else spec.actuators:
        spec.delete(actuator)
    drop_looks(spec)
    trunk.name = robot.spec.base_link
    trunk.pos, trunk.quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    for joint in trunk.joints:  # which may have inherited friction that was meant for the legs
        joint.armature, joint.frictionloss, joint.damping = 0.0, 0.0, np.zeros(len(joint.damping))
    _write_inertias(spec, compile_mjcf(spec, path))
    _drop_shapes(spec)
    compile_mjcf(spec, path)
    return spec


def mjcf_parity(robot: Robot, path: Path | str) -> Parity:
    """Compare an MJCF with our robot; the table belongs beside what was measured in it.

    Args and errors as for `mjcf_spec`.
    """
    model = mjcf_spec(robot, path, actuators=True).compile()
    return compare_models(robot, model, tolerance=SIX_DIGITS)


@dataclass(frozen=True)
class ForeignRobot:
    """Record of the MJCF that a result was made with.

    Attributes:
        path: The file.
        sha256: Of it and of the files it names, see `mjcf_sha256`.
        parity: What it has otherwise than our robot (a is ours, b the file's).
    """

    path: str
    sha256: str
    parity: Parity

    @classmethod
    def read(cls, robot: Robot, path: Path | str) -> ForeignRobot:
        """Look at the file; args and errors as for `mjcf_spec`."""
        return cls(str(path), mjcf_sha256(path), mjcf_parity(robot, path))

    def to_json(self) -> str:
        """The record as JSON; `from_json` reads it."""
        head = {"path": self.path, "sha256": self.sha256}
        return json.dumps({**head, "parity": json.loads(self.parity.to_json())}, indent=1) + "\n"

    @classmethod
    def from_json(cls, text: str) -> ForeignRobot:
        """Read the record that `to_json` wrote.

        Raises:
            InvalidInput: The text is something else.
        """
        stored = from_text(text, _Stored, "a record of an MJCF", "make it again")
        return cls(stored.path, stored.sha256, Parity.from_json(json.dumps(stored.parity)))


@dataclass(frozen=True)
class _Stored:
    path: str
    sha256: str
    parity: dict[str, Any]


def mjcf_sha256(path: Path | str) -> str:
    """SHA-256 of an MJCF, followed by the files that it names as far as they are there.

    Raises:
        FileProblem: It cannot be read.
    """
    path = known_path("path", path).expanduser()
    check_mjcf(path)
    with loading(path):
        others = sorted({Path(name) for name in mujoco.mju_getXMLDependencies(str(path))} - {path})
    files = [path, *(other for other in others if other.is_file())]
    return sha256(b"".join(read_bytes(file, "put the file in order") for file in files))


def _trunk(spec: mujoco.MjSpec, robot: Robot, path: Path) -> mujoco.MjsBody:
    """The floating body that bears the legs."""
    hinges = {joint.name for joint in spec.joints if joint.type == _HINGE}
    missing = [name for name in robot.joint_names if name not in hinges]
    if missing:
        raise InvalidInput(
            f"{path} has no joint {', '.join(missing)}; the {robot.name} needs the hinges "
            f"{', '.join(robot.joint_names)}: rename those of the file, or choose its robot with "
            "--robot"
        )
    others = [
        joint.name or "without a name"
        for joint in spec.joints
        if joint.name not in robot.joint_names and joint.type != _FREE
    ]
    if others:
        raise InvalidInput(
            f"{path} has joints that the {robot.name} has not: {', '.join(others)}; "
            "nothing would hold them: remove them"
        )
    trunk = spec.joint(robot.joint_names[0]).parent.parent
    while not trunk.joints and trunk.parent is not None and trunk.parent.name != "world":
        trunk = trunk.parent  # which the leg is mounted on by bodies that are welded to it
    floating = [joint.type for joint in trunk.joints] == [_FREE]
    if trunk.parent is None or trunk.parent.name != "world" or not floating:
        raise InvalidInput(
            f"{path}: the body that bears {robot.joint_names[0]} does not float; put it into the "
            "worldbody, with <freejoint/> in it"
        )
    return trunk


def _keep_the_robot(spec: mujoco.MjSpec, trunk: mujoco.MjsBody) -> None:
    """Delete what is not the robot itself: its surroundings, its sensors, its keyframes."""
    around = (*spec.worldbody.geoms, *spec.lights, *spec.cameras, *spec.excludes)
    for element in (*spec.keys, *spec.sensors, *around):
        spec.delete(element)
    for body in spec.worldbody.bodies:
        if body.name != trunk.name:
            spec.delete(body)
    spec.option = mujoco.MjSpec().option


def _drop_shapes(spec: mujoco.MjSpec) -> None:
    """Delete meshes and shapes that touch nothing; contact is the scenario's for the rest."""
    usual = mujoco.MjSpec().worldbody.add_geom()
    for geom in spec.geoms:
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH or not (geom.contype or geom.conaffinity):
            spec.delete(geom)
            continue
        for name in ("solimp", "priority", "margin", "gap", "solmix"):
            setattr(geom, name, getattr(usual, name))
        geom.material = ""
    for element in (*spec.meshes, *spec.materials, *spec.textures, *spec.skins, *spec.pairs):
        spec.delete(element)


def _write_inertias(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Write every body's inertia down in one form, so that shapes have no more say in it."""
    for body in _links(spec):
        compiled = model.body(body.id)
        body.mass, body.ipos = float(compiled.mass[0]), compiled.ipos
        body.inertia, body.iquat = compiled.inertia, compiled.iquat
        body.fullinertia = np.full(6, np.nan)
        body.explicitinertial = True
    for name in ("inertiafromgeom", "boundmass", "boundinertia", "balanceinertia", "settotalmass"):
        setattr(spec.compiler, name, getattr(mujoco.MjSpec().compiler, name))


def _links(spec: mujoco.MjSpec) -> list[mujoco.MjsBody]:
    """All bodies but the world."""
    return list(spec.bodies[1:])
