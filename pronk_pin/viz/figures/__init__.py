"""Figures: results in, matplotlib figures out.

Comes in: summaries, strides, gaits, explanations.
Goes out: figures, or files of them.
"""

from .explanation_figure import write_explanation_figure
from .figures import (
    LABELS,
    errors_by_speed,
    learned_minus_model,
    learning_curves,
    stayed_up,
    torque_library,
    torque_surface,
    tracking,
)
from .gait_figures import write_gait_figures
from .learning_figures import errors_by_seed, predicted_and_measured
from .skill_figures import gains_figure, transfers_figure
from .suite_figures import by_scenario, heat_map, peak_curves

__all__ = [
    "LABELS",
    "by_scenario",
    "errors_by_seed",
    "errors_by_speed",
    "gains_figure",
    "heat_map",
    "learned_minus_model",
    "learning_curves",
    "peak_curves",
    "predicted_and_measured",
    "stayed_up",
    "torque_library",
    "torque_surface",
    "tracking",
    "transfers_figure",
    "write_explanation_figure",
    "write_gait_figures",
]
