"""Parity of two robot models: masses, joints and motors side by side, and M, h and J.

Comes in: two models, Pinocchio's or MuJoCo's.
Goes out: a `Parity`: a table of what is the same and what is not.
"""

from .models import ROUND_OFF, SIX_DIGITS, Model, Parity, compare_models
from .table import Row, format_value, merged

__all__ = [
    "ROUND_OFF",
    "SIX_DIGITS",
    "Model",
    "Parity",
    "Row",
    "compare_models",
    "format_value",
    "merged",
]
