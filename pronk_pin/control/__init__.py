"""Control: feedback, feedforward and iterative learning, one tape of commands a phase."""

from ..base import BASES
from .attitude import AttitudeRegulator, attitude_angle, attitude_error, roll_pitch_yaw
from .balance import Balance, BalanceSpec
from .contacts import ContactDetector, StanceContact, TouchdownDetector
from .controller import Controller
from .controller_spec import CONTROLLERS, ControllerSpec, load_controller
from .estimation import AttitudeEstimator, AttitudeFilter, TrunkKnown
from .feedforward import model_feedforward
from .filters import ZeroPhaseFilter
from .guided_strides import GuidedStrides, Settings
from .learning import (
    SKIPPED,
    CurrentIterationILC,
    LearningLaw,
    PaperILC,
    PDTypeILC,
    StrideSelection,
    anti_windup,
)
from .lifted import LiftedModel
from .linearise import lifted_model
from .model_based import ModelBasedILC, NormOptimalILC, PlantInversionILC
from .placement import FootPlacement
from .record import PARTS, SAMPLES, PhaseLog, StrideRecord, phase_grid, resample
from .reference import FlightTiming
from .regulation import LegAngleRegulator
from .tape import Gains, Tape, clip_torque
from .torque_library import Skill, TorqueLibrary

__all__ = [
    "BASES",
    "CONTROLLERS",
    "PARTS",
    "SAMPLES",
    "SKIPPED",
    "AttitudeEstimator",
    "AttitudeFilter",
    "AttitudeRegulator",
    "Balance",
    "BalanceSpec",
    "ContactDetector",
    "Controller",
    "ControllerSpec",
    "CurrentIterationILC",
    "FlightTiming",
    "FootPlacement",
    "Gains",
    "GuidedStrides",
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
    "Skill",
    "StanceContact",
    "StrideRecord",
    "StrideSelection",
    "Tape",
    "TorqueLibrary",
    "TouchdownDetector",
    "TrunkKnown",
    "ZeroPhaseFilter",
    "anti_windup",
    "attitude_angle",
    "attitude_error",
    "clip_torque",
    "lifted_model",
    "load_controller",
    "model_feedforward",
    "phase_grid",
    "resample",
    "roll_pitch_yaw",
]
