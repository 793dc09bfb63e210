"""MuJoCo as an engine: the robot's URDF or another MJCF, on its ground.

Comes in: a `Robot` or an MJCF, and a `Scenario`.
Goes out: a `World`.
"""

from .mjcf import ForeignRobot, mjcf_parity, mjcf_sha256, mjcf_spec
from .model import build_model
from .world import MujocoEngine, MujocoWorld, finite, without_warnings

__all__ = [
    "ForeignRobot",
    "MujocoEngine",
    "MujocoWorld",
    "build_model",
    "finite",
    "mjcf_parity",
    "mjcf_sha256",
    "mjcf_spec",
    "without_warnings",
]
