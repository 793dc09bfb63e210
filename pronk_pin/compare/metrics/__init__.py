"""Numbers of strides: errors, effort, time to beat a model, and how sure they are.

Comes in: strides as an `xarray.Dataset`.
Goes out: rows of the summary, intervals and comparisons, and the paper's Table I.
"""

from .metrics import (
    COLUMNS,
    KEYS,
    STEADY_STRIDES,
    VARIABLES,
    CellSummary,
    by_joint,
    feedback_share,
    join_summaries,
    peak_history,
    reduction,
    settling_stride,
    steady,
    strides_to_converge,
    summarize,
    summarize_cell,
)
from .paper_table import table_1
from .robots import family, in_family, robots, sampled
from .statistics import (
    CONFIDENCE,
    LEAST_UNITS,
    NO_INTERVAL,
    Interval,
    compare_controllers,
    compare_pairs,
    control_arm,
    mean_interval,
    unit_of,
)
from .time_to_beat import (
    LEARNER,
    RIVAL,
    PeakHistory,
    beat_rows,
    beaten,
    lessons,
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
    "CellSummary",
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
    "join_summaries",
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
    "summarize_cell",
    "table_1",
    "unit_of",
]
