"""One simulation: n robots, one controller, one scenario, event by event.

Comes in: gaits, a `ControllerSpec`, a `Scenario`, a `Schedule`.
Goes out: a log of strides and ticks, and its labelled dataset.
"""

from .dataset import to_dataset
from .memory import SHORTER, check_memory, number_of_robots
from .schedule import SHORTEST, Schedule
from .simulation import Progress, Simulation, simulate

__all__ = [
    "SHORTER",
    "SHORTEST",
    "Progress",
    "Schedule",
    "Simulation",
    "check_memory",
    "number_of_robots",
    "simulate",
    "to_dataset",
]
