"""The robot: its rigid-body model with names, feet, limits and standing posture.

Everything is read from the URDF; a `RobotSpec` only says which names play which part, see
`pronk_pin.robot.robot_spec`.

Layout, here and everywhere: ``q = [x, y, z, qx, qy, qz, qw, joints]`` (19), ``v = [base linear and
angular velocity in the body frame, joints]`` (18), joints by leg FL, FR, RL, RR and within a leg
hip, thigh, calf.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from .._checks import instance_of, numbers
from .._display import Displayed
from .._typing import Array, IntArray
from ..errors import InvalidInput
from ..storage import from_text
from .parameters import BY_JOINT, NOTHING, SLIDING, ModelParameters, loaded
from .robot_spec import (
    CENTRE,
    JOINTS,
    ROBOTS,
    RobotSpec,
    check_names,
    frame_id,
    load_robot_spec,
    locate,
    place_feet,
)
from .urdf_file import read_urdf

__all__ = [
    "JOINTS",
    "NB",
    "ROBOTS",
    "Robot",
    "RobotSpec",
    "load_robot",
    "recorded_robot",
    "robot_attributes",
    "with_rotors",
]

NB = 6
"""Velocities of the floating base."""


@dataclass(frozen=True, eq=False, repr=False)
class Robot(Displayed):
    """A legged robot: Pinocchio's model with its names, limits and parameters.

    Attributes:
        spec: The names the robot was built from.
        urdf_path: The URDF it was read from.
        urdf: What was in it then.
        package_dir: Folder in which packages lie that the URDF's meshes may be of, see `find_mesh`.
        model: Pinocchio's model with a floating base; treat it as read-only.
        foot_radius: Radius of the spherical feet [m].
        urdf_joint_names: The joints in the order of the URDF document, which is MuJoCo's order.
        parameters: What the model says beyond the URDF, see `with_parameters`.
        bare: The robot without its parameters; None where it has none.
    """

    spec: RobotSpec
    urdf_path: Path
    urdf: bytes
    package_dir: Path
    model: pin.Model
    foot_radius: float
    urdf_joint_names: tuple[str, ...]
    parameters: ModelParameters = NOTHING
    bare: Robot | None = None

    def _title(self) -> str:
        return f"Robot {self.name}"

    def _facts(self) -> dict[str, str]:
        changed = vars(self.parameters).items() - vars(NOTHING).items()
        return {
            "URDF": str(self.urdf_path),
            "mass": f"{self.mass:.2f} kg",
            "joints": ", ".join(self.joint_names),
            "torques": f"up to {max(self.tau_max, default=0.0):g} N m",
            "parameters": ", ".join(f"{name} {value}" for name, value in sorted(changed)),
        }

    def with_parameters(self, parameters: ModelParameters) -> Robot:
        """The robot with rotors, friction, motors and load that its URDF leaves out.

        Dynamics, inverse dynamics, impacts and gait optimisation of the robot that comes out use
        them; parameters that this robot has already are replaced. A simulated `World` does not:
        what is true there is the scenario's to say.

        Args:
            parameters: The parameters.

        Raises:
            InvalidInput: Parameters of another number of joints, or a trunk without mass.
        """
        return _with_parameters(
            self.bare or self, instance_of("parameters", parameters, ModelParameters)
        )

    @property
    def name(self) -> str:
        """Short name of the robot."""
        return self.spec.name

    @cached_property
    def nq(self) -> int:
        """Size of q."""
        return int(self.model.nq)

    @cached_property
    def nv(self) -> int:
        """Size of v."""
        return int(self.model.nv)

    @cached_property
    def nu(self) -> int:
        """Number of motors."""
        return self.nv - NB

    @property
    def legs(self) -> tuple[str, ...]:
        """Legs in the order of q."""
        return self.spec.legs

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Joints in the order of q: those of the legs, and any others the URDF has."""
        return tuple(self.model.names[2:])

    @property
    def foot_names(self) -> tuple[str, ...]:
        """Links of the feet, in the order of the legs."""
        return self.spec.foot_names

    @cached_property
    def foot_ids(self) -> tuple[int, ...]:
        """Pinocchio's frame ids of the feet's centres."""
        centres = [name + CENTRE for name in self.foot_names]
        names = zip(centres, self.foot_names, strict=True)
        return tuple(
            frame_id(self.model, centre if self.model.existFrame(centre) else name)
            for centre, name in names
        )

    @cached_property
    def data(self) -> pin.Data:
        """Scratch memory for Pinocchio's algorithms; not to be shared between threads."""
        return self.model.createData()

    @cached_property
    def at_rest(self) -> Array:
        """A velocity or acceleration of zero, shape (18,); read-only."""
        zero = np.zeros(self.nv)
        zero.flags.writeable = False
        return zero

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
        return self._limits(self.spec.velocity_limits, self.model.velocityLimit)

    @cached_property
    def tau_max(self) -> Array:
        """Torque limits [N m], shape (12,)."""
        return self._limits(self.spec.torque_limits, self.model.effortLimit)

    def _limits(self, given: tuple[float, ...], of_urdf: Array) -> Array:
        """Limits of the joints: those that the specification gives for a leg, or the URDF's."""
        limits = np.array(of_urdf[-self.nu :])
        if given:
            limits = np.where(self.joint_kinds < 0, limits, np.array(given)[self.joint_kinds])
        return limits

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        return float(pin.computeTotalMass(self.model))

    @cached_property
    def gravity(self) -> float:
        """Gravitational acceleration, positive [m/s^2]."""
        return float(-self.model.gravity.linear[2])

    @cached_property
    def joint_kinds(self) -> IntArray:
        """For each joint its place in the leg, 0 for a hip; -1 for joints of no leg, (12,)."""
        return np.array([kind for _, kind in self._places], dtype=np.intp)

    @cached_property
    def joint_coordinates(self) -> dict[str, tuple[str, list[str]]]:
        """Coordinates of a dataset's axis `joint`: its name, its leg, and its kind in `JOINTS`."""
        return {
            "joint": ("joint", [name.removesuffix("_joint") for name in self.joint_names]),
            "leg": ("joint", [leg for leg, _ in self._places]),
            "kind": ("joint", [JOINTS[kind] if leg else "" for leg, kind in self._places]),
        }

    @property
    def _places(self) -> list[tuple[str, int]]:
        """For each joint its leg and its place in it; "" and -1 for joints of no leg."""
        places = {
            name: (leg, kind)
            for leg in self.legs
            for kind, name in enumerate(self.spec.leg_joints(leg))
        }
        return [places.get(name, ("", -1)) for name in self.joint_names]

    def of_joint(self, name: str) -> Array:
        """A parameter out of `armature`, `damping` and `coulomb`, by joint, shape (12,)."""
        return self.parameters.of_joint(name, self.joint_kinds, len(self.spec.joints))

    def friction(self, rates: Array) -> Array:
        """Friction `d v + c tanh(v / v_s)` at joint velocities v (..., 12) [rad/s], in [N m]."""
        sliding = np.tanh(rates / SLIDING)
        return np.asarray(self.of_joint("damping") * rates + self.of_joint("coulomb") * sliding)

    def friction_rate(self, rates: Array) -> Array:
        """Derivative of `friction` by the joint velocities, shape (..., 12) [N m s/rad]."""
        slope = 1.0 / (SLIDING * np.cosh(np.clip(rates / SLIDING, -300.0, 300.0)) ** 2)
        return np.asarray(self.of_joint("damping") + self.of_joint("coulomb") * slope)

    def joint_torques(self, tau: Array, rates: Array) -> Array:
        """Torques that move the joints, from those that the motors are commanded.

        Args:
            tau: Motor torques [N m], shape (..., 12).
            rates: Joint velocities [rad/s], shape (..., 12).
        """
        if self.parameters.ideal_motors:
            return tau
        return np.asarray(self.parameters.torque_constant * tau - self.friction(rates))

    @cached_property
    def standing(self) -> Array:
        """Standing posture with the feet on the ground z = 0, shape (19,)."""
        q, names = pin.neutral(self.model), self.spec.joint_names
        angles = np.resize(self.spec.standing, len(names))
        q[[NB + 1 + self.joint_names.index(name) for name in names]] = angles
        pin.framesForwardKinematics(self.model, self.data, q)
        lowest = min(self.data.oMf[foot].translation[2] for foot in self.foot_ids)
        q[2] = self.foot_radius - lowest
        return np.array(q)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the URDF, and of the parameters if any; results and gaits carry it."""
        document = self.urdf
        if self.parameters != NOTHING:
            document += repr(self.parameters).encode()
        return hashlib.sha256(document).hexdigest()

    def q_from_base(self, position: Array, joints: Array, *, pitch: Array | float = 0.0) -> Array:
        """Configuration from the trunk's position, its pitch and the joints; batched.

        Args:
            position: Trunk position in the world [m], shape (..., 3).
            joints: Joint angles [rad], shape (..., 12).
            pitch: Rotation about the y axis [rad], shape (...).

        Returns:
            q, shape (..., 19).
        """
        # The checks of states are a floor above.
        position, joints, pitch = numbers(position=position, joints=joints, pitch=pitch)
        fits = position.shape[-1:] == (3,) and joints.shape == (*position.shape[:-1], self.nu)
        if not fits or pitch.shape not in ((), position.shape[:-1]):
            raise InvalidInput(
                f"position, joints and pitch have the shapes {position.shape}, {joints.shape} and "
                f"{pitch.shape}; give (..., 3), (..., {self.nu}) and (...), of the same batch"
            )
        half = 0.5 * np.broadcast_to(pitch, position.shape[:-1])
        zero = np.zeros_like(half)
        quaternion = np.stack([zero, np.sin(half), zero, np.cos(half)], axis=-1)
        return np.concatenate([position, quaternion, joints], axis=-1)


def load_robot(robot: str | RobotSpec = "a1") -> Robot:
    """Load a robot by its short name, or from a specification of your own.

    Args:
        robot: What `load_robot_spec` takes.

    Raises:
        UnknownName: There is no robot of that name.
        FileProblem: The URDF, or a file of a specification, is missing or cannot be read.
        InvalidInput: The URDF lacks a joint or a foot that the specification names.
    """
    return _load(load_robot_spec(robot))


def robot_attributes(spec: RobotSpec) -> dict[str, str]:
    """Attributes by which a dataset names its robot: one that is not shipped is in them whole."""
    own = {} if ROBOTS.get(spec.name) == spec else {"robot_spec": json.dumps(asdict(spec))}
    return {"robot": spec.name, **own}


def recorded_robot(attributes: Mapping[Any, Any]) -> Robot:
    """The robot that the attributes of a dataset name, see `robot_attributes`.

    Raises:
        InvalidInput: A specification in them is damaged.
        UnknownName: It is known by name only, and that is not known here.
        FileProblem: Its URDF is missing.
    """
    stored = attributes.get("robot_spec")
    if stored is None:
        return load_robot(str(attributes["robot"]))
    what = "a specification of a robot"
    return load_robot(from_text(str(stored), RobotSpec, what, "make the strides again"))


def with_rotors(robot: Robot) -> Robot:
    """The robot with the rotors' inertia of its datasheet.

    Raises:
        InvalidInput: That is not known.
    """
    if not robot.spec.rotors:
        raise InvalidInput(
            f"the rotors of {robot.name} are not known; give RobotSpec(rotors=...) their inertia, "
            "or choose controllers that do not need it, as 'pd', 'model' and 'ilc'"
        )
    return robot.with_parameters(ModelParameters(armature=robot.spec.rotors))


@lru_cache(maxsize=16)
def _load(spec: RobotSpec) -> Robot:
    path, package_dir = locate(spec.urdf)
    data, document, model = read_urdf(path)
    model.name = spec.name
    check_names(spec, model, path)
    radius = place_feet(spec, document, model)
    order = [element.get("name", "") for element in document.findall("joint")]
    joints = set(model.names[2:])
    return Robot(
        spec=spec,
        urdf_path=path,
        urdf=data,
        package_dir=package_dir,
        model=model,
        foot_radius=radius,
        urdf_joint_names=tuple(name for name in order if name in joints),
    )


@lru_cache(maxsize=32)
def _with_parameters(bare: Robot, parameters: ModelParameters) -> Robot:
    if parameters == NOTHING:
        return bare
    model = bare.model.copy()
    robot = replace(bare, model=model, parameters=parameters, bare=bare)
    by_joint = {name: robot.of_joint(name) for name in BY_JOINT}  # complains of a wrong number
    model.armature = model.armature + np.concatenate([np.zeros(NB), by_joint["armature"]])
    model.inertias[1] = loaded(model.inertias[1], parameters)
    return robot
