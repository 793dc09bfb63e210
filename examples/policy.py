"""A policy from a file of weights, in plain numpy: `python examples/policy.py [folder]`.

The network is tiny and clones the PD law: `fit` draws errors and rates, asks PD for the torques,
and solves for the last layer. A policy that was trained elsewhere goes the same way: its weights
into an `.npz`, its layers into `command`.
"""

import sys
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from pronk_pin.compare import Experiment, Schedule, run_experiment
from pronk_pin.control import ControllerSpec, Gains, Observation
from pronk_pin.viz import save_figure
from pronk_pin.viz.figures import errors_by_speed


@dataclass(frozen=True)
class Policy:
    """Torques from a network with one hidden layer, asked at every tick.

    Attributes:
        weights: File of the arrays `hidden` (24, h), `bias` (h,) and `out` (h, 12).
    """

    weights: str

    def command(self, observation: Observation) -> np.ndarray:
        """Motor torques of m robots [N m], shape (m, 12)."""
        hidden, bias, out = load(self.weights)
        error = observation.position - observation.joints
        rate = observation.velocity - observation.joint_rates
        return np.tanh(np.hstack([error, 0.02 * rate]) @ hidden + bias) @ out


@lru_cache
def load(path: str) -> tuple[np.ndarray, ...]:
    """The layers of a file of weights."""
    with np.load(path, allow_pickle=False) as file:
        return file["hidden"], file["bias"], file["out"]


def fit(path: Path, *, size: int = 400, samples: int = 20_000, seed: int = 0) -> Path:
    """Fit the network to the PD law of the paper, and write its weights."""
    rng, gains = np.random.default_rng(seed), Gains()
    error = 0.1 * rng.standard_normal((samples, 12))
    rate = 4.0 * rng.standard_normal((samples, 12))
    hidden = 0.5 * rng.standard_normal((24, size))
    bias = 0.5 * rng.standard_normal(size)
    features = np.tanh(np.hstack([error, 0.02 * rate]) @ hidden + bias)
    out = np.linalg.lstsq(features, gains.feedback(error, rate), rcond=1e-8)[0]
    np.savez(path, hidden=hidden, bias=bias, out=out)
    return path


if __name__ == "__main__":
    folder = Path(*(sys.argv[1:] or ["results/policy"]))
    folder.parent.mkdir(parents=True, exist_ok=True)
    weights = fit(folder.with_suffix(".weights.npz").absolute())
    policy = ControllerSpec("policy", tick_controller=Policy(str(weights)))
    experiment = Experiment(
        speeds=(0.0, 0.4),
        controllers=("pd", policy),
        schedule=Schedule(baseline=4.0, learning=0.5),
    )
    results = run_experiment(experiment, folder, workers=2)
    table = results.summary().query("metric == 'peak_error' and joint in ['thigh', 'calf']")
    print(table.pivot_table(index="controller", columns="joint", values="value").round(4))
    figure = errors_by_speed(results.summary(), scenario="nominal")
    save_figure(figure, folder / "picture.svg")
