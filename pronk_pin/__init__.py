"""When a legged robot repeats a motion, does practice beat the model?"""

from .errors import PronkError
from .parameters import ModelParameters
from .robot import Robot, RobotSpec, load_robot

__all__ = ["ModelParameters", "PronkError", "Robot", "RobotSpec", "load_robot"]
__version__ = "0.1.0"
