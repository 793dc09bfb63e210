"""Figures: results in, matplotlib figures out.

Comes in: summaries, strides, gaits, explanations.
Goes out: figures, or files of them.
"""

from .condition_figure import estimated_conditions
from .driving_figure import driving_figure
from .explanation_figure import write_explanation_figure
from .gait_figures import write_gait_figures
from .knowledge_figure import knowledge_ladder, shows_knowledge
from .learning_figures import errors_by_seed, learning_curves, predicted_and_measured
from .skill_figures import gains_figure, transfers_figure
from .still_figure import SPREAD, still
from .suite_figures import by_scenario, heat_map, peak_curves
from .tracking_figures import (
    LABELS,
    errors_by_speed,
    learned_minus_model,
    torque_library,
    torque_surface,
    tracking,
    upright_strides,
)

__all__ = [
    "LABELS",
    "SPREAD",
    "by_scenario",
    "driving_figure",
    "errors_by_seed",
    "errors_by_speed",
    "estimated_conditions",
    "gains_figure",
    "heat_map",
    "knowledge_ladder",
    "learned_minus_model",
    "learning_curves",
    "peak_curves",
    "predicted_and_measured",
    "shows_knowledge",
    "still",
    "torque_library",
    "torque_surface",
    "tracking",
    "transfers_figure",
    "upright_strides",
    "write_explanation_figure",
    "write_gait_figures",
]
