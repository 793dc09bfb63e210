"""When a stored skill may be reused, and when it has to be practised again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from .._typing import Array
from ..control import ControllerSpec, Skill
from ..errors import InvalidInput
from ..gait import load_library
from ..robot import load_robot
from .experiment import torque_library
from .gains import judged, simulate
from .scenario import Scenario
from .simulate import Schedule
from .strides import to_dataset

TOLERANCE = 0.25
"""By how much a reused skill's error may exceed that where it was learned."""
_PRACTICE = Schedule(0.5, 4.0, 16.0)
_REPLAY = Schedule(0.5, 16.0, 0.0)  # the strides that count begin after the start


def may_be_reused(replayed: Array, learned: Array, *, tolerance: float = TOLERANCE) -> bool:
    """The rule: replay the skill for some strides, and keep it if it tracks nearly as at home.

    Args:
        replayed: Errors of the joints in the new task [rad].
        learned: Their errors where the skill was learned [rad].
        tolerance: By how much their root mean square may be larger.
    """
    return _rms(replayed) <= (1.0 + tolerance) * _rms(learned)


def measure_transfers(
    spec: ControllerSpec,
    speeds: Sequence[float],
    home: Scenario,
    worlds: Sequence[Scenario],
    *,
    robot: str = "a1",
) -> pd.DataFrame:
    """Learn at home; replay at home, at speeds left out, and in other worlds, beside practice.

    Args:
        spec: A controller that learns.
        speeds: Increasing speeds [m/s], three or more.
        home: Where the skill is learned.
        worlds: Where it is tried.
        robot: Short name of the robot.

    Returns:
        A row for each transfer, and for each speed that was left out: `task`; mean peaks over the
        speeds [rad] of the replayed skill, `thigh` and `calf`, and of one practised there,
        `thigh_practised` and `calf_practised`; the
        rule's answer `reuse`; and whether that was `right`: whether practice gains no more than the
        tolerance.
    """
    if spec.law is None or len(speeds) < 3:
        raise InvalidInput("transfers need a controller that learns, and three speeds or more")
    machine, library = load_robot(robot), load_library(robot)
    gaits = [library.at(speed) for speed in speeds]
    frozen = replace(spec, law=None, flight_law=None)
    practice = simulate(machine, gaits, spec, home, _PRACTICE)
    strides = to_dataset(practice.strides, machine, gaits, attributes={"robot": robot})
    stored = torque_library(strides)  # the mean of the last strides, as the controller replays
    skill = Skill(stored.torque, stored.flight)
    inner = np.array(speeds)[1:-1]
    left_out = Skill(np.concatenate([stored.without(v).at(np.array([v])) for v in inner]))
    at_home = simulate(machine, gaits, frozen, home, _REPLAY, skill)
    between = simulate(machine, gaits[1:-1], frozen, home, _REPLAY, left_out)
    inside = simulate(machine, gaits[1:-1], spec, home, _PRACTICE)
    tasks = [("at home", at_home, practice), ("speeds left out", between, inside)]
    for world in worlds:
        replayed = simulate(machine, gaits, frozen, world, _REPLAY, skill)
        tasks.append((world.name, replayed, simulate(machine, gaits, spec, world, _PRACTICE)))
    judgements = [(name, judged(one), judged(other)) for name, one, other in tasks]
    by_speed = [
        (f"left out {speed:+.2f} m/s", judged(between, k), judged(inside, k))
        for k, speed in enumerate(inner)
    ]
    judgements[2:2] = by_speed
    rows, learned = [], _errors(judged(practice))
    for name, replayed_there, practised_there in judgements:
        with_skill, anew = _errors(replayed_there), _errors(practised_there)
        reuse = may_be_reused(with_skill, learned)
        gains_little = _rms(with_skill) <= (1.0 + TOLERANCE) * _rms(anew)
        row = {"task": name, "thigh": with_skill[0], "calf": with_skill[1]}
        row |= {"thigh_practised": anew[0], "calf_practised": anew[1]}
        rows.append({**row, "reuse": reuse, "right": reuse == gains_little})
    return pd.DataFrame(rows)


def describe_transfers(table: pd.DataFrame) -> str:
    """The transfers as text for a terminal."""
    lines = [
        "                    stored skill [rad]   practised there [rad]   the rule",
        "task                  thigh    calf         thigh    calf",
    ]
    for row in table.itertuples():
        advice = "reuse" if row.reuse else "practise again"
        lines.append(
            f"{row.task:<18}  {row.thigh:7.4f} {row.calf:7.4f}       {row.thigh_practised:7.4f} "
            f"{row.calf_practised:7.4f}   {advice}: {'right' if row.right else 'wrong'}"
        )
    return "\n".join(lines)


def _errors(judged_: dict[str, float | int]) -> Array:
    return np.array([judged_["thigh"], judged_["calf"]], dtype=float)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
