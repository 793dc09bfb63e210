"""Looking: scenes, the live page, replays in one file, pictures and films."""

from .gait_scenes import gait_scene, library_programme
from .live import LiveServer, serve
from .programme import Programme
from .replay import write_replay
from .scene import Mark, Scene, Track
from .show import play, show
from .video import Film, write_film, write_png

__all__ = [
    "Film",
    "LiveServer",
    "Mark",
    "Programme",
    "Scene",
    "Track",
    "gait_scene",
    "library_programme",
    "play",
    "serve",
    "show",
    "write_film",
    "write_png",
    "write_replay",
]
