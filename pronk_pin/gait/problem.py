"""What a gait is asked to be."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..dynamics import Contact
from ..errors import InvalidInput
from ..robot import Robot


@dataclass(frozen=True)
class GaitProblem:
    """A pronking gait to be found: section II.B of the paper, trunk locked to the sagittal plane.

    Attributes:
        robot: The robot.
        speed: Average forward speed of the trunk [m/s].
        apex: Greatest height of the trunk [m].
        contact: A foot is a sphere that rolls without slip, or a point at the sphere's centre.
            The A1's spheres roll 7 to 10 mm a stance: 10 % of the speed.
        friction: Coefficient of friction of the ground.
        torque_weight: W_tau of eq. (6) [1/(N m)^2].
        velocity_weight: W_q of eq. (6) [1/(rad/s)^2].
        stance: Shortest and longest stance [s].
        flight: Shortest and longest flight [s].
        stride: Shortest and longest stride [s]. The cost always takes the shortest; the paper's
            17 strides in 7 s are about 0.41 s each.
        hip_limit: Largest hip angle [rad]; it keeps the solver off a second, splay-legged family.
        trunk_height: Least height of the trunk [m].
        clearance: Height of the feet above the ground in the middle of flight [m].
        intervals: Mesh intervals of stance and of flight.
    """

    robot: Robot = field(repr=False)
    speed: float
    apex: float = 0.34
    contact: Contact = "rolling"
    friction: float = 0.6
    torque_weight: float = 1.0
    velocity_weight: float = 0.15
    stance: tuple[float, float] = (0.1, 0.3)
    flight: tuple[float, float] = (0.2, 0.35)
    stride: tuple[float, float] = (0.36, 0.6)
    hip_limit: float = 0.1
    trunk_height: float = 0.2
    clearance: float = 0.03
    intervals: tuple[int, int] = (12, 16)

    def __post_init__(self) -> None:
        for name in ("stance", "flight", "stride"):
            shortest, longest = getattr(self, name)
            if not 0.0 < shortest <= longest:
                raise InvalidInput(
                    f"{name} lasts from {shortest:g} to {longest:g} s; "
                    "give two positive durations, the shorter one first"
                )
        positive = ("friction", "torque_weight", "hip_limit")
        for name in positive:
            if not getattr(self, name) > 0.0:
                raise InvalidInput(f"{name} is {getattr(self, name):g}; it must be positive")
        if not self.apex > self.trunk_height:
            raise InvalidInput(
                f"the apex, {self.apex:g} m, is not above the least trunk height, "
                f"{self.trunk_height:g} m; raise the one or lower the other"
            )
        if min(self.intervals) < 4 or any(n % 2 for n in self.intervals):
            raise InvalidInput(
                f"{self.intervals} mesh intervals; give two even numbers, 4 or more, so that the "
                "middle of flight is a node with neighbours"
            )
