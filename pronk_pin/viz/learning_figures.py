"""Figures of what learning does, beside what was said of it before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ..compare.prediction import Prediction
from ..errors import cannot_write
from .style import LOOKS


def predicted_and_measured(predictions: Sequence[Prediction]) -> Figure:
    """RMS of the stance error over the strides of learning, predicted and measured."""
    figure = Figure(figsize=(3.6 * len(predictions) + 0.8, 3.6), layout="constrained")
    axes = figure.subplots(1, len(predictions), squeeze=False, sharey=True)[0]
    for one, prediction in zip(axes, predictions, strict=True):
        strides = np.arange(len(prediction.measured))
        for column, joint, color in ((2, "calf", "#0072B2"), (1, "thigh", "#D55E00")):
            one.semilogy(strides, prediction.measured[:, column], "-", color=color, label=joint)
            for rms, style, name in (
                (prediction.rehearsed, "--", "rehearsed"),
                (prediction.predicted, ":", "lifted model"),
            ):
                label = f"{joint}, {name}"
                one.semilogy(strides, rms[:, column], style, color=color, label=label)
        radius = prediction.analysis.radius
        one.set_title(f"{prediction.speed:g} m/s, spectral radius {radius:.3f}", fontsize=9)
        one.set_xlabel("strides of learning")
    axes[0].set_ylabel("RMS of the stance error [rad]")
    axes[0].legend(fontsize=7)
    figure.suptitle(predictions[0].controller)
    return figure


def errors_by_seed(table: pd.DataFrame) -> Figure:
    """Peak error over the strides of learning by what it began with: median and range of speeds.

    Args:
        table: What `compare.seeding.measure_seeding` returns.
    """
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for one, joint in zip(axes, ("calf", "thigh"), strict=True):
        for name, rows in table.groupby("controller", sort=False):
            errors, look = rows.groupby("stride")[joint], LOOKS[str(name)]
            strides = errors.median().index.to_numpy()
            one.semilogy(
                strides, errors.median(), linestyle=look.line, color=look.color, label=look.label
            )
            one.fill_between(strides, errors.min(), errors.max(), color=look.color, alpha=0.15)
        one.set_title(joint, fontsize=9)
        one.set_xlabel("strides of learning")
    axes[0].set_ylabel("peak of the stance error [rad]")
    axes[1].legend(fontsize=7)
    return figure


def write_prediction(predictions: Sequence[Prediction], path: Path) -> Path:
    """Write `predicted_and_measured` to a file; errors are those of `write_seeding`."""
    return _write(predicted_and_measured(predictions), path)


def write_seeding(table: pd.DataFrame, path: Path) -> Path:
    """Write `errors_by_seed` to a file.

    Raises:
        FileProblem: It cannot be written.
    """
    return _write(errors_by_seed(table), path)


def _write(figure: Figure, path: Path) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise cannot_write(path, error, f"choose another file, as {path.stem}.png") from error
    return path
