"""When a legged robot repeats a motion, does practice beat the model?"""

import importlib
from typing import TYPE_CHECKING

from .errors import PronkError

if TYPE_CHECKING:
    from .robot import ModelParameters, Robot, RobotSpec, load_robot

__all__ = ["ModelParameters", "PronkError", "Robot", "RobotSpec", "load_robot"]
__version__ = "0.2.0"

_LATER = tuple(name for name in __all__ if name != "PronkError")
"""Names of `robot`, which is imported when they are first asked for (PEP 562): a worker process
watches its parent before it imports NumPy, Pinocchio and MuJoCo, which takes seconds."""

if not TYPE_CHECKING:  # or every name would seem to exist

    def __getattr__(name: str) -> object:
        if name not in _LATER:
            raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
        found = getattr(importlib.import_module(".robot", __name__), name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})
