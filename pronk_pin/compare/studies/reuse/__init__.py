"""What stored torques are worth: at other speeds, in other conditions, scenarios and engines.

Comes in: a robot, speeds, scenarios; a `TorqueLibrary`.
Goes out: a `TorqueLibrary` over conditions; tables of what replay is worth beside learning.
"""

from .build_library import build_library, describe_library, parse_conditions
from .engine_transfer import describe_engine_transfer, measure_engine_transfer
from .library_trial import describe_library_trial, measure_library
from .seeding import describe_seeding, measure_seeding, stayed_up
from .transfer import TOLERANCE, describe_transfers, measure_transfers

__all__ = [
    "TOLERANCE",
    "build_library",
    "describe_engine_transfer",
    "describe_library",
    "describe_library_trial",
    "describe_seeding",
    "describe_transfers",
    "measure_engine_transfer",
    "measure_library",
    "measure_seeding",
    "measure_transfers",
    "parse_conditions",
    "stayed_up",
]
