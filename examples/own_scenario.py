"""A scenario and a metric of one's own: `python examples/own_scenario.py [folder]`."""

import sys

import numpy as np
import xarray as xr

from pronk_pin.compare import Experiment, Metric, Scenario, Schedule, run_experiment
from pronk_pin.compare.report import answer
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import heat_map

warm = Scenario("warm", armature=0.009, damping=0.05, coulomb=0.1, torque_constant=0.95)


def hardest_landing(strides: xr.Dataset) -> np.ndarray:
    """Largest force on a foot in the last strides [N], one for each speed."""
    return strides["tick_force"].sel(direction="z").max(("last", "part", "tick", "foot")).values


if __name__ == "__main__":
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", "ilc"),
        scenarios=("nominal", warm, warm + "payload=1.5"),
        metrics=(Metric("hardest_landing", "N", hardest_landing),),
        schedule=Schedule(baseline=2.0, learning=6.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/own-scenario"]), workers=2)
    table = results.summary().query("joint == 'calf' and metric == 'peak_error' or joint == '-'")
    table = table[table["metric"].isin(["peak_error", "hardest_landing"])]
    keys = ["metric", "scenario"]
    print(table.pivot_table(index=keys, columns="controller", values="value").round(4))
    save_figure(heat_map(answer(results.summary())), results.folder / "picture.svg")
