"""A still of the replay: the robot beside its reference, before learning and after."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._typing import Array
from ...compare.metrics import of_first_leg
from ...compare.report import SHOWN
from ...kinematics import foot_positions, mirror
from ...robot import Robot, length_scale
from ..figure_style import PALETTE, REFERENCE, TWO_COLUMNS, legend_below, look, new_figure, styled

SPREAD = 3.0
"""Factor by which the errors of the angles are drawn larger than they are."""


@styled
def still(strides: xr.Dataset, robot: Robot, *, speed: float, name: str = "ilc") -> Figure:
    """Where the calf is farthest off, in the stride before the learning and in the last.

    Left legs from the side, errors `SPREAD` times as large as they were.

    Args:
        strides: The strides of a controller that learned.
        robot: Its robot.
        speed: Which robot [m/s].
        name: The controller, for its colour.
    """
    of_speed = strides.sel(speed=speed, method="nearest")
    count = int(of_speed["count"])
    began = int(np.argmax(of_speed["learning"].to_numpy()[:count] == 1))
    figure = new_figure(TWO_COLUMNS, 2.6)
    moments = (("before learning", max(began - 1, 0), "pd"), ("the last stride", count - 1, name))
    size, handles = length_scale(robot), {}
    for axes, (words, k, who) in zip(figure.subplots(1, 2, sharey=True), moments, strict=True):
        q, planned, peak = _worst(of_speed.isel(stride=k), robot)
        handles["reference"] = _legs(axes, robot, planned, REFERENCE, 5.0, alpha=0.45)
        handles[f"robot, {words}"] = _legs(axes, robot, q, look(who).color, 2.0)
        axes.axhline(-0.5 * robot.foot_radius, color=PALETTE["brown"], lw=0.8)
        axes.set_title(f"{words} (stride {k}): calf {1e3 * peak:.0f} mrad off")
        axes.set_aspect("equal")
        axes.set_xlim(-0.45 * size, 0.32 * size)
        axes.set_xlabel("along [m]")
    figure.axes[0].set_ylabel("height [m]")
    legend_below(figure, handles.values(), handles)
    return figure


def _worst(stride: xr.Dataset, robot: Robot) -> tuple[Array, Array, float]:
    """Configurations, robot and reference (19,), where the calf is farthest off, and how far."""
    stance = stride.sel(part="stance")
    errors = stance["error"].transpose("phase", "joint").to_numpy()
    calf = list(map(str, stride["joint"].to_numpy())).index(of_first_leg(stride, SHOWN[0]))
    worst = int(np.nanargmax(np.abs(errors[:, calf])))
    planned = stance["reference"].transpose("phase", "joint").to_numpy()[worst]
    height = float(stance["base"].transpose("phase", "axis").to_numpy()[worst, 1])
    base = np.array([0.0, 0.0, height])
    q = robot.q_from_base(base, planned - SPREAD * errors[worst])
    return q, robot.q_from_base(base, planned), float(abs(errors[worst, calf]))


def _legs(
    axes: Axes, robot: Robot, q: Array, color: str, width: float, *, alpha: float = 1.0
) -> object:
    """Trunk and left legs of a configuration; what stands for them in the legend."""
    style: dict[str, Any] = {"color": color, "lw": width, "alpha": alpha, "solid_capstyle": "round"}
    feet, data, hips = foot_positions(robot, q), robot.model.createData(), []
    pin.forwardKinematics(robot.model, data, q)
    for leg, _ in mirror(robot).pairs:
        joints = [robot.model.getJointId(n) for n in robot.spec.leg_joints(robot.legs[leg])[1:]]
        points = np.array([*(data.oMi[joint].translation for joint in joints), feet[leg]])
        hips.append(points[0])
        axes.plot(points[:, 0], points[:, 2], **style)
    trunk = np.array(hips)
    return axes.plot(trunk[:, 0], trunk[:, 2], **{**style, "lw": 2.0 * width})[0]
