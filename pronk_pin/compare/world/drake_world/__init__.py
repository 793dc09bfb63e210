"""Drake as an engine: the robot's URDF on level ground, with other contacts than MuJoCo's.

Comes in: a `Robot` and a `Scenario`.
Goes out: a `World`. Drake itself is imported when one is asked for, and not before.
"""

from .drake_engine import APPROXIMATIONS, DrakeEngine

__all__ = ["APPROXIMATIONS", "DrakeEngine"]
