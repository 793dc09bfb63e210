"""What a simulation takes of the machine's memory, before anything of it is allocated."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence

from ...errors import InvalidInput
from ...gait import Gait
from .log import SHORTEST_STRIDE
from .quantities import STRIDE_QUANTITIES, sizes_of

_COPIES = 3
"""A finished log, the dataset that is made of it, and its file are in memory together."""

SHORTER = "shorten --schedule.baseline and --schedule.learning, or give fewer --speeds"


def log_size(gaits: Sequence[Gait], duration: float) -> float:
    """Memory that the strides of robots take with these gaits, over a duration [s], in bytes."""
    shortest = min(gait.duration for gait in gaits)
    strides = duration / (SHORTEST_STRIDE * shortest) + 1.0
    one = {"speed": 1, "stride": 1, **sizes_of(gaits[0])}
    stride = sum(math.prod(each.shape(one)) * each.dtype.itemsize for each in STRIDE_QUANTITIES)
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
            f"the strides of {number_of_robots(gaits)} over {duration:g} s{beside} take about "
            f"{needed / 1e9:.3g} GB, and this machine has {there / 1e9:.3g} GB; {SHORTER}{fewer}"
        )


def number_of_robots(gaits: Sequence[Gait]) -> str:
    """How many robots there are, in words."""
    return "one robot" if len(gaits) == 1 else f"{len(gaits)} robots"
