"""Motor torques and contact forces for a given motion: eq. (2) solved for tau and lambda.

Comes in: a `Robot`, a motion or a wanted wrench, which feet stand, friction, a guide.
Goes out: motor torques, contact forces, and whether they are feasible.
"""

from .distribution import distribute_wrench, wrench_matrix
from .solve import (
    GUIDE_COORDINATES,
    SAGITTAL_GUIDE,
    Feedforward,
    InverseDynamics,
    feedforward,
    inverse_dynamics,
)

__all__ = [
    "GUIDE_COORDINATES",
    "SAGITTAL_GUIDE",
    "Feedforward",
    "InverseDynamics",
    "distribute_wrench",
    "feedforward",
    "inverse_dynamics",
    "wrench_matrix",
]
