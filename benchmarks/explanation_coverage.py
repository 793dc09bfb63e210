"""How often the intervals of `explain` hold the truth: `python benchmarks/explanation_coverage.py`.

In sampled scenarios `random-0-<i>` whose motors are late by 0 to 5 ms, in turn: the share of the
intervals of each term that hold its true value, and how far the estimates are from it. Payload,
damping and delay are to be within 5 % of the truth, and 90 % of the intervals to hold it.
"""

from __future__ import annotations

import argparse

import numpy as np
import pandas as pd
import xarray as xr

from pronk_pin import load_robot
from pronk_pin.compare import Scenario, Schedule, Simulation, explain, load_scenario
from pronk_pin.compare.simulation.dataset import to_dataset
from pronk_pin.control import load_controller
from pronk_pin.gait import load_library

SPEEDS = (-0.4, 0.0, 0.4, 0.8)
SCHEDULE = Schedule(baseline=4.0, learning=16.0)
DELAYS = (0.0, 0.001, 0.002, 0.003, 0.004, 0.005)
"""Of the motors [s]; the i-th world has the i-th, in turn."""
NOISE = {"tick_joints": 5e-4, "tick_joint_rates": 0.05, "tick_torque": 0.1}
"""Of encoders [rad, rad/s] and of the current [N m], white."""
NEAR = 0.05
"""Error that counts as near, over the truth where that is not zero."""
IMU_NOISE = 0.3
"""Of the accelerometer [m/s^2]."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Coverage of the intervals of explain.")
    parser.add_argument("--worlds", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0, help="of the sampled scenarios")
    parser.add_argument("--noise", type=float, default=1.0, help="of the sensors, over the usual")
    args = parser.parse_args()
    tables = []
    for index in range(args.worlds):
        strides = simulate_learning(sampled(args.seed, index))
        tables.append(table_of(strides, noise=args.noise, seed=index))
    print(format_coverage(coverage(pd.concat(tables))))


def sampled(seed: int, index: int) -> Scenario:
    """The index-th sampled scenario, with its delay."""
    delay = DELAYS[index % len(DELAYS)]
    return load_scenario(f"random-{seed}-{index}" + (f"+delay={delay:g}" if delay else ""))


def simulate_learning(scenario: Scenario) -> xr.Dataset:
    """The strides of a run that learns."""
    robot, library = load_robot("a1"), load_library("a1")
    gaits = [library.at(speed) for speed in SPEEDS]
    simulation = Simulation(
        robot,
        gaits,
        load_controller("ilc"),
        scenario,
        schedule=SCHEDULE,
        rng=np.random.default_rng(scenario.seed),
    )
    attributes = {
        "robot": "a1",
        "base": "locked",
        "scenario": scenario.name,
        "controller": "ilc",
        "scenario_parameters": scenario.to_json(),
        "timestep": scenario.timestep,
    }
    return to_dataset(simulation.run(), robot, gaits, attributes=attributes)


def table_of(strides: xr.Dataset, *, noise: float, seed: int) -> pd.DataFrame:
    """The terms that are seen through so much noise of the sensors."""
    rng = np.random.default_rng(seed)
    noisy = strides.copy()
    for name, size in NOISE.items():
        noisy[name] = strides[name] + noise * size * rng.standard_normal(strides[name].shape)
    table = explain(noisy, imu_noise=noise * IMU_NOISE, rng=rng).table()
    return table[table["seen"]]


def coverage(table: pd.DataFrame) -> pd.DataFrame:
    """One row a term: share of the intervals that hold the truth, errors, and half intervals."""
    error = (table["estimate"] - table["true"]).abs()
    rows = pd.DataFrame(
        {
            "inside": (table["low"] <= table["true"]) & (table["true"] <= table["high"]),
            "error": error,
            "relative": (error / table["true"].abs()).where(table["true"] != 0.0),
            "near": (error <= NEAR * table["true"].abs()).where(table["true"] != 0.0),
            "half": 0.5 * (table["high"] - table["low"]),
        }
    )
    by_term = rows.groupby(level="term", sort=False)
    return pd.DataFrame(
        {
            "worlds": by_term["inside"].count(),
            "inside": by_term["inside"].mean(),
            "median error": by_term["error"].median(),
            "worst error": by_term["error"].max(),
            "median relative": by_term["relative"].median(),
            "near": by_term["near"].mean(),
            "half interval": by_term["half"].median(),
            "unit": table["unit"].groupby(level="term", sort=False).first(),
        }
    )


def format_coverage(table: pd.DataFrame) -> str:
    """Format the table, and the share of all intervals that hold the truth."""
    lines = [
        f"{'term':<16}{'worlds':>7}{'inside':>8}{'median error':>14}{'worst':>10}"
        f"{'of truth':>10}{f'in {NEAR:.0%}':>8}{'half interval':>15}  unit"
    ]
    for name, row in table.iterrows():
        lines.append(
            f"{name:<16}{row['worlds']:>7}{row['inside']:>8.0%}{row['median error']:>14.2g}"
            f"{row['worst error']:>10.2g}{row['median relative']:>10.2%}"
            f"{row['near']:>8.0%}{row['half interval']:>15.2g}  {row['unit']}"
        )
    inside = float(np.average(table["inside"], weights=table["worlds"]))
    return "\n".join([*lines, f"{'all':<16}{table['worlds'].sum():>7}{inside:>8.0%}"])


if __name__ == "__main__":
    main()
