"""Numbers into tables and words: the answer, its limitations, and differences between results.

Comes in: a summary, or `Results`.
Goes out: tables and text for a terminal and for the report.
"""

from .between_engines import (
    errors_between_engines,
    format_between_engines,
    winners_between_engines,
)
from .cells import against_model, beat_text, between, number, units_of_intervals
from .commands import answer_commands, command_tables, format_commands, shortened
from .difference import format_changes
from .limitations import limitations
from .overview import ControllerOverview, JointOverview, Overview, answer, overview
from .tables import (
    SHOWN,
    SHOWN_PARAMETERS,
    beside_the_paper,
    paper_learner,
    sampled_scenarios,
)
from .terminal import beside_note, format_suite, format_summary, format_tables
from .verdict import answer_in_words, families, verdict

__all__ = [
    "SHOWN",
    "SHOWN_PARAMETERS",
    "ControllerOverview",
    "JointOverview",
    "Overview",
    "against_model",
    "answer",
    "answer_commands",
    "answer_in_words",
    "beat_text",
    "beside_note",
    "beside_the_paper",
    "between",
    "command_tables",
    "errors_between_engines",
    "families",
    "format_between_engines",
    "format_changes",
    "format_commands",
    "format_suite",
    "format_summary",
    "format_tables",
    "limitations",
    "number",
    "overview",
    "paper_learner",
    "sampled_scenarios",
    "shortened",
    "units_of_intervals",
    "verdict",
    "winners_between_engines",
]
