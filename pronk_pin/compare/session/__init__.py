"""A live session: robots that are simulated while somebody changes what they do.

Comes in: an `Experiment`, and what is asked while it goes.
Goes out: moments and strides as they happen, skills, a recording as a results folder.
"""

from .live_clock import RATES, LiveClock
from .live_robot import LIVE_CONTROLLERS, LiveRobot, LiveStride, Moment
from .live_session import IMPULSE, LiveSession

__all__ = [
    "IMPULSE",
    "LIVE_CONTROLLERS",
    "RATES",
    "LiveClock",
    "LiveRobot",
    "LiveSession",
    "LiveStride",
    "Moment",
]
