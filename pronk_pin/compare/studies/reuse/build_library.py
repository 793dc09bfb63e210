"""Practice over a grid of speeds and conditions, for a torque library of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from ...._checks import known_name, reals
from ...._typing import Array
from ....control import ControllerSpec, TorqueLibrary, load_controller
from ....errors import InvalidInput
from ....gait import GaitLibrary
from ....robot import RobotSpec
from ...execution import run_experiment
from ...experiment import LIBRARY_VARIABLES, Cell, Experiment, torque_library
from ...results import Results
from ...simulation import Schedule
from ...world import KNOWN, Scenario, load_scenario, shipped_scenario
from ..learning_runs import LONG, learning_law

_MOST = 1000
"""Combinations of conditions that are practised in one library."""


def parse_conditions(words: Sequence[str]) -> dict[str, Array]:
    """Values of conditions by name, from words as "slope=-0.1,0,0.1".

    Raises:
        InvalidInput: A word is something else, or its values do not increase.
        UnknownName: There is no mismatch of that name.
    """
    found: dict[str, Array] = {}
    for word in words:
        name, equals, values = word.partition("=")
        try:
            numbers = [float(value) for value in values.split(",")] if equals else []
        except ValueError:
            numbers = []
        if not numbers or name in found:
            raise InvalidInput(
                f"condition '{word}': give each once, with its values, as slope=-0.1,0,0.1"
            )
        found[name] = np.array(numbers)
    return _known(found)


def build_library(
    speeds: Sequence[float],
    conditions: Mapping[str, Sequence[float] | Array],
    scenario: str | Scenario,
    folder: Path | str,
    *,
    spec: ControllerSpec | None = None,
    schedule: Schedule = LONG,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
    workers: int | None = None,
    progress: bool = True,
) -> TorqueLibrary:
    """Practise at some speeds in each combination of conditions, and keep what is learned.

    The practice is an `Experiment` of which each combination is a scenario; one that was broken
    off goes on where it was.

    Args:
        speeds: Speeds [m/s].
        conditions: Increasing values of each condition, by the name of a mismatch: "slope",
            "payload", "gravity", see `compare.world.scenario`.
        scenario: What is the same in all of them; it may not have the conditions in it.
        folder: Results folder of the practice.
        spec: A controller that learns; by default `ilc`.
        schedule: How long; by default until the touchdowns have settled.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.
        workers: Processes; by default one for each core.
        progress: Show a progress bar.

    Returns:
        The library. Robots begin with the values that are nearest to those of the scenario.

    Raises:
        InvalidInput: There are no conditions, their values do not increase, the controller does not
            learn, or a robot fell.
        UnknownName: There is no mismatch of that name.
        PronkError: What `run_experiment` raises.
    """
    values = _known(conditions)
    spec = load_controller("ilc") if spec is None else spec
    learning_law(spec)
    scenario = load_scenario(scenario)
    worlds = [
        in_conditions(scenario, dict(zip(values, place, strict=True)))
        for place in product(*(axis.tolist() for axis in values.values()))
    ]
    if len(worlds) > _MOST:
        raise InvalidInput(f"{len(worlds)} combinations of conditions; give {_MOST} or fewer")
    experiment = Experiment(
        robot=robot,
        gaits=gaits,
        speeds=tuple(speeds),
        controllers=(spec,),
        scenarios=tuple(worlds),
        schedule=schedule,
    )
    results = run_experiment(experiment, folder, workers=workers, progress=progress)
    cells = {cell.scenario: cell for cell in experiment.cells()}
    learned = [_learned(results, cells[world.name], world.name) for world in worlds]
    home = {name: _home(scenario, name, axis) for name, axis in values.items()}
    return replace(
        TorqueLibrary.joined(learned, values, home=home),
        robot=experiment.model.name,
        gaits=tuple(gait.sha256 for gait in experiment.planned),
    )


def in_conditions(scenario: Scenario, conditions: Mapping[str, float]) -> Scenario:
    """A scenario in some conditions, by the names of mismatches."""
    parts = "+".join(f"{name}={value!r}" for name, value in conditions.items())
    if shipped_scenario(scenario.name) is None:
        return scenario + load_scenario(parts)
    return load_scenario(f"{scenario.name}+{parts}")  # by its shortest name


def describe_library(library: TorqueLibrary) -> str:
    """What a library holds, and how far it is to be believed, for a terminal."""
    spread = float(np.sqrt(np.mean(library.spread**2)))
    scale = float(np.sqrt(np.mean(library.torque**2)))
    lines = [
        f"{library!r}",
        f"spread over the strides  {spread:.3f} N m, of {scale:.2f} N m (root mean squares)",
        "left out and interpolated from its neighbours: what is missed, over the change between",
        "them",
    ]
    for name, errors in library.leave_one_out().items():
        axis = library.speeds if name == "speed" else library.conditions[name]
        inner = zip(axis[1:-1], errors, strict=True)
        told = ", ".join(f"{error:.0%} at {value:g}" for value, error in inner)
        lines.append(f"  {name:<12} {told or 'unknown, of fewer than three values'}")
    return "\n".join(lines)


def _known(conditions: Mapping[str, Sequence[float] | Array]) -> dict[str, Array]:
    if not conditions:
        raise InvalidInput("no conditions; give one or more, as slope=-0.1,0,0.1")
    found = {}
    for name, given in conditions.items():
        known_name("condition", name, KNOWN)
        values = np.array(reals(f"values of {name}", tuple(np.asarray(given).tolist())))
        if len(values) < 2 or np.any(np.diff(values) <= 0.0):
            raise InvalidInput(
                f"condition {name}: give two values or more, increasing, as {name}=-0.1,0,0.1"
            )
        found[name] = values
    return found


def _home(scenario: Scenario, name: str, values: Array) -> float:
    """The value of a condition that is nearest to a scenario's own."""
    attribute = next(iter(KNOWN[name].changes(float(values[0]))))
    own = getattr(scenario, attribute)
    if not isinstance(own, float):
        own = values[(len(values) - 1) // 2]
    return float(np.clip(own, values[0], values[-1]))


def _learned(results: Results, cell: Cell, scenario: str) -> TorqueLibrary:
    """What was learned in a scenario.

    Raises:
        InvalidInput: A robot fell there.
    """
    strides = results.strides(cell, (*LIBRARY_VARIABLES, "upright"))
    upright = (strides["upright"] != 0.0).all("stride").to_numpy()
    if not upright.all():
        fell = ", ".join(f"{speed:g}" for speed in strides["speed"].to_numpy()[~upright])
        raise InvalidInput(
            f"robots fell in scenario '{scenario}' at {fell} m/s, so that nothing was learned "
            "there; leave these speeds or conditions out, or learn more slowly"
        )
    return torque_library(strides)
