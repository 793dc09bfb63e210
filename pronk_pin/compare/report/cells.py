"""Cells of tables: numbers, intervals and verdicts of an overview as short texts."""

from __future__ import annotations

import numpy as np

from ..metrics import Interval
from .overview import ControllerOverview, Overview
from .tables import SHOWN


def units_of_intervals(table: Overview) -> str:
    """What the intervals of an `overview` are drawn over, in words; empty where there are none."""
    units = {row.unit for row in table.values() if any(j.peak.known for j in row.joints.values())}
    return " and ".join(f"{unit}s" for unit in sorted(units))


def against_model(row: ControllerOverview) -> str:
    """Whether calf and thigh are better than with the model's feedforward: yes, no, or open.

    A dash where no robot stayed up under both, and of learning that nothing taught.
    """
    joints = [row.joints[joint] for joint in SHOWN]
    if row.taught == 0 or not all(joint.pairs for joint in joints):
        return "-"
    return "/".join({True: "yes", None: "open", False: "no"}[joint.better] for joint in joints)


def beat_text(row: ControllerOverview) -> str:
    """Strides until the model is beaten, and by how many robots; "never" where by none."""
    beat = row.beat
    if not beat.learners or row.taught == 0:
        return "-"
    if not beat.robots:
        return "never"
    few = "" if beat.robots == beat.learners else f" ({beat.robots}/{beat.learners})"
    return f"{beat.strides:.0f}{few}"


def between(interval: Interval, form: str, word: str = " to ") -> str:
    """An interval, as "0.0210 to 0.0232"; a dash without one."""
    if not interval.known:
        return "-"
    return f"{interval.low:{form}}{word}{interval.high:{form}}"


def number(value: float, form: str) -> str:
    """A number, or a dash where there is none."""
    return format(value, form) if np.isfinite(value) else "-"
