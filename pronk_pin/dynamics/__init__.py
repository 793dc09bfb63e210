"""Rigid-body dynamics of the floating-base robot: eq. (2) to (5) of the paper, and impacts.

    M(q) a + H(q, v) v + G(q) = S tau + J^T lam

`q`, `v` and `a` are in Pinocchio's layout (see `pronk_pin.robot`): the base's velocity and
acceleration are in its own frame. Contact forces are in the world's axes, foot by foot. The paper
writes J for our J^T.
"""

from ..kinematics.contacts import Contact, contact_bias, contact_jacobian
from .derivatives import (
    FlightDerivatives,
    StanceDerivatives,
    flight_derivatives,
    stance_derivatives,
)
from .forward import StanceDae, flight_dynamics, impact, stance_dae, stance_dynamics
from .planar import (
    NO_ROTORS,
    PlanarDerivatives,
    Rotors,
    planar_acceleration,
    planar_derivatives,
    planar_dynamics,
    planar_equations,
    planar_impact,
    planar_rows,
)
from .simulation import PhaseSimulation, simulate_phase
from .stance import Baumgarte, Impact, StanceDynamics
from .terms import coriolis_matrix, gravity, mass_matrix, nonlinear_effects, selection_matrix

__all__ = [
    "NO_ROTORS",
    "Baumgarte",
    "Contact",
    "FlightDerivatives",
    "Impact",
    "PhaseSimulation",
    "PlanarDerivatives",
    "Rotors",
    "StanceDae",
    "StanceDerivatives",
    "StanceDynamics",
    "contact_bias",
    "contact_jacobian",
    "coriolis_matrix",
    "flight_derivatives",
    "flight_dynamics",
    "gravity",
    "impact",
    "mass_matrix",
    "nonlinear_effects",
    "planar_acceleration",
    "planar_derivatives",
    "planar_dynamics",
    "planar_equations",
    "planar_impact",
    "planar_rows",
    "selection_matrix",
    "simulate_phase",
    "stance_dae",
    "stance_derivatives",
    "stance_dynamics",
]
