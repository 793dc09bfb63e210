"""Metrics of effort: mechanical power and cost of transport, from the last strides' ticks."""

from __future__ import annotations

import numpy as np
import xarray as xr
from scipy.integrate import trapezoid

from ..._typing import Array
from ...dynamics import cost_of_transport, mechanical_power
from ...robot import NB, Robot, recorded_robot

TICKS = ("tick_base", "tick_base_rate", "tick_joints", "tick_joint_rates", "tick_torque")
"""Variables that it takes."""


def effort(strides: xr.Dataset) -> dict[str, tuple[Array, str]]:
    """Compute mechanical `power` [W] and `cost_of_transport` [-] of each robot.

    `P = 1/T int sum_i max(tau_i q'_i, 0) dt` and `P T / (m g distance)`, with commanded torques;
    braking gives nothing back. The weight is the robot's own, without what a scenario adds.

    Args:
        strides: The strides of one simulation; without ticks there is nothing to say.

    Returns:
        Values of shape (n,) by name; NaN for a robot that has no whole stride in its ticks.
    """
    if not set(TICKS) <= set(strides.data_vars):
        return {}
    robot, dt = recorded_robot(strides.attrs), float(strides.attrs["timestep"])
    values = np.full((2, strides.sizes["speed"]), np.nan)
    for k in range(strides.sizes["speed"]):
        base, base_rate, joints, rates, torque = (_sequence(strides[name][k]) for name in TICKS)
        whole = np.isfinite(np.hstack([base, base_rate, joints, rates, torque])).all(axis=1)
        if whole.sum() < 2:
            continue
        base, base_rate, joints, rates, torque = (
            part[whole] for part in (base, base_rate, joints, rates, torque)
        )
        t = dt * np.arange(len(base))
        v = _rates(robot, base_rate, rates)
        spent = np.maximum(mechanical_power(robot, v, torque), 0.0).sum(axis=1)
        cost = cost_of_transport(robot, t, _states(robot, base, joints), v, torque)
        values[:, k] = trapezoid(spent, t) / (t[-1] - t[0]), cost if np.isfinite(cost) else np.nan
    return {"power": (values[0], "W"), "cost_of_transport": (values[1], "1")}


def _sequence(values: xr.DataArray) -> Array:
    """One robot's ticks one after the other, (ticks, ...), in float64."""
    ordered = values.transpose("last", "part", "tick", ...)
    return ordered.to_numpy().reshape(-1, ordered.shape[-1]).astype(float)


def _states(robot: Robot, base: Array, joints: Array) -> Array:
    q = np.tile(robot.standing, (len(base), 1))
    q[:, [0, 2]], q[:, 7:] = base, joints
    return q


def _rates(robot: Robot, base_rate: Array, rates: Array) -> Array:
    v = np.zeros((len(rates), robot.nv))
    v[:, [0, 2]], v[:, NB:] = base_rate, rates
    return v
