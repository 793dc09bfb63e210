"""Study of smaller feedback gains after learning, as the paper claims (section IV)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from ..._checks import Interval, reals
from ...control import ControllerSpec, Gains, InitialFeedforward
from ...errors import InvalidInput
from ...gait import Gait, load_library
from ...robot import JOINTS, NL, Robot, load_robot
from ..metrics import STEADY_STRIDES
from ..report import number
from ..simulation import Schedule, Simulation
from ..world import Scenario

SHARES = (1.0, 0.75, 0.5, 0.35, 0.25)
"""Feedback gains of the sweep, over the controller's own."""
NO_FEEDFORWARD = InitialFeedforward()
"""Initial feedforward of a robot that has not learned."""
_BASELINE, _LEARNING, _REPLAY = 4.0, 16.0, 16.0


def sweep_gains(
    spec: ControllerSpec,
    speeds: Sequence[float],
    scenario: Scenario,
    *,
    robot: str = "a1",
    shares: Sequence[float] = SHARES,
) -> pd.DataFrame:
    """Learn once with full gains, then replay the learned feedforward with smaller ones.

    Args:
        spec: A controller that learns.
        speeds: Desired speeds [m/s].
        scenario: The scenario.
        robot: Short name of the robot.
        shares: Feedback gains, over the controller's own.

    Returns:
        A row for each share, with and without what was learned: `share`, `learned`, mean peak
        stance errors `thigh` and `calf` [rad] over speeds and the last strides, robots `upright`
        and how many `robots` there are.
    """
    if spec.law is None:
        raise InvalidInput(
            f"controller '{spec.name}' does not learn; choose one that does, as 'ilc'"
        )
    speeds, shares = reals("speeds", speeds), reals("shares", shares, Interval(0, 1))
    if not speeds or not shares:
        raise InvalidInput("no speeds or no shares; give at least one of each")
    machine, library = load_robot(robot), load_library(robot)
    gaits = [library.at(speed) for speed in speeds]
    learning = simulate(machine, gaits, spec, scenario, Schedule(0.5, _BASELINE, _LEARNING))
    controller = learning.controller
    learned = InitialFeedforward(controller.feedforward, controller.flight)
    rows = []
    for share in shares:
        for initial in (NO_FEEDFORWARD, learned):
            gains = Gains(_scaled(spec.gains.kp, share), _scaled(spec.gains.kd, share))
            replay = replace(spec, law=None, flight_law=None, gains=gains)
            if initial is NO_FEEDFORWARD:
                replay = replace(replay, timing=None)  # learning finds that out, too
            schedule = Schedule(0.5, _REPLAY, 0.0)
            replayed = simulate(machine, gaits, replay, scenario, schedule, initial)
            rows.append({"share": share, "learned": initial is learned, **mean_peaks(replayed)})
    return pd.DataFrame(rows)


def describe_gains(table: pd.DataFrame) -> str:
    """The sweep as a table, and the answer computed from it, as text for a terminal."""
    lines = [
        "          peak without learning [rad]     peak with what was learned [rad]",
        "gains       thigh    calf   upright         thigh    calf   upright",
    ]
    for share, pair in table.groupby("share", sort=False):
        cells = "".join(
            f"    {number(row.thigh, '.4f'):>7} {number(row.calf, '.4f'):>7}  "
            f"{row.upright:2d} of {row.robots:2d}    "
            for row in pair.sort_values("learned").itertuples()
        )
        lines.append(f"{float(str(share)):5.0%}  {cells.rstrip()}")
    return "\n".join([*lines, "", _answer(table)])


def _answer(table: pd.DataFrame) -> str:
    full = table[(table["share"] == table["share"].max()) & ~table["learned"]].iloc[0]
    if not full["upright"]:
        return "Nothing is concluded: no robot stayed up with full gains and without learning."
    good = table[
        table["learned"]
        & (table["thigh"] <= full["thigh"])
        & (table["calf"] <= full["calf"])
        & (table["upright"] == table["robots"])
    ]
    smaller = good[good["share"] < full["share"]]
    if smaller.empty:
        return "No: with smaller gains, what was learned does not track as well as full gains did."
    least = smaller.loc[smaller["share"].idxmin()]
    plain = table[(table["share"] == least["share"]) & ~table["learned"]].iloc[0]
    alone = f"{plain['calf']:.3f}" if plain["upright"] else "all fell"
    return (
        f"Yes: down to {least['share']:.0%} of the gains, what was learned tracks at least as well "
        f"as full\ngains without it ({least['calf']:.3f} against {full['calf']:.3f} rad in the "
        f"calf; {alone} with those gains alone)."
    )


def simulate(
    robot: Robot,
    gaits: Sequence[Gait],
    spec: ControllerSpec,
    scenario: Scenario,
    schedule: Schedule,
    initial: InitialFeedforward = NO_FEEDFORWARD,
) -> Simulation:
    """Run a simulation of a controller, with one seed."""
    simulation = Simulation(
        robot,
        gaits,
        spec,
        scenario,
        schedule=schedule,
        rng=np.random.default_rng(0),
        feedforward=initial.feedforward,
        flight=initial.flight,
    )
    simulation.run()
    return simulation


def mean_peaks(simulation: Simulation, robot: int | None = None) -> dict[str, float | int]:
    """Mean peaks over the last strides of the robots, or one, and how many robots stayed up.

    Means are over those that stayed up; NaN without one.
    """
    log = simulation.strides
    steady = [
        log["peak_error"][k, max(0, count - STEADY_STRIDES) : count].mean(axis=0)
        for k, count in enumerate(log.count)
        if robot in (None, k) and simulation.upright[k] and count
    ]
    legs = np.mean(steady, axis=0) if steady else np.full(NL, np.nan)
    peaks = legs.reshape(-1, len(JOINTS)).mean(axis=0)
    upright = simulation.upright
    return {
        **{joint: float(peak) for joint, peak in zip(JOINTS, peaks, strict=True)},
        "upright": int(upright.sum()),
        "robots": len(upright),
    }


def _scaled(gains: tuple[float, float, float], share: float) -> tuple[float, float, float]:
    hip, thigh, calf = gains
    return share * hip, share * thigh, share * calf
