"""What was recorded of a live session, as a results folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from ..experiment import Experiment, strides_attributes
from ..metrics import join_summaries, summarize_cell
from ..results import Results, describe_run, locked, make_folder


def write_recording(
    experiment: Experiment, folder: Path, datasets: Sequence[xr.Dataset]
) -> Results:
    """Write the strides of a session, which `view` and `report` open.

    Its provenance says that somebody drove: who makes the experiment anew gets other strides.

    Args:
        experiment: What was simulated: its controllers in the order of the datasets, one scenario.
        folder: A new folder.
        datasets: The strides of each robot.

    Raises:
        FileProblem: It cannot be written.
    """
    results = Results.of(experiment, folder)
    make_folder(results)
    with locked(folder):
        for cell, strides in zip(experiment.compared, datasets, strict=True):
            # Robots touch down apart, and so do their commands change; each stride has its own.
            named = strides.assign_coords(command=list(experiment.commands))
            results.save(cell, named.assign_attrs(strides_attributes(cell)))
        cells = experiment.compared
        results.write_summary(join_summaries(summarize_cell(results.strides(c)) for c in cells))
        record = {**describe_run(), "executor": "a live session", "cells": {}}
        results.write_provenance({"finished": True, "runs": [record]})
    return results
