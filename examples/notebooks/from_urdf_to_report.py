# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From URDF to report
#
# A robot that is not shipped, ANYmal B, from its URDF to the report of a comparison: what is known
# of it, two gaits, and whether practice beats its model. The page is a notebook,
# `examples/notebooks/from_urdf_to_report.py` (`jupytext --to notebook` makes an `.ipynb` of it),
# and was run when this site was built.

# %%
from pathlib import Path

from IPython.display import SVG

from pronk_pin.compare import Experiment, Schedule, run_experiment
from pronk_pin.compare.report import format_tables
from pronk_pin.gait import build_library
from pronk_pin.robot import feedback_gains, load_robot
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import errors_by_speed, write_gait_figures
from pronk_pin.viz.report import write_report

# %% [markdown]
# ## What is what in the URDF
#
# A specification names links and joints. What is not in it (gains, apex, rotors, friction) is
# scaled from the A1.

# %%
Path("anymal_b.toml").write_text("""
name = "anymal_b"
urdf = "anymal_b_simple_description/robots/anymal.urdf"
base_link = "base"
legs = ["LF", "LH", "RF", "RH"]
joints = ["HAA", "HFE", "KFE"]
joint_pattern = "{leg}_{joint}"
foot_pattern = "{leg}_FOOT"
standing = [0, 0.9, -1.8, 0, -0.9, 1.8, 0, 0.9, -1.8, 0, -0.9, 1.8]
""")
robot = load_robot("anymal_b.toml")
print(f"{robot.name}: {robot.mass:.1f} kg, gains kp, kd:", *feedback_gains(robot))

# %% [markdown]
# ## Two gaits
#
# Each is an optimal control problem, solved by IPOPT and audited: every constraint, the residual
# of the whole robot, and what an integration of its torques does.

# %%
gaits = build_library(robot, (0.0, 0.3), workers=1, progress=False)
print(gaits.audit[0].table())

# %%
figures = write_gait_figures(gaits, Path("gaits"), suffix="svg", robot=robot)
SVG(filename=figures[-1])

# %% [markdown]
# ## Does practice beat the model?

# %%
experiment = Experiment(
    robot=robot.spec,
    gaits=gaits,
    controllers=("pd", "model", "ilc"),
    schedule=Schedule(baseline=2.0, learning=8.0),
)
results = run_experiment(experiment, "anymal", workers=1, progress=False)
print(format_tables(results.summary(), scenario="nominal"))

# %%
figure = errors_by_speed(results.summary(), scenario="nominal")
SVG(filename=save_figure(figure, Path("errors.svg")))

# %% [markdown]
# The report is one page with all of it: tables, figures, how to read them, and where the numbers
# are from.

# %%
print(write_report(results).name, [path.name for path in sorted(results.folder.iterdir())])
