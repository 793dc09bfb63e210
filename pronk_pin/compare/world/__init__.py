"""The truth: robots in MuJoCo, with all that the model does not know.

Comes in: a `Robot` or an MJCF, and a `Scenario`.
Goes out: a `World` that plays tapes or torques, and what sensors say of it.
"""

from .imu import InertialUnit, level_specific_force
from .mismatch import KNOWN, MISMATCHES, Mismatch
from .mjcf import ForeignRobot, mjcf_parity, mjcf_sha256, mjcf_spec
from .motors import Motors
from .scenario import (
    BASE_SCENARIOS,
    SCENARIOS,
    Scenario,
    load_scenario,
    random_scenarios,
    shipped_scenario,
)
from .sensors import Sensors, SensorSuite
from .world import Motion, World, build_model, finite, without_warnings

__all__ = [
    "BASE_SCENARIOS",
    "KNOWN",
    "MISMATCHES",
    "SCENARIOS",
    "ForeignRobot",
    "InertialUnit",
    "Mismatch",
    "Motion",
    "Motors",
    "Scenario",
    "SensorSuite",
    "Sensors",
    "World",
    "build_model",
    "finite",
    "level_specific_force",
    "load_scenario",
    "mjcf_parity",
    "mjcf_sha256",
    "mjcf_spec",
    "random_scenarios",
    "shipped_scenario",
    "without_warnings",
]
