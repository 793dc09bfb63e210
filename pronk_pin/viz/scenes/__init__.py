"""What is shown: robots that move, their marks, and the menu of what can be chosen.

Comes in: motions, gaits, strides.
Goes out: a `Scene`, or a `Menu` of scenes.
"""

from .gait_scenes import gait_scene, library_menu, nearest
from .menu import Choice, Menu
from .mesh_files import Mesh
from .scene import CHANNELS, GHOST_COLOR, SECOND_COLOR, Color, History, Mark, Scene, Track
from .stride_scenes import result_menu

__all__ = [
    "CHANNELS",
    "GHOST_COLOR",
    "SECOND_COLOR",
    "Choice",
    "Color",
    "History",
    "Mark",
    "Menu",
    "Mesh",
    "Scene",
    "Track",
    "gait_scene",
    "library_menu",
    "nearest",
    "result_menu",
]
