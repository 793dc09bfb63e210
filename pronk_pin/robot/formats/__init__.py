"""The robot in other programs' words; the only part of `robot` that needs MuJoCo.

Comes in: a `Robot`.
Goes out: its MuJoCo specification, and files: MJCF and URDF.
"""

from .mjcf_file import check_mjcf, compile_mjcf, drop_looks, loading, read_mjcf
from .model_files import write_mjcf, write_urdf
from .urdf import body_inertia, mujoco_spec, set_body_inertia

__all__ = [
    "body_inertia",
    "check_mjcf",
    "compile_mjcf",
    "drop_looks",
    "loading",
    "mujoco_spec",
    "read_mjcf",
    "set_body_inertia",
    "write_mjcf",
    "write_urdf",
]
