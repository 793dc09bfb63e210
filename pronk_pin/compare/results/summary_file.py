"""summary.csv: written from a table, and read as that table to the bit or not at all."""

from __future__ import annotations

import io

import pandas as pd

from ...errors import FileProblem
from ...storage import reading
from ..metrics import COLUMNS, COMMAND_COLUMNS
from .manifest import Manifest

SUMMARY = "summary.csv"
"""Its name."""

_NUMBERS = ("speed", "value")


def write_summary(manifest: Manifest, summary: pd.DataFrame, *, made_of: str) -> None:
    """Write the summary of a folder.

    Args:
        manifest: The folder's manifest.
        summary: The table.
        made_of: Digest of the strides that it was computed from.

    Raises:
        FileProblem: It cannot be written.
    """
    manifest.write(SUMMARY, summary.to_csv(index=False), made_of=made_of)


def read_summary(manifest: Manifest, *, made_of: str) -> pd.DataFrame | None:
    """Read the summary of a folder; None where it is missing, damaged, or of other strides.

    Args:
        manifest: The folder's manifest.
        made_of: Digest of the strides that are there.
    """
    if manifest.made_of(SUMMARY) != made_of:
        return None
    try:
        data = manifest.read(SUMMARY, "")
        with reading(SUMMARY, ""):
            # As text at first: the reader's own conversion may miss the last bit.
            summary = pd.read_csv(io.BytesIO(data), dtype=dict.fromkeys(_NUMBERS, str))
            numbers = [name for name in _NUMBERS if name in summary]
            summary = summary.astype(dict.fromkeys(numbers, float))
    except FileProblem:
        return None
    return summary if list(summary.columns) in (COLUMNS, COMMAND_COLUMNS) else None
