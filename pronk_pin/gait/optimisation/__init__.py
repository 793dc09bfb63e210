"""The solver: a gait problem as a nonlinear program on the folded robot.

Comes in: a `GaitProblem`, perhaps a neighbour to begin with.
Goes out: a `GaitSolution`, or `GaitNotFound` with the demands that fight.
"""

from .ballistics import check_ballistics
from .guess import vertical_hop
from .optimize import GaitSolution, SolverState, fit_phase, optimize_gait, resampled

__all__ = [
    "GaitSolution",
    "SolverState",
    "check_ballistics",
    "fit_phase",
    "optimize_gait",
    "resampled",
    "vertical_hop",
]
