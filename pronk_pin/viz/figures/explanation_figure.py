"""The learned torque by cause over the phase, and the parameters with their intervals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...compare import Explanation
from ...compare.identification import discrepancy
from ...compare.metrics import of_first_leg
from ..figure_style import new_figure, save_figure, styled

COLORS = {
    "armature": "#0072B2",
    "damping": "#56B4E9",
    "Coulomb": "#009E73",
    "load": "#E69F00",
    "weak motors": "#D55E00",
    "delay": "#CC79A7",
    "gravity": "#5C3A21",
    "deviation": "#999999",
    "internal forces": "#DDDDDD",
    "unexplained": "#F0E442",
}
"""Colour of a cause, of Okabe and Ito; grey is no term, and yellow nothing explains."""
_JOINTS = ("thigh", "calf")


@styled
def explanation_figure(explanation: Explanation, *, speed: float | None = None) -> Figure:
    """One speed's discrepancy by cause, in stance and flight, and all parameters.

    Args:
        explanation: The explanation.
        speed: Which speed [m/s]; by default the one nearest to 0.5.
    """
    figure = new_figure(10.0, 6.0)
    grid = figure.add_gridspec(2, 3, width_ratios=[1.2, 1.2, 1.0])
    shares = explanation.shares.sel(speed=0.5 if speed is None else speed, method="nearest")
    for row, joint in enumerate(_JOINTS):
        for column, part in enumerate(("stance", "flight")):
            axes = figure.add_subplot(grid[row, column])
            _stacked(axes, explanation, float(shares["speed"]), part, joint)
            if row == 1:
                axes.set_xlabel(f"phase of {part}")
            if column == 0:
                axes.set_ylabel("learned - model [N m]")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=7)
    _parameters(figure.add_subplot(grid[:, 2]), explanation)
    figure.suptitle(
        f"What was learned, by cause: {explanation.attributes.get('controller', '')} in "
        f"'{explanation.attributes.get('scenario', '')}' at {float(shares['speed']):g} m/s"
    )
    return figure


def write_explanation_figure(
    explanation: Explanation, path: Path | str, *, speed: float | None = None
) -> Path:
    """Write the figure; the name's ending says how: png, svg or pdf.

    Raises:
        InvalidInput: The format is unknown.
        FileProblem: It cannot be written.
    """
    return save_figure(explanation_figure(explanation, speed=speed), Path(path))


def _stacked(axes: Axes, explanation: Explanation, speed: float, part: str, joint: str) -> None:
    """Causes stacked from zero, those that push up above and those that push down below."""
    shares = explanation.shares
    name = of_first_leg(shares, joint)
    at = {"speed": speed, "part": part, "joint": name}
    phase = shares["phase"].to_numpy()
    whole = discrepancy(shares).sel(at).to_numpy()
    finite = np.isfinite(whole)
    torque = shares["torque"].sel(at)
    above, below = np.zeros((2, finite.sum()))
    for cause in map(str, shares["cause"].to_numpy()):
        values = torque.sel(cause=cause).to_numpy()[finite]
        top, bottom = above + np.maximum(values, 0.0), below + np.minimum(values, 0.0)
        color = COLORS.get(cause, "#000000")
        axes.fill_between(phase[finite], above, top, label=cause, color=color, lw=0.0)
        axes.fill_between(phase[finite], below, bottom, color=color, lw=0.0)
        above, below = top, bottom
    axes.plot(phase, whole, color="black", lw=1.4, label="learned - model")
    axes.axhline(0.0, color="0.3", lw=0.5)
    axes.set_xlim(0.0, 1.0)
    axes.set_title(f"{name}, {part}", fontsize=9)


def _parameters(axes: Axes, explanation: Explanation) -> None:
    """Estimates and intervals, each in its term's own scale, with the truth as a cross."""
    table = explanation.table()
    scale = np.array([term.scale for term in explanation.terms])
    rows = np.arange(len(table))[::-1]
    estimate, low, high, true = (
        table[name].to_numpy(dtype=float) / scale for name in ("estimate", "low", "high", "true")
    )
    reach = np.vstack([estimate - low, high - estimate])
    axes.errorbar(estimate, rows, xerr=reach, fmt="o", ms=4, capsize=3, color="#0072B2")
    axes.plot([], [], "o-", color="#0072B2", ms=4, label="estimate, 95 % interval")
    if np.isfinite(true).any():
        axes.plot(true, rows, "x", color="#D55E00", ms=7, label="truth")
    axes.axvline(0.0, color="0.3", lw=0.5)
    axes.set_yticks(
        rows,
        [
            f"{term.name} [{term.scale:g} {term.unit}]" + ("" if seen else ": not seen")
            for term, seen in zip(explanation.terms, table["seen"], strict=True)
        ],
        fontsize=7,
    )
    axes.set_xlabel("in units of what stands in brackets", fontsize=8)
    axes.legend(fontsize=7, loc="lower right")
