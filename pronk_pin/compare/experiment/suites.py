"""Named experiments: questions that are asked again and again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..._checks import known_name
from ..world import MISMATCHES, random_scenarios
from .experiment import Experiment

SUITES: Mapping[str, Mapping[str, Any]] = {
    "default": {},
    "mismatch": {"scenarios": MISMATCHES},
    "sampled": {
        "speeds": (-0.4, 0.0, 0.4, 0.8),
        "controllers": ("pd", "model", "ilc"),
        "scenarios": tuple(scenario.name for scenario in random_scenarios(20, seed=0)),
    },
    "control": {
        "speeds": (-0.3, 0.0, 0.3, 0.6),
        "controllers": ("pd", "ilc", "ilc-zero", "model"),
        "seeds": tuple(range(5)),
    },
    "paper": {"controllers": ("pd", "ilc", "ilc-paper"), "seeds": tuple(range(5))},
}
"""Changes of each suite to `Experiment()`: the paper's speeds under five controllers; the same in
every scenario of the list of mismatches; learning against the model in 20 sampled scenarios, at
four speeds only, as the worlds are the sample; the control arm, which must show nothing; Table I
with intervals over seeds, and with the paper's own learning law."""


def load_suite(name: str) -> Experiment:
    """The experiment of that name.

    Raises:
        UnknownName: There is none.
    """
    return Experiment(**SUITES[known_name("suite", name, SUITES)])
