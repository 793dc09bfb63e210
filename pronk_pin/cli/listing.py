"""The command `pronk-pin list`: what can be named, with a line about each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

from tyro.conf import Positional

from .._display import show

if TYPE_CHECKING:
    from ..control import ControllerSpec

Kind: TypeAlias = Literal[
    "controllers", "robots", "gaits", "scenarios", "engines", "metrics", "suites"
]


@dataclass(frozen=True)
class List:
    """List what can be named: what is shipped, and what installed packages announce."""

    kind: Positional[Kind] = "controllers"
    """What to list."""

    def run(self) -> None:
        """Do it."""
        rows = list(_LISTS[self.kind]())
        width = max(len(name) for name, _ in rows)
        show("\n".join(f"{name:<{width}}  {text}".rstrip() for name, text in rows))


def _controllers() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..control import CONTROLLERS, load_controller

    for name in (*CONTROLLERS, *announced_names("controller")):
        yield name, _what_it_does(load_controller(name))


_MODELS = {"datasheet": "datasheet's rotors", "identified": "identified model"}


def _what_it_does(spec: ControllerSpec) -> str:
    learned = [
        f"{part} ({type(law).__name__}{', gain 0' if getattr(law, 'gain', None) == 0 else ''})"
        for part, law in zip(("stance", "flight"), spec.laws, strict=True)
        if law
    ]
    torque = type(spec.tick_controller).__name__ if spec.tick_controller else ""
    source = {"library": "torque library", "identified": "identified model"}.get(spec.source)
    begins = "" if spec.source == "none" else f"begins with torques of the {source or 'model'}"
    parts = (
        f"computes torques at every tick ({torque})" if torque else begins,
        f"learns in {' and '.join(learned)}" if learned else "",
        "adapts the flight's duration" if spec.timing else "",
        "" if spec.gait_model == "urdf" else f"gaits planned with the {_MODELS[spec.gait_model]}",
        "" if spec.stiffness == 1.0 else f"gains {spec.stiffness:g} times as stiff",
        "feels its trunk by an IMU" if spec.imu else "",
        f"knows {', '.join(spec.knows)}" if spec.knows else "knows nothing",
    )
    return "; ".join(filter(None, parts) if any(parts[:-1]) else ("feedback alone", parts[-1]))


def _robots() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..robot import ROBOTS, load_robot_spec

    for name in (*ROBOTS, *announced_names("robot")):
        spec = load_robot_spec(name)
        rotors = "known" if spec.rotors else "not known"
        yield name, f"{len(spec.legs)} legs, rotors {rotors}, {spec.urdf}"


def _gaits() -> Iterator[tuple[str, str]]:
    from ..gait import shipped_libraries

    for library in sorted(shipped_libraries(), key=lambda one: (one.robot, one.base)):
        speeds, apexes = library.speeds, library.apexes
        gait = library.metadata.get("gait", "pronk")
        yield (
            f"{gait} of {library.robot}, base {library.base}",
            f"{speeds[0]:g} to {speeds[-1]:g} m/s, apex {' '.join(f'{h:g}' for h in apexes)} m",
        )


_WORLDS = {
    "ideal": "the robot as its URDF has it",
    "nominal": "with the rotors' inertia and the friction that URDFs leave out",
}


def _scenarios() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..compare import KNOWN
    from ..compare.world import BASE_SCENARIOS

    for name in BASE_SCENARIOS:
        yield name, f"a world to begin with: {_WORLDS[name]}"
    for name, mismatch in KNOWN.items():
        yield f"{name}={mismatch.value:g}", f"{mismatch.text} [{mismatch.unit}]"
    yield "random-SEED-INDEX", "a sampled scenario"
    for name in announced_names("scenario"):
        yield name, "announced by an installed package"


def _engines() -> Iterator[tuple[str, str]]:
    from .._registry import announced_names
    from ..compare import ENGINES

    for name, engine in ENGINES.items():
        yield name, (type(engine).__doc__ or "").partition("\n")[0]
    for name in announced_names("engine"):
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
    "engines": _engines,
    "metrics": _metrics,
    "suites": _suites,
}
