"""A result as tables and arrays: `python examples/results_in_pandas.py [folder]`.

`summary()` is one long table, a row a number; `dataset()` the labelled strides of all simulations,
of which what is asked for is read.
"""

import sys

from matplotlib.figure import Figure

from pronk_pin.compare import Experiment, Schedule, run_experiment

if __name__ == "__main__":
    experiment = Experiment(
        speeds=(-0.3, 0.0, 0.3),
        controllers=("pd", "ilc"),
        schedule=Schedule(baseline=2.0, learning=5.0),
    )
    results = run_experiment(experiment, *(sys.argv[1:] or ["results/pandas"]), workers=2)
    summary = results.summary()
    calf = summary.query("metric == 'peak_error' and joint == 'calf'")
    print(calf.pivot(index="speed", columns="controller", values="value").round(4))

    strides = results.dataset()  # controller x scenario x seed x speed x stride x ...
    nominal = strides.sel(scenario="nominal", seed=0)
    peaks = nominal["peak_error"].groupby("kind").mean()  # over the legs
    history = peaks.sel(kind="calf", controller="ilc").to_pandas()
    print(history.iloc[:, ::3].round(3).to_string())
    learned = nominal["feedforward"].sel(controller="ilc", part="stance")
    print(f"largest learned torque {float(abs(learned).max()):.1f} {learned.units}")

    figure = Figure(figsize=(6, 3), layout="constrained")
    axes = figure.subplots()
    history.T.plot(ax=axes, ylabel="peak error of the calf [rad]", ylim=(0, None))
    figure.savefig(results.folder / "picture.svg")
