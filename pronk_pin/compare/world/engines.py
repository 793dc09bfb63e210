"""Engines by name."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..._registry import find, imported, is_address
from ...control import Gains
from ...errors import InvalidInput, PronkError
from ...robot import Robot
from .drake_world import DrakeEngine
from .engine import Engine, World
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


def check_engine(robot: Robot, scenario: Scenario, base: str) -> None:
    """Check that the engine of a scenario is there, and can simulate it.

    Raises:
        UnknownName, InvalidInput, MissingExtra: It cannot, see `Engine.check`; or one of a user's
            own ends in an error of its own.
    """
    with _named(scenario):
        engine_of(scenario).check(robot, scenario, base)


def make_world(
    robot: Robot, scenario: Scenario, n: int, *, base: str, servo: Gains | None = None
) -> World:
    """Make a world in the engine of a scenario; arguments as for `Engine.world`, errors as for
    `check_engine`."""
    check_engine(robot, scenario, base)
    with _named(scenario):
        return engine_of(scenario).world(robot, scenario, n, base=base, servo=servo)


@contextmanager
def _named(scenario: Scenario) -> Iterator[None]:
    """Name a user's own engine where it ends in an error of its own."""
    try:
        yield
    except PronkError:
        raise
    except Exception as error:  # whatever a user's engine does
        if not is_address(scenario.engine):
            raise
        raise InvalidInput(
            f"engine {scenario.engine} ends in {type(error).__name__}: {error}"
        ) from error
