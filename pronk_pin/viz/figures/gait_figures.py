"""Figures of a gait library: every gait over its stride, and one from the side and as a diagram."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec

from ..._typing import Array
from ...gait import Gait, GaitLibrary, Motion
from ...kinematics import foot_positions, mirror
from ...robot import JOINTS, NB, Robot, arrow_scale, length_scale, load_robot
from ..figure_style import ACCENT, SEQUENTIAL, known_format, new_figure, save_figure, styled

_SAMPLES = 81
_FRAMES = 7
_SHOWN_SPEED = 0.5  # m/s, unless another is asked for
_ARROW = 2e-3  # m/N
_PAIRS = ("front", "rear")


def write_gait_figures(
    library: GaitLibrary,
    folder: Path,
    *,
    speed: float | None = None,
    apex: float | None = None,
    suffix: str = "png",
    robot: Robot | None = None,
) -> list[Path]:
    """Write the figures of a library.

    Args:
        library: The gaits.
        folder: Where to write; it is made if need be.
        speed: Speed of the side view [m/s]; by default the one nearest to 0.5.
        apex: Greatest height of the trunk [m]; by default the library's own.
        suffix: "png", "svg" or "pdf".
        robot: The robot; by default the one that is known by the library's name.

    Raises:
        InvalidInput: The format is unknown, or the library has no such apex.
        SpeedOutOfRange: The library does not cover the speed.
        FileProblem: A figure cannot be written.
    """
    known_format(suffix)
    robot = load_robot(library.robot) if robot is None else robot
    part = library.at_apex(apex)
    if speed is None:
        speed = float(part.speeds[np.argmin(np.abs(part.speeds - _SHOWN_SPEED))])
    figures = {
        "stride": stride_figure(part, robot),
        "side": side_view(part.at(speed), robot, base=library.base),
        "diagram": gait_diagram(part.at(speed), robot),
    }
    stem = f"{library.robot}-{library.metadata.get('gait', 'gait')}"
    return [
        save_figure(figure, folder / f"{stem}-{name}.{suffix}") for name, figure in figures.items()
    ]


@styled
def stride_figure(library: GaitLibrary, robot: Robot) -> Figure:
    """Joint angles, torques, ground forces and the trunk over the stride, for all speeds.

    Args:
        library: Gaits at one apex.
        robot: Their robot.
    """
    figure = new_figure(11.0, 11.5)
    grid = GridSpec(5, 4, figure=figure, height_ratios=[1, 1, 1, 1, 1])
    speeds = library.speeds
    norm = Normalize(float(speeds[0]), float(max(speeds[-1], speeds[0] + 1e-3)))
    colors = colormaps[SEQUENTIAL]
    left = [leg for leg, _ in mirror(robot).pairs]
    axes = _axes(figure, grid, _PAIRS[: len(left)], pitch=library.base == "sagittal")
    for gait in library.gaits:
        color, start = colors(norm(gait.speed)), 0.0
        for phase in gait.phases:
            motion = phase.motion(robot, np.linspace(0.0, 1.0, _SAMPLES))
            t = (start + motion.t) / gait.duration
            for key, values in _curves(motion, left).items():
                if key in axes:
                    axes[key].plot(t, values, color=color, lw=1.0)
            start += phase.duration
    _phases(axes, library, robot)
    for key, panel in axes.items():
        _limits(panel, key, robot)
    mappable = ScalarMappable(norm, colors)
    figure.colorbar(mappable, ax=list(axes.values()), label="speed [m/s]", shrink=0.5, pad=0.01)
    kind = library.metadata.get("gait", "gait")
    figure.suptitle(
        f"{robot.name.upper()}, {kind}, {library.base} base, apex {library.apex:g} m: one stride, "
        "left legs; grey: on the ground"
    )
    return figure


@styled
def side_view(gait: Gait, robot: Robot, *, base: str = "locked") -> Figure:
    """A stroboscopic side view of one stride, with the forces of the ground.

    The poses stand side by side, a constant distance apart, at equal steps of time.

    Args:
        gait: The gait.
        robot: Its robot.
        base: How the trunk moves, for the title.
    """
    figure = new_figure(11.0, 2.5)
    axes = figure.subplots()
    times = np.linspace(0.0, gait.duration, _FRAMES, endpoint=False)
    size = length_scale(robot)
    spread = 0.62 * size  # m between two poses, on top of how far the robot went
    colors = colormaps[SEQUENTIAL](np.linspace(0.0, 0.85, _FRAMES))
    for frame, time in enumerate(times):
        motion, name = _at(gait, robot, float(time))
        shift = frame * spread
        _pose(axes, robot, motion, shift, colors[frame])
        axes.annotate(
            f"{1e3 * time:.0f} ms\n{name}",
            (motion.q[0, 0] + shift, -0.05 * size),
            ha="center",
            va="top",
            fontsize=8,
        )
    trunk = np.concatenate([p.base_reference(np.linspace(0, 1, _SAMPLES))[0] for p in gait.phases])
    clock = np.concatenate(
        [
            start + np.linspace(0, 1, _SAMPLES) * phase.duration
            for phase, start in zip(gait.phases, _starts(gait), strict=True)
        ]
    )
    drawn = clock <= times[-1]
    x = trunk[drawn, 0] + clock[drawn] * _FRAMES / gait.duration * spread
    axes.plot(x, trunk[drawn, 1], ":", color="0.5", lw=1.0, label="trunk")
    axes.axhline(0.0, color="0.3", lw=1.0)
    axes.set_aspect("equal")
    axes.set_ylim(-0.19 * size, 0.42 * size)
    axes.set_yticks(np.round([0.0, 0.2 * size, 0.4 * size], 1))
    axes.set_xticks([])
    axes.set_ylabel("height [m]")
    axes.set_title(
        f"{robot.name.upper()} at {gait.speed:g} m/s, {base} base, apex {gait.apex:g} m: a stride "
        f"of {1e3 * gait.duration:.0f} ms, poses spread out; arrows: ground forces",
        fontsize=9,
    )
    return figure


@styled
def gait_diagram(gait: Gait, robot: Robot) -> Figure:
    """The gait diagram (Hildebrand): a row a leg, a bar while its foot stands.

    Each row has its duty factor, the share of the stride that the foot stands.

    Args:
        gait: The gait.
        robot: Its robot.
    """
    figure = new_figure(5.0, 0.7 + 0.3 * len(robot.legs))
    axes = figure.subplots()
    starts = np.append(_starts(gait), gait.duration) / gait.duration
    for row, leg in enumerate(robot.legs):
        stands = [(k, leg in phase.feet) for k, phase in enumerate(gait.phases)]
        bars = [(starts[k], starts[k + 1] - starts[k]) for k, standing in stands if standing]
        axes.broken_barh(bars, (row - 0.35, 0.7), color="0.25", lw=0)
        axes.text(1.02, row, f"{sum(width for _, width in bars):.0%}", va="center", fontsize=8)
    for start in starts[1:-1]:
        axes.axvline(start, color="0.7", lw=0.6, zorder=0)
    axes.set_yticks(range(len(robot.legs)), robot.legs)
    axes.set_ylim(len(robot.legs) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel(f"t / stride of {1e3 * gait.duration:.0f} ms")
    axes.set_title(f"{robot.name.upper()} at {gait.speed:g} m/s: feet on the ground", fontsize=9)
    return figure


def _axes(
    figure: Figure, grid: GridSpec, pairs: tuple[str, ...], *, pitch: bool
) -> dict[str, Axes]:
    """One panel a quantity, by its key."""
    axes: dict[str, Axes] = {}
    for column, pair in enumerate(pairs):
        for row, joint in enumerate(JOINTS):
            angle, torque = f"{pair} {joint} angle", f"{pair} {joint} torque"
            axes[angle] = figure.add_subplot(grid[row, column])
            axes[angle].set_title(f"{pair} {joint} [rad]", fontsize=9)
            axes[torque] = figure.add_subplot(grid[row, column + 2])
            axes[torque].set_title(f"{pair} {joint} torque [N m]", fontsize=9)
        for i, axis in enumerate("xz"):
            axes[f"{pair} {axis}"] = figure.add_subplot(grid[3, column + 2 * i])
            axes[f"{pair} {axis}"].set_title(f"{pair} foot, force along {axis} [N]", fontsize=9)
    last = "pitch" if pitch else "vx"
    titles = {
        "z": "trunk height [m]",
        "vz": "trunk vertical speed [m/s]",
        "vx": "trunk speed [m/s]",
    }
    titles |= {"pitch": "trunk pitch [rad]"}
    shown = ("z", "vz", "vx", "pitch") if last == "pitch" else ("z", "vz", "vx")
    for column, key in enumerate(shown):
        axes[key] = figure.add_subplot(grid[4, column])
        axes[key].set_title(titles[key], fontsize=9)
        axes[key].set_xlabel("t / stride", fontsize=8)
    for panel in axes.values():
        panel.tick_params(labelsize=7)
        panel.set_xlim(0.0, 1.0)
    return axes


def _curves(motion: Motion, left: list[int]) -> dict[str, Array]:
    """Each panel's quantity at the motion's instants."""
    pitch = 2.0 * np.arctan2(motion.q[:, 4], motion.q[:, 6])
    cos, sin = np.cos(pitch), np.sin(pitch)
    vx, vz = motion.v[:, 0], motion.v[:, 2]
    curves = {"z": motion.q[:, 2], "pitch": pitch}
    curves |= {"vx": cos * vx + sin * vz, "vz": cos * vz - sin * vx}
    for pair, leg in zip(_PAIRS, left, strict=False):
        for i, joint in enumerate(JOINTS):
            column = len(JOINTS) * leg + i
            curves[f"{pair} {joint} angle"] = motion.q[:, NB + 1 + column]
            curves[f"{pair} {joint} torque"] = motion.tau[:, column]
        curves[f"{pair} x"], curves[f"{pair} z"] = motion.lam[:, leg, 0], motion.lam[:, leg, 2]
    return curves


def _phases(axes: dict[str, Axes], library: GaitLibrary, robot: Robot) -> None:
    """Shade the phases with feet on the ground, the panel's own or any, of the middle gait."""
    gait = library.gaits[len(library.gaits) // 2]
    of_leg = {
        robot.legs[leg]: pair
        for pair, legs in zip(_PAIRS, mirror(robot).pairs, strict=False)
        for leg in legs
    }
    for key, panel in axes.items():
        for phase, start in zip(gait.phases, _starts(gait), strict=True):
            pairs = {of_leg[leg] for leg in phase.feet}
            if pairs and (key.split()[0] in pairs or key.split()[0] not in _PAIRS):
                end = (start + phase.duration) / gait.duration
                panel.axvspan(start / gait.duration, end, color="0.93", lw=0, zorder=0)


def _limits(axes: Axes, key: str, robot: Robot) -> None:
    """Lines at the robot's limits, where they come near."""
    words = key.split()
    if words[-1] not in ("angle", "torque"):
        return
    leg, _ = mirror(robot).pairs[_PAIRS.index(words[0])]
    column = len(JOINTS) * leg + JOINTS.index(words[1])
    bounds = {
        "angle": (robot.q_min[column], robot.q_max[column]),
        "torque": (-robot.tau_max[column], robot.tau_max[column]),
    }[words[-1]]
    low, high = axes.get_ylim()
    for bound in bounds:
        if low - 0.3 * (high - low) < bound < high + 0.3 * (high - low):
            axes.axhline(bound, color=ACCENT, lw=0.8, ls="--")


def _starts(gait: Gait) -> Array:
    """When the phases begin [s]."""
    durations = [phase.duration for phase in gait.phases]
    return np.concatenate([[0.0], np.cumsum(durations)[:-1]])


def _at(gait: Gait, robot: Robot, time: float) -> tuple[Motion, str]:
    """The motion at one instant of the stride, and the name of its phase."""
    starts = _starts(gait)
    k = int(np.searchsorted(starts, time, side="right")) - 1
    phase = gait.phases[k]
    s = np.array([min(1.0, (time - starts[k]) / phase.duration)])
    return phase.motion(robot, s), phase.name


def _pose(axes: Axes, robot: Robot, motion: Motion, shift: float, color: Array) -> None:
    """Trunk and left legs of one pose, and the forces on its feet."""
    q = motion.q[0]
    feet = foot_positions(robot, q)
    hips = []
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    for leg, _ in mirror(robot).pairs:
        names = robot.spec.leg_joints(robot.legs[leg])
        joints = [robot.model.getJointId(joint) for joint in names]
        points = [np.array(data.oMi[joint].translation) for joint in joints[1:]] + [feet[leg]]
        hips.append(points[0])
        line = np.array(points)
        axes.plot(line[:, 0] + shift, line[:, 2], color=color, lw=2.2, solid_capstyle="round")
        axes.plot(feet[leg, 0] + shift, feet[leg, 2], "o", color=color, ms=3.5)
        force = _ARROW * arrow_scale(robot) * motion.lam[0, leg]
        if np.linalg.norm(force) > 1e-3:
            axes.annotate(
                "",
                xy=(feet[leg, 0] + shift + force[0], force[2]),
                xytext=(feet[leg, 0] + shift, 0.0),
                arrowprops={"arrowstyle": "->", "color": ACCENT, "lw": 1.4},
            )
    trunk = np.array(hips)
    axes.plot(trunk[:, 0] + shift, trunk[:, 2], color=color, lw=6.0, solid_capstyle="round")
