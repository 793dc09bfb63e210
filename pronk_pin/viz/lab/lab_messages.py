"""What a page may ask of a live session: messages of known kinds, read with their types checked."""

from __future__ import annotations

from typing import TypeAlias

import msgspec

from ..._checks import known_name
from ...compare.session import LIVE_CONTROLLERS, LiveSession
from ...errors import InvalidInput

LONGEST = 2048
"""Longest message of a page [bytes]; what is longer ends its connection."""


class _Message(msgspec.Struct, tag_field="do", forbid_unknown_fields=True, frozen=True):
    """A message; its kind stands in the field "do"."""


class SetSpeed(_Message, tag="speed", frozen=True):
    """Command another speed."""

    speed: float


class SetLearning(_Message, tag="learning", frozen=True):
    """Switch learning on or off, of one robot or all."""

    on: bool
    robot: int | None = None


class SetController(_Message, tag="controller", frozen=True):
    """Go on under another controller."""

    robot: int
    name: str


class SetWorld(_Message, tag="world", frozen=True):
    """Go on in the scenario with these mismatches."""

    values: dict[str, float]


class Forget(_Message, tag="forget", frozen=True):
    """Play again what the controllers began with."""

    robot: int | None = None


class Push(_Message, tag="push", frozen=True):
    """Push one robot, or all."""

    impulse: tuple[float, float, float]
    robot: int | None = None


class Pause(_Message, tag="pause", frozen=True):
    """Pause, or go on."""

    paused: bool


class Step(_Message, tag="step", frozen=True):
    """Go on to the next touchdowns."""


class SetRate(_Message, tag="rate", frozen=True):
    """Go faster or slower than the wall's clock."""

    rate: float


class Reset(_Message, tag="reset", frozen=True):
    """Stand up and begin again; with nothing learned, or with all that was."""

    forget: bool = True


class Record(_Message, tag="record", frozen=True):
    """Begin a recording, or end it and write it."""

    on: bool


Asked: TypeAlias = (
    SetSpeed
    | SetLearning
    | SetController
    | SetWorld
    | Forget
    | Push
    | Pause
    | Step
    | SetRate
    | Reset
    | Record
)

_DECODER: msgspec.json.Decoder[Asked] = msgspec.json.Decoder(Asked)


def read_message(message: str | bytes) -> Asked:
    """Read a message.

    Raises:
        InvalidInput: It is none, or of an unknown kind, or has a field of another type.
    """
    if isinstance(message, bytes):
        raise InvalidInput("messages are text; send JSON with a field 'do'")
    try:
        return _DECODER.decode(message)
    except (msgspec.DecodeError, UnicodeError) as error:
        raise InvalidInput(f"no message of this page ({error}); load the page again") from error


def obey(session: LiveSession, asked: Asked) -> None:
    """Do what a message asks, but for recordings, whose folder it does not know.

    Raises:
        PronkError: It cannot be done; what could be is named.
    """
    match asked:
        case SetSpeed(speed):
            session.set_speed(speed)
        case SetLearning(on, robot):
            session.set_learning(on, robot)
        case SetController(robot, name):
            # Names only: a page opens no file of this machine.
            shown = (spec.name for spec in session.controllers)
            known_name("controller of a live session", name, (*LIVE_CONTROLLERS, *shown))
            session.set_controller(robot, name)
        case SetWorld(values):
            session.set_mismatches(values)
        case Forget(robot):
            session.forget(robot)
        case Push(impulse, robot):
            session.push(impulse, robot)
        case Pause(paused):
            session.pause(paused)
        case Step():
            session.step()
        case SetRate(rate):
            session.clock.rate = rate
        case Reset(forget):
            session.reset(forget=forget)
        case Record():
            raise InvalidInput("recordings are begun where their folder is known")
