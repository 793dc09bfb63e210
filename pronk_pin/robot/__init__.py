"""What the robot is: its rigid-body model, names, limits, parameters and layouts.

Comes in: a URDF, the names of its parts (`RobotSpec`), what it lacks (`ModelParameters`).
Goes out: a `Robot`, and conversions between the orders of Pinocchio, MuJoCo and the paper.
"""

from .base import BASES, Base
from .conventions import (
    MujocoState,
    PinocchioState,
    from_mujoco,
    from_paper,
    joint_order,
    rotation_matrix,
    to_mujoco,
    to_paper,
)
from .parameters import NOTHING, SLIDING, ModelParameters
from .robot import (
    NB,
    Robot,
    load_robot,
    recorded_robot,
    robot_attributes,
    with_rotors,
)
from .robot_spec import JOINTS, ROBOTS, RobotSpec, load_robot_spec
from .similarity import (
    MotorConstants,
    Size,
    arrow_scale,
    feedback_gains,
    length_scale,
    motor_constants,
    scaled_duration,
    scaled_length,
    size,
    torque_scale,
)
from .state import (
    REFUSALS,
    as_array,
    as_numbers,
    as_one,
    as_q,
    as_robot,
    as_state,
    by_state,
    leg_indices,
    sound_base,
)
from .urdf_document import check_shape, numbers_of, placement_of
from .urdf_file import document_of, find_mesh, read_urdf

__all__ = [
    "BASES",
    "JOINTS",
    "NB",
    "NOTHING",
    "REFUSALS",
    "ROBOTS",
    "SLIDING",
    "Base",
    "ModelParameters",
    "MotorConstants",
    "MujocoState",
    "PinocchioState",
    "Robot",
    "RobotSpec",
    "Size",
    "arrow_scale",
    "as_array",
    "as_numbers",
    "as_one",
    "as_q",
    "as_robot",
    "as_state",
    "by_state",
    "check_shape",
    "document_of",
    "feedback_gains",
    "find_mesh",
    "from_mujoco",
    "from_paper",
    "joint_order",
    "leg_indices",
    "length_scale",
    "load_robot",
    "load_robot_spec",
    "motor_constants",
    "numbers_of",
    "placement_of",
    "read_urdf",
    "recorded_robot",
    "robot_attributes",
    "rotation_matrix",
    "scaled_duration",
    "scaled_length",
    "size",
    "sound_base",
    "to_mujoco",
    "to_paper",
    "torque_scale",
    "with_rotors",
]
