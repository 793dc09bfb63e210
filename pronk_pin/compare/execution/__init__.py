"""Running an experiment: its cells side by side in any executor, and taken up where they stopped.

Comes in: an `Experiment`, a folder, and who is to simulate.
Goes out: the `Results` of all its cells.
"""

from .run import run_experiment

__all__ = ["run_experiment"]
