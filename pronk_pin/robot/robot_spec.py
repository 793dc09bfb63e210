"""Specification of a robot: its URDF, and the roles of the links and joints in it."""

from __future__ import annotations

import importlib.metadata
import xml.etree.ElementTree as ElementTree
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from .._checks import Interval, file_name, none_or, real, reals, sequence_of, text
from .._checks import path as known_path
from .._registry import find
from ..errors import FileProblem, InvalidInput
from ..storage import as_type, check_file, read_toml
from .urdf_document import numbers_of, placement_of

JOINTS = ("hip", "thigh", "calf")
"""Joints of a leg, from the trunk down; a `RobotSpec` says what a URDF calls them."""

_OF_A_LEG = {
    "rotors": Interval(0, 10, "kg m^2"),
    "torque_limits": Interval(0, 1e5, "N m", above=True),
    "velocity_limits": Interval(0, 1e5, "rad/s", above=True),
    "damping": Interval(0, 50, "N m s/rad"),
    "coulomb": Interval(0, 50, "N m"),
    "kp": Interval(0, 1e5, "N m/rad", above=True),
    "kd": Interval(0, 1e4, "N m s/rad"),
}
"""Fields with one value for each joint of a leg, and what the values can be."""

CENTRE = " (centre)"
"""Ending of the names of frames at the centres of feet that are not at their link's origin."""

_DATA_DISTRIBUTION = "example-robot-data"


def _own_file(urdf: str) -> str:
    """The absolute path of a file that is there, whatever the current folder is later on."""
    with suppress(RuntimeError):  # there is no home
        path = Path(urdf).expanduser()
        return str(path.resolve()) if not path.is_absolute() and _is_file(path) else urdf
    return urdf


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name that no file can have
        return False


