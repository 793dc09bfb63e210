"""The league of controllers, at equal gains and at each one's best: `python benchmarks/league.py`.

Every controller plays with the paper's gains and with multiples of them (stiffness times m, damping
times the root of m; computed torque with natural frequencies instead). Its best gains are those
with the least mean peak in calf and thigh, from the true contact on, in the nominal scenario with
the motors' delay in question; it is judged in others with them. A robot that falls, or that grows
worse as it learns, rules the gains out. Prints two tables for docs/learning.md; the folder
(results/league) is gone on with.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from pronk_pin.compare import Experiment, Results, Schedule, run_experiment
from pronk_pin.control import ComputedTorque, ControllerSpec, load_controller

SPEEDS = (-0.4, 0.0, 0.4, 0.8)
MULTIPLES = (1.0, 2.0, 4.0, 8.0)
PLAYED = (
    *("pd", "model", "model+timing", "model+rotors", "identified", "identified+gait"),
    *("ilc-paper", "ilc-stance", "ilc", "ilc+rotors", "library"),
)
TICKS = {"computed-torque+rotors": (100.0, 60.0, 140.0), "whole-body-qp+rotors": (100.0, 60.0)}
"""Those that are asked at every tick, with their natural frequencies [1/s], the usual one first."""
USUAL_ONLY = ("model+eso",)
"""Whose gains are not changed."""
NO_DELAY = ("nominal", "payload", "weak-motors", "ideal")
DELAY = ("delay", "payload+delay")
SCENARIOS = (*NO_DELAY, *DELAY)
"""The first of either is the one in which gains are chosen."""


def variants(name: str) -> dict[str, ControllerSpec]:
    """A controller with all gains, by what they are called; the first has the usual ones."""
    spec = load_controller(name)
    law = spec.tick_controller
    if isinstance(law, ComputedTorque):
        return {
            f"omega {value:g}": replace(
                spec,
                name=name if value == law.omega else f"{name}_{value:g}",
                tick_controller=replace(law, omega=value),
            )
            for value in TICKS[name]
        }
    if name in USUAL_ONLY or (spec.source == "identified" and not spec.timing):
        return {"x1": spec}
    return {
        f"x{m:g}": replace(
            spec,
            name=name if m == 1.0 else f"{name}_x{m:g}",
            stiffness=m,
        )
        for m in MULTIPLES
    }


class League:
    """What came out, by controller, gains and scenario.

    Args:
        results: The results.
    """

    def __init__(self, results: Results) -> None:
        table = results.summary()
        self._values = table.groupby(["controller", "scenario", "metric", "joint"])["value"].mean()
        self._worst = table.groupby(["controller", "scenario", "metric", "joint"])["value"].min()
        self._times = results.control_times

    def peak(self, controller: str, scenario: str, joint: str, metric: str = "peak_error") -> float:
        """Mean peak over the speeds [rad]; NaN where a robot fell."""
        if self._worst[controller, scenario, "upright", "-"] != 1.0:
            return math.nan
        return float(self._values[controller, scenario, metric, joint])

    def diverges(self, controller: str, scenario: str) -> bool:
        """Whether a robot grew worse as it learned."""
        key = (controller, scenario, "diverging", "-")
        return bool(key in self._values.index and self._values[key] > 0.0)

    def sum(self, controller: str, scenario: str) -> float:
        """Calf and thigh together [rad], by which gains are chosen; NaN rules them out."""
        if self.diverges(controller, scenario):
            return math.nan
        return sum(self.peak(controller, scenario, joint) for joint in ("calf", "thigh"))

    def cell(self, controller: str, scenario: str) -> str:
        """Calf and thigh in milliradians."""
        values = [1e3 * self.peak(controller, scenario, joint) for joint in ("calf", "thigh")]
        if np.isnan(values).any():
            return "fell"
        grows = ", grows" if self.diverges(controller, scenario) else ""
        return (
            "/".join(f"{value:.1f}" if value < 9.95 else f"{value:.0f}" for value in values) + grows
        )

    def cost(self, controller: str) -> str:
        """Time that it takes a robot and tick over that of `pd`."""
        return f"{self._times[controller] / self._times['pd']:.1f}"

    def best(self, specs: dict[str, ControllerSpec], scenario: str) -> tuple[str, str]:
        """The best gains in a scenario, and the controller with them."""
        sums = {gains: self.sum(spec.name, scenario) for gains, spec in specs.items()}
        series = pd.Series(sums).dropna()
        if series.empty:
            return "none", next(iter(specs.values())).name
        return str(series.idxmin()), specs[str(series.idxmin())].name


def main() -> None:
    """Run, and print the tables."""
    controllers = {name: variants(name) for name in (*PLAYED, *USUAL_ONLY, *TICKS)}
    experiment = Experiment(
        speeds=SPEEDS,
        controllers=tuple(spec for specs in controllers.values() for spec in specs.values()),
        scenarios=SCENARIOS,
        schedule=Schedule(baseline=4.0, learning=26.0),
    )
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "results/league")
    league = League(run_experiment(experiment, folder))
    print(f"| controller | knows | adapts | time / `pd` | {' | '.join(SCENARIOS)} |")
    print("|---" * (4 + len(SCENARIOS)) + "|")
    for name in controllers:
        spec = load_controller(name)
        cells = [league.cell(name, scenario) for scenario in SCENARIOS]
        knows = ", ".join(spec.knows) or "nothing"
        adapts = "torque, timing" if any(spec.laws) and spec.timing else ""
        adapts = adapts or ("torque" if any(spec.laws) else "timing" if spec.timing else "nothing")
        print(f"| `{name}` | {knows} | {adapts} | {league.cost(name)} | {' | '.join(cells)} |")
    print()
    print(f"| controller | gains | {' | '.join(NO_DELAY)} | with delay | {' | '.join(DELAY)} |")
    print("|---" * (3 + len(SCENARIOS)) + "|")
    for name, specs in controllers.items():
        row = []
        for scenarios in (NO_DELAY, DELAY):
            gains, best = league.best(specs, scenarios[0])
            row += [gains, *(league.cell(best, scenario) for scenario in scenarios)]
        print(f"| `{name}` | {' | '.join(row)} |")


if __name__ == "__main__":
    main()
