"""Experiments: cells side by side in any executor, and the folder of their results.

Comes in: an `Experiment` or the name of a suite.
Goes out: `Results` on disk, with where they are from.
"""

from .demand import check_demand
from .executors import known_address
from .experiment import (
    DEFAULT_CONTROLLERS,
    Cell,
    Experiment,
    initial_feedforward,
    run_cell,
    torque_library,
)
from .results import Results, default_folder
from .run import run_experiment
from .suites import SUITES, load_suite

__all__ = [
    "DEFAULT_CONTROLLERS",
    "SUITES",
    "Cell",
    "Experiment",
    "Results",
    "check_demand",
    "default_folder",
    "initial_feedforward",
    "known_address",
    "load_suite",
    "run_cell",
    "run_experiment",
    "torque_library",
]
