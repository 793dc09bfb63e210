"""Power and cost of transport of a motion whose energy is known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from pronk_pin import Robot
from pronk_pin.compare import Results
from pronk_pin.compare.metrics.effort import effort

DT, TICKS, LAST = 0.001, 200, 3


def strides(speed: float, power: float) -> xr.Dataset:
    """One robot that glides along while one motor gives a power and another one brakes."""
    shape = (1, LAST, 2, TICKS)
    time = DT * np.arange(LAST * 2 * TICKS).reshape(shape)
    base = np.stack([speed * time, np.full(shape, 0.3)], axis=-1)
    base_rate = np.stack([np.full(shape, speed), np.zeros(shape)], axis=-1)
    rates, torque = np.zeros((*shape, 12)), np.zeros((*shape, 12))
    rates[..., 2], torque[..., 2] = 4.0, power / 4.0
    rates[..., 5], torque[..., 5] = 4.0, -power
    tick = ("speed", "last", "part", "tick")
    joint = (*tick, "joint")
    return xr.Dataset(
        {
            "tick_base": ((*tick, "axis"), base),
            "tick_base_rate": ((*tick, "axis"), base_rate),
            "tick_joints": (joint, np.zeros((*shape, 12))),
            "tick_joint_rates": (joint, rates),
            "tick_torque": (joint, torque),
        },
        coords={"speed": [speed]},
        attrs={"robot": "a1", "timestep": DT},
    )


def test_the_cost_is_the_energy_over_weight_times_distance(robot: Robot) -> None:
    found = effort(strides(0.5, 60.0))
    (power, watt), (cost, one) = found["power"], found["cost_of_transport"]
    assert (watt, one) == ("W", "1")
    np.testing.assert_allclose(power, 60.0)
    np.testing.assert_allclose(cost, 60.0 / (robot.mass * 9.81 * 0.5), rtol=1e-9)


def test_ends_of_parts_are_left_out(robot: Robot) -> None:
    data = strides(0.5, 60.0)
    data["tick_torque"][0, :, 1, 150:] = np.nan
    np.testing.assert_allclose(effort(data)["power"][0], 60.0, rtol=0.2)
    data["tick_torque"][:] = np.nan
    assert np.isnan(effort(data)["cost_of_transport"][0]).all()


def test_a_robot_that_stays_where_it_is_has_a_power_but_no_cost() -> None:
    found = effort(strides(0.0, 60.0))
    assert np.isfinite(found["power"][0]).all()
    assert not np.isfinite(found["cost_of_transport"][0]).any()


def test_without_ticks_there_is_nothing_to_say() -> None:
    assert effort(strides(0.5, 60.0).drop_vars("tick_torque")) == {}


def test_a_pronking_robot_spends_about_what_its_height_and_push_need(
    comparison: Results, robot: Robot
) -> None:
    """At least the energy that lifts the trunk from its lowest point to the apex each stride."""
    summary = comparison.summary()
    mine = summary[(summary["controller"] == "ilc") & (summary["joint"] == "-")]
    wide = mine.pivot_table(index="speed", columns="metric", values="value")
    cell = comparison.strides(comparison.find(controller="ilc"))
    depth = cell["base"].sel(axis="z", part="stance").min("phase").mean("stride").to_numpy()
    lifted = robot.mass * 9.81 * (0.34 - depth)
    least = lifted / wide["stride_duration"].to_numpy()
    assert np.all(wide["power"] > least)
    assert np.all(wide["power"] < 6 * least)


@pytest.mark.parametrize("speed", [0.45])
def test_the_cost_of_transport_fits_the_power(comparison: Results, speed: float) -> None:
    summary = comparison.summary()
    robot_rows = summary[(summary["speed"] == speed) & (summary["joint"] == "-")]
    for _, rows in robot_rows.groupby("controller"):
        value = rows.set_index("metric")["value"]
        moved = speed + value["speed_error"]
        weight = 13.741 * 9.81
        assert value["cost_of_transport"] == pytest.approx(value["power"] / (weight * moved), 0.03)
