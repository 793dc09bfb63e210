"""Gaits: optimal periodic motions, their Bezier form, and the gait library.

Comes in: a `Robot`, a speed, an apex and a contact sequence (`GaitProblem`).
Goes out: a `GaitSolution`, its `Audit`, and a `Gait` in a `GaitLibrary`.
"""

from .audit import BezierLoss, audit, bezier_orders
from .build import build_library
from .checks import Audit, Check
from .describe import describe_gait, describe_library
from .gait import Gait, GaitPhase, Motion, joint_references, known_gaits
from .library import GaitLibrary, load_library, shipped_libraries
from .optimisation import GaitSolution, SolverState, optimize_gait, vertical_hop
from .problem import BOUND, PRONK, ContactPhase, GaitProblem
from .replan import replan
from .residual import GaitResidual, gait_residual
from .style import SPEEDS, STYLES, Style, gait_problem, known_base, load_style, number_range

__all__ = [
    "BOUND",
    "PRONK",
    "SPEEDS",
    "STYLES",
    "Audit",
    "BezierLoss",
    "Check",
    "ContactPhase",
    "Gait",
    "GaitLibrary",
    "GaitPhase",
    "GaitProblem",
    "GaitResidual",
    "GaitSolution",
    "Motion",
    "SolverState",
    "Style",
    "audit",
    "bezier_orders",
    "build_library",
    "describe_gait",
    "describe_library",
    "gait_problem",
    "gait_residual",
    "joint_references",
    "known_base",
    "known_gaits",
    "load_library",
    "load_style",
    "number_range",
    "optimize_gait",
    "replan",
    "shipped_libraries",
    "vertical_hop",
]
