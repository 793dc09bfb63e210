"""What a simulation or an experiment demands of the machine, before anything of it is allocated."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..control import PARTS
from ..errors import InvalidInput
from ..gait import Gait, load_library
from ..robot import NL
from .record import SAMPLES, SHORTEST_STRIDE, StrideLog

if TYPE_CHECKING:
    from .experiment import Experiment  # which imports the simulation, which asks here

LONGEST = 30.0
"""Days that an experiment may take, by a hopeful estimate."""

_QUICK = 25.0
"""Robot-seconds that a core simulates in a second, at 1 kHz with a locked base: `make compare`
takes a minute on two cores for 14 robots, 5 controllers and 40.5 s. Tick by tick it is less."""

_COPIES = 3
"""A finished log, the dataset that is made of it, and its file are in memory together."""

_DAY = 86_400.0
_SHORTER = "shorten --schedule.practice and --schedule.learning, or give fewer --speeds"


def log_size(gaits: Sequence[Gait], duration: float) -> float:
    """Memory that the strides of robots take with these gaits, over a duration [s], in bytes."""
    shortest = min(gait.duration for gait in gaits)
    strides = duration / (SHORTEST_STRIDE * shortest) + 1.0
    curves = len(PARTS) * SAMPLES * (len(StrideLog.CURVES) * NL + 2 + 3)  # base, attitude
    stride = (
        curves * np.dtype(np.float32).itemsize
        + (len(StrideLog.SCALARS) + 3 * NL) * np.dtype(np.float64).itemsize
    )
    return len(gaits) * strides * stride


def memory() -> float:
    """Physical memory of this machine [bytes]; infinite where the system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def check_memory(gaits: Sequence[Gait], duration: float, *, at_once: int = 1) -> None:
    """Refuse simulations whose strides do not fit into this machine's memory.

    Args:
        gaits: The gaits of one simulation's robots.
        duration: How long it lasts [s].
        at_once: Simulations that run side by side.

    Raises:
        InvalidInput: They do not.
    """
    needed, there = _COPIES * log_size(gaits, duration) * at_once, memory()
    if needed > there:
        beside = f" in each of {at_once} workers" if at_once > 1 else ""
        fewer = ", or lower --workers" if at_once > 1 else ""
        raise InvalidInput(
            f"the strides of {_robots(gaits)} over {duration:g} s{beside} take about "
            f"{needed / 1e9:.3g} GB, and this machine has {there / 1e9:.3g} GB; {_SHORTER}{fewer}"
        )


def check_demand(experiment: Experiment, workers: int) -> None:
    """Refuse an experiment that does not fit into memory, or takes longer than anybody waits.

    Args:
        experiment: The experiment.
        workers: Processes that share it.

    Raises:
        InvalidInput: It does not, or does.
    """
    base: Literal["sagittal"] | None = None if experiment.base == "locked" else "sagittal"
    library = load_library(experiment.robot, base=base)
    gaits = [library.at(speed) for speed in experiment.speeds]
    duration, cells = experiment.schedule.duration, len(experiment.cells())
    check_memory(gaits, duration, at_once=min(workers, cells))
    days = duration * len(gaits) * cells / _QUICK / workers / _DAY
    if days > LONGEST:
        raise InvalidInput(
            f"{cells} simulations of {_robots(gaits)} over {duration:g} s take about {days:.3g} "
            f"days on {workers} cores, beyond {LONGEST:g} days; {_SHORTER}, --controllers, "
            "--scenarios or --seeds"
        )


def _robots(gaits: Sequence[Gait]) -> str:
    return "one robot" if len(gaits) == 1 else f"{len(gaits)} robots"
