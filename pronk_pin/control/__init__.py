"""What the robot is told to do: feedback, feedforward and learning, one tape a phase."""

from .controller import CONTROLLERS, Controller, ControllerSpec, load_controller
from .filters import ZeroPhaseFilter
from .learning import LearningLaw, PaperILC, PDTypeILC, StrideSelection
from .record import SAMPLES, PhaseLog, StrideRecord, phase_grid, resample
from .regulation import LegAngleRegulator
from .tape import Gains, Player, Tape
from .torque_library import TorqueLibrary

__all__ = [
    "CONTROLLERS",
    "SAMPLES",
    "Controller",
    "ControllerSpec",
    "Gains",
    "LearningLaw",
    "LegAngleRegulator",
    "PDTypeILC",
    "PaperILC",
    "PhaseLog",
    "Player",
    "StrideRecord",
    "StrideSelection",
    "Tape",
    "TorqueLibrary",
    "ZeroPhaseFilter",
    "load_controller",
    "phase_grid",
    "resample",
]
