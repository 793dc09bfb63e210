"""Questions that take more than one experiment to answer.

Comes in: a robot, speeds, controllers, or `Results`.
Goes out: gain reduction, seeding, transfer, stability, prediction, reproduction of Table I, and the
loop closed with an identified model.
"""

from .driving import (
    DRIVERS,
    PUSHED,
    RAMPS,
    SWEEPS,
    Driving,
    describe_wandering,
    measure_driving,
    measure_wandering,
)
from .gain_reduction import describe_gains, sweep_gains
from .identified_models import close_loop, format_loop
from .learning_runs import machine_and_gaits
from .prediction import (
    STRIDES,
    Prediction,
    compare_prediction,
    describe_prediction,
    simulate_learning,
    stored_learning,
)
from .reproduce import format_reproduction
from .reuse import (
    TOLERANCE,
    build_library,
    describe_engine_transfer,
    describe_library,
    describe_library_trial,
    describe_seeding,
    describe_transfers,
    measure_engine_transfer,
    measure_library,
    measure_seeding,
    measure_transfers,
    parse_conditions,
    stayed_up,
)
from .stability import COUPLINGS, describe_stability, measure_stability

__all__ = [
    "COUPLINGS",
    "DRIVERS",
    "PUSHED",
    "RAMPS",
    "STRIDES",
    "SWEEPS",
    "TOLERANCE",
    "Driving",
    "Prediction",
    "build_library",
    "close_loop",
    "compare_prediction",
    "describe_engine_transfer",
    "describe_gains",
    "describe_library",
    "describe_library_trial",
    "describe_prediction",
    "describe_seeding",
    "describe_stability",
    "describe_transfers",
    "describe_wandering",
    "format_loop",
    "format_reproduction",
    "machine_and_gaits",
    "measure_driving",
    "measure_engine_transfer",
    "measure_library",
    "measure_seeding",
    "measure_stability",
    "measure_transfers",
    "measure_wandering",
    "parse_conditions",
    "simulate_learning",
    "stayed_up",
    "stored_learning",
    "sweep_gains",
]
