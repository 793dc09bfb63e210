"""A robot of one's own, from its URDF to the report: `python examples/own_robot.py [folder]`."""

import sys
from pathlib import Path

from pronk_pin.compare import Experiment, Schedule, run_experiment
from pronk_pin.gait import build_library
from pronk_pin.robot import feedback_gains, load_robot, motor_constants
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import still

SPECIFICATION = """
name = "anymal_b"
urdf = "anymal_b_simple_description/robots/anymal.urdf"  # or one beside this file
base_link = "base"
legs = ["LF", "LH", "RF", "RH"]
joints = ["HAA", "HFE", "KFE"]
joint_pattern = "{leg}_{joint}"
foot_pattern = "{leg}_FOOT"
standing = [0, 0.9, -1.8, 0, -0.9, 1.8, 0, 0.9, -1.8, 0, -0.9, 1.8]
# Scaled from the A1 where they are not given: kp, kd, apex, rotors, damping, coulomb.
"""

if __name__ == "__main__":
    folder = Path(*(sys.argv[1:] or ["results/own-robot"]))
    file = folder.with_name(f"{folder.name}-anymal_b.toml")
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(SPECIFICATION)
    robot = load_robot(file)
    kp, kd = feedback_gains(robot)
    print(
        f"{robot.name}: {robot.mass:.1f} kg, kp {kp}, kd {kd}, rotors {motor_constants(robot)[0]}"
    )

    gaits = build_library(robot, (0.0, 0.3), workers=2, progress=False)
    print(gaits)
    experiment = Experiment(
        robot=robot.spec,
        gaits=gaits,
        controllers=("pd", "model", "ilc"),
        schedule=Schedule(baseline=2.0, learning=8.0),
    )
    results = run_experiment(experiment, folder, workers=2)
    table = results.summary()
    table = table[table["metric"] == "peak_error"]
    print(table.pivot_table(index="joint", columns="controller", values="value").round(4))
    figure = still(results.all_strides(controller="ilc"), robot, speed=0.3)
    save_figure(figure, folder / "picture.svg")
