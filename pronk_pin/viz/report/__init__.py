"""The report of a result, in HTML and Markdown.

Comes in: `Results`.
Goes out: report.html, report.md, and their figures.
"""

from .report import scenario_figures, write_figures, write_report

__all__ = [
    "scenario_figures",
    "write_figures",
    "write_report",
]
