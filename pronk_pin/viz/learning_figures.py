"""Figures of what learning does, beside what was said of it before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..compare.prediction import Prediction
from ..errors import cannot_write


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


def write_prediction(predictions: Sequence[Prediction], path: Path) -> Path:
    """Write `predicted_and_measured` to a file.

    Raises:
        FileProblem: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        predicted_and_measured(predictions).savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        raise cannot_write(path, error, "choose another file, as analysis.png") from error
    return path
