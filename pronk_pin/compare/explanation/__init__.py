"""Identification: the learned torque decomposed into physical causes, with parameters."""

from .describe import describe, foreign, words
from .explain import Explanation, explain
from .mend import mended_gaits
from .shares import explained, share_table
from .terms import TERMS, Motion, Term

__all__ = [
    "TERMS",
    "Explanation",
    "Motion",
    "Term",
    "describe",
    "explain",
    "explained",
    "foreign",
    "mended_gaits",
    "share_table",
    "words",
]
