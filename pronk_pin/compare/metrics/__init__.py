"""Numbers of strides: errors, effort, time to beat a model, and how sure they are.

Comes in: strides as an `xarray.Dataset`.
Goes out: rows of the summary, intervals and comparisons, and the paper's Table I.
"""

from .metrics import (
    COLUMNS,
    KEYS,
    STEADY_STRIDES,
    by_joint,
    feedback_share,
    reduction,
    settling_stride,
    steady,
    strides_to_converge,
    summarize,
)
from .paper_table import table_1
from .statistics import (
    CONFIDENCE,
    LEAST_UNITS,
    NO_INTERVAL,
    Interval,
    compare_controllers,
    compare_pairs,
    control_arm,
    family,
    in_family,
    mean_interval,
    robots,
    sampled,
    unit_of,
)
from .time_to_beat import (
    LEARNER,
    RIVAL,
    VARIABLES,
    PeakHistory,
    beat_rows,
    beaten,
    lessons,
    peak_history,
)

__all__ = [
    "COLUMNS",
    "CONFIDENCE",
    "KEYS",
    "LEARNER",
    "LEAST_UNITS",
    "NO_INTERVAL",
    "RIVAL",
    "STEADY_STRIDES",
    "VARIABLES",
    "Interval",
    "PeakHistory",
    "beat_rows",
    "beaten",
    "by_joint",
    "compare_controllers",
    "compare_pairs",
    "control_arm",
    "family",
    "feedback_share",
    "in_family",
    "lessons",
    "mean_interval",
    "peak_history",
    "reduction",
    "robots",
    "sampled",
    "settling_stride",
    "steady",
    "strides_to_converge",
    "summarize",
    "table_1",
    "unit_of",
]
