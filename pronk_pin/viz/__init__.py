"""Looking: scenes, the live page, and replays in one file."""

from .live import serve
from .replay import write_replay
from .scene import Scene, Track, gait_scene

__all__ = ["Scene", "Track", "gait_scene", "serve", "write_replay"]
