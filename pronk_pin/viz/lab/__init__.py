"""A live session on a page: robots that are taught, loaded and pushed while one looks.

Comes in: an `Experiment`, and what pages ask.
Goes out: a served page.
"""

from .lab import CONTROLLERS, live_lab, serve_lab
from .lab_server import LabServer

__all__ = ["CONTROLLERS", "LabServer", "live_lab", "serve_lab"]
