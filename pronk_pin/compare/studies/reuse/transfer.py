"""Study of transfer: where stored feedforward may be reused, and where learning is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr

from ...._typing import Array
from ....control import ControllerSpec, InitialFeedforward
from ....gait import Gait, GaitLibrary
from ....robot import RobotSpec
from ...experiment import torque_library
from ...report import number
from ...simulation import Schedule, simulate
from ...world import Scenario
from ..learning_runs import (
    COMPARED,
    learn,
    learning_law,
    machine_and_gaits,
    mean_peaks,
    speeds_with_neighbours,
)

TOLERANCE = 0.25
"""Relative excess that the error may have in another task over that where it was learned."""
_REPLAY = Schedule(0.5, 16.0, 0.0)  # the strides that count begin after the start


def may_be_reused(replayed: Array, learned: Array, *, tolerance: float = TOLERANCE) -> bool:
    """The rule for another scenario: try the feedforward, keep it if it tracks nearly as at home.

    Between learned speeds `TorqueLibrary.reusable` knows without a trial.

    Args:
        replayed: Errors of the joints in the new task [rad].
        learned: Their errors where the stored feedforward was learned [rad].
        tolerance: By how much their root mean square may be larger.
    """
    return _rms(replayed) <= (1.0 + tolerance) * _rms(learned)


def measure_transfers(
    spec: ControllerSpec,
    speeds: Sequence[float],
    home: Scenario,
    scenarios: Sequence[Scenario],
    *,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
) -> pd.DataFrame:
    """Compare replay at home, at speeds left out, and in other scenarios with learning there.

    Args:
        spec: A controller that learns.
        speeds: Increasing speeds [m/s], three or more.
        home: Where the stored feedforward is learned.
        scenarios: Where it is tried.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.

    Returns:
        A row for each transfer, and for each speed that was left out: `task`; mean peaks over the
        speeds [rad] of the replayed feedforward, `thigh` and `calf`, and of one learned there,
        `thigh_relearned` and `calf_relearned`; the rule's answer `reuse`, for a speed from what is
        known of its neighbours, for a world from a trial; and whether that was `right`: whether
        learning gains no more than the tolerance.
    """
    learning_law(spec)
    speeds = speeds_with_neighbours("transfer", speeds)
    machine, library = machine_and_gaits(robot, gaits)
    played = [library.at(speed) for speed in speeds]
    frozen = replace(spec, law=None, flight_law=None)
    learning = learn(machine, played, spec, home)
    stored = torque_library(learning)
    initial, inner = stored.initial_feedforward(np.array(speeds)), np.array(speeds)[1:-1]
    left_out, reusable = stored.left_out(inner)
    learned = _errors(learning)

    def replay(own: Sequence[Gait], world: Scenario, initial: InitialFeedforward) -> xr.Dataset:
        rng = np.random.default_rng(0)
        return simulate(machine, own, frozen, world, schedule=_REPLAY, rng=rng, initial=initial)

    def row(task: str, replayed: Array, relearned_errors: Array, reuse: bool) -> dict[str, object]:
        gains_little = may_be_reused(replayed, relearned_errors)
        peaks = {"thigh": replayed[0], "calf": replayed[1]}
        peaks |= {"thigh_relearned": relearned_errors[0], "calf_relearned": relearned_errors[1]}
        return {"task": task, **peaks, "reuse": reuse, "right": reuse == gains_little}

    def tried(task: str, replayed: xr.Dataset, relearned: xr.Dataset) -> dict[str, object]:
        errors = _errors(replayed)
        return row(task, errors, _errors(relearned), may_be_reused(errors, learned))

    rows = [tried("at home", replay(played, home, initial), learning)]
    between = replay(played[1:-1], home, left_out)
    for k, speed in enumerate(inner):
        # Robots do not know of each other: learning at home was learning at this speed, too.
        errors, relearned_errors = _errors(between, k), _errors(learning, k + 1)
        rows.append(row(f"left out {speed:+.2f} m/s", errors, relearned_errors, bool(reusable[k])))
    for scenario in scenarios:
        relearned = learn(machine, played, spec, scenario)
        rows.append(tried(scenario.name, replay(played, scenario, initial), relearned))
    return pd.DataFrame(rows)


def describe_transfers(table: pd.DataFrame) -> str:
    """Format the transfers for a terminal."""
    lines = [
        "                    stored feedforward [rad]   learned there [rad]   the rule",
        "task                  thigh    calf         thigh    calf",
    ]
    for row in table.itertuples():
        advice = "reuse" if row.reuse else "learn again"
        answer = "right" if row.right else "wrong"
        if np.isnan(row.calf_relearned):
            answer = "open, as no robot stayed up that learned there"
        peaks = [
            f"{number(peak, '.4f'):>7}"
            for peak in (row.thigh, row.calf, row.thigh_relearned, row.calf_relearned)
        ]
        lines.append(
            f"{row.task:<18}  {' '.join(peaks[:2])}       {' '.join(peaks[2:])}   "
            f"{advice}: {answer}"
        )
    return "\n".join([*lines, "", _in_words(table)])


def _in_words(table: pd.DataFrame) -> str:
    table = table.dropna(subset=[f"{joint}_relearned" for joint in COMPARED])
    if table.empty:
        return "Nothing is concluded: no robot stayed up that learned."
    between = table[table["task"].str.startswith("left out")].dropna()
    more = [
        number(between[joint].mean() / between[f"{joint}_relearned"].mean() - 1.0, "+.0%")
        for joint in COMPARED
    ]
    wrong = table[~table["right"]]
    harmful, needless = int(wrong["reuse"].sum()), int((~wrong["reuse"]).sum())
    return (
        f"At speeds left out the stored feedforward's mean error is {more[0]} in the thigh and "
        f"{more[1]} in the calf\nagainst learning there. Of {len(table)} answers of the rule "
        f"{harmful} let stored feedforward be reused that learning would better\nby more than "
        f"{TOLERANCE:.0%}, and {needless} asked for learning that gained less."
    )


def _errors(strides: xr.Dataset, robot: int | None = None) -> Array:
    peaks = mean_peaks(strides, robot)
    return np.array([peaks[joint] for joint in COMPARED], dtype=float)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
