"""What answers after a stride: laws from one stride's record to the next one's feedforward.

Comes in: a `StrideRecord`, and a `LiftedModel` for laws that need one.
Goes out: the next stride's feedforward, and torque libraries of what was learned.
"""

from .condition_estimate import FIRST_STRIDES, ConditionEstimate
from .guard import GuardState, LearningGuard, Memory
from .laws import (
    FLIGHT_LAW,
    SKIPPED,
    CurrentIterationILC,
    LawContext,
    LearningLaw,
    PaperILC,
    PDTypeILC,
    StrideSelection,
    anti_windup,
    bound,
    delivered,
    known_law,
    learned_by,
)
from .lifted import LiftedModel
from .model_based import ModelBasedILC, NormOptimalILC, PlantInversionILC
from .symmetry import symmetric
from .torque_library import InitialFeedforward, TorqueLibrary

__all__ = [
    "FIRST_STRIDES",
    "FLIGHT_LAW",
    "SKIPPED",
    "ConditionEstimate",
    "CurrentIterationILC",
    "GuardState",
    "InitialFeedforward",
    "LawContext",
    "LearningGuard",
    "LearningLaw",
    "LiftedModel",
    "Memory",
    "ModelBasedILC",
    "NormOptimalILC",
    "PDTypeILC",
    "PaperILC",
    "PlantInversionILC",
    "StrideSelection",
    "TorqueLibrary",
    "anti_windup",
    "bound",
    "delivered",
    "known_law",
    "learned_by",
    "symmetric",
]
