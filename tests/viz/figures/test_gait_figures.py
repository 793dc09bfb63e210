"""Figures of gaits, read back: every curve, arrow, label and shade is the gait's."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba

from pronk_pin.gait import Gait, GaitLibrary, bezier, load_library
from pronk_pin.kinematics import foot_positions
from pronk_pin.robot import JOINTS, Robot, length_scale, load_robot
from pronk_pin.viz.figure_style import ACCENT
from pronk_pin.viz.figures.gait_figures import gait_diagram, side_view, stride_figure

COLUMNS = {"front": 0, "rear": 6}
"""First joint of the left legs, FL and RL."""


@pytest.fixture(scope="module")
def library() -> GaitLibrary:
    return load_library("a1").at_apex(0.34)


@pytest.fixture(scope="module")
def panels(library: GaitLibrary) -> dict[str, Axes]:
    """The panels of the stride's figure by their titles."""
    return {axes.get_title(): axes for axes in stride_figure(library, load_robot("a1")).axes}


def curves(axes: Axes) -> list[np.ndarray]:
    """The curves of a panel, each (n, 2); lines at limits are none."""
    drawn = [line for line in axes.lines if to_rgba(line.get_color()) != to_rgba(ACCENT)]
    return [np.column_stack(line.get_data()) for line in drawn]


