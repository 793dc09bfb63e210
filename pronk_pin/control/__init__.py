"""What the robot is told to do: feedback, feedforward and learning, one tape a phase."""

from .contacts import ContactDetector, StanceContact
from .controller import CONTROLLERS, Controller, ControllerSpec, load_controller
from .filters import ZeroPhaseFilter
from .learning import (
    SKIPPED,
    CurrentIterationILC,
    LearningLaw,
    ModelBasedILC,
    NormOptimalILC,
    PaperILC,
    PDTypeILC,
    PlantInversionILC,
    StrideSelection,
    anti_windup,
)
from .lifted import LiftedModel
from .linearise import Settings, lifted_model
from .record import PARTS, SAMPLES, PhaseLog, StrideRecord, phase_grid, resample
from .regulation import LegAngleRegulator
from .tape import Gains, Tape, clip_torque
from .torque_library import TorqueLibrary

__all__ = [
    "CONTROLLERS",
    "PARTS",
    "SAMPLES",
    "SKIPPED",
    "ContactDetector",
    "Controller",
    "ControllerSpec",
    "CurrentIterationILC",
    "Gains",
    "LearningLaw",
    "LegAngleRegulator",
    "LiftedModel",
    "ModelBasedILC",
    "NormOptimalILC",
    "PDTypeILC",
    "PaperILC",
    "PhaseLog",
    "PlantInversionILC",
    "Settings",
    "StanceContact",
    "StrideRecord",
    "StrideSelection",
    "Tape",
    "TorqueLibrary",
    "ZeroPhaseFilter",
    "anti_windup",
    "clip_torque",
    "lifted_model",
    "load_controller",
    "phase_grid",
    "resample",
]
