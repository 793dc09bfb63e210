"""What happens, and what it says: worlds, simulations, experiments, metrics, results."""

from .experiment import DEFAULT_CONTROLLERS, Cell, Experiment, run_cell
from .explanation import Explanation, describe, explain
from .metrics import reduction, steady, summarize
from .results import Results, default_folder
from .run import run_experiment
from .scenario import SCENARIOS, Scenario, load_scenario
from .simulate import Schedule, Simulation
from .world import World, build_model

__all__ = [
    "DEFAULT_CONTROLLERS",
    "SCENARIOS",
    "Cell",
    "Experiment",
    "Explanation",
    "Results",
    "Scenario",
    "Schedule",
    "Simulation",
    "World",
    "build_model",
    "default_folder",
    "describe",
    "explain",
    "load_scenario",
    "reduction",
    "run_cell",
    "run_experiment",
    "steady",
    "summarize",
]
