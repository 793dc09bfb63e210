"""The command `pronk-pin list`: what can be named, with a line about each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from tyro.conf import Positional

if TYPE_CHECKING:
    from ..control import ControllerSpec

Kind: TypeAlias = Literal["controllers", "robots", "gaits", "scenarios", "metrics", "suites"]


@dataclass(frozen=True)
class List:
    """List what can be named: what is shipped, and what installed packages announce."""

    kind: Positional[Kind] = "controllers"
    """What to list."""

    def run(self) -> None:
        """Do it."""
        rows = list(_LISTS[self.kind]())
        width = max(len(name) for name, _ in rows)
        for name, text in rows:
            print(f"{name:<{width}}  {text}".rstrip())


def _controllers() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..control import CONTROLLERS, load_controller

    for name in (*CONTROLLERS, *announced_names("controller")):
        yield name, _what_it_does(load_controller(name))


def _what_it_does(spec: ControllerSpec) -> str:
    learned = [part for part, law in zip(("stance", "flight"), spec.laws, strict=True) if law]
    torque = type(spec.tick_controller).__name__ if spec.tick_controller else ""
    begins = "" if spec.source == "none" else f"begins with torques of the {spec.source}"
    parts = (
        f"computes torques at every tick ({torque})" if torque else begins,
        f"learns in {' and '.join(learned)}" if learned else "",
        "adapts the flight's duration" if spec.timing else "",
        f"knows {', '.join(spec.knows)}" if spec.knows else "knows nothing",
    )
    return "; ".join(filter(None, parts))


def _robots() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..robot import ROBOTS, load_robot_spec

    for name in (*ROBOTS, *announced_names("robot")):
        yield name, load_robot_spec(name).urdf


def _gaits() -> Iterator[tuple[str, str]]:
    from ..gait import shipped_libraries

    for library in sorted(shipped_libraries(), key=lambda one: (one.robot, one.base)):
        speeds, apexes = library.speeds, library.apexes
        gait = library.metadata.get("gait", "pronk")
        yield (
            f"{gait} of {library.robot}, base {library.base}",
            f"{speeds[0]:g} to {speeds[-1]:g} m/s, apex {' '.join(f'{h:g}' for h in apexes)} m",
        )


def _scenarios() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..compare import KNOWN
    from ..compare.world import BASE_SCENARIOS

    for name in BASE_SCENARIOS:
        yield name, "a world to begin with"
    for name, mismatch in KNOWN.items():
        yield f"{name}={mismatch.value:g}", f"{mismatch.text} [{mismatch.unit}]"
    yield "random-SEED-INDEX", "a sampled scenario"
    for name in announced_names("scenario"):
        yield name, "announced by an installed package"


def _metrics() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..compare.metrics import METRICS

    for name, (unit, text) in METRICS.items():
        yield f"{name} [{unit}]", text
    for name in announced_names("metric"):
        yield name, "announced by an installed package"


def _suites() -> Iterator[tuple[str, str]]:
    from ..compare.experiment import SUITES, load_suite

    for name in SUITES:
        suite = load_suite(name)
        yield (
            name,
            f"{len(suite.cells())} simulations of {len(suite.speeds)} robots: "
            f"{len(suite.controllers)} controllers, {len(suite.scenarios)} scenarios, "
            f"{len(suite.seeds)} seeds",
        )


_LISTS: dict[Kind, Callable[[], Iterator[tuple[str, str]]]] = {
    "controllers": _controllers,
    "robots": _robots,
    "gaits": _gaits,
    "scenarios": _scenarios,
    "metrics": _metrics,
    "suites": _suites,
}
