"""The page that plays scenes: live, in one file, in a browser without a window.

Comes in: a `Scene` or a `Menu`.
Goes out: a served page, a replay, a picture, a film.
"""

from .browser import Browser
from .live import (
    DURATION,
    SCRIPT,
    Bytes,
    LiveServer,
    Route,
    known_port,
    serve,
    text_as_bytes,
)
from .page import data_text
from .replay import write_replay
from .scene_encoding import row_bytes
from .show import play, show
from .video import Film, check_film, write_film, write_png

__all__ = [
    "DURATION",
    "SCRIPT",
    "Browser",
    "Bytes",
    "Film",
    "LiveServer",
    "Route",
    "check_film",
    "data_text",
    "known_port",
    "play",
    "row_bytes",
    "serve",
    "show",
    "text_as_bytes",
    "write_film",
    "write_png",
    "write_replay",
]