def of_speed(axes: Axes, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Stance and flight of the k-th gait."""
    drawn = curves(axes)
    return drawn[2 * k], drawn[2 * k + 1]


@pytest.mark.parametrize("pair", COLUMNS)
@pytest.mark.parametrize("joint", range(3))
def test_joints_and_torques_are_drawn_over_the_stride(
    library: GaitLibrary, panels: dict[str, Axes], pair: str, joint: int
) -> None:
    column, name = COLUMNS[pair] + joint, JOINTS[joint]
    for k, gait in enumerate(library.gaits):
        begin = 0.0
        for part, phase in enumerate(gait.phases):
            angle = of_speed(panels[f"{pair} {name} [rad]"], k)[part]
            torque = of_speed(panels[f"{pair} {name} torque [N m]"], k)[part]
            s = (angle[:, 0] * gait.duration - begin) / phase.duration
            np.testing.assert_allclose(s[[0, -1]], [0.0, 1.0], atol=1e-9)
            reference = phase.joint_reference(np.clip(s, 0.0, 1.0))[0][:, column]
            np.testing.assert_allclose(angle[:, 1], reference, atol=1e-9)
            tau = bezier.evaluate(phase.tau, np.clip(s, 0.0, 1.0))[:, column]
            np.testing.assert_allclose(torque[:, 1], tau, atol=1e-9)
            begin += phase.duration


def test_the_drawn_forces_carry_the_weight_and_change_the_drawn_speed(
    library: GaitLibrary, panels: dict[str, Axes], robot: Robot
) -> None:
    """Newton's law between three panels: both left feet twice, against the trunk's speed. The legs
    move too, so that it holds to some percent."""
    for k, gait in enumerate(library.gaits):
        up = [of_speed(panels[f"{pair} foot, force along z [N]"], k)[0] for pair in COLUMNS]
        impulse = sum(2.0 * np.trapezoid(f[:, 1], gait.duration * f[:, 0]) for f in up)
        speed = of_speed(panels["trunk vertical speed [m/s]"], k)[0][:, 1]
        weight = robot.mass * robot.gravity
        change = robot.mass * (speed[-1] - speed[0])
        assert impulse == pytest.approx(weight * gait.stance.duration + change, rel=0.12)
        for pair in COLUMNS:
            for axis in "xz":
                in_air = of_speed(panels[f"{pair} foot, force along {axis} [N]"], k)[1]
                np.testing.assert_array_equal(in_air[:, 1], 0.0)


def test_the_drawn_trunk_moves_as_its_speeds_say_and_reaches_the_apex(
    library: GaitLibrary, panels: dict[str, Axes]
) -> None:
    for k, gait in enumerate(library.gaits):
        covered = 0.0
        for part in (0, 1):
            height = of_speed(panels["trunk height [m]"], k)[part]
            time = gait.duration * height[:, 0]
            climbed = np.trapezoid(
                of_speed(panels["trunk vertical speed [m/s]"], k)[part][:, 1], time
            )
            assert climbed == pytest.approx(height[-1, 1] - height[0, 1], abs=2e-4)
            covered += np.trapezoid(of_speed(panels["trunk speed [m/s]"], k)[part][:, 1], time)
        assert covered == pytest.approx(gait.speed * gait.duration, abs=2e-4)
        assert height[:, 1].max() == pytest.approx(0.34, abs=2e-4)


def test_colours_go_with_the_speed_and_grey_shows_when_feet_stand(
    library: GaitLibrary, panels: dict[str, Axes]
) -> None:
    axes = panels["front calf [rad]"]
    colours = [line.get_color() for line in axes.lines[::2]][: len(library.gaits)]
    lightness = [np.dot(to_rgba(colour)[:3], (0.3, 0.6, 0.1)) for colour in colours]
    assert np.all(np.diff(lightness) > 0.0)  # of viridis, from slow to fast
    middle = library.gaits[len(library.gaits) // 2]
    for axes in panels.values():
        for patch in axes.patches:
            box = patch.get_extents().transformed(axes.transData.inverted())
            share = middle.stance.duration / middle.duration
            assert (box.x0, box.x1) == pytest.approx((0.0, share))
    assert sum(len(axes.patches) for axes in panels.values()) >= 18


def test_limits_are_drawn_where_the_gaits_come_near_them(
    library: GaitLibrary, panels: dict[str, Axes], robot: Robot
) -> None:
    """Far from those of the A1, and at those of an A1 with motors that are as weak as can be."""

    def limits(axes: Axes) -> list[float]:
        drawn = (line for line in axes.lines if to_rgba(line.get_color()) == to_rgba(ACCENT))
        return sorted(float(line.get_ydata()[0]) for line in drawn)

    assert not any(limits(axes) for axes in panels.values())
    model = robot.model.copy()
    torque = curves(panels["rear calf torque [N m]"])
    most = max(float(np.abs(curve[:, 1]).max()) for curve in torque)
    model.upperEffortLimit[6 + COLUMNS["rear"] + 2] = most
    weak = dataclasses.replace(robot, model=model)
    assert weak.tau_max[COLUMNS["rear"] + 2] == most
    found = {axes.get_title(): limits(axes) for axes in stride_figure(library, weak).axes}
    with_limits = {title: values for title, values in found.items() if values}
    assert list(with_limits) == ["rear calf torque [N m]"]
    assert most in with_limits["rear calf torque [N m]"]


@pytest.mark.parametrize("name", ["a1", "solo12"])
def test_the_side_view_shows_poses_with_their_times_phases_and_forces(name: str) -> None:
    robot = load_robot(name)
    library = load_library(name)
    gait = library.at(float(library.speeds[-1]))
    axes = side_view(gait, robot).axes[0]
    labels = [text for text in axes.texts if "ms" in text.get_text()]
    arrows = [text for text in axes.texts if text.arrow_patch is not None]
    times = np.linspace(0.0, gait.duration, len(labels), endpoint=False)
    expected = []
    for time, label in zip(times, labels, strict=True):
        stands = time < gait.stance.duration
        assert label.get_text() == f"{1e3 * time:.0f} ms\n{'stance' if stands else 'flight'}"
        if stands:
            motion = gait.stance.motion(robot, np.array([time / gait.stance.duration]))
            expected += [motion.lam[0, leg] for leg in (0, 2)]
    pushed = [force for force in expected if np.linalg.norm(force) > 1.0]
    drawn = [np.subtract(arrow.xy, arrow.xyann) for arrow in arrows]
    assert len(drawn) >= len(pushed) > 0
    lengths = [np.linalg.norm(arrow) for arrow in drawn]
    scale = [arrow[1] / force[2] for arrow, force in zip(drawn, expected, strict=False)]
    np.testing.assert_allclose(scale, scale[0])  # one scale for all [m/N]
    for arrow, force in zip(drawn, expected, strict=False):
        np.testing.assert_allclose(arrow, scale[0] * force[[0, 2]])
    # A foot that bears its quarter of the weight has an arrow that is seen, and not the picture.
    quarter = scale[0] * robot.mass * robot.gravity / 4.0 / robot.standing[2]
    assert 0.1 < quarter < 0.4
    assert max(lengths) < 2.0 * robot.standing[2]


def test_legs_in_the_side_view_stand_on_the_ground_where_their_arrows_begin(robot: Robot) -> None:
    gait: Gait = load_library("a1").at(0.5)
    axes = side_view(gait, robot).axes[0]
    feet = np.array([line.get_data() for line in axes.lines if line.get_marker() == "o"])
    heights = feet.reshape(-1, 2, 2)[:, :, 1]  # (frames, front and rear, height)
    times = np.linspace(0.0, gait.duration, len(heights), endpoint=False)
    for time, drawn in zip(times, heights, strict=True):
        phase, begin = (
            (gait.stance, 0.0)
            if time < gait.stance.duration
            else (gait.flight, gait.stance.duration)
        )
        q = phase.motion(robot, np.array([(time - begin) / phase.duration])).q[0]
        np.testing.assert_allclose(drawn, foot_positions(robot, q)[[0, 2], 2], atol=1e-9)
    starts = sorted(float(text.xyann[0]) for text in axes.texts if text.arrow_patch is not None)
    standing = sorted(feet.reshape(-1, 2)[feet.reshape(-1, 2)[:, 1] < 0.0201, 0])
    assert set(np.round(starts, 6)) <= set(np.round(standing, 6))
    assert length_scale(robot) == 1.0


@pytest.mark.parametrize("name", ["pronk", "bound", "trot"])
def test_bars_of_the_gait_diagram_lie_where_the_foot_is_on_the_ground(
    robot: Robot, name: str
) -> None:
    """Read back against the motion itself: a foot stands where its height is its radius, and it
    does not move."""
    gait = load_library("a1", gait=name).at(0.4)
    axes = gait_diagram(gait, robot).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == list(robot.legs)
    bars = [
        [path.get_extents().x0 * gait.duration, path.get_extents().x1 * gait.duration, row]
        for row, collection in enumerate(axes.collections)
        for path in collection.get_paths()
    ]
    begin = 0.0
    for phase in gait.phases:
        middle = begin + 0.5 * phase.duration
        height = foot_positions(robot, phase.motion(robot, np.array([0.5])).q)[0, :, 2]
        down = {row for first, last, row in bars if first < middle < last}
        assert down == set(np.flatnonzero(height - robot.foot_radius < 1e-4))
        begin += phase.duration
    shares = [float(text.get_text().rstrip("%")) / 100.0 for text in axes.texts]
    for row, share in enumerate(shares):
        lasting = sum(last - first for first, last, own in bars if own == row)
        assert share == pytest.approx(lasting / gait.duration, abs=0.006)
