"""The truth: robots in an engine, with all that the model does not know.

Comes in: a `Robot` or an MJCF, and a `Scenario`.
Goes out: a `World` of an `Engine` that plays tapes or torques, and what sensors say of it.
"""

from .drake_world import DrakeEngine
from .engine import Engine, Motion, World, check_motion
from .engines import ENGINES, check_engine, engine_of, load_engine, make_world
from .imu import InertialUnit, level_specific_force
from .mismatch import KNOWN, MISMATCHES, Mismatch
from .motors import Motors
from .mujoco_world import (
    ForeignRobot,
    MujocoEngine,
    MujocoWorld,
    build_model,
    mjcf_parity,
    mjcf_sha256,
    mjcf_spec,
)
from .scenario import (
    BASE_SCENARIOS,
    DEFAULT_ENGINE,
    OTHER_ENGINES,
    SCENARIOS,
    Scenario,
    load_scenario,
    random_scenarios,
    shipped_scenario,
)
from .sensors import Sensors, SensorSuite

__all__ = [
    "BASE_SCENARIOS",
    "DEFAULT_ENGINE",
    "ENGINES",
    "KNOWN",
    "MISMATCHES",
    "OTHER_ENGINES",
    "SCENARIOS",
    "DrakeEngine",
    "Engine",
    "ForeignRobot",
    "InertialUnit",
    "Mismatch",
    "Motion",
    "Motors",
    "MujocoEngine",
    "MujocoWorld",
    "Scenario",
    "SensorSuite",
    "Sensors",
    "World",
    "build_model",
    "check_engine",
    "check_motion",
    "engine_of",
    "level_specific_force",
    "load_engine",
    "load_scenario",
    "make_world",
    "mjcf_parity",
    "mjcf_sha256",
    "mjcf_spec",
    "random_scenarios",
    "shipped_scenario",
]
