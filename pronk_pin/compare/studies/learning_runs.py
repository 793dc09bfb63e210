"""Learning runs and their peaks, as several studies need them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

from ..._checks import reals
from ...control import ControllerSpec, LearningLaw
from ...errors import InvalidInput
from ...gait import Gait, GaitLibrary
from ...robot import JOINTS, Robot, RobotSpec
from ..experiment import Experiment
from ..metrics import STEADY_STRIDES
from ..simulation import Progress, Schedule, simulate
from ..world import Scenario

COMPARED = ("thigh", "calf")
"""Joints whose errors are compared."""

# At 0.8 m/s it takes 20 s until the touchdown stays at one tick.
LONG = Schedule(0.5, 4.0, 28.0)
"""Baseline and learning until the touchdowns have settled."""


def machine_and_gaits(
    robot: str | RobotSpec, gaits: str | GaitLibrary
) -> tuple[Robot, GaitLibrary]:
    """A robot and its gaits, each given as an `Experiment` takes it.

    Raises:
        PronkError: What `Experiment` raises.
    """
    experiment = Experiment(robot=robot, gaits=gaits, controllers=("pd",))
    return experiment.model, experiment.library


def learning_law(spec: ControllerSpec) -> LearningLaw:
    """The law of the stance that a controller learns by.

    Raises:
        InvalidInput: It has none.
    """
    if spec.law is None:
        raise InvalidInput(
            f"controller '{spec.name}' does not learn in stance; choose one with a law, as 'ilc'"
        )
    return spec.law


def speeds_with_neighbours(study: str, speeds: Sequence[float]) -> tuple[float, ...]:
    """Speeds for a study that leaves the inner ones out [m/s].

    Raises:
        InvalidInput: There are fewer than three, or they do not increase.
    """
    speeds = reals("speeds", speeds)
    if len(speeds) < 3:
        raise InvalidInput(f"{study} needs three speeds or more: one between two that are learned")
    if np.any(np.diff(speeds) <= 0.0):
        raise InvalidInput("the speeds must increase; give each once, the lowest first")
    return speeds


def learn(
    robot: Robot,
    gaits: Sequence[Gait],
    spec: ControllerSpec,
    scenario: Scenario,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Learn until the touchdowns have settled; the strides, of which a torque library is made."""
    rng = np.random.default_rng(0)
    return simulate(robot, gaits, spec, scenario, schedule=LONG, rng=rng, progress=progress)


def peaks_by_stride(strides: xr.Dataset) -> pd.DataFrame:
    """Peaks of each robot from the last stride before the learning on, as many of each.

    Returns:
        A row for each speed and stride: `speed` [m/s], `stride` (of learning; 0 is the last before
        it), peak stance errors `thigh` and `calf` from the true contact on, means over the legs
        [rad], and whether the robot is `upright`.
    """
    learning, peak, upright = (
        strides[name].to_numpy() for name in ("learning", "peak_error", "upright")
    )
    first, tables = np.argmax(learning == 1, axis=1), []
    length = int((strides["count"].to_numpy() - first).min()) + 1
    for k, speed in enumerate(strides["speed"].to_numpy()):
        window = slice(first[k] - 1, first[k] - 1 + length)
        legs = peak[k, window].reshape(length, -1, len(JOINTS)).mean(axis=1)  # (length, 3)
        tables.append(
            pd.DataFrame(
                {
                    "speed": speed,
                    "stride": np.arange(length),
                    **{joint: legs[:, JOINTS.index(joint)] for joint in COMPARED},
                    "upright": upright[k, window] == 1,
                }
            )
        )
    return pd.concat(tables, ignore_index=True)


def mean_peaks(strides: xr.Dataset, robot: int | None = None) -> dict[str, float | int]:
    """Mean peaks over the last strides of the robots, or one, and how many robots stayed up.

    Means are over those that stayed up; NaN without one. Each robot counts with its own last
    `STEADY_STRIDES`, learned in or not, where `compare.metrics` takes as many of all.
    """
    counts = strides["count"].to_numpy()
    peaks = strides["peak_error"].transpose("speed", "stride", "joint").to_numpy()
    upright = (strides["upright"] != 0.0).all("stride").to_numpy()  # NaN where there is no stride
    steady = [
        peaks[k, max(0, count - STEADY_STRIDES) : count].mean(axis=0)
        for k, count in enumerate(counts)
        if robot in (None, k) and upright[k] and count
    ]
    legs = np.mean(steady, axis=0) if steady else np.full(strides.sizes["joint"], np.nan)
    means = legs.reshape(-1, len(JOINTS)).mean(axis=0)
    return {
        **{joint: float(mean) for joint, mean in zip(JOINTS, means, strict=True)},
        "upright": int(upright.sum()),
        "robots": len(upright),
    }
