"""Why a result says nothing of learning: who fell, what taught nothing, what was not run."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from ..metrics import LEARNER, in_family, lessons
from .overview import Overview
from .tables import SHOWN

_NAMES = {"pd": "PD", "model": "the model's feedforward"}


def inconclusive(summary: pd.DataFrame, *, scenario: str, table: Overview, against: str) -> str:
    """Why nothing is concluded of learning in a world, as a clause; empty where something is.

    Args:
        summary: See `compare.metrics`.
        scenario: The scenario, or a family of sampled ones.
        table: Its `overview`.
        against: What learning is compared with, "pd" or "model".
    """
    return _untaught(in_family(summary, scenario)) or _unpaired(table, against)


def unsaid(tables: Mapping[str, Overview]) -> str:
    """Why an experiment has no verdict, from its `answer`.

    A verdict takes PD and learning, and the model's feedforward too where there are several worlds.
    """
    controllers = {name for table in tables.values() for name in table}
    needed = ["pd", LEARNER, "model"] if len(tables) > 1 else ["pd", LEARNER]
    missing = [name for name in needed if name not in controllers]
    return (
        f"There is no verdict: it takes {' and '.join(missing)}, which did not run. Run again with "
        f"'--controllers {' '.join(missing)}' and the same --folder: what is there stays."
    )


def _untaught(summary: pd.DataFrame) -> str:
    """Whether no stride taught learning anything, with the reasons counted."""
    found = lessons(summary, controller=LEARNER)
    if found is None:
        metrics = summary[summary["controller"] == LEARNER]["metric"]
        if (metrics == "strides_to_converge").any():  # an earlier version's, which does not say
            return ""
        return "learning was never switched on, so that learning is PD"
    if found.taught:
        return ""
    counted = ", ".join(f"{count} {reason}" for reason, count in found.skipped.items())
    return f"learning learned from none of its {found.strides} strides of learning ({counted})"


def _unpaired(table: Overview, against: str) -> str:
    """Whether there is no robot whose errors under the two can be compared."""
    other = _NAMES[against]
    down = [name for name in (LEARNER, against) if not table[name].upright]
    if down:
        names = " and under ".join({LEARNER: "learning", against: other}[name] for name in down)
        return f"no robot stayed up under {names}"
    joints = [table[LEARNER].joints[joint] for joint in SHOWN]
    compared = [joint.reduction if against == "pd" else joint.difference for joint in joints]
    if np.isfinite([interval.value for interval in compared]).all():
        return ""
    return f"no robot has an error to compare under both learning and {other}"