@dataclass(frozen=True)
class RobotSpec:
    """Roles of the names of a URDF in a legged robot.

    Attributes:
        name: Short name, as on the command line.
        urdf: Path of the URDF: a file's, which is kept as an absolute one, or relative to the
            `robots` folder of example-robot-data.
        base_link: Link of the trunk.
        legs: Legs in Pinocchio's order, which is alphabetical.
        joints: What the URDF calls a leg's joints, from the trunk down. Closed-form leg kinematics
            and the gaits need three: hip, thigh and calf.
        joint_pattern: Name of a joint, with `{leg}` and `{joint}`.
        foot_pattern: Name of the foot's frame, with `{leg}`.
        standing: Joint angles of the standing posture [rad]: of one leg, the same for each, or of
            all legs one after the other.
        foot_radius: Radius of the spherical feet [m]; None to read it from the collision spheres
            in the URDF. Where these are in the foot's link, too, is read from there.
        rotors: Rotor inertia of a leg's joints as they feel it, through the gear [kg m^2], from the
            motors' datasheet; one for each of `joints`, or none where it is not known. The URDF's
            model is without it; controllers that know it say so.
        torque_limits: Largest torques of a leg's motors [N m], where the URDF's are not theirs;
            none for the URDF's.
        velocity_limits: Largest velocities of a leg's joints [rad/s], likewise.
        damping: Viscous friction that a leg's motors add to its joints [N m s/rad], in the nominal
            scenario; none for the A1's, scaled, see `robot.similarity`.
        coulomb: Coulomb friction that they add [N m], likewise.
        kp: Feedback gains of a leg's joints [N m/rad]; none for the A1's, scaled by weight and leg
            length, see `robot.similarity`.
        kd: Their derivative gains [N m s/rad], likewise.
        apex: Apex of its gaits [m]; None for the A1's, scaled by the standing height.
    """

    name: str
    urdf: str
    base_link: str = "trunk"
    legs: tuple[str, ...] = ("FL", "FR", "RL", "RR")
    joints: tuple[str, ...] = JOINTS
    joint_pattern: str = "{leg}_{joint}_joint"
    foot_pattern: str = "{leg}_foot"
    standing: tuple[float, ...] = (0.0, 0.9, -1.8)
    foot_radius: float | None = None
    rotors: tuple[float, ...] = ()
    torque_limits: tuple[float, ...] = ()
    velocity_limits: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()
    coulomb: tuple[float, ...] = ()
    kp: tuple[float, ...] = ()
    kd: tuple[float, ...] = ()
    apex: float | None = None

    def __post_init__(self) -> None:
        file_name("name", self.name)
        for name in ("urdf", "base_link", "joint_pattern", "foot_pattern"):
            if not text(name, getattr(self, name)):
                raise InvalidInput(f"{name} is empty; give what stands in the URDF")
        object.__setattr__(self, "urdf", _own_file(self.urdf))
        for name in ("legs", "joints"):
            names = sequence_of(name, getattr(self, name), text)
            if not names or len(set(names)) < len(names):
                raise InvalidInput(f"{name} must name at least one, and none of them twice")
            object.__setattr__(self, name, names)
        self._check_patterns()
        object.__setattr__(self, "standing", reals("standing", self.standing))
        if len(self.standing) not in (len(self.joints), len(self.joint_names)):
            raise InvalidInput(
                f"standing has {len(self.standing)} angles; give {len(self.joints)}, for the "
                f"joints of one leg, or {len(self.joint_names)}, for all legs"
            )
        radius = none_or(real, "foot_radius", self.foot_radius, Interval(0, unit="m"))
        object.__setattr__(self, "foot_radius", radius)

        apex = none_or(real, "apex", self.apex, Interval(0, 100, "m", above=True))
        object.__setattr__(self, "apex", apex)
        for name, within in _OF_A_LEG.items():
            values = reals(name, getattr(self, name), within)
            object.__setattr__(self, name, values)
            if len(values) not in (0, len(self.joints)):
                raise InvalidInput(
                    f"{name} has {len(values)} values; give {len(self.joints)}, one for each joint "
                    "of a leg, or none"
                )

    @classmethod
    def load(cls, path: Path | str) -> RobotSpec:
        """Read a specification from a TOML file with the fields' names as keys.

        A URDF that lies beside the file, or below its folder, is named relative to it.

        Raises:
            FileProblem: The file is missing, or is no such file.
            InvalidInput: A value is out of range.
        """
        path = known_path("path", path).expanduser()
        remedy = "correct it: its keys are the fields of RobotSpec, name and urdf at least"
        document = read_toml(path, remedy)
        urdf = document.get("urdf")
        if isinstance(urdf, str) and (path.parent / urdf).is_file():
            document["urdf"] = str((path.parent / urdf).resolve())
        return as_type(document, cls, path, remedy, what="specification of a robot")

    def _check_patterns(self) -> None:
        for name in ("joint_pattern", "foot_pattern"):
            pattern = getattr(self, name)
            try:
                pattern.format(leg="FL", joint="hip")
            except (KeyError, IndexError, ValueError) as error:
                raise InvalidInput(
                    f"{name}={pattern!r} is not a pattern ({error}); write {{leg}} where the name "
                    "of the leg stands, and {joint} where that of the joint does"
                ) from error

    def leg_joints(self, leg: str) -> tuple[str, ...]:
        """Names of a leg's joints, from the trunk down."""
        return tuple(self.joint_pattern.format(leg=leg, joint=joint) for joint in self.joints)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The joints of the legs, by leg."""
        return tuple(name for leg in self.legs for name in self.leg_joints(leg))

    @property
    def foot_names(self) -> tuple[str, ...]:
        """The feet, in the order of the legs."""
        return tuple(self.foot_pattern.format(leg=leg) for leg in self.legs)


ROBOTS = {
    path.stem: RobotSpec.load(path) for path in sorted(Path(__file__).with_name("specs").iterdir())
}
"""Robots known by name; their files are examples for one of your own."""


def load_robot_spec(robot: str | RobotSpec) -> RobotSpec:
    """The specification of a robot.

    Args:
        robot: One of `ROBOTS`, the name of an entry point of the group `pronk_pin.robots`, the
            address of a `RobotSpec`, module:object, or a TOML file, see `RobotSpec.load`; one
            itself is returned as it is.

    Raises:
        UnknownName: There is no robot of that name.
        FileProblem: There is no such file, or it is damaged.
        InvalidInput: It is something else.
    """
    if isinstance(robot, RobotSpec):
        return robot
    if isinstance(robot, str | Path) and str(robot).endswith(".toml"):
        return RobotSpec.load(robot)
    return find("robot", robot, ROBOTS, RobotSpec)


def check_names(spec: RobotSpec, model: pin.Model, path: Path) -> None:
    """Check that the model has what the specification names, one angle a joint.

    Raises:
        InvalidInput: It has not.
    """
    joints = list(model.names[2:])
    if [name for name in joints if name in spec.joint_names] != list(spec.joint_names):
        raise InvalidInput(
            f"{path.name}: its joints are {', '.join(joints)}; the specification expects "
            f"{', '.join(spec.joint_names)}; adapt joints, joint_pattern and legs of the RobotSpec"
        )
    for leg, name in zip(spec.legs, spec.foot_names, strict=True):
        if not model.existFrame(name):
            raise InvalidInput(f"{path.name} has no frame {name}; adapt foot_pattern")
        mover = model.names[model.frames[frame_id(model, name)].parentJoint]
        if mover != spec.leg_joints(leg)[-1]:
            raise InvalidInput(
                f"{path.name}: foot {name} is moved by joint {mover}, and not by "
                f"{spec.leg_joints(leg)[-1]}, the last of its leg; adapt joints or foot_pattern"
            )
    if not model.existFrame(spec.base_link):
        raise InvalidInput(f"{path.name} has no link {spec.base_link}; adapt base_link")
    mover = model.names[model.frames[frame_id(model, spec.base_link)].parentJoint]
    if mover in joints:
        raise InvalidInput(
            f"{path.name}: link {spec.base_link} is moved by joint {mover}; adapt base_link, which "
            "is the link that floats"
        )


def frame_id(model: pin.Model, name: str) -> int:
    """Pinocchio's id of the frame of a link, or of a joint where no link has that name."""
    link = model.existFrame(name, pin.BODY)
    return int(model.getFrameId(name, pin.BODY) if link else model.getFrameId(name))


