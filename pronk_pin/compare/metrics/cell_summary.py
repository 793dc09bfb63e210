"""What a simulation gives to the summary of its experiment: at constant or commanded speeds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd
import xarray as xr

from .command_metrics import COMMAND_COLUMNS, summarize_commands
from .metrics import COLUMNS, peak_history, summarize
from .own_metrics import Metric
from .time_to_beat import PeakHistory, beat_rows


class CellSummary(NamedTuple):
    """What one simulation gives to the summary of its experiment."""

    rows: pd.DataFrame
    """Its own rows: see `summarize` and `summarize_commands`."""
    peaks: PeakHistory | None
    """What its rows relative to another simulation are made of; None where speeds change."""


def summarize_cell(strides: xr.Dataset, own_metrics: Sequence[Metric] = ()) -> CellSummary:
    """Compute what one simulation gives to the summary of its experiment."""
    if by_command(strides):
        return CellSummary(summarize_commands(strides, own_metrics), None)
    return CellSummary(summarize(strides, own_metrics), peak_history(strides))


def join_summaries(cells: Iterable[CellSummary]) -> pd.DataFrame:
    """The summary of an experiment: the rows of each simulation, and those relative to another."""
    cells = list(cells)
    histories = [cell.peaks for cell in cells if cell.peaks is not None]
    relative = pd.DataFrame(beat_rows(histories), columns=COLUMNS)
    full = [table for table in (*(cell.rows for cell in cells), relative) if len(table)]
    summary = pd.concat(full)
    columns = COMMAND_COLUMNS if by_command(summary) else COLUMNS
    return summary.sort_values(columns[:-2], ignore_index=True)[columns]


def by_command(table: pd.DataFrame | xr.Dataset) -> bool:
    """Whether strides, or a summary, are by commands instead of constant speeds."""
    return "command" in table
