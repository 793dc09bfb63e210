"""What a learning law will do, before any stride is made: a model's strides and linear algebra.

Comes in: a `Robot`, a `Gait`, a `LearningLaw`.
Goes out: strides of the planar robot, the lifted model, convergence, a rehearsed learning.
"""

from .analysis import Analysis, analyze, predict
from .linearisation import lifted_model
from .planar_strides import PlanarStrides, StrideSettings
from .rehearsal import rehearse

__all__ = [
    "Analysis",
    "PlanarStrides",
    "StrideSettings",
    "analyze",
    "lifted_model",
    "predict",
    "rehearse",
]
