"""Engines by name."""

from __future__ import annotations

from ..._registry import find, imported, is_address
from ...errors import InvalidInput
from .drake_world import DrakeEngine
from .engine import Engine
from .mujoco_world import MujocoEngine
from .scenario import Scenario

_SHIPPED: tuple[Engine, ...] = MujocoEngine(), DrakeEngine()

ENGINES: dict[str, Engine] = {engine.name: engine for engine in _SHIPPED}
"""Engines that are shipped, by name."""


def load_engine(name: str, *, sha256: str = "") -> Engine:
    """The engine of that name: a shipped one, one that an installed package announces as an entry
    point of the group `pronk_pin.engines`, or one at an address, module:object.

    Args:
        name: Its name or address.
        sha256: SHA-256 that the module of an address has to have; by default any.

    Raises:
        UnknownName: There is none of that name.
        InvalidInput: What is there cannot be imported, or is no `Engine`.
    """
    if is_address(name) and isinstance(imported(name, sha256=sha256), type):
        raise InvalidInput(f"engine {name} is a class; give an object of it")
    return find("engine", name, ENGINES, Engine)  # type: ignore[type-abstract]


def engine_of(scenario: Scenario) -> Engine:
    """The engine of a scenario; errors as for `load_engine`."""
    return load_engine(scenario.engine, sha256=scenario.engine_sha256)
