"""What a robot takes itself to be in, as it is drawn."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from pronk_pin.compare import load_scenario
from pronk_pin.viz.figures import estimated_conditions

TOLD = np.array([[0.0, 0.0, 0.03, 0.06, 0.07], [0.0, 0.0, 0.05, 0.08, 0.09]])


def strides(scenario: str) -> xr.Dataset:
    """Two robots that learn from the second stride on; the third has fallen."""
    told = np.concatenate([TOLD, np.full((1, 5), 9.0)])
    return xr.Dataset(
        {
            "conditions": (("speed", "stride", "condition"), told[..., None]),
            "learning": (("speed", "stride"), np.tile([0.0, 1, 1, 1, 1], (3, 1))),
            "upright": (("speed", "stride"), np.array([[1.0] * 5, [1.0] * 5, [0.0] * 5])),
            "count": ("speed", np.full(3, 5)),
        },
        coords={"speed": [0.0, 0.2, 0.4], "condition": ["slope"]},
        attrs={"scenario_parameters": load_scenario(scenario).to_json()},
    )


def test_estimates_are_drawn_from_the_learning_on_beside_the_true_value() -> None:
    worlds = {name: {"library=hills": strides(name)} for name in ("slope=0.08", "payload")}
    figure = estimated_conditions(worlds)
    assert [axes.get_title() for axes in figure.axes] == ["slope=0.08", "payload"]
    assert figure.axes[0].get_ylabel() == "slope [rad]"
    for axes, true in zip(figure.axes, (0.08, 0.0), strict=True):
        level, curve = axes.lines
        assert level.get_ydata()[0] == true
        np.testing.assert_array_equal(curve.get_xdata(), range(4))
        np.testing.assert_allclose(curve.get_ydata(), TOLD[:, 1:].mean(axis=0))
        (band,) = axes.collections
        assert band.get_datalim(axes.transData).y1 == pytest.approx(0.09)
