"""A controller that answers at every tick, in ten lines: `python examples/own_tick_controller.py`.

It sees an `Observation` and answers torques, or `SetPoints` for the motor drivers. Learning goes
with it as with any other: `law` and `flight_law` write the feedforward that it is shown.
"""

import sys
from dataclasses import dataclass, replace

import numpy as np

from pronk_pin.compare import Experiment, Schedule, run_experiment
from pronk_pin.control import ControllerSpec, Observation, SetPoints, load_controller
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import learning_curves


@dataclass(frozen=True)
class SoftLanding:
    """PD whose stiffness comes up over the first part of the stance; asked at 500 Hz."""

    kp: float = 60.0
    kd: float = 3.0
    soft: float = 0.3
    period: float = 0.002

    def command(self, observation: Observation) -> SetPoints:
        """Set points of m robots, which the drivers follow until the next ones."""
        share = np.clip(observation.phase[:, None] / self.soft, 0.3, 1.0)
        kp = self.kp * (share if observation.part == 0 else 1.0)
        reference = (observation.position, observation.velocity, observation.feedforward)
        return SetPoints(*reference, kp, self.kd)


soft = ControllerSpec("soft", tick_controller=SoftLanding())
learning = replace(load_controller("ilc"), name="soft+ilc", tick_controller=SoftLanding())

if __name__ == "__main__":
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", soft, learning),
        schedule=Schedule(baseline=2.0, learning=5.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/own-tick"]), workers=2)
    table = results.summary().query("metric == 'peak_error' and joint in ['thigh', 'calf']")
    print(table.pivot_table(index="controller", columns="joint", values="value").round(4))
    print({name: f"{time:.1f} us a tick" for name, time in results.control_times.items()})
    strides = {name: results.all_strides(controller=name) for name in ("pd", "soft", "soft+ilc")}
    save_figure(learning_curves(strides), results.folder / "picture.svg")
