"""Comparison of controllers: worlds, simulations, experiments, metrics, results.

Comes in: an `Experiment`: robot, speeds, controllers, scenarios, seeds.
Goes out: `Results`: a folder of strides, a summary, tables, and what was learned.
"""

from .execution import run_experiment
from .experiment import DEFAULT_CONTROLLERS, Cell, Experiment, run_cell
from .identification import Explanation, describe, explain
from .metrics import Metric, reduction, steady, summarize
from .results import Results, default_folder
from .session import LiveSession, LiveStride, Moment
from .simulation import Schedule, Simulation
from .world import (
    ENGINES,
    KNOWN,
    MISMATCHES,
    SCENARIOS,
    DrakeEngine,
    Engine,
    ForeignRobot,
    Mismatch,
    Motion,
    MujocoEngine,
    MujocoWorld,
    Scenario,
    Sensors,
    SensorSuite,
    World,
    build_model,
    load_engine,
    load_scenario,
    mjcf_parity,
    mjcf_spec,
    random_scenarios,
)

__all__ = [
    "DEFAULT_CONTROLLERS",
    "ENGINES",
    "KNOWN",
    "MISMATCHES",
    "SCENARIOS",
    "Cell",
    "DrakeEngine",
    "Engine",
    "Experiment",
    "Explanation",
    "ForeignRobot",
    "LiveSession",
    "LiveStride",
    "Metric",
    "Mismatch",
    "Moment",
    "Motion",
    "MujocoEngine",
    "MujocoWorld",
    "Results",
    "Scenario",
    "Schedule",
    "SensorSuite",
    "Sensors",
    "Simulation",
    "World",
    "build_model",
    "default_folder",
    "describe",
    "explain",
    "load_engine",
    "load_scenario",
    "mjcf_parity",
    "mjcf_spec",
    "random_scenarios",
    "reduction",
    "run_cell",
    "run_experiment",
    "steady",
    "summarize",
]
