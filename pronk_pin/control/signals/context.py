"""Context of a controller: the robots, gaits and settings that its parts are bound to."""

from __future__ import annotations

from dataclasses import dataclass

from ...gait import Gait
from ...robot import Robot
from .tape import Gains


@dataclass(frozen=True)
class ControlContext:
    """What a controller's laws and its balance may be bound to, by their `bind(context)`.

    Attributes:
        robot: The robot.
        gaits: The gait of each of the n robots.
        controller: Name of the controller.
        gains: Its feedback gains.
        base: How the trunks may move, one of `BASES`.
        timestep: Time step of the control [s].
        ticks: Length of the longest tape.
    """

    robot: Robot
    gaits: tuple[Gait, ...]
    controller: str
    gains: Gains
    base: str
    timestep: float
    ticks: int
