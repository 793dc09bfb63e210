"""What goes to and fro between controller and robot: tapes, records, references.

Comes in: gaits, and what was measured at every tick.
Goes out: `Tape`, `StrideRecord`, filtered signals, and detected contacts.
"""

from .contact_detection import ContactDetector, ImpactDetector, StanceContact, TouchdownDetector
from .context import ControlContext
from .filters import PAPER_A, PAPER_B, ZeroPhaseFilter, first_order, look_ahead
from .record import PARTS, SAMPLES, PhaseLog, StrideRecord, held, phase_grid, resample
from .reference import LATEST_TOUCHDOWN, FlightTiming, Reference
from .speed_profile import SpeedProfile
from .tape import Gains, Tape, clip_torque

__all__ = [
    "LATEST_TOUCHDOWN",
    "PAPER_A",
    "PAPER_B",
    "PARTS",
    "SAMPLES",
    "ContactDetector",
    "ControlContext",
    "FlightTiming",
    "Gains",
    "ImpactDetector",
    "PhaseLog",
    "Reference",
    "SpeedProfile",
    "StanceContact",
    "StrideRecord",
    "Tape",
    "TouchdownDetector",
    "ZeroPhaseFilter",
    "clip_torque",
    "first_order",
    "held",
    "look_ahead",
    "phase_grid",
    "resample",
]
