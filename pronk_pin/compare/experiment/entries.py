"""What an experiment takes by name or as an object: controllers, scenarios, robots, gaits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from ...errors import InvalidInput
from ...gait import GaitLibrary
from .description import describe

_T = TypeVar("_T")


def name_of(value: Any) -> str:
    """Name of what is given by name or as an object; of a gait library, its robot's."""
    return value if isinstance(value, str) else str(getattr(value, "name", None) or value.robot)


def named(values: Iterable[_T], name: str) -> _T | str:
    """The one of a name; the name itself without one."""
    return next((value for value in values if name_of(value) == name), name)


def shortest(kind: str, value: _T, shipped: Callable[[str], _T | None]) -> str | _T:
    """The name of what is shipped; else the object itself, whose name must not be taken."""
    name = name_of(value)
    known = shipped(name)
    if known is None:
        return value
    if describe(known) != describe(value):
        raise InvalidInput(
            f"{kind} '{name}' is not the one that is shipped under that name; give yours another "
            "name"
        )
    return name


def digest_of(gaits: str | GaitLibrary) -> str:
    """What gaits are known by: their name, or the SHA-256 of a library."""
    return gaits if isinstance(gaits, str) else gaits.sha256
