"""What asking a controller at every tick costs: `python benchmarks/tick_controllers.py`.

In one run, interleaved: the tick-by-tick loop of PD, as noise and turning trunks need it, and tick
controllers that are nothing but the same PD, as torques and as set points. Times are the process's
own, as the machine may be shared; the motion is the same, or it says so.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from pronk_pin import load_robot
from pronk_pin.compare import Schedule, Simulation, load_scenario
from pronk_pin.control import ControllerSpec, Gains, Observation, SetPoints
from pronk_pin.gait import load_library

SECONDS = 3.0
CASES = (1, 14, 56)
"""Robots."""
REPEATS = 5
GAINS = Gains()


@dataclass(frozen=True)
class Torques:
    """PD that answers torques."""

    def command(self, observation: Observation) -> np.ndarray:
        feedback = GAINS.proportional * (observation.position - observation.joints)
        feedback += GAINS.derivative * (observation.velocity - observation.joint_rates)
        return observation.feedforward + feedback


@dataclass(frozen=True)
class Drivers:
    """PD in the motor drivers."""

    def command(self, observation: Observation) -> SetPoints:
        reference = (observation.position, observation.velocity, observation.feedforward)
        return SetPoints(*reference, GAINS.proportional, GAINS.derivative)


SPECS = {
    "PD": ControllerSpec("pd"),
    "torques": ControllerSpec("torques", tick_controller=Torques()),
    "set points": ControllerSpec("set-points", tick_controller=Drivers()),
}


def play(n: int, spec: ControllerSpec) -> tuple[float, np.ndarray]:
    """Time that n robots take, and their peak errors [s, rad]."""
    robot, library = load_robot("a1"), load_library("a1")
    simulation = Simulation(
        robot,
        [library.at(speed) for speed in np.linspace(-0.5, 0.8, n)],
        spec,
        load_scenario("nominal"),
        schedule=Schedule(startup=0.1, baseline=SECONDS, learning=0.0),
        rng=np.random.default_rng(0),
        chunked=False,
    )
    began = time.process_time()
    log = simulation.run()
    return time.process_time() - began, log["peak_error"]


def main() -> None:
    """Print times a robot and tick, and their ratios to the loop without a tick controller."""
    print(f"{'robots':>6}" + "".join(f"{name:>14}" for name in SPECS) + "   us a robot and tick")
    for n in CASES:
        runs = [{name: play(n, spec) for name, spec in SPECS.items()} for _ in range(REPEATS)]
        ticks = n * SECONDS / 0.001
        cells = []
        for name in SPECS:
            taken = np.median([run[name][0] for run in runs])
            ratio = np.median([run[name][0] / run["PD"][0] for run in runs])
            cells.append(f"{1e6 * taken / ticks:.1f} ({ratio:.2f})")
        print(f"{n:>6}" + "".join(f"{cell:>14}" for cell in cells), flush=True)
        for name, (_, peaks) in runs[0].items():
            apart = np.nanmax(abs(peaks - runs[0]["PD"][1]))
            if not apart < 1e-6:
                print(f"       {name}: peak errors differ by up to {apart:.1e} rad")


if __name__ == "__main__":
    main()
