"""Study of transfer: where stored feedforward may be reused, and where learning is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from ..._checks import reals
from ..._typing import Array
from ...control import ControllerSpec, TorqueLibrary
from ...errors import InvalidInput
from ...gait import Gait, load_library
from ...robot import Robot, load_robot
from ..experiment import torque_library
from ..report import number
from ..simulation import Schedule, Simulation, to_dataset
from ..world import Scenario
from .gain_reduction import judged, simulate

TOLERANCE = 0.25
"""Relative excess that the error may have in another task over that where it was learned."""
COMPARED = ("thigh", "calf")
"""Joints whose errors are compared."""

# At 0.8 m/s it takes 20 s until the touchdown stays at one tick.
_PRACTICE = Schedule(0.5, 4.0, 28.0)
_REPLAY = Schedule(0.5, 16.0, 0.0)  # the strides that count begin after the start


def may_be_reused(replayed: Array, learned: Array, *, tolerance: float = TOLERANCE) -> bool:
    """The rule for another scenario: try the feedforward, keep it if it tracks nearly as at home.

    Between practised speeds `TorqueLibrary.reusable` knows without a trial.

    Args:
        replayed: Errors of the joints in the new task [rad].
        learned: Their errors where the skill was learned [rad].
        tolerance: By how much their root mean square may be larger.
    """
    return _rms(replayed) <= (1.0 + tolerance) * _rms(learned)


def practise_library(
    robot: Robot, gaits: Sequence[Gait], spec: ControllerSpec, scenario: Scenario
) -> tuple[Simulation, TorqueLibrary]:
    """Learn until the touchdowns have settled; the library is the mean of the last strides."""
    practice = simulate(robot, gaits, spec, scenario, _PRACTICE)
    strides = to_dataset(practice.strides, robot, gaits, attributes={"robot": robot.name})
    return practice, torque_library(strides)


def measure_transfers(
    spec: ControllerSpec,
    speeds: Sequence[float],
    home: Scenario,
    worlds: Sequence[Scenario],
    *,
    robot: str = "a1",
) -> pd.DataFrame:
    """Compare replay at home, at speeds left out, and in other scenarios with learning there.

    Args:
        spec: A controller that learns.
        speeds: Increasing speeds [m/s], three or more.
        home: Where the skill is learned.
        worlds: Where it is tried.
        robot: Short name of the robot.

    Returns:
        A row for each transfer, and for each speed that was left out: `task`; mean peaks over the
        speeds [rad] of the replayed skill, `thigh` and `calf`, and of one practised there,
        `thigh_practised` and `calf_practised`; the rule's answer `reuse`, for a speed from what is
        known of its neighbours, for a world from a trial; and whether that was `right`: whether
        practice gains no more than the tolerance.
    """
    speeds = reals("speeds", speeds)
    if spec.law is None:
        raise InvalidInput(
            f"controller '{spec.name}' does not learn; transfers need a controller that learns, as "
            "'ilc'"
        )
    if len(speeds) < 3:
        raise InvalidInput("transfers need three speeds or more: one between two; give them")
    if np.any(np.diff(speeds) <= 0.0):
        raise InvalidInput("the speeds must increase; give each once, the lowest first")
    machine, library = load_robot(robot), load_library(robot)
    gaits = [library.at(speed) for speed in speeds]
    frozen = replace(spec, law=None, flight_law=None)
    practice, stored = practise_library(machine, gaits, spec, home)
    skill, inner = stored.skill(np.array(speeds)), np.array(speeds)[1:-1]
    left_out, known = stored.left_out(inner)
    learned = _errors(practice)

    def row(task: str, replayed: Array, practised: Array, reuse: bool) -> dict[str, object]:
        gains_little = may_be_reused(replayed, practised)
        peaks = {"thigh": replayed[0], "calf": replayed[1]}
        peaks |= {"thigh_practised": practised[0], "calf_practised": practised[1]}
        return {"task": task, **peaks, "reuse": reuse, "right": reuse == gains_little}

    def tried(task: str, replay: Simulation, practised: Simulation) -> dict[str, object]:
        errors = _errors(replay)
        return row(task, errors, _errors(practised), may_be_reused(errors, learned))

    at_home = simulate(machine, gaits, frozen, home, _REPLAY, skill)
    rows = [tried("at home", at_home, practice)]
    between = simulate(machine, gaits[1:-1], frozen, home, _REPLAY, left_out)
    for k, speed in enumerate(inner):
        # Robots do not know of each other: practice at home was practice at this speed, too.
        errors, practised = _errors(between, k), _errors(practice, k + 1)
        rows.append(row(f"left out {speed:+.2f} m/s", errors, practised, bool(known[k])))
    for world in worlds:
        replayed = simulate(machine, gaits, frozen, world, _REPLAY, skill)
        anew = simulate(machine, gaits, spec, world, _PRACTICE)
        rows.append(tried(world.name, replayed, anew))
    return pd.DataFrame(rows)


def describe_transfers(table: pd.DataFrame) -> str:
    """Format the transfers for a terminal."""
    lines = [
        "                    stored skill [rad]   practised there [rad]   the rule",
        "task                  thigh    calf         thigh    calf",
    ]
    for row in table.itertuples():
        advice = "reuse" if row.reuse else "practise again"
        answer = "right" if row.right else "wrong"
        if np.isnan(row.calf_practised):
            answer = "open, as no robot stayed up that practised there"
        peaks = [
            f"{number(peak, '.4f'):>7}"
            for peak in (row.thigh, row.calf, row.thigh_practised, row.calf_practised)
        ]
        lines.append(
            f"{row.task:<18}  {' '.join(peaks[:2])}       {' '.join(peaks[2:])}   "
            f"{advice}: {answer}"
        )
    return "\n".join([*lines, "", _in_words(table)])


def _in_words(table: pd.DataFrame) -> str:
    table = table.dropna(subset=[f"{joint}_practised" for joint in COMPARED])
    if table.empty:
        return "Nothing is concluded: no robot stayed up that practised."
    between = table[table["task"].str.startswith("left out")].dropna()
    more = [
        number(between[joint].mean() / between[f"{joint}_practised"].mean() - 1.0, "+.0%")
        for joint in COMPARED
    ]
    wrong = table[~table["right"]]
    harmful, needless = int(wrong["reuse"].sum()), int((~wrong["reuse"]).sum())
    return (
        f"At speeds left out the stored skill's mean error is {more[0]} in the thigh and "
        f"{more[1]} in the calf\nagainst practice there. Of {len(table)} answers of the rule "
        f"{harmful} let a skill be reused that practice would better\nby more than "
        f"{TOLERANCE:.0%}, and {needless} asked for practice that gained less."
    )


def _errors(simulation: Simulation, robot: int | None = None) -> Array:
    found = judged(simulation, robot)
    return np.array([found[joint] for joint in COMPARED], dtype=float)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
