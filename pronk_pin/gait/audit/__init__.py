"""The judge of solutions, by other means than the solver's.

Comes in: a `GaitSolution`.
Goes out: an `Audit`, and what each Bezier order loses.
"""

from .audit import BezierLoss, audit, bezier_orders

__all__ = [
    "BezierLoss",
    "audit",
    "bezier_orders",
]
