"""Tick controllers: what computes commands from measurements at a rate of its own.

Comes in: an `Observation`: the reference at a tick, and the measured joints, feet and trunk.
Goes out: motor torques, or `SetPoints` for the motor drivers.
"""

from .computed_torque import ComputedTorque
from .extended_state_observer import ExtendedStateObserver
from .level_robot import level_robot
from .tick_controller import (
    BindableTickController,
    ControlTime,
    Observation,
    SetPoints,
    TickController,
    TickLoop,
    known_tick_controller,
)
from .whole_body_qp import WholeBodyQP

__all__ = [
    "BindableTickController",
    "ComputedTorque",
    "ControlTime",
    "ExtendedStateObserver",
    "Observation",
    "SetPoints",
    "TickController",
    "TickLoop",
    "WholeBodyQP",
    "known_tick_controller",
    "level_robot",
]
