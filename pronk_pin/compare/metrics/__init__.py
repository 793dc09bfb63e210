"""Numbers of strides: errors, effort, time to beat a model, and how sure they are.

Comes in: strides as an `xarray.Dataset`.
Goes out: rows of the summary, intervals and comparisons, and the paper's Table I.
"""

from .cell_summary import CellSummary, by_command, join_summaries, summarize_cell
from .command_metrics import (
    COMMAND_COLUMNS,
    COMMAND_KEYS,
    STARTED,
    stride_table,
    summarize_commands,
)
from .metrics import (
    COLUMNS,
    KEYS,
    STEADY_STRIDES,
    VARIABLES,
    by_joint,
    family,
    feedback_share,
    in_family,
    of_first_leg,
    peak_history,
    reduction,
    robots,
    sampled,
    settling_stride,
    steady,
    strides_to_converge,
    summarize,
)
from .own_metrics import METRICS, Metric, load_metric
from .paper_table import of_papers_robot, table_1
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
    "COMMAND_COLUMNS",
    "COMMAND_KEYS",
    "CONFIDENCE",
    "KEYS",
    "LEARNER",
    "LEAST_UNITS",
    "METRICS",
    "NO_INTERVAL",
    "RIVAL",
    "STARTED",
    "STEADY_STRIDES",
    "VARIABLES",
    "CellSummary",
    "Interval",
    "Metric",
    "PeakHistory",
    "beat_rows",
    "beaten",
    "by_command",
    "by_joint",
    "compare_controllers",
    "compare_pairs",
    "control_arm",
    "family",
    "feedback_share",
    "in_family",
    "join_summaries",
    "lessons",
    "load_metric",
    "mean_interval",
    "of_first_leg",
    "of_papers_robot",
    "peak_history",
    "reduction",
    "robots",
    "sampled",
    "settling_stride",
    "steady",
    "stride_table",
    "strides_to_converge",
    "summarize",
    "summarize_cell",
    "summarize_commands",
    "table_1",
    "unit_of",
]
