"""What the world is like, and the model does not know: the only place that says so."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .._state import known_name
from ..errors import InvalidInput

# Rotor inertia of Unitree's motor about its own axis; ref: links *_rotor of go1.urdf in
# example-robot-data (the A1 has the same motor, and its URDF leaves the rotors out).
ROTOR_INERTIA = 0.000111842
GEAR_RATIO = 9.0  # paper, section II.A


@dataclass(frozen=True)
class Scenario:
    """The true world of a simulation.

    Attributes:
        name: Short name, as on the command line.
        armature: Rotor inertia as the joint feels it, through the gear [kg m^2].
        damping: Viscous friction in the joints [N m s/rad].
        coulomb: Coulomb friction in the joints [N m].
        torque_constant: Torque that a motor gives, over the torque it is asked for.
        payload: Mass fixed to the trunk [kg].
        payload_position: Where the payload sits, in the trunk's frame [m].
        ground_time_constant: Time constant of the contact [s], MuJoCo's solref; larger is softer.
        ground_friction: Friction coefficient between foot and ground.
        timestep: Time step of the simulation and of the control [s].
    """

    name: str
    armature: float = 0.0
    damping: float = 0.0
    coulomb: float = 0.0
    torque_constant: float = 1.0
    payload: float = 0.0
    payload_position: tuple[float, float, float] = (0.0, 0.0, 0.06)
    ground_time_constant: float = 0.002
    ground_friction: float = 0.8
    timestep: float = 0.001

    def __post_init__(self) -> None:
        for quantity in ("armature", "damping", "coulomb", "payload"):
            if not getattr(self, quantity) >= 0.0:
                raise InvalidInput(f"scenario '{self.name}': {quantity} must not be negative")
        for quantity in ("torque_constant", "ground_friction", "timestep"):
            if not getattr(self, quantity) > 0.0:
                raise InvalidInput(f"scenario '{self.name}': {quantity} must be positive")
        if not self.ground_time_constant >= 2 * self.timestep:
            raise InvalidInput(
                f"scenario '{self.name}': a ground_time_constant below two time steps "
                f"({2 * self.timestep:g} s) is unstable; make it larger"
            )


_NOMINAL = Scenario("nominal", armature=ROTOR_INERTIA * GEAR_RATIO**2, damping=0.1, coulomb=0.2)

SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("ideal"),
        _NOMINAL,
        replace(_NOMINAL, name="payload", payload=3.0),
        replace(_NOMINAL, name="weak-motors", torque_constant=0.85),
        replace(_NOMINAL, name="soft-ground", ground_time_constant=0.01),
    )
}
"""Scenarios known by name."""


def load_scenario(name: str) -> Scenario:
    """The scenario of that name.

    Raises:
        UnknownName: There is none.
    """
    return SCENARIOS[known_name("scenario", name, SCENARIOS)]


MISMATCHES = tuple(SCENARIOS)
"""The laboratory's list."""
