"""Simulations from beginning to end, as labelled strides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from ...control import ControllerSpec, InitialFeedforward
from ...gait import Gait
from ...robot import Robot
from ..world import Scenario
from .dataset import to_dataset
from .schedule import Schedule
from .simulation import Progress, Simulation


def simulate(
    robot: Robot,
    gaits: Sequence[Gait],
    spec: ControllerSpec,
    scenario: Scenario,
    *,
    schedule: Schedule,
    rng: np.random.Generator,
    initial: InitialFeedforward | None = None,
    base: str = "locked",
    attributes: Mapping[str, str | int | float] | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate robots under one controller in one scenario, and label their strides.

    Args:
        robot: The robot.
        gaits: The gait of each robot.
        spec: The controller.
        scenario: The scenario.
        schedule: What happens when.
        rng: Source of the scatter at the start, and of the sensors' noise.
        initial: Torques that the controller begins with; by default none.
        base: How the trunks may move: "locked" to x and z, "sagittal" with pitch, or "free".
        attributes: Attributes of the dataset; by default the name of the robot.
        progress: Called with the number of time steps done since the last call.

    Returns:
        The strides, see `to_dataset`.
    """
    initial = InitialFeedforward() if initial is None else initial
    simulation = Simulation(
        robot,
        gaits,
        spec,
        scenario,
        schedule=schedule,
        rng=rng,
        feedforward=initial.feedforward,
        flight=initial.flight,
        base=base,
    )
    attributes = {"robot": robot.name} if attributes is None else attributes
    return to_dataset(simulation.run(progress), robot, gaits, attributes=attributes)
