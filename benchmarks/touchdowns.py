"""How well touchdowns are felt, by the load and by the encoders: `python benchmarks/touchdowns.py`.

Two rows a world: mean peaks in calf and thigh over the last 30 strides of `ilc`, in the worst of
some speeds [rad], from the true contact on and as felt. `--all` takes all speeds of the library.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from pronk_pin import load_robot
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import load_controller
from pronk_pin.gait import load_library

SPEEDS = (-0.3, 0.3, 0.8)
SCENARIOS = (
    *("nominal", "late-touchdown", "touchdown-jitter"),
    *("noise", "noise+late-touchdown", "noise+touchdown-jitter"),
    *("soft-ground", "soft-ground+late-touchdown", "soft-ground+touchdown-jitter"),
)


def main() -> None:
    robot, library, both = load_robot("a1"), load_library("a1"), load_controller("ilc")
    load = replace(both, contact=replace(both.contact, impact=None))
    speeds = library.speeds if "--all" in sys.argv[1:] else SPEEDS
    gaits = [library.at(float(speed)) for speed in speeds]
    print("| world | touchdown by | calf | thigh | calf, felt | thigh, felt |")
    print("|---|---|---|---|---|---|")
    for name in SCENARIOS:
        for by, spec in (("load", load), ("load or impact", both)):
            log = Simulation(
                robot,
                gaits,
                spec,
                load_scenario(name),
                schedule=Schedule(baseline=2.0, learning=20.0),
                rng=np.random.default_rng(0),
            ).run()
            worst = []
            for peak in ("peak_error", "felt_peak_error"):
                last = [log[peak][k, n - 30 : n].mean(axis=0) for k, n in enumerate(log.count)]
                legs = np.reshape(last, (-1, 4, 3)).mean(axis=1).max(axis=0)
                worst += [f"{legs[joint]:.4f}" for joint in (2, 1)]
            print(f"| `{name}` | {by} | {' | '.join(worst)} |", flush=True)


if __name__ == "__main__":
    main()
