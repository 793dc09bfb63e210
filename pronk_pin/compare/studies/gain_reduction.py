"""Study of smaller feedback gains after learning, as the paper claims (section IV)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from ..._checks import Interval, reals
from ...control import ControllerSpec, Gains, InitialFeedforward
from ...errors import InvalidInput
from ...gait import GaitLibrary
from ...robot import RobotSpec
from ..report import number
from ..simulation import Schedule, Simulation, simulate
from ..world import Scenario
from .learning_runs import learning_law, machine_and_gaits, mean_peaks

SHARES = (1.0, 0.75, 0.5, 0.35, 0.25)
"""Feedback gains of the sweep, over the controller's own."""
_LEARNING, _REPLAY = Schedule(0.5, 4.0, 16.0), Schedule(0.5, 16.0, 0.0)


def sweep_gains(
    spec: ControllerSpec,
    speeds: Sequence[float],
    scenario: Scenario,
    *,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
    shares: Sequence[float] = SHARES,
) -> pd.DataFrame:
    """Learn once with full gains, then replay the learned feedforward with smaller ones.

    Args:
        spec: A controller that learns.
        speeds: Desired speeds [m/s].
        scenario: The scenario.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.
        shares: Feedback gains, over the controller's own.

    Returns:
        A row for each share, with and without what was learned: `share`, `learned`, mean peak
        stance errors `thigh` and `calf` [rad] over speeds and the last strides, robots `upright`
        and how many `robots` there are.
    """
    learning_law(spec)
    speeds, shares = reals("speeds", speeds), reals("shares", shares, Interval(0, 1))
    if not speeds or not shares:
        raise InvalidInput("no speeds or no shares; give at least one of each")
    machine, library = machine_and_gaits(robot, gaits)
    played = [library.at(speed) for speed in speeds]
    rng = np.random.default_rng(0)
    learning = Simulation(machine, played, spec, scenario, schedule=_LEARNING, rng=rng)
    learning.run()
    learned = InitialFeedforward(learning.controller.feedforward, learning.controller.flight)
    rows = []
    for share in shares:
        for initial in (None, learned):
            full = spec.gains_of(machine)
            gains = Gains(_scaled(full.kp, share), _scaled(full.kd, share))
            replay = replace(spec, law=None, flight_law=None, gains=gains, stiffness=1.0)
            if initial is None:
                replay = replace(replay, timing=None)  # learning finds that out, too
            replayed = simulate(
                machine,
                played,
                replay,
                scenario,
                schedule=_REPLAY,
                rng=np.random.default_rng(0),
                initial=initial,
            )
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


def _scaled(gains: tuple[float, float, float], share: float) -> tuple[float, float, float]:
    hip, thigh, calf = gains
    return share * hip, share * thigh, share * calf