def place_feet(spec: RobotSpec, document: ElementTree.Element, model: pin.Model) -> float:
    """Give the model a frame at the centre of each foot's collision sphere; the spheres' radius.

    Where a sphere is about the origin of its link there is a frame already. A foot that has none,
    or several, is about the origin of its link, with the radius of the specification [m].

    Raises:
        InvalidInput: There is no such radius, or the feet have not all the same.
    """
    radii = []
    for foot in spec.foot_names:
        spheres = [
            (shape, sphere)
            for shape in document.findall(f"./link[@name='{foot}']/collision")
            for sphere in shape.findall("geometry/sphere")
        ]
        if len(spheres) != 1:
            if spec.foot_radius is not None:
                continue
            raise InvalidInput(
                f"{spec.name}: foot {foot} has {len(spheres) or 'no'} collision sphere"
                f"{'s' * bool(spheres)}; give foot_radius in the RobotSpec"
            )
        shape, sphere = spheres[0]
        radii.append(float(numbers_of(sphere, "radius", None, 1)[0]))
        centre = placement_of(shape).translation
        if np.any(centre):
            parent = frame_id(model, foot)
            joint, place = model.frames[parent].parentJoint, model.frames[parent].placement
            place = place * pin.SE3(np.eye(3), centre)
            model.addFrame(
                pin.Frame(foot + CENTRE, joint, parent, place, pin.FrameType.OP_FRAME), False
            )
    if spec.foot_radius is not None:
        return spec.foot_radius
    if max(radii) > min(radii) * (1.0 + 1e-9):
        raise InvalidInput(
            f"{spec.name}: the feet's collision spheres have the radii "
            f"{', '.join(f'{radius:g}' for radius in radii)} m; give them one, or foot_radius in "
            "the RobotSpec"
        )
    return radii[0]


def locate(urdf: str) -> tuple[Path, Path]:
    """Path of a URDF, and of a folder with packages that its `package://` addresses may name.

    Raises:
        FileProblem: There is no such URDF.
    """
    path, data = Path(urdf).expanduser(), _data_folder()
    if path.is_absolute():
        check_file(path, "put it back, or check the path in the RobotSpec")
        return path, data or path.parent
    wanted = Path("example-robot-data", "robots", urdf)
    if data is None or not _is_file(data / wanted):
        remedy = f"check the path, or run 'pip install {_DATA_DISTRIBUTION}'"
        raise FileProblem(path, f"neither a file nor a robot of {_DATA_DISTRIBUTION}", remedy)
    return data / wanted, data


@lru_cache(maxsize=1)
def _data_folder() -> Path | None:
    """The folder in which example-robot-data lies, if it is installed."""
    try:
        files = importlib.metadata.files(_DATA_DISTRIBUTION) or []
    except importlib.metadata.PackageNotFoundError:
        return None
    for file in files:
        if "example-robot-data/robots/" in file.as_posix():
            parents = Path(str(file.locate())).resolve().parents
            return next(each.parent for each in parents if each.name == "example-robot-data")
    return None
