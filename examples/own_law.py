"""A learning law of one's own, beside ours: `python examples/own_law.py [folder]`.

A law is a function of a stride's record. Whoever has it in a package of their own compares it from
the shell, too: `pronk-pin compare --controllers pd ilc my_package.laws:controller`.
"""

import sys
from dataclasses import dataclass

import numpy as np

from pronk_pin.compare import Experiment, Schedule, run_experiment
from pronk_pin.control import ControllerSpec, StrideRecord
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import learning_curves


@dataclass(frozen=True)
class FeedbackLearning:
    """Next torques are the last ones and a share of what the feedback had to add [N m]."""

    share: float = 0.4

    def update(self, record: StrideRecord) -> np.ndarray:
        """From a stride's record to the next feedforward, shape (robots, samples, 12)."""
        return 0.98 * record.feedforward + self.share * record.feedback


mine = ControllerSpec("mine", law=FeedbackLearning())

if __name__ == "__main__":
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", "ilc-stance", mine),
        schedule=Schedule(baseline=2.0, learning=6.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/own-law"]), workers=2)
    table = results.summary().query("metric == 'peak_error' and joint in ['thigh', 'calf']")
    print(table.pivot_table(index="controller", columns="joint", values="value").round(4))
    strides = {name: results.all_strides(controller=name) for name in ("pd", "ilc-stance", "mine")}
    save_figure(learning_curves(strides), results.folder / "picture.svg")
