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
# # What did it learn?
#
# The A1 practises in a world that its model does not know: rotors and friction, two kilograms on
# its back, and weak motors. What it has learned is a torque; taken apart, it says what the model
# lacks. The page is a notebook, `examples/notebooks/what_did_it_learn.py`, and was run when this
# site was built.

# %%
from pathlib import Path

import numpy as np
from IPython.display import SVG

from pronk_pin.compare import Experiment, Schedule, describe, explain, load_scenario, run_experiment
from pronk_pin.control import model_feedforward
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import learned_minus_model, write_explanation_figure

# %%
experiment = Experiment(
    speeds=(-0.3, 0.1, 0.5),
    controllers=("pd", "model", "ilc"),
    scenarios=(load_scenario("payload=2") + "weak-motors=0.9",),
    schedule=Schedule(baseline=3.0, learning=10.0),
)
results = run_experiment(experiment, "result", workers=1, progress=False)
strides = results.all_strides(controller="ilc")
peaks = strides["peak_error"].groupby("kind").mean()
print(peaks.sel(kind="calf").isel(stride=slice(None, 36, 5)).to_pandas().round(3).to_string())

# %% [markdown]
# ## Learned, less what the model would have commanded
#
# If the model were right, learning would end at its torques.

# %%
figure = learned_minus_model(strides, results.all_strides(controller="model"))
SVG(filename=save_figure(figure, Path("difference.svg")))

# %% [markdown]
# ## Why
#
# Joint angles, torques, the trunk's motion and the contacts of the last strides go into the
# equations of motion; rotors, friction, load, torque constant and delay are fitted, each with an
# interval from a bootstrap over strides. The simulator's own values stand beside.

# %%
explanation = explain(strides, draws=100, rng=np.random.default_rng(0))
print(describe(explanation))

# %%
SVG(filename=write_explanation_figure(explanation, Path("explanation.svg"), speed=0.5))

# %% [markdown]
# ## The mended model
#
# With what was found the model computes torques that it could not before: those of a gait, by the
# datasheet and by the mended robot.

# %%
gait = results.experiment.planned_at([0.5])[0]
before, after = (
    model_feedforward(model, [gait])[0]
    for model in (results.experiment.model, explanation.identified)
)
print("the mended robot weighs", round(explanation.identified.mass, 2), "kg in place of", end=" ")
print(round(results.experiment.model.mass, 2), "kg; its torques differ by up to", end=" ")
print(round(float(np.abs(after - before).max()), 1), "N m")
