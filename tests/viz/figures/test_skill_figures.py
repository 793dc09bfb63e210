"""Figures of what learned feedforward is good for show every number of their tables."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from pronk_pin.viz.figure_style import figure_bytes
from pronk_pin.viz.figures.skill_figures import gains_figure, transfers_figure

SHARES = [1.0, 0.5, 0.25]


@pytest.fixture
def gains() -> pd.DataFrame:
    rows = [
        {"share": share, "learned": learned, "thigh": error, "calf": 2.0 * error, "robots": 4}
        for learned, level in ((False, 0.1), (True, 0.01))
        for share in SHARES
        for error in [level / share]
    ]
    table = pd.DataFrame(rows)
    return table.assign(upright=np.where((table["share"] < 0.3) & ~table["learned"], 3, 4))


@pytest.fixture
def transfers() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "task": ["at home", "left out +0.20 m/s", "payload"],
            "thigh": [0.003, 0.004, 0.02],
            "calf": [0.004, 0.006, 0.03],
            "thigh_relearned": [0.003, 0.0039, 0.004],
            "calf_relearned": [0.004, 0.005, 0.006],
            "reuse": [True, False, False],
            "right": [True, False, True],
        }
    )


def test_the_gains_figure_has_both_ways_and_rings_around_who_fell(gains: pd.DataFrame) -> None:
    axes = gains_figure(gains).axes[1]
    curves = {str(line.get_label()): np.column_stack(line.get_data()) for line in axes.lines}
    np.testing.assert_allclose(curves["with what was learned"][:, 0], [25.0, 50.0, 100.0])
    np.testing.assert_allclose(curves["with what was learned"][:, 1], [0.04, 0.02, 0.01])
    np.testing.assert_allclose(curves["some fell"], [[25.0, 0.4]])
    np.testing.assert_allclose(curves["full gains alone"][:, 1], 0.1)


def test_the_transfer_figure_tells_the_rules_answer_and_where_it_was_wrong(
    transfers: pd.DataFrame,
) -> None:
    figure = transfers_figure(transfers)
    names = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert names == ["at home", "left out +0.20 m/s (rule wrong)", "payload"]
    points = {
        str(line.get_label()): np.column_stack(line.get_data()).tolist()
        for line in figure.axes[1].lines
    }
    assert points["stored feedforward: reuse"] == [[0.003, 0]]
    assert points["stored feedforward: learn again"] == [[0.004, 1], [0.02, 2]]
    assert points["learned there"] == [[0.003, 0], [0.0039, 1], [0.004, 2]]
    assert figure_bytes(figure, "svg") == figure_bytes(transfers_figure(transfers), "svg")


def test_axes_have_units(gains: pd.DataFrame, transfers: pd.DataFrame) -> None:
    for axes in gains_figure(gains).axes:
        assert axes.get_ylabel().endswith("[rad]")
        assert axes.get_xlabel().endswith("[%]")
    for axes in transfers_figure(transfers).axes:
        assert axes.get_xlabel().endswith("[rad]")


def test_panels_say_which_joint_they_show(gains: pd.DataFrame, transfers: pd.DataFrame) -> None:
    for figure, columns in ((gains_figure(gains), gains), (transfers_figure(transfers), transfers)):
        for axes in figure.axes:
            drawn = np.concatenate([np.ravel(line.get_data()) for line in axes.lines])
            for value in columns[axes.get_title()]:
                assert np.isclose(drawn.astype(float), value).any()
        assert [axes.get_title() for axes in figure.axes] == ["calf", "thigh"]
