"""Motor torques and contact forces for a given motion: eq. (2) solved for tau and lambda.

Comes in: a `Robot`, a motion or a wanted wrench, which feet stand, friction, a planar constraint.
Goes out: motor torques, contact forces, and whether they are feasible.
"""

from .distribution import distribute_wrench, wrench_matrix
from .qp import cone_sides
from .solve import (
    CONSTRAINT_COORDINATES,
    PLANAR_CONSTRAINT,
    Feedforward,
    InverseDynamics,
    feedforward,
    inverse_dynamics,
)

__all__ = [
    "CONSTRAINT_COORDINATES",
    "PLANAR_CONSTRAINT",
    "Feedforward",
    "InverseDynamics",
    "cone_sides",
    "distribute_wrench",
    "feedforward",
    "inverse_dynamics",
    "wrench_matrix",
]
