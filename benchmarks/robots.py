"""Practice on every robot whose gaits are shipped: `python benchmarks/robots.py [folder]`.

Five speeds each, the nominal scenario, 20 s without learning and 20 s with it; the robot's gains,
motors and apex are those of its specification, or the A1's, scaled. Prints the table of
docs/laboratory.md; the folder keeps the simulations, so that it goes on where it was.
"""

import sys
from pathlib import Path

import pandas as pd

from pronk_pin.compare import Experiment, run_experiment
from pronk_pin.robot import ROBOTS, load_robot

CONTROLLERS = ("pd", "model", "model+timing", "ilc")


def row(name: str, summary: pd.DataFrame) -> list[str]:
    """A robot's row: how many stayed up, and the mean peaks, calf and thigh [mrad]."""
    up = summary[summary["metric"] == "upright"]
    peaks = summary[(summary["metric"] == "peak_error") & summary["joint"].isin(["calf", "thigh"])]
    means = 1e3 * peaks.pivot_table(index="controller", columns="joint", values="value")
    cells = [f"{means.loc[c, 'calf']:.1f}, {means.loc[c, 'thigh']:.1f}" for c in CONTROLLERS]
    gained = 1.0 - means.loc["ilc"] / means.loc["pd"]
    return [
        name,
        f"{load_robot(name).mass:.1f} kg",
        f"{int(up['value'].sum())} of {len(up)}",
        *cells,
        f"{gained['calf']:.0%}, {gained['thigh']:.0%}",
    ]


if __name__ == "__main__":
    folder = Path(*(sys.argv[1:] or ["results/robots"]))
    head = ["robot", "mass", "up", *CONTROLLERS, "practice cuts PD's by"]
    lines = [head, ["---"] * len(head)]
    for name in ROBOTS:
        experiment = Experiment(
            robot=name,
            speeds=(-0.2, 0.0, 0.2, 0.4, 0.6),
            controllers=CONTROLLERS,
        )
        lines.append(row(name, run_experiment(experiment, folder / name, workers=2).summary()))
    print("\n".join(f"| {' | '.join(cells)} |" for cells in lines))
