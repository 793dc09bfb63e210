"""The page that plays scenes: live, in one file, in a browser without a window.

Comes in: a `Scene` or a `Menu`.
Goes out: a served page, a replay, a picture, a film.
"""

from .browser import Browser
from .live import DURATION, LiveServer, known_port, serve
from .replay import write_replay
from .show import play, show
from .video import Film, check_film, write_film, write_png

__all__ = [
    "DURATION",
    "Browser",
    "Film",
    "LiveServer",
    "check_film",
    "known_port",
    "play",
    "serve",
    "show",
    "write_film",
    "write_png",
    "write_replay",
]
