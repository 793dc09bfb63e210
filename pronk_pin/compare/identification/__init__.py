"""Identification: the learned torque decomposed into physical causes, with parameters.

Comes in: strides with their ticks.
Goes out: an `Explanation`: parameters with intervals, shares by cause, an identified `Robot`.
"""

from .explanation import DRAWS, IMU_NOISE, Explanation, check_learner, explain
from .findings import describe, foreign, remarks
from .model_terms import TERMS, Motion, Term
from .shares import discrepancy, explained, share_table

__all__ = [
    "DRAWS",
    "IMU_NOISE",
    "TERMS",
    "Explanation",
    "Motion",
    "Term",
    "check_learner",
    "describe",
    "discrepancy",
    "explain",
    "explained",
    "foreign",
    "remarks",
    "share_table",
]
