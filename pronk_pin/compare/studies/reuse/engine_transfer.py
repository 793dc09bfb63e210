"""Study of engines: does a skill that was learned in one hold in another?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from ...._checks import sequence_of, text
from ....control import InitialFeedforward, load_controller
from ....errors import InvalidInput
from ....gait import Gait
from ....robot import Robot
from ...experiment import initial_feedforward, torque_library
from ...metrics import STEADY_STRIDES
from ...report import number
from ...simulation import Progress, Schedule, simulate
from ...world import Scenario, check_engine, engine_of
from ..learning_runs import COMPARED, learn, peaks_by_stride

SHOWN = (0, 1, 5, 15)
"""Strides of learning in the table; 0 is the last one before."""

STARTS = ("nothing", "the model")
"""What learning begins with, beside the skills of the engines."""

_SCHEDULE = Schedule(0.5, 4.0, 16.0)


def measure_engine_transfer(
    robot: Robot,
    gaits: Sequence[Gait],
    scenario: Scenario,
    engines: Sequence[str],
    *,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Learn in each engine; then begin in each with nothing, the model, and each engine's skill.

    Each robot first plays 4 s of what it begins with, and then learns on.

    Args:
        robot: The robot.
        gaits: Gaits of the speeds.
        scenario: The scenario.
        engines: Names or addresses of engines, two or more.
        progress: Called with the number of time steps done since the last call.

    Returns:
        A row for each engine, start, speed and stride: `engine`, `start` ("nothing", "the model",
        or the engine in which the skill was learned), `speed`, `stride` (of learning; 0 is the last
        before it), peak stance errors `thigh` and `calf`, means over the legs [rad], and whether
        the robot stayed `upright`.

    Raises:
        InvalidInput: There are fewer than two engines, or one cannot simulate the scenario.
        MissingExtra: One is not installed.
    """
    engines = sequence_of("engines", engines, text)
    if len(set(engines)) < 2:
        raise InvalidInput("a transfer between engines needs two of them; give another one")
    asked = [scenario.in_engine(engine) for engine in dict.fromkeys(engines)]
    worlds = {engine_of(world).name: world for world in asked}
    for world in asked:
        check_engine(robot, world, "locked")
    fresh, seeded, skilled = map(load_controller, ("ilc", "model+ilc", "library+ilc"))
    skills = {
        engine: torque_library(learn(robot, gaits, fresh, world, progress=progress))
        for engine, world in worlds.items()
    }
    speeds = np.array([gait.speed for gait in gaits])
    model = initial_feedforward(seeded, gaits, model=robot)
    starts = {"nothing": (fresh, InitialFeedforward()), "the model": (seeded, model)}
    starts |= {name: (skilled, skill.initial_feedforward(speeds)) for name, skill in skills.items()}
    tables = []
    for engine, world in worlds.items():
        for start, (spec, initial) in starts.items():
            rng = np.random.default_rng(0)
            strides = simulate(
                *(robot, gaits, spec, world),
                schedule=_SCHEDULE,
                rng=rng,
                initial=initial,
                progress=progress,
            )
            table = peaks_by_stride(strides)
            tables.append(table.assign(engine=engine, start=start))
    return pd.concat(tables, ignore_index=True)


def describe_engine_transfer(table: pd.DataFrame) -> str:
    """Format means over the speeds for a terminal, and say what they mean."""
    columns = "".join(f"{name:>12}" for name in (*(f"stride {k}" for k in SHOWN), "the end"))
    wide = max(len(name) for name in table["engine"])
    lines = [
        f"mean peaks of {table['speed'].nunique()} speeds in stance, calf and thigh [mrad],",
        "by stride of learning; 0 is the last before it",
        f"{'engine':<{wide}}  {'begins with':<{wide + 9}}{columns}",
    ]
    for (engine, start), rows in table.groupby(["engine", "start"], sort=False):
        skill = start if start in STARTS else f"skill of {start}"
        peaks = rows.groupby("stride")[list(reversed(COMPARED))].mean()
        cells = [_pair(peaks.loc[k].to_numpy()) if k in peaks.index else "-" for k in SHOWN]
        cells.append(_pair(peaks.iloc[-STEADY_STRIDES:].mean().to_numpy()))
        fell = int((~rows.groupby("speed")["upright"].all()).sum())
        tail = f"   {fell} fell" if fell else ""
        columns = "".join(f"{cell:>12}" for cell in cells)
        lines.append(f"{engine:<{wide}}  {skill:<{wide + 9}}{columns}{tail}")
    return "\n".join([*lines, "", *_in_words(table)])


def _pair(peaks: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return ", ".join(number(1e3 * float(peak), ".1f") for peak in peaks)


def _in_words(table: pd.DataFrame) -> Iterator[str]:
    """Of each skill in each other engine: what of the errors it takes away at once, and later."""

    def error(engine: str, start: str, stride: int | None) -> float:
        rows = table[(table["engine"] == engine) & (table["start"] == start)]
        last = rows["stride"].max()
        at = rows["stride"] > last - STEADY_STRIDES if stride is None else rows["stride"] == stride
        return float(rows[at][list(COMPARED)].to_numpy().mean())

    engines = list(dict.fromkeys(table["engine"]))
    for there in engines:
        nothing, goal = error(there, "nothing", 0), error(there, "nothing", None)
        for origin in engines:
            if origin == there:
                continue
            shares = [
                (nothing - error(there, origin, stride)) / (nothing - goal) for stride in (0, 5, 15)
            ]
            at_once, five, fifteen = (number(share, ".0%") for share in shares)
            yield (
                f"Of the error that practice takes away in {there}, the skill of {origin} takes "
                f"{at_once}\nwithout learning there, {five} after 5 strides, {fifteen} after 15."
            )
