"""Experiments: what is asked, cell by cell, and what every number of it depends on.

Comes in: robot, speeds, controllers, scenarios and seeds, or the name of a suite.
Goes out: an `Experiment`, its cells and their definition, and the strides of a cell.
"""

from .cell import Cell, check_stored_library, run_cell, strides_attributes
from .definition import Definition, cell_definition, define, differences, fingerprint
from .description import describe
from .entries import name_of
from .experiment import DEFAULT_CONTROLLERS, Experiment
from .experiment_file import GAITS, URDF, from_document, read_config, to_document
from .initial_feedforward import (
    LIBRARY_VARIABLES,
    check_library,
    feedforward_by_speed,
    initial_feedforward,
    torque_library,
)
from .suites import SUITES, load_suite

__all__ = [
    "DEFAULT_CONTROLLERS",
    "GAITS",
    "LIBRARY_VARIABLES",
    "SUITES",
    "URDF",
    "Cell",
    "Definition",
    "Experiment",
    "cell_definition",
    "check_library",
    "check_stored_library",
    "define",
    "describe",
    "differences",
    "feedforward_by_speed",
    "fingerprint",
    "from_document",
    "initial_feedforward",
    "load_suite",
    "name_of",
    "read_config",
    "run_cell",
    "strides_attributes",
    "to_document",
    "torque_library",
]
