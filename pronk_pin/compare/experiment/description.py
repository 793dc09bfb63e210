"""Objects as data, as JSON has it, and back again: controllers, scenarios, robots, schedules.

Objects of our classes come back as they were. What comes from outside, a user's law say, is not
imported by reading a record: an `Unloaded` stands in for it, which is enough for reports, and
imports the module where the object has to do something.
"""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np

from ... import __name__ as _OURS
from ... import control, robot
from ..._registry import imported, is_address, source_sha256
from ..._typing import Array
from ...control import StrideRecord, feedback, learning, signals, tick_control
from ...control.signals import ControlContext
from ...errors import InvalidInput
from .. import metrics, world

Description: TypeAlias = dict[str, Any]
"""Nested dictionaries, lists, strings and numbers."""

T = TypeVar("T")

_SCRIPT = "__main__"

_ROOMS = (control, feedback, learning, signals, tick_control, world, robot, metrics)
"""Where our own classes are looked up, by their names."""


def describe(value: object) -> Any:
    """An object as JSON has it: class and fields, and the source of a class from outside."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Unloaded):
        return value.description
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): describe(part) for key, part in value.items()}
    if isinstance(value, Iterable):
        return [describe(part) for part in value]
    if inspect.isroutine(value) or isinstance(value, type):
        return _origin(value)
    if dataclasses.is_dataclass(value):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    else:
        fields = dict(getattr(value, "__dict__", {}))
    return {**_origin(type(value)), **{key: describe(part) for key, part in fields.items()}}


def _origin(thing: Any) -> Description:
    """Where a class or function comes from; of one from outside, the SHA-256 of its module too."""
    module, name = str(thing.__module__), str(thing.__qualname__)
    if module == "__mp_main__":  # the script itself, in a worker
        module = _SCRIPT
    if module.partition(".")[0] == _OURS:
        return {"class": name}
    return {"class": f"{module}:{name}", "source_sha256": source_sha256(thing)}


@dataclass(frozen=True)
class Unloaded:
    """An object of a class from outside, as its description has it: it loads when it is bound.

    It passes for a learning law, a tick controller and a function.

    Attributes:
        description: Its class, by address, the SHA-256 of its module, and its fields.
    """

    description: Description

    def bind(self, context: ControlContext) -> Any:
        """The object itself, bound to the robots of a context if it can be.

        Raises:
            InvalidInput: See `load`.
        """
        found = self.load()
        bind = getattr(found, "bind", None)
        return found if bind is None else bind(context)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function that it stands for."""
        return self.load()(*arguments)  # type: ignore[operator]

    def update(self, record: StrideRecord) -> Array:
        """Nothing: a law is bound before it is used."""
        raise InvalidInput(f"{self.description['class']} was not bound before it was used")

    def load(self) -> object:
        """Import its module, and make the object of its fields.

        Raises:
            InvalidInput: The module cannot be imported or is another one than it was, or its class
                is no dataclass: such an object has to be given again.
        """
        address = self.description["class"]
        if address.startswith(f"{_SCRIPT}:"):
            raise InvalidInput(
                f"{address} is a class of the script that made this result; run that script again, "
                "or move the class into a module that can be imported"
            )
        found = imported(address, sha256=self.description.get("source_sha256", ""))
        function = inspect.isroutine(found)
        if not function and not _is_dataclass(found):
            raise InvalidInput(
                f"{address} is no dataclass, so it cannot be made again of what is on record; pass "
                "the experiment with the object itself to run_experiment"
            )
        return found if function else _made(found, self.description, address)


def restore(document: object, kind: type[T], what: str) -> T:
    """The object that a description says, or that a user wrote; the class may be left out there.

    Args:
        document: The description: a mapping of the fields, "class" among them.
        kind: Class of the object.
        what: What it is, for the error.

    Raises:
        InvalidInput: It is no description of such an object.
    """
    found = _restored(document, kind, what)
    if not isinstance(found, kind):
        raise InvalidInput(f"{what} is not a {kind.__name__}; give a mapping of its fields")
    return found


def _restored(document: object, expected: object, what: str) -> Any:
    """An object, a tuple of them, or a value as it stands."""
    if isinstance(document, list | tuple):
        inner = next(iter(typing.get_args(expected)), None)
        return tuple(_restored(part, inner, what) for part in document)
    if not isinstance(document, Mapping):
        return document
    name = document.get("class", "")
    if isinstance(name, str) and is_address(name):
        recorded = Unloaded(dict(document))
        # What a user wrote by hand is loaded at once: no record says which module was meant.
        return recorded if "source_sha256" in document else recorded.load()
    kind = _class(name, expected, what)
    if kind is None:
        return {key: _restored(part, None, f"{what}: {key}") for key, part in document.items()}
    return _made(kind, document, what)


def _made(kind: Any, document: Mapping[str, Any], what: str) -> Any:
    """An object of a dataclass."""
    parts = {key: part for key, part in document.items() if key not in ("class", "source_sha256")}
    hints = typing.get_type_hints(kind)
    for key in parts.keys() - {field.name for field in dataclasses.fields(kind) if field.init}:
        raise InvalidInput(f"{what}: a {kind.__name__} has no field '{key}'; leave it out")
    fields = {key: _restored(part, hints[key], f"{what}: {key}") for key, part in parts.items()}
    try:
        return kind(**fields)
    except TypeError as error:  # a field is missing
        raise InvalidInput(f"{what}: {error}; give it") from error


def _class(name: object, expected: object, what: str) -> Any:
    """One of our dataclasses by its name, or the one that a field is annotated with, if any."""
    if not name:
        options = [part for part in (expected, *typing.get_args(expected)) if _is_dataclass(part)]
        return options[0] if options else None
    for room in _ROOMS:
        if _is_dataclass(found := getattr(room, str(name), None)):
            return found
    raise InvalidInput(
        f"{what}: there is no class '{name}' here; give the name of one of ours, or the address of "
        "another, module:class"
    )


def _is_dataclass(part: object) -> bool:
    return isinstance(part, type) and dataclasses.is_dataclass(part)
