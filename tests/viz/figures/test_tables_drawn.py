"""Figures of studies and of all scenarios, read back from tables that are known."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from pronk_pin._typing import Array
from pronk_pin.compare.metrics import Interval
from pronk_pin.compare.report import SHOWN, Overview
from pronk_pin.compare.report.overview import Beat, ControllerOverview, JointOverview
from pronk_pin.robot import JOINTS, load_robot
from pronk_pin.viz.figure_style import look
from pronk_pin.viz.figures import (
    by_scenario,
    driving_figure,
    errors_by_seed,
    heat_map,
    knowledge_ladder,
    predicted_and_measured,
    shows_knowledge,
)
from pronk_pin.viz.figures.explanation_figure import explanation_figure


def curve(axes: Axes, label: str) -> Array:
    """The line of a label, (n, 2)."""
    (line,) = (line for line in axes.lines if line.get_label() == label)
    return np.column_stack([np.asarray(each, dtype=float) for each in line.get_data()])


def test_a_drive_shows_speeds_errors_and_feedback_of_each_command_over_time() -> None:
    commands = {"0 1s, 0->0.4 1s": [0.0, 0.0, 0.0, 0.08, 0.24], "0.3 2s": [0.3] * 5}
    rows = [
        {
            "command": command,
            "controller": controller,
            "time": 0.4 * k,
            "commanded": speeds[k],
            "gait_speed": speeds[k],
            "speed": speeds[k] - 0.01 * place,
            "calf": 0.001 * (k + 1) * (place + 1),
            "feedback_share": 0.1 * (k + 1) / (place + 1),
        }
        for command, speeds in commands.items()
        for place, controller in enumerate(("pd", "library"))
        for k in range(5)
    ]
    table = pd.DataFrame(rows)
    axes = driving_figure(table).axes
    assert [panel.get_title() for panel in axes[:2]] == list(commands)
    for column, command in enumerate(commands):
        speed, error, share = axes[column::2]
        mine = table[table["command"] == command]
        for controller in ("pd", "library"):
            of = mine[mine["controller"] == controller]
            label = look(controller).label
            np.testing.assert_allclose(curve(speed, label), of[["time", "speed"]])
            np.testing.assert_allclose(curve(error, label)[:, 1], 1e3 * of["calf"])  # [mrad]
            np.testing.assert_allclose(curve(share, label)[:, 1], 100.0 * of["feedback_share"])
    np.testing.assert_allclose(curve(axes[0], "commanded"), [[0, 0], [1, 0], [2, 0.4]])
    labels = [panel.get_ylabel() for panel in axes[::2]]
    assert labels == ["speed [m/s]", "peak calf error [mrad]", "feedback's share [%]"]
    assert axes[5].get_xlabel() == "time [s]"


def test_learning_by_what_it_began_with_is_a_median_and_a_range_of_those_that_stood() -> None:
    rows = [
        {
            "controller": controller,
            "speed": speed,
            "stride": stride,
            "upright": not (controller == "ilc" and speed == 0.6),
            "thigh": level * scale / (stride + 1),
            "calf": 2.0 * level * scale / (stride + 1),
        }
        for controller, level in (("ilc", 0.1), ("model+ilc", 0.03))
        for speed, scale in ((0.0, 1.0), (0.2, 1.5), (0.4, 4.0), (0.6, 90.0))
        for stride in range(6)
    ]
    table = pd.DataFrame(rows)
    figure = errors_by_seed(table)
    for axes, joint in zip(figure.axes, SHOWN, strict=True):
        for controller in ("ilc", "model+ilc"):
            mine = table[(table["controller"] == controller) & table["upright"]]
            by_stride = mine.pivot_table(index="stride", columns="speed", values=joint).to_numpy()
            drawn = curve(axes, look(controller).label)
            np.testing.assert_allclose(drawn[:, 0], range(6))
            np.testing.assert_allclose(drawn[:, 1], np.median(by_stride, axis=1))
            (band,) = (
                each
                for each in axes.collections
                if to_rgba(each.get_facecolor()[0])[:3] == to_rgba(look(controller).color)[:3]
            )
            heights = band.get_paths()[0].vertices
            for stride in range(6):
                reach = heights[np.isclose(heights[:, 0], stride), 1]
                assert reach.min() == pytest.approx(by_stride[stride].min())
                assert reach.max() == pytest.approx(by_stride[stride].max())


def test_what_was_foreseen_and_what_happened_are_drawn_stride_by_stride() -> None:
    rng = np.random.default_rng(0)
    errors = {
        name: rng.uniform(0.01, 0.1, (7, 3)) for name in ("predicted", "rehearsed", "measured")
    }
    found = [
        SimpleNamespace(
            controller="ilc", speed=speed, analysis=SimpleNamespace(radius=0.5 + speed), **errors
        )
        for speed in (0.0, 0.25)
    ]
    asked: Any = found
    figure = predicted_and_measured(asked)
    assert [axes.get_title() for axes in figure.axes] == [
        "0 m/s, spectral radius 0.500",
        "0.25 m/s, spectral radius 0.750",
    ]
    names = {"measured": "measured", "rehearsed": "rehearsed", "predicted": "lifted model"}
    for axes in figure.axes:
        for joint in SHOWN:
            for name, words in names.items():
                drawn = curve(axes, f"{joint}, {words}")
                assert drawn[:, 0].tolist() == list(range(7))
                np.testing.assert_allclose(drawn[:, 1], errors[name][:, JOINTS.index(joint)])


def overview_of(calf: float, thigh: float, *, robots: int = 4, fell: int = 0) -> ControllerOverview:
    """What one controller reached; its errors are known, the rest does not matter."""
    joints = {
        joint: JointOverview(Interval(peak, np.nan, np.nan), felt=peak, rms=peak)
        for joint, peak in (("calf", calf), ("thigh", thigh))
    }
    return ControllerOverview(
        joints=joints,
        settled=np.nan,
        taught=None,
        beat=Beat(np.nan, 0, 0),
        feedback=0.5,
        power=1.0,
        cost=1.0,
        moving=robots,
        speed_error=0.0,
        apex_error=0.0,
        upright=robots - fell,
        fell=fell,
        diverging=0,
        robots=robots,
        unit="speed",
    )


TABLES: dict[str, Overview] = {
    "nominal": {
        "pd": overview_of(0.1, 0.05),
        "model": overview_of(0.03, 0.02),
        "model+rotors": overview_of(0.01, 0.008),
        "ilc": overview_of(0.012, 0.006, fell=1),
    },
    "payload": {
        "pd": overview_of(0.2, 0.15),
        "model": overview_of(np.nan, np.nan, fell=4),
        "ilc": overview_of(0.02, 0.01),
    },
}


def test_the_heat_map_has_a_row_a_scenario_and_says_who_fell() -> None:
    figure = heat_map(TABLES)
    names = ["pd", "model", "ilc", "model+rotors"]  # as legends have them
    assert ticks(figure.axes[0]) == ["nominal", "payload"]
    for axes, joint in zip(figure.axes[:2], SHOWN, strict=True):
        assert axes.get_title() == joint
        shown = [label.get_text() for label in axes.get_xticklabels()]
        assert shown == [look(name).label for name in names]
        (image,) = axes.images
        values = np.ma.filled(np.ma.asarray(image.get_array()), np.nan)
        for row, table in enumerate(TABLES.values()):
            for column, name in enumerate(names):
                expected = table[name].joints[joint].peak.value if name in table else np.nan
                np.testing.assert_allclose(values[row, column], 1e3 * expected)  # mrad
        written = {text.get_position(): text.get_text() for text in axes.texts}
        mine = TABLES["nominal"]["ilc"].joints[joint].peak.value
        assert written[names.index("ilc"), 0] == f"{1e3 * mine:.0f}\n1 fell"
        assert written[names.index("model"), 1] == "all\nfell"
        assert (names.index("model+rotors"), 1) not in written


def test_the_knowledge_is_a_ladder_from_nothing_up_and_practice_a_line() -> None:
    assert shows_knowledge(TABLES)
    assert not shows_knowledge({"payload": {"pd": TABLES["payload"]["pd"]}})
    (nominal, payload) = knowledge_ladder(TABLES).axes
    assert (nominal.get_title(), payload.get_title()) == ("nominal", "payload")
    curves, lines = ladder(nominal)
    for joint in SHOWN:
        table = TABLES["nominal"]
        peaks = [table[name].joints[joint].peak.value for name in ("pd", "model", "model+rotors")]
        assert any(np.allclose(drawn, np.column_stack([range(3), peaks])) for drawn in curves)
        assert any(np.isclose(line, table["ilc"].joints[joint].peak.value) for line in lines)
    assert len(lines) == 2
    labels = [label.get_text() for label in nominal.get_xticklabels()]
    assert labels == ["nothing", "URDF", "URDF,\nrotors", "identified"]


def ladder(axes: Axes) -> tuple[list[Array], list[float]]:
    """Curves with markers, and levels of horizontal lines."""
    curves, levels = [], []
    for line in axes.lines:
        x, y = (np.asarray(values, dtype=float) for values in line.get_data())
        if line.get_marker() not in ("None", "", None):
            curves.append(np.column_stack([x, y]))
        else:
            levels.append(float(y[0]))
    return curves, levels


def test_each_sampled_world_has_its_line_with_all_controllers() -> None:
    rng = np.random.default_rng(1)
    worlds, controllers = [f"random-0-{k}" for k in range(5)], ["pd", "ilc", "model"]
    columns = pd.MultiIndex.from_product([SHOWN, controllers])
    table = pd.DataFrame(rng.uniform(0.01, 0.1, (5, 6)), worlds, columns)
    figure = by_scenario(table)
    for axes, joint in zip(figure.axes, SHOWN, strict=True):
        for controller in controllers:
            drawn = curve(axes, look(controller).label)
            np.testing.assert_allclose(drawn[:, 0], table[joint][controller])
            assert drawn[:, 1].tolist() == list(range(5))
        (bars,) = axes.collections
        for row, segment in enumerate(bars.get_segments()):
            errors = table[joint].iloc[row]
            np.testing.assert_allclose(segment, [[errors.min(), row], [errors.max(), row]])
    assert ticks(figure.axes[0]) == worlds
    low, high = figure.axes[0].get_ylim()
    assert low > high  # the first at the top


def ticks(axes: Axes) -> Sequence[str]:
    return [label.get_text() for label in axes.get_yticklabels()]


def explanation_of(torques: Array, table: pd.DataFrame) -> Any:
    """What the figure reads of an explanation: torques by cause, and parameters."""
    causes = ["armature", "load", "unexplained"]
    joints = load_robot("a1").joint_coordinates
    dims = ("speed", "cause", "part", "phase", "joint")
    whole = torques.sum(axis=1)
    shares = xr.Dataset(
        {
            "torque": (dims, torques),
            "learned": (("speed", "part", "phase", "joint"), 2.0 + whole),
            "model": (("speed", "part", "phase", "joint"), np.full(whole.shape, 2.0)),
            "duration": (("speed", "part"), np.full((2, 2), 0.2)),
        },
        coords={
            "speed": [0.1, 0.6],
            "cause": causes,
            "part": ["stance", "flight"],
            "phase": np.linspace(0.0, 1.0, 5),
            **joints,
        },
    )
    terms = [
        SimpleNamespace(name=name, scale=scale, unit="kg") for name, scale in (("a", 0.5), ("b", 4))
    ]
    attributes = {"controller": "ilc", "scenario": "payload"}
    return SimpleNamespace(shares=shares, terms=terms, table=lambda: table, attributes=attributes)


def test_causes_are_stacked_to_what_was_learned_beyond_the_model() -> None:
    torques = np.random.default_rng(2).normal(size=(2, 3, 2, 5, 12))
    table = pd.DataFrame(
        {
            "estimate": [1.0, -2.0],
            "low": [0.5, -3.0],
            "high": [2.5, -1.5],
            "true": [1.25, np.nan],
            "seen": [True, False],
        }
    )
    figure = explanation_figure(explanation_of(torques, table), speed=0.6)
    assert "at 0.6 m/s" in figure.get_suptitle()
    for place, joint in ((1, "thigh"), (2, "calf")):
        for part, name in enumerate(("stance", "flight")):
            (axes,) = (a for a in figure.axes if a.get_title() == f"FL_{joint}, {name}")
            mine = torques[1, :, part, :, place]  # (causes, phases)
            first = 1 if name == "stance" else 0  # feet bounce in the first 30 ms of a stance
            drawn = curve(axes, "learned - model")[first:, 1]
            np.testing.assert_allclose(drawn, mine.sum(axis=0)[first:])
            bands = [path.vertices for each in axes.collections for path in each.get_paths()]
            for k, phase in list(enumerate(np.linspace(0.0, 1.0, 5)))[first:]:
                heights = np.concatenate([b[np.isclose(b[:, 0], phase), 1] for b in bands])
                up, down = np.maximum(mine[:, k], 0.0).sum(), np.minimum(mine[:, k], 0.0).sum()
                assert heights.max() == pytest.approx(up)
                assert heights.min() == pytest.approx(down)
    parameters = figure.axes[-1]
    labels = [label.get_text() for label in parameters.get_yticklabels()]
    assert labels == ["a [0.5 kg]", "b [4 kg]: not seen"]
    (bars,) = (each for each in parameters.collections if len(each.get_paths()) == 2)
    reach = [path.vertices[:, 0].tolist() for path in bars.get_paths()]
    np.testing.assert_allclose(reach, [[1.0, 5.0], [-0.75, -0.375]])  # in units of the scales
    (truth,) = (line for line in parameters.lines if line.get_label() == "truth")
    np.testing.assert_allclose(np.asarray(truth.get_xdata(), float)[0], 2.5)
    (points,) = (
        line for line in parameters.lines if line.get_marker() == "o" and len(line.get_xdata())
    )
    np.testing.assert_allclose(np.column_stack(points.get_data()), [[2.0, 1.0], [-0.5, 0.0]])
