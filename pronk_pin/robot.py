"""What the robot is: the rigid-body model with its names, feet, limits and standing posture.

Everything is read from the URDF; a `RobotSpec` only says which names play which part.

Layout, here and everywhere: ``q = [x, y, z, qx, qy, qz, qw, joints]`` (19), ``v = [base linear and
angular velocity in the body frame, joints]`` (18), joints by leg FL, FR, RL, RR and within a leg
hip, thigh, calf.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from ._typing import Array
from .errors import FileProblem, InvalidInput, UnknownName

JOINTS = ("hip", "thigh", "calf")
"""Joints of a leg, from the trunk down."""

NB, NL = 6, 12
"""Velocities of the floating base, and actuated joints of a robot with four legs of three."""

_DATA_DISTRIBUTION = "example-robot-data"


@dataclass(frozen=True)
class RobotSpec:
    """Which names of a URDF play which part in a quadruped.

    Attributes:
        name: Short name, as on the command line.
        urdf: Path of the URDF: absolute, or relative to the `robots` folder of example-robot-data.
        base_link: Link of the trunk.
        legs: Legs in Pinocchio's order.
        joint_pattern: Name of a joint, with `{leg}` and `{joint}` (hip, thigh, calf).
        foot_pattern: Name of the foot's frame, with `{leg}`.
        standing: Hip, thigh and calf angle of the standing posture [rad], the same for each leg.
    """

    name: str
    urdf: str
    base_link: str = "trunk"
    legs: tuple[str, ...] = ("FL", "FR", "RL", "RR")
    joint_pattern: str = "{leg}_{joint}_joint"
    foot_pattern: str = "{leg}_foot"
    standing: tuple[float, float, float] = (0.0, 0.9, -1.8)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The twelve joints, by leg."""
        return tuple(
            self.joint_pattern.format(leg=leg, joint=joint) for leg in self.legs for joint in JOINTS
        )

    @property
    def foot_names(self) -> tuple[str, ...]:
        """The feet, in the order of the legs."""
        return tuple(self.foot_pattern.format(leg=leg) for leg in self.legs)


