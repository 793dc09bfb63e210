"""What of the world a page can change, and how far."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...compare.session import LiveSession
from ...compare.world import KNOWN, load_scenario
from ...errors import InvalidInput


@dataclass(frozen=True)
class Knob:
    """A slider of the page.

    Attributes:
        name: The mismatch that it sets.
        text: What it is.
        unit: Unit of its value.
        low, high, step: Its range, in that unit.
        usual: Value at which the world is as it was at first.
    """

    name: str
    text: str
    unit: str
    low: float
    high: float
    step: float
    usual: float


_RANGES = {
    "payload": ("payload", 0.0, 6.0, 0.25),
    "coulomb": ("dry friction in the joints", 0.0, 2.0, 0.05),
    "armature": ("rotor inertia", 0.0, 0.05, 0.001),
    "slope": ("slope", -0.12, 0.12, 0.01),
    "soft-ground": ("softness of the ground", 0.002, 0.02, 0.001),
    "slippery": ("friction of the ground", 0.1, 1.2, 0.05),
    "delay": ("delay of the motors", 0.0, 0.008, 0.001),
}
"""What it is, and how far it goes, by the mismatch; as far as the A1 stays up at most speeds."""


def knobs_of(session: LiveSession) -> list[Knob]:
    """The knobs of a session: those of what its scenario does not have already."""
    scenario, robot = session.base_scenario, session.experiment.model
    usual = {
        "payload": scenario.payload,
        "coulomb": float(np.mean(scenario.by_joint("coulomb", robot))),
        "armature": float(np.mean(scenario.by_joint("armature", robot))),
        "slope": scenario.slope,
        "soft-ground": scenario.ground_time_constant,
        "slippery": scenario.ground_friction,
        "delay": scenario.delay,
    }
    knobs = []
    for name, (text, low, high, step) in _RANGES.items():
        try:
            _ = scenario + load_scenario(f"{name}={high}")
        except InvalidInput:
            continue
        knobs.append(Knob(name, text, KNOWN[name].unit, low, high, step, usual[name]))
    return knobs
