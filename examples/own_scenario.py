"""A scenario of one's own, alone and with known mismatches: `python examples/own_scenario.py`."""

import sys

from pronk_pin.compare import Experiment, Scenario, Schedule, run_experiment

warm = Scenario("warm", armature=0.009, damping=0.05, coulomb=0.1, torque_constant=0.95)

if __name__ == "__main__":
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", "ilc"),
        scenarios=("nominal", warm, warm + "payload=1.5", "rough" + warm),
        schedule=Schedule(baseline=2.0, learning=6.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/own-scenario"]), workers=2)
    table = results.summary().query("metric == 'peak_error' and joint == 'calf'")
    print(table.pivot_table(index="scenario", columns="controller", values="value").round(4))
