"""Objects by name: those that are shipped, those that installed packages announce as entry points,
and any at an address, `module:object`.

An entry point of the group `pronk_pin.controllers` (likewise `.robots`, `.scenarios`, `.engines`,
`.metrics`) is found by its name. An address is imported as Python imports: from what is installed,
or from the folder that the program was started in.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import inspect
import re
import sys
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

from ._checks import instance_of
from .errors import InvalidInput, UnknownName
from .storage import sha256 as digest

T = TypeVar("T")

_ADDRESS = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_][\w.]*")


def find(kind: str, name: object, shipped: Mapping[str, T], wanted: type[T]) -> T:
    """The object of a name or address.

    Args:
        kind: What it is, as in "controller"; entry points have it in their group.
        name: The name, or the address.
        shipped: Objects of this package by name.
        wanted: Their class.

    Raises:
        UnknownName: There is none of that name.
        InvalidInput: The name is none, or what is there cannot be imported, or is something else.
    """
    options = f"{', '.join(shipped)}, or an address, module:object"
    name = instance_of(kind, name, str, f"a {wanted.__name__}, or a name, one of: {options}")
    if name in shipped:
        return shipped[name]
    announced = _announced(kind)
    if name in announced:
        name = announced[name]
    elif not is_address(name):
        raise UnknownName(kind, name, (*shipped, *announced))
    found = imported(name)
    if not isinstance(found, wanted):
        raise InvalidInput(
            f"{kind} {name} is a {type(found).__name__}; let the address be that of a "
            f"{wanted.__name__}"
        )
    return found


def announced_names(kind: str) -> tuple[str, ...]:
    """Names of a kind that installed packages announce as entry points."""
    return tuple(_announced(kind))


@lru_cache
def _announced(kind: str) -> dict[str, str]:
    """Addresses by the names that are announced."""
    found = importlib.metadata.entry_points(group=f"pronk_pin.{kind}s")
    return {entry.name: entry.value for entry in sorted(found, key=lambda entry: entry.name)}


def is_address(name: str) -> bool:
    """Whether a name is an address, `module:object`."""
    return _ADDRESS.fullmatch(name) is not None


def function_address(name: str, value: object) -> str:
    """The address of a function, from the function itself or its address; empty without one.

    Raises:
        InvalidInput: It is neither, or is one that cannot be imported by name.
    """
    if inspect.isfunction(value):
        module = "__main__" if value.__module__ == "__mp_main__" else value.__module__
        value = f"{module}:{value.__qualname__}"
    if not isinstance(value, str) or (value and not is_address(value)):
        raise InvalidInput(
            f"{name}={value!r} is no function that can be found by name; give one that stands in a "
            "module, or its address, module:function"
        )
    return value


def source_sha256(thing: object) -> str:
    """SHA-256 of the module that a class, a function, or an object's class comes from; "unknown"
    without a file."""
    source = thing if inspect.isclass(thing) or inspect.isroutine(thing) else type(thing)
    try:
        return digest(Path(inspect.getfile(source)).read_bytes())
    except (OSError, TypeError):
        return "unknown"  # typed in by hand, or compiled


def imported(address: str, *, sha256: str = "") -> object:
    """Import the object at an address.

    Args:
        address: Its address.
        sha256: `source_sha256` that it has to have; by default any.

    Raises:
        InvalidInput: The module cannot be imported, has no such object, or is another one.
    """
    module, _, qualified_name = address.partition(":")
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.append(here)  # last, so that it hides nothing that is installed
    try:
        found: object = importlib.import_module(module)
    except ImportError as error:
        raise InvalidInput(
            f"{address}: module {module} cannot be imported ({error}); install it, or run the "
            "command in the folder that it lies in"
        ) from error
    except Exception as error:  # whatever a user's module does when it is imported
        raise InvalidInput(
            f"{address}: importing {module} ends in {type(error).__name__}: {error}"
        ) from error
    for name in qualified_name.split("."):
        if not hasattr(found, name):
            raise InvalidInput(f"{address}: {module} has no {qualified_name}; correct the address")
        found = getattr(found, name)
    if sha256 and source_sha256(found) != sha256:
        raise InvalidInput(
            f"the module of {address} has changed since; put the old one back, or take another "
            "folder"
        )
    return found
