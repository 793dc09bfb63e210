"""Model parameters beyond the URDF: rotors, friction, motors and load.

A URDF often leaves out what turns and rubs inside a joint. `Robot.with_parameters` adds it, for
dynamics, inverse dynamics, impacts and gait optimisation alike:

    (M + A) a + H v + G = S (k tau - D v_j - C sign(v_j)) + J^T lam

with the rotors' inertia A, viscous friction D, Coulomb friction C and the torque constant k.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from .._checks import ANY, Interval, keep_reals, keep_vectors
from .._typing import Array, IntArray
from ..errors import InvalidInput

SLIDING = 0.1
"""Joint velocity at which Coulomb friction is at 76 % of its full strength [rad/s]: sign(v) is
written as tanh(v / SLIDING), so that it has a derivative."""

BY_JOINT = ("armature", "damping", "coulomb")
"""Parameters with a value for each kind of joint."""

_PAYLOAD = Interval(-1000, 1000, "kg")


@dataclass(frozen=True)
class ModelParameters:
    """Parameters of a robot's model beyond its URDF; the defaults change nothing.

    Attributes:
        armature: Rotor inertia as the joints of a leg feel it, hip, thigh, calf [kg m^2].
        damping: Their viscous friction [N m s/rad].
        coulomb: Their Coulomb friction [N m].
        payload: Mass fixed to the trunk [kg], as a point; negative if the trunk is lighter.
        payload_position: Where it sits, in the trunk's frame [m].
        trunk_shift: By how far the trunk's own centre of mass lies beside the URDF's [m].
        torque_constant: Torque that a motor gives, over the torque it is asked for.
    """

    armature: tuple[float, ...] = (0.0, 0.0, 0.0)
    damping: tuple[float, ...] = (0.0, 0.0, 0.0)
    coulomb: tuple[float, ...] = (0.0, 0.0, 0.0)
    payload: float = 0.0
    payload_position: tuple[float, float, float] = (0.0, 0.0, 0.06)
    trunk_shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque_constant: float = 1.0

    def __post_init__(self) -> None:
        keep_vectors(self, dict.fromkeys(BY_JOINT, Interval(0, 1000)), length=None)
        keep_vectors(self, {"payload_position": ANY, "trunk_shift": ANY})
        keep_reals(self, {"payload": _PAYLOAD, "torque_constant": Interval(0, 100, above=True)})

    @property
    def ideal_motors(self) -> bool:
        """Whether joints get the torques that their motors are commanded, without friction."""
        rubs = any(self.damping) or any(self.coulomb)
        return not rubs and self.torque_constant == 1.0

    def of_joint(self, name: str, kinds: IntArray, joints: int) -> Array:
        """A parameter of `BY_JOINT` for every joint, shape (joints,).

        Args:
            name: Which parameter.
            kinds: Which kind each joint is, as an index into the parameter; -1 for none.
            joints: How many kinds a leg has.

        Raises:
            InvalidInput: The parameter has not one value for each kind, and is not zero.
        """
        values = getattr(self, name)
        if not any(values):  # the default, which fits any leg
            return np.zeros(len(kinds))
        if len(values) != joints:
            raise InvalidInput(
                f"{name} has {len(values)} values; give {joints}, one for each joint of a leg"
            )
        return np.asarray(np.append(values, 0.0)[kinds])


NOTHING = ModelParameters()
"""The URDF as it stands."""


def loaded(trunk: pin.Inertia, parameters: ModelParameters) -> pin.Inertia:
    """Inertia of the trunk with its payload and its shifted centre of mass.

    Raises:
        InvalidInput: Nothing would be left of its mass.
    """
    if not trunk.mass + parameters.payload > 0.0:
        raise InvalidInput(
            f"a payload of {parameters.payload:g} kg leaves nothing of the trunk's "
            f"{trunk.mass:g} kg; give a larger one"
        )
    own = pin.Inertia(trunk.mass, trunk.lever + np.array(parameters.trunk_shift), trunk.inertia)
    if parameters.payload == 0.0:
        return own
    place = np.array(parameters.payload_position)
    # About the trunk's origin all is linear in the masses, negative ones included.
    mass = own.mass + parameters.payload
    first = own.mass * own.lever + parameters.payload * place
    second = _about_origin(own.inertia, own.mass, own.lever)
    second = second + _about_origin(np.zeros((3, 3)), parameters.payload, place)
    centre = first / mass
    return pin.Inertia(mass, centre, second - _about_origin(np.zeros((3, 3)), mass, centre))


def _about_origin(inertia: Array, mass: float, centre: Array) -> Array:
    """Rotational inertia about the origin, from that about the centre of mass."""
    return np.asarray(inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))