ROBOTS = {spec.name: spec for spec in (RobotSpec("a1", "a1_description/urdf/a1.urdf"),)}
"""Robots known by name."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A quadruped: Pinocchio's model, and the names and numbers that everything else needs.

    Attributes:
        spec: The names the robot was built from.
        urdf_path: The URDF it was read from.
        package_dir: Folder against which the URDF's `package://` meshes are resolved.
        model: Pinocchio's model with a floating base; treat it as read-only.
        foot_radius: Radius of the spherical feet [m].
        urdf_joint_names: The joints in the order of the URDF document, which is MuJoCo's order.
    """

    spec: RobotSpec
    urdf_path: Path
    package_dir: Path
    model: pin.Model
    foot_radius: float
    urdf_joint_names: tuple[str, ...]

    @property
    def name(self) -> str:
        """Short name of the robot."""
        return self.spec.name

    @property
    def nq(self) -> int:
        """Size of q."""
        return int(self.model.nq)

    @property
    def nv(self) -> int:
        """Size of v."""
        return int(self.model.nv)

    @property
    def nu(self) -> int:
        """Number of motors."""
        return self.nv - NB

    @property
    def legs(self) -> tuple[str, ...]:
        """Legs in the order of q."""
        return self.spec.legs

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the order of q."""
        return self.spec.joint_names

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Frames of the feet, in the order of the legs."""
        return self.spec.foot_names

    @cached_property
    def foot_ids(self) -> tuple[int, ...]:
        """Pinocchio's frame ids of the feet."""
        return tuple(int(self.model.getFrameId(name)) for name in self.foot_names)

    @cached_property
    def data(self) -> pin.Data:
        """Scratch memory for Pinocchio's algorithms; not to be shared between threads."""
        return self.model.createData()

    @cached_property
    def q_min(self) -> Array:
        """Lower joint limits [rad], shape (12,)."""
        return np.array(self.model.lowerPositionLimit[-self.nu :])

    @cached_property
    def q_max(self) -> Array:
        """Upper joint limits [rad], shape (12,)."""
        return np.array(self.model.upperPositionLimit[-self.nu :])

    @cached_property
    def v_max(self) -> Array:
        """Joint velocity limits [rad/s], shape (12,)."""
        return np.array(self.model.velocityLimit[-self.nu :])

    @cached_property
    def tau_max(self) -> Array:
        """Torque limits [N m], shape (12,)."""
        return np.array(self.model.effortLimit[-self.nu :])

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        return float(pin.computeTotalMass(self.model))

    @cached_property
    def gravity(self) -> float:
        """Gravitational acceleration, positive [m/s^2]."""
        return float(-self.model.gravity.linear[2])

    @cached_property
    def standing(self) -> Array:
        """Standing posture with the feet on the ground z = 0, shape (19,)."""
        q = pin.neutral(self.model)
        q[-self.nu :] = np.tile(self.spec.standing, len(self.legs))
        pin.framesForwardKinematics(self.model, self.data, q)
        lowest = min(self.data.oMf[foot].translation[2] for foot in self.foot_ids)
        q[2] = self.foot_radius - lowest
        return np.array(q)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the URDF; results and gaits carry it."""
        return hashlib.sha256(self.urdf_path.read_bytes()).hexdigest()

    def q_from_base(self, position: Array, joints: Array, *, pitch: Array | float = 0.0) -> Array:
        """Configuration from the trunk's position, its pitch and the joints; batched.

        Args:
            position: Trunk position in the world [m], shape (..., 3).
            joints: Joint angles [rad], shape (..., 12).
            pitch: Rotation about the y axis [rad], shape (...).

        Returns:
            q, shape (..., 19).
        """
        half = 0.5 * np.broadcast_to(np.asarray(pitch, dtype=float), position.shape[:-1])
        zero = np.zeros_like(half)
        quaternion = np.stack([zero, np.sin(half), zero, np.cos(half)], axis=-1)
        return np.concatenate([position, quaternion, joints], axis=-1)


def load_robot(robot: str | RobotSpec = "a1") -> Robot:
    """Load a robot by its short name, or from a specification of your own.

    Args:
        robot: "a1", or a `RobotSpec`.

    Raises:
        UnknownName: There is no robot of that name.
        FileProblem: The URDF is missing or cannot be read.
        InvalidInput: The URDF lacks a joint or a foot that the specification names.
    """
    if isinstance(robot, str):
        if robot not in ROBOTS:
            raise UnknownName("robot", robot, ROBOTS)
        robot = ROBOTS[robot]
    return _load(robot)


@lru_cache(maxsize=16)
def _load(spec: RobotSpec) -> Robot:
    path, package_dir = _locate(spec.urdf)
    try:
        model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        geometry = pin.buildGeomFromUrdf(
            model, str(path), pin.GeometryType.COLLISION, package_dirs=[str(package_dir)]
        )
        document = ElementTree.parse(path).getroot()
    except (ValueError, RuntimeError, ElementTree.ParseError) as error:
        raise FileProblem(path, f"not a usable URDF ({error})", "check the file") from error
    model.name = spec.name
    joints = tuple(name for name in model.names[2:])
    if joints != spec.joint_names:
        raise InvalidInput(
            f"{path.name}: its joints are {', '.join(joints)}; the specification expects "
            f"{', '.join(spec.joint_names)}; adapt joint_pattern and legs of the RobotSpec"
        )
    missing = [name for name in spec.foot_names if not model.existFrame(name)]
    if missing:
        raise InvalidInput(f"{path.name} has no frame {missing[0]}; adapt foot_pattern")
    order = [element.get("name", "") for element in document.iter("joint")]
    return Robot(
        spec=spec,
        urdf_path=path,
        package_dir=package_dir,
        model=model,
        foot_radius=_foot_radius(geometry, model, spec),
        urdf_joint_names=tuple(name for name in order if name in spec.joint_names),
    )


def _foot_radius(geometry: pin.GeometryModel, model: pin.Model, spec: RobotSpec) -> float:
    """Radius of the feet's collision spheres."""
    first = int(model.getFrameId(spec.foot_names[0]))
    for item in geometry.geometryObjects:
        if item.parentFrame == first and hasattr(item.geometry, "radius"):
            return float(item.geometry.radius)
    raise InvalidInput(f"{spec.name}: foot {spec.foot_names[0]} has no collision sphere")


def _locate(urdf: str) -> tuple[Path, Path]:
    """Path of a URDF and of the folder that its `package://` addresses start from."""
    path = Path(urdf).expanduser()
    if path.is_absolute():
        if not path.is_file():
            raise FileProblem(path, "no such URDF", "check the path in the RobotSpec")
        return path, path.parent
    wanted = f"example-robot-data/robots/{urdf}"
    try:
        files = importlib.metadata.files(_DATA_DISTRIBUTION) or []
    except importlib.metadata.PackageNotFoundError:
        files = []
    for file in files:
        if file.as_posix().endswith(wanted):
            located = Path(str(file.locate())).resolve()
            return located, located.parents[len(Path(wanted).parts) - 1]
    raise FileProblem(
        wanted, "not found in the installed packages", f"run 'pip install {_DATA_DISTRIBUTION}'"
    )
