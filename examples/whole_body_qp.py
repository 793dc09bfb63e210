"""A whole-body QP against practice: `python examples/whole_body_qp.py [folder]`.

The QP knows the robot's masses and rotors, and feels its feet; practice knows nothing. Both play
gaits that are planned with the rotors. With motors 4 ms late the QP needs to be more cautious.
"""

import sys
from dataclasses import replace

from pronk_pin.compare import Experiment, Schedule, run_experiment
from pronk_pin.compare.report import answer
from pronk_pin.control import WholeBodyQP, load_controller
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import heat_map

cautious = replace(
    load_controller("whole-body-qp+rotors"),
    name="qp-cautious",
    tick_controller=WholeBodyQP(omega=60.0),
)

if __name__ == "__main__":
    experiment = Experiment(
        speeds=(0.3,),
        controllers=("pd", "ilc+rotors", "whole-body-qp+rotors", cautious),
        scenarios=("nominal", "delay"),
        schedule=Schedule(baseline=2.0, learning=5.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/whole-body-qp"]), workers=2)
    table = results.summary().query("metric == 'peak_error' and joint == 'calf'")
    print(table.pivot_table(index="controller", columns="scenario", values="value").round(4))
    print({name: f"{time:.0f} us a tick" for name, time in results.control_times.items()})
    save_figure(heat_map(answer(results.summary())), results.folder / "picture.svg")
