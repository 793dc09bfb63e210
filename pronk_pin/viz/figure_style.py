"""One look for every figure: colours, line styles, sizes, formats.

Colours are those of Okabe and Ito and a few more, which readers with any colour vision tell apart;
controllers differ in line style and marker too, so that a black and white print can be read. Sizes
are those of an IEEE column and page; letters are 8 points in print.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeVar

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..errors import InvalidInput
from ..storage import write_file

PALETTE = {
    "black": "#000000",
    "orange": "#E69F00",
    "sky": "#56B4E9",
    "green": "#009E73",
    "yellow": "#F0E442",
    "blue": "#0072B2",
    "vermilion": "#D55E00",
    "purple": "#CC79A7",
    "grey": "#737373",
    "brown": "#5C3A21",
    "indigo": "#4B0082",
    "ultramarine": "#2222EE",
    "maroon": "#A60445",
    "olive": "#858F23",
    "emerald": "#04BC73",
}
"""The colours by name; yellow is too light for lines on white. The last seven are not of theirs."""

REFERENCE, ACCENT = PALETTE["grey"], PALETTE["vermilion"]
"""Colours of references, and of events and limits."""

SEQUENTIAL, DIVERGING = "viridis", "PuOr_r"
"""Colour maps: for magnitudes, and for differences around zero."""

ONE_COLUMN, TWO_COLUMNS = 3.5, 7.16
"""Widths of a column and of a page [in]."""

FORMATS = ("png", "svg", "pdf")
"""Formats that figures are written in."""


@dataclass(frozen=True)
class Look:
    """Colour, marker and line of a controller in figures.

    Attributes:
        label: Its name in words.
        color: Its colour.
        line: Line style, as matplotlib takes it.
        marker: Marker.
    """

    label: str
    color: str
    line: str | tuple[int, tuple[float, ...]] = "-"
    marker: str = "o"

    @property
    def curve(self) -> dict[str, Any]:
        """Colour, line style and label, as arguments of `plot`."""
        return {"color": self.color, "ls": self.line, "label": self.label}


_DASHED, _DASH_DOT, _SHORT = (0, (5, 2)), (0, (5, 1.5, 1, 1.5)), (0, (2.5, 1.5))

LOOKS = {
    "pd": Look("PD", PALETTE["black"], "-", "x"),
    "model": Look("PD + model", PALETTE["orange"], _DASH_DOT, "s"),
    "library": Look("PD + library", PALETTE["sky"], _SHORT, "^"),
    "ilc": Look("ILC", PALETTE["blue"], "-", "o"),
    "ilc+rotors": Look("ILC, gaits with rotors", PALETTE["emerald"], _SHORT, "h"),
    "ilc-stance": Look("ILC, stance only", PALETTE["olive"], _DASHED, "d"),
    "model+rotors": Look("PD + model with rotors, gaits too", PALETTE["maroon"], "-", "p"),
    "model+ilc": Look("ILC seeded by the model", PALETTE["green"], _DASHED, "D"),
    "library+ilc": Look("ILC seeded by the library", PALETTE["ultramarine"], _SHORT, "<"),
    "ilc-paper": Look("ILC, the paper's law", PALETTE["vermilion"], _DASH_DOT, "v"),
    "identified": Look("PD + identified model", PALETTE["brown"], _DASHED, "P"),
    "identified+gait": Look("PD + identified model, gaits again", PALETTE["indigo"], "-", "*"),
    "paper": Look("paper", PALETTE["purple"], "", "+"),
}
"""Looks by controller, in the order of legends; "paper" are the paper's own numbers."""

_OTHERS = (
    ("vermilion", _SHORT, "P"),
    ("purple", _DASHED, "*"),
    ("grey", "-", "d"),
    ("sky", _DASHED, "h"),
    ("green", _SHORT, "<"),
    ("orange", _DASHED, ">"),
)

_RC: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "figure.titlesize": 9.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.5,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "pronk_pin",  # the same bytes each time
    "pdf.fonttype": 42,  # TrueType, which publishers ask for
}

_P = ParamSpec("_P")
_T = TypeVar("_T")


def styled(draw: Callable[_P, _T]) -> Callable[_P, _T]:
    """Have a function that makes a figure do so in this style; the caller's own stays untouched."""

    @functools.wraps(draw)
    def inner(*args: _P.args, **kwargs: _P.kwargs) -> _T:
        with rc_context(_RC):
            return draw(*args, **kwargs)

    return inner


def look(controller: str) -> Look:
    """Look of a controller in figures; one that has none of its own gets one by its name."""
    if controller in LOOKS:
        return LOOKS[controller]
    color, line, marker = _OTHERS[sum(controller.encode()) % len(_OTHERS)]
    return Look(controller, PALETTE[color], line, marker)


def in_order(controllers: Iterable[str]) -> list[str]:
    """Controllers in the order of the legends: those of `LOOKS`, then any others by name."""
    order = list(LOOKS)
    return sorted(set(controllers), key=lambda c: (order.index(c) if c in order else len(order), c))


def known_format(suffix: str) -> str:
    """The format itself, if figures can be written in it.

    Raises:
        InvalidInput: They cannot.
    """
    if suffix not in FORMATS:
        raise InvalidInput(f"figures cannot be written as '{suffix}'; choose {', '.join(FORMATS)}")
    return suffix


def known_figure(path: Path | None) -> Path | None:
    """The path itself, if a figure can be written there in the format of its suffix, or none is.

    Raises:
        InvalidInput: It cannot.
    """
    if path is not None:
        known_format(path.suffix.removeprefix("."))
    return path


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size [in] that lays itself out."""
    return Figure(figsize=(width, height), layout="constrained")


def legend_below(figure: Figure, handles: Iterable[Any], labels: Iterable[str]) -> None:
    """One legend for all panels, under them; none where there is nothing to name."""
    shown = list(labels)
    if not shown:
        return
    columns = min(len(shown), 4)
    figure.legend(list(handles), shown, loc="outside lower center", ncols=columns)


def log_axis(axes: Axes, axis: Literal["x", "y"] = "y") -> None:
    """A logarithmic axis with plain numbers, as far as something is drawn: 0.02, not 2e-2."""
    drawn = [line.get_data()[axis == "y"] for line in axes.lines]
    if not any(np.any(np.asarray(values, dtype=float) > 0.0) for values in drawn):
        return
    axes.set_yscale("log") if axis == "y" else axes.set_xscale("log")
    plain_ticks(axes.yaxis if axis == "y" else axes.xaxis)


def plain_ticks(axis: Axis) -> None:
    """Ticks of a logarithmic axis at 1, 2 and 5 times powers of ten, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def say(axes: Axes, words: str) -> None:
    """Say in a panel why it is empty."""
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", color="0.4")


def figure_bytes(figure: Figure, suffix: str) -> bytes:
    """A figure as a file of that format, the same bytes each time.

    Raises:
        InvalidInput: The format is unknown.
    """
    known_format(suffix)
    undated: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": None}
    buffer = io.BytesIO()
    with rc_context(_RC):
        figure.savefig(buffer, format=suffix, dpi=200, metadata=undated[suffix])
    return buffer.getvalue()


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure in the format of the path's suffix, and make its folder.

    Raises:
        InvalidInput: The format is unknown.
        FileProblem: It cannot be written.
    """
    data = figure_bytes(figure, path.suffix.removeprefix("."))
    return write_file(path, data, remedy="choose another folder")
