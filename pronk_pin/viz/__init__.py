"""Looking: scenes, the live page and laboratory, replays in one file, pictures and films.

Comes in: motions, gaits, `Results`.
Goes out: a page, a replay, a film, figures, a report.
"""

from .figure_style import known_figure, save_figure
from .lab import LabServer, live_lab, serve_lab
from .player import Film, LiveServer, play, serve, show, write_film, write_png, write_replay
from .scenes import Mark, Menu, Scene, Track, gait_scene, library_menu

__all__ = [
    "Film",
    "LabServer",
    "LiveServer",
    "Mark",
    "Menu",
    "Scene",
    "Track",
    "gait_scene",
    "known_figure",
    "library_menu",
    "live_lab",
    "play",
    "save_figure",
    "serve",
    "serve_lab",
    "show",
    "write_film",
    "write_png",
    "write_replay",
]
