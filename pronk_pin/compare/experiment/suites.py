"""Named experiments: questions that are asked again and again."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

from ..._checks import known_name
from ..simulation import Schedule
from ..world import MISMATCHES, random_scenarios
from .experiment import Experiment

_FOUR_SPEEDS = (-0.4, 0.0, 0.4, 0.8)

_EIGHT_SPEEDS = (-0.5, -0.3, -0.1, 0.1, 0.3, 0.5, 0.7, 0.8)
"""As many units as an interval takes."""

SUITES: Mapping[str, Mapping[str, Any]] = {
    "default": {},
    "knowledge": {
        "speeds": _EIGHT_SPEEDS,
        "controllers": ("pd", "ilc", "ilc+rotors", "model", "model+rotors", "identified+gait"),
        "scenarios": (
            *("nominal", "ideal", "payload", "weak-motors", "delay"),
            *(scenario.name for scenario in random_scenarios(8, seed=0)),
        ),
    },
    "pairs": {
        "speeds": _FOUR_SPEEDS,
        "controllers": ("pd", "ilc"),
        "scenarios": tuple("+".join(pair) for pair in itertools.combinations(MISMATCHES, 2)),
        "schedule": Schedule(baseline=4.0, learning=60.0),
    },
    "mismatch": {
        "controllers": ("pd", "ilc", "ilc+rotors", "model", "model+rotors"),
        "scenarios": MISMATCHES,
    },
    "sampled": {
        "speeds": _FOUR_SPEEDS,
        "controllers": ("pd", "model", "ilc"),
        "scenarios": tuple(scenario.name for scenario in random_scenarios(20, seed=0)),
    },
    "control": {
        "speeds": (-0.3, 0.0, 0.3, 0.6),
        "controllers": ("pd", "ilc", "ilc-zero", "model"),
        "scenarios": ("rough",),
        "seeds": tuple(range(8)),
    },
    "engines": {
        "speeds": (-0.4, -0.1, 0.2, 0.5, 0.8),
        "controllers": ("pd", "ilc", "ilc+rotors", "model", "model+rotors", "library"),
        "scenarios": tuple(
            f"{world}{engine}"
            for world in ("ideal", "nominal", "payload")
            for engine in ("", "+drake")
        ),
    },
    "paper": {"controllers": ("pd", "ilc", "ilc-paper")},
}
"""Changes of each suite to `Experiment()`: the paper's speeds under `DEFAULT_CONTROLLERS`; what a
model must know to be as good as practice, scenario by scenario; long learning in every pair of the
list of mismatches; the paper's speeds in every scenario of that list; learning against the model in
20 sampled scenarios, at four speeds only, as the worlds are the sample; the control arm, which
learns with gain 0, on rough ground, where seeds differ; whether another engine says the same, side
by side; Table I, with the paper's own law."""


def load_suite(name: str, **changes: Any) -> Experiment:
    """The experiment of that name.

    Args:
        name: One of `SUITES`.
        changes: Fields of the experiment that are otherwise.

    Raises:
        UnknownName: There is none.
    """
    return Experiment(**{**SUITES[known_name("suite", name, SUITES)], **changes})
