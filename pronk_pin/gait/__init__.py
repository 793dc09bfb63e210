"""What the robot should do: optimal gaits, their Bezier form, and the library."""

from .gait import Gait, GaitPhase, Motion
from .library import GaitLibrary, load_library

__all__ = ["Gait", "GaitLibrary", "GaitPhase", "Motion", "load_library"]
