"""Figures have one look, and are the same bytes each time."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from pronk_pin.errors import FileProblem, InvalidInput
from pronk_pin.viz.figure_style import (
    FORMATS,
    LOOKS,
    figure_bytes,
    in_order,
    look,
    new_figure,
    save_figure,
    styled,
)

# What an eye without the long- or the middle-wave cones makes of linear RGB; ref: Vienot, Brettel
# and Mollon, Digital video colourmaps for checking the legibility of displays by dichromats, 1999.
DEFICIENCIES = {
    "protan": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
    "deutan": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
}


@styled
def some_figure() -> mpl.figure.Figure:
    figure = new_figure(3.5, 2.0)
    figure.subplots().plot([0, 1], [0, 1], **look("ilc").curve)
    return figure


@pytest.mark.parametrize("deficiency", DEFICIENCIES)
def test_controllers_differ_for_any_eye(deficiency: str) -> None:
    matrix = np.array(DEFICIENCIES[deficiency])
    for first, second in combinations(LOOKS.values(), 2):
        seen = [
            np.clip(matrix @ np.power(to_rgb(one.color), 2.2), 0.0, 1.0) ** (1.0 / 2.2)
            for one in (first, second)
        ]
        same_line = (first.line, first.marker) == (second.line, second.marker)
        assert not same_line
        # Where two colours come near each other, line and marker tell them apart.
        assert np.linalg.norm(seen[0] - seen[1]) > 0.12, (first.label, second.label)


def test_the_style_stays_within_the_figure() -> None:
    before = dict(mpl.rcParams)
    figure = some_figure()
    assert dict(mpl.rcParams) == before
    assert not figure.axes[0].spines["top"].get_visible()
    assert figure.axes[0].xaxis.label.get_fontsize() == 8.0


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_figure_is_the_same_bytes_each_time(suffix: str, tmp_path: Path) -> None:
    path = save_figure(some_figure(), tmp_path / "new" / f"figure.{suffix}")
    assert path.read_bytes() == figure_bytes(some_figure(), suffix)
    signature = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[suffix]
    assert path.read_bytes().startswith(signature)


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="'bmp'; choose png, svg, pdf"):
        save_figure(some_figure(), tmp_path / "figure.bmp")


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileProblem, match="choose another folder"):
        save_figure(some_figure(), tmp_path / "file" / "figure.svg")


def test_a_controller_without_a_look_gets_one_that_lasts() -> None:
    assert look("ilc-of-mine") == look("ilc-of-mine")
    assert look("ilc-of-mine").label == "ilc-of-mine"


def test_legends_begin_with_pd_and_drop_nobody() -> None:
    assert in_order(["zeta", "ilc", "pd", "alpha"]) == ["pd", "ilc", "alpha", "zeta"]
