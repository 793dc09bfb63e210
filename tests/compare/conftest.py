"""One small comparison, and simulations to order, for all tests of what happens."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pronk_pin._typing import Array
from pronk_pin.compare import Experiment, Results, Schedule, Simulation, load_scenario
from pronk_pin.compare.run import run_experiment
from pronk_pin.control import ControllerSpec
from pronk_pin.gait import Gait, load_library
from pronk_pin.robot import Robot

SPEEDS = (0.0, 0.45)
EXPERIMENT = Experiment(
    speeds=SPEEDS,
    controllers=("pd", "ilc", "library"),
    schedule=Schedule(practice=4.0, learning=6.0),
)


@pytest.fixture(scope="session")
def gaits() -> list[Gait]:
    library = load_library("a1")
    return [library.at(speed) for speed in SPEEDS]


@pytest.fixture(scope="session")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """A small comparison that has been run; tests that change it work on a copy."""
    folder = tmp_path_factory.mktemp("results") / "small"
    return run_experiment(EXPERIMENT, folder, workers=1, progress=False)


@pytest.fixture(scope="session")
def simulation(robot: Robot, gaits: list[Gait]) -> Callable[..., Simulation]:
    def build(
        spec: ControllerSpec,
        *,
        seconds: float = 1.5,
        seed: int = 0,
        feedforward: Array | None = None,
    ) -> Simulation:
        return Simulation(
            robot,
            gaits,
            spec,
            load_scenario("nominal"),
            schedule=Schedule(startup=0.2, practice=seconds, learning=0.0),
            rng=np.random.default_rng(seed),
            feedforward=feedforward,
        )

    return build
