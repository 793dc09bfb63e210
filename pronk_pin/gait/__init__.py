"""What the robot should do: optimal gaits, their Bezier form, and the library."""

from .audit import Audit, Check, audit
from .build import SPEEDS, build_library, describe_gait, describe_library
from .gait import Gait, GaitPhase, Motion
from .library import GaitLibrary, load_library
from .optimize import GaitSolution, optimize_gait
from .problem import GaitProblem

__all__ = [
    "SPEEDS",
    "Audit",
    "Check",
    "Gait",
    "GaitLibrary",
    "GaitPhase",
    "GaitProblem",
    "GaitSolution",
    "Motion",
    "audit",
    "build_library",
    "describe_gait",
    "describe_library",
    "load_library",
    "optimize_gait",
]
