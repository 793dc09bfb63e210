"""Model-based torque at every tick, from the measured state: computed torque, and a whole-body QP.

Comes in: the tape's reference at a tick, and the measured joints and loads of the feet.
Goes out: motor torques. It needs the URDF, the rotors' inertia and the feet's forces, and a trunk
that is locked to x and z.
"""

from .computed_torque import Aim, ComputedTorque, Reading, TorqueControl, TorqueLaw
from .whole_body_qp import WholeBodyQP

__all__ = ["Aim", "ComputedTorque", "Reading", "TorqueControl", "TorqueLaw", "WholeBodyQP"]
