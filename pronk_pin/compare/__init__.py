"""Comparison of controllers: worlds, simulations, experiments, metrics, results."""

from .experiment import DEFAULT_CONTROLLERS, Cell, Experiment, run_cell
from .explanation import Explanation, describe, explain
from .foreign import ForeignRobot, mjcf_parity, mjcf_spec
from .metrics import reduction, steady, summarize
from .mismatch import KNOWN, MISMATCHES, Mismatch
from .results import Results, default_folder
from .run import run_experiment
from .scenario import SCENARIOS, Scenario, load_scenario, random_scenarios
from .schedule import Schedule
from .sensors import Sensors, SensorSuite
from .simulate import Simulation
from .world import World, build_model

__all__ = [
    "DEFAULT_CONTROLLERS",
    "KNOWN",
    "MISMATCHES",
    "SCENARIOS",
    "Cell",
    "Experiment",
    "Explanation",
    "ForeignRobot",
    "Mismatch",
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
