"""Study of the initial feedforward: none, the model's, or the library's of other speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from ...._typing import Array
from ....control import ControllerSpec, InitialFeedforward, TorqueLibrary, load_controller
from ....gait import Gait, GaitLibrary
from ....robot import Robot, RobotSpec
from ...experiment import initial_feedforward, torque_library
from ...metrics import STEADY_STRIDES, settling_stride
from ...report import number
from ...simulation import Schedule, simulate
from ...world import Scenario
from ..learning_runs import (
    COMPARED,
    learn,
    learning_law,
    machine_and_gaits,
    peaks_by_stride,
    speeds_with_neighbours,
)

LEARNERS = ("ilc", "model+ilc", "library+ilc")
"""The same laws, from nothing, from the model's feedforward, and from the torque library."""
SHOWN = (0, 1, 2, 5, 10)
"""Strides of learning in the table; 0 is the last one before."""
_SCHEDULE = Schedule(0.5, 4.0, 16.0)
_WORDS = {"none": "nothing", "model": "the model", "library": "the library"}


def measure_seeding(
    speeds: Sequence[float],
    scenario: Scenario,
    *,
    spec: ControllerSpec | None = None,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
) -> pd.DataFrame:
    """Learn at the inner speeds from each initial feedforward; the library holds the others only.

    Args:
        speeds: Increasing speeds [m/s], three or more. The library is learned at all of them,
            and each inner one begins with what its neighbours learned.
        scenario: The scenario.
        spec: A controller whose laws learn; by default `ilc`.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.

    Returns:
        A row for each controller of `LEARNERS`, with these laws, speed and stride: `controller`,
        `speed`, `stride` (of learning; 0 is the last before it), peak stance errors `thigh` and
        `calf`, means over the legs [rad], and whether the robot stayed `upright`.

    Raises:
        InvalidInput: There are fewer than three speeds, they do not increase, or the controller
            does not learn.
    """
    spec = load_controller("ilc") if spec is None else spec
    learning_law(spec)
    speeds = speeds_with_neighbours("seeding", speeds)
    machine, library = machine_and_gaits(robot, gaits)
    learned = [library.at(speed) for speed in speeds]
    specs = [
        replace(spec, name=name, source=load_controller(name).source, library="", library_sha256="")
        for name in LEARNERS
    ]
    inner = learned[1:-1]
    stored = torque_library(learn(machine, learned, specs[0], scenario))
    tables = []
    for spec in specs:
        strides = simulate(
            machine,
            inner,
            spec,
            scenario,
            schedule=_SCHEDULE,
            rng=np.random.default_rng(0),
            initial=_seed(spec, machine, inner, stored),
        )
        tables.append(peaks_by_stride(strides).assign(controller=spec.name))
    return pd.concat(tables, ignore_index=True)


def settling(table: pd.DataFrame) -> pd.DataFrame:
    """Count the strides of learning until thigh and calf have settled, by controller and speed.

    All controllers have the same goal: a tenth or less missing of what learning from nothing takes
    away. It is 0 where the seed alone is there, and NaN where a robot never stays there, or falls,
    or where the one that learns from nothing does, so that there is no goal.

    Args:
        table: What `measure_seeding` returns.
    """
    rows_out = []
    for speed, rows in table.groupby("speed"):
        curves = {name: _curves(rows, name) for name in LEARNERS}
        nothing = curves[LEARNERS[0]]
        final = nothing[-STEADY_STRIDES:].mean(axis=0)
        for name, curve in curves.items():
            fell = not rows[rows["controller"].isin([name, LEARNERS[0]])]["upright"].all()
            counts = [
                float("nan")
                if fell
                else settling_stride(curve[:, j], float(nothing[0, j]), float(final[j])) - 1.0
                for j in range(len(COMPARED))
            ]
            rows_out.append({"controller": name, "speed": speed, "strides": float(np.max(counts))})
    return pd.DataFrame(rows_out)


def stayed_up(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of the robots that did not fall."""
    stood = table.groupby(["controller", "speed"])["upright"].transform("all")
    return table[stood.astype(bool)]


def describe_seeding(table: pd.DataFrame) -> str:
    """Format medians over the speeds, with their range, for a terminal."""
    strides, speeds = settling(table), table["speed"].nunique()
    peaks = " ".join(f"{f'stride {k}':>9}" for k in SHOWN)
    lines = [
        f"median over {speeds} speed{'s' if speeds > 1 else ''}",
        f"begins with   joint   peak [rad]: {peaks}   the end   strides to settle",
    ]
    for name in LEARNERS:
        of_controller = table[table["controller"] == name]
        fell = int((~of_controller.groupby("speed")["upright"].all()).sum())
        of_controller, counts = stayed_up(of_controller), _of(strides, name)
        took = _settled(counts) + (f", {fell} fell" if fell else "")
        for joint in COMPARED:
            medians = of_controller.groupby("stride")[joint].median()
            values = " ".join(f"{number(medians.get(k, np.nan), '.4f'):>9}" for k in SHOWN)
            end = f"{number(medians.iloc[-STEADY_STRIDES:].median(), '.4f'):>9}"
            first = joint == COMPARED[0]
            start = _WORDS[load_controller(name).source] if first else ""
            line = f"{start:<12}  {joint:<20}{values} {end}"
            lines.append(f"{line}   {took}" if first else line)
    return "\n".join(lines)


def _settled(counts: Array) -> str:
    """Strides to settle of those that did, (n,) with NaN for the others."""
    did = counts[np.isfinite(counts)]
    if did.size == 0:
        return "never"
    text = f"{np.median(did):.0f} ({did.min():.0f} to {did.max():.0f})"
    return text if did.size == counts.size else f"{text}, {did.size} of {counts.size}"


def _seed(
    spec: ControllerSpec, robot: Robot, gaits: Sequence[Gait], stored: TorqueLibrary
) -> InitialFeedforward:
    if spec.source == "library":
        return stored.left_out(np.array([gait.speed for gait in gaits]))[0]
    return initial_feedforward(spec, gaits, model=robot)


def _curves(rows: pd.DataFrame, controller: str) -> Array:
    """Peaks of one robot by stride, (strides, 2)."""
    of_controller = rows[rows["controller"] == controller].sort_values("stride")
    return np.asarray(of_controller[list(COMPARED)].to_numpy(), dtype=float)


def _of(strides: pd.DataFrame, controller: str) -> Array:
    return np.asarray(strides[strides["controller"] == controller]["strides"], dtype=float)
