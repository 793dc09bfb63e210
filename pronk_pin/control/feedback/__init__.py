"""What answers at once: speed, attitude, foot placement, and what is believed of the trunk.

Comes in: measured joints, rates, trunk and contact forces.
Goes out: leg angles at touchdown, torques that balance, estimates of speed and attitude.
"""

from .attitude import AttitudeRegulator, attitude_angle, attitude_error, roll_pitch_yaw
from .balance import Balance, BalanceSpec
from .estimation import (
    SPEED_FILTER,
    AttitudeEstimator,
    AttitudeFilter,
    SpeedEstimator,
    TrunkEstimate,
)
from .foot_placement import FootPlacement
from .speed import LegAngleRegulator

__all__ = [
    "SPEED_FILTER",
    "AttitudeEstimator",
    "AttitudeFilter",
    "AttitudeRegulator",
    "Balance",
    "BalanceSpec",
    "FootPlacement",
    "LegAngleRegulator",
    "SpeedEstimator",
    "TrunkEstimate",
    "attitude_angle",
    "attitude_error",
    "roll_pitch_yaw",
]
