"""Rigid-body dynamics of the floating-base robot: eq. (2) to (5) of the paper, and impacts.

    M(q) a + H(q, v) v + G(q) = S tau + J^T lam

`q`, `v` and `a` are in Pinocchio's layout (see `pronk_pin.robot`): the base's velocity and
acceleration are in its own frame. Contact forces are in the world's axes, foot by foot. The paper
writes J for our J^T.

Comes in: a `Robot`, states, motor torques, and which feet stand.
Goes out: the equations' terms, accelerations, contact forces, impacts, their derivatives, the
planar robot's, and energies.
"""

from ..kinematics import Contact, contact_bias, contact_jacobian
from .derivatives import (
    FlightDerivatives,
    StanceDerivatives,
    flight_derivatives,
    stance_derivatives,
)
from .energetics import (
    CentroidalMomentum,
    centroidal_momentum,
    cost_of_transport,
    kinetic_energy,
    mechanical_power,
    potential_energy,
)
from .forward import StanceDae, flight_dynamics, impact, stance_dae, stance_dynamics
from .phase_simulation import PhaseSimulation, simulate_phase
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
from .stance import Baumgarte, Impact, StanceDynamics
from .terms import coriolis_matrix, gravity, mass_matrix, nonlinear_effects, selection_matrix

__all__ = [
    "NO_ROTORS",
    "Baumgarte",
    "CentroidalMomentum",
    "Contact",
    "FlightDerivatives",
    "Impact",
    "PhaseSimulation",
    "PlanarDerivatives",
    "Rotors",
    "StanceDae",
    "StanceDerivatives",
    "StanceDynamics",
    "centroidal_momentum",
    "contact_bias",
    "contact_jacobian",
    "coriolis_matrix",
    "cost_of_transport",
    "flight_derivatives",
    "flight_dynamics",
    "gravity",
    "impact",
    "kinetic_energy",
    "mass_matrix",
    "mechanical_power",
    "nonlinear_effects",
    "planar_acceleration",
    "planar_derivatives",
    "planar_dynamics",
    "planar_equations",
    "planar_impact",
    "planar_rows",
    "potential_energy",
    "selection_matrix",
    "simulate_phase",
    "stance_dae",
    "stance_derivatives",
    "stance_dynamics",
]
