"""Cost of torques that are computed at every tick: `python benchmarks/torque_control.py`.

Time a robot and tick of whole simulations, 14 robots, beside that of `pd`, whose tapes are played.
"""

from __future__ import annotations

import time

import numpy as np

from pronk_pin import load_robot
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import load_controller
from pronk_pin.gait import load_library

CONTROLLERS = ("pd", "computed-torque", "whole-body-qp")
ROBOTS, SECONDS = 14, 4.0


def cost(controller: str) -> float:
    """Time a robot and tick [us]."""
    library = load_library("a1")
    simulation = Simulation(
        load_robot("a1"),
        [library.at(speed) for speed in np.linspace(-0.5, 0.8, ROBOTS)],
        load_controller(controller),
        load_scenario("nominal"),
        schedule=Schedule(startup=0.1, baseline=SECONDS, learning=0.0),
        rng=np.random.default_rng(0),
    )
    began = time.perf_counter()
    log = simulation.run()
    return 1e9 * (time.perf_counter() - began) / float(np.nansum(log["duration"]) / 1e-3) / 1e3


def main() -> None:
    """Print a table."""
    costs = {name: cost(name) for name in CONTROLLERS}
    print(f"{'controller':<20} {'us/tick':>8} {'over pd':>8}")
    for name, value in costs.items():
        print(f"{name:<20} {value:>8.1f} {value / costs['pd']:>8.1f}")


if __name__ == "__main__":
    main()
