"""What is shown: robots that move, their marks, and the menu of what can be chosen.

Comes in: motions, gaits, strides.
Goes out: a `Scene`, or a `Programme` of scenes.
"""

from .gait_scenes import gait_scene, library_programme, nearest
from .menu import Choice, Programme
from .meshes import Mesh
from .scene import CHANNELS, GHOST_COLOR, SECOND_COLOR, Color, Mark, Scene, Track
from .stride_scenes import practice_programme

__all__ = [
    "CHANNELS",
    "GHOST_COLOR",
    "SECOND_COLOR",
    "Choice",
    "Color",
    "Mark",
    "Mesh",
    "Programme",
    "Scene",
    "Track",
    "gait_scene",
    "library_programme",
    "nearest",
    "practice_programme",
]
