"""Trial of a torque library over conditions: at places between those that were practised."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pandas as pd
from tqdm import tqdm

from ...._checks import Interval, whole
from ....control import (
    ControllerSpec,
    InitialFeedforward,
    TorqueLibrary,
    load_controller,
)
from ....errors import InvalidInput
from ....gait import Gait, GaitLibrary
from ....robot import Robot, RobotSpec
from ...experiment import check_library, initial_feedforward
from ...report import number
from ...simulation import Schedule, simulate
from ...world import Scenario
from ..learning_runs import COMPARED, LONG, machine_and_gaits, mean_peaks
from .build_library import in_conditions
from .transfer import TOLERANCE, may_be_reused

_REPLAY = Schedule(0.5, 8.0, 0.0)
_ESTIMATING = Schedule(0.5, 1.0, 8.0)
TOLD_AFTER = 3
"""Strides after which the estimate of the conditions is told."""
KINDS = ("pd", "model", "known", "library", "ilc")
"""No feedforward; the model's; the library's where the robot is told of the conditions; where it
estimates them; and practice there."""


def measure_library(
    library: TorqueLibrary,
    scenario: Scenario,
    *,
    points: int = 20,
    rng: np.random.Generator,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
    progress: bool = False,
) -> pd.DataFrame:
    """Play a library where it was not practised, and practise there, too.

    Args:
        library: A library of conditions.
        scenario: What is the same in all of them.
        points: Number of places, evenly distributed over speeds and conditions at random.
        rng: Draws them.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.
        progress: Show a progress bar.

    Returns:
        A row for each place: `speed` [m/s] and the conditions, by name; these as they were
        estimated after `TOLD_AFTER` strides and at the end, `slope_early`, `slope_late` and the
        like; mean peaks of the last strides [rad], `pd_thigh`, `pd_calf` and likewise of all
        `KINDS`, NaN where the robot fell; the rule's answers, `alike` from the touchdowns at the
        practised places around it, and `tried`, from the errors of the replay beside those where
        the library is at home.

    Raises:
        InvalidInput: The library has no conditions, or is of another robot.
        SpeedOutOfRange: The gaits do not cover its speeds.
    """
    if not library.conditions:
        raise InvalidInput(
            "this torque library is of no conditions; build one with pronk-pin ilc build-library"
        )
    points = whole("points", points, Interval(1, 10_000))
    machine, gait_library = machine_and_gaits(robot, gaits)
    check_library(library, machine, lambda speeds: [gait_library.at(v) for v in speeds])
    axes = {"speed": library.speeds, **library.conditions}
    places = [
        {name: float(rng.uniform(axis[0], axis[-1])) for name, axis in axes.items()}
        for _ in range(points)
    ]
    bar = tqdm(places, desc="trying the library", unit=" places", disable=not progress)
    return pd.DataFrame(
        _row(library, scenario, place, machine, gait_library.at(place["speed"])) for place in bar
    )


def _row(
    library: TorqueLibrary,
    scenario: Scenario,
    place: dict[str, float],
    robot: Robot,
    gait: Gait,
) -> dict[str, object]:
    """What comes out at one place."""
    speed = np.array([place["speed"]])
    conditions = {name: np.array([place[name]]) for name in library.conditions}
    world = in_conditions(scenario, {name: place[name] for name in conditions})
    replay, pd_only = load_controller("library"), load_controller("pd")
    row: dict[str, object] = {**place}

    def play(
        kind: str,
        spec: ControllerSpec,
        initial: InitialFeedforward,
        schedule: Schedule = _REPLAY,
        where: Scenario = world,
    ) -> np.ndarray:
        strides = simulate(
            robot,
            [gait],
            spec,
            where,
            schedule=schedule,
            rng=np.random.default_rng(0),
            initial=initial,
        )
        peaks = mean_peaks(strides)
        row.update({f"{kind}_{joint}": float(peaks[joint]) for joint in COMPARED})
        if initial.library is not None:
            told = strides["conditions"].to_numpy()[0]
            begun = int(np.argmax(strides["learning"].to_numpy()[0] == 1))
            for k, name in enumerate(conditions):
                row[f"{name}_early"] = float(told[begun + TOLD_AFTER - 1, k])
                row[f"{name}_late"] = float(told[int(strides["count"][0]) - 1, k])
        return np.array([peaks[joint] for joint in COMPARED], dtype=float)

    at_home = library.initial_feedforward(speed)
    model, learner = load_controller("model"), load_controller("ilc")
    play("pd", pd_only, InitialFeedforward())
    play("model", model, initial_feedforward(model, [gait], model=robot))
    play("known", replay, library.initial_feedforward(speed, conditions))
    home = play("home", replay, at_home, where=in_conditions(scenario, library.home))
    replayed = play("library", replay, at_home._replace(library=library), _ESTIMATING)
    play("ilc", learner, InitialFeedforward(), LONG)
    row["alike"] = bool(library.reusable(speed, conditions)[0])
    row["tried"] = may_be_reused(replayed, home)
    return row


def describe_library_trial(table: pd.DataFrame) -> str:
    """Format the trial for a terminal, and say what it comes to."""
    names = [name.removesuffix("_late") for name in table.columns if name.endswith("_late")]
    digits = {name: _decimals(table[name]) for name in names}
    head = "".join(f"{name:>8}{'estimated':>14}" for name in names)
    lines = [
        "mean peaks of stance errors from the true contact on, calf/thigh [mrad]; conditions as",
        f"estimated after {TOLD_AFTER} strides and at the end",
        f"{'speed':>6}{head}" + "".join(f"{kind:>8}" for kind in KINDS) + "  rule",
    ]
    for row in table.to_dict("records"):
        told = "".join(
            f"{row[name]:>8.{k}f}{row[f'{name}_early']:>7.{k}f}{row[f'{name}_late']:>7.{k}f}"
            for name, k in digits.items()
        )
        peaks = (
            "/".join(number(1e3 * row[f"{kind}_{joint}"], ".0f") for joint in COMPARED[::-1])
            for kind in KINDS
        )
        rule = "reuse" if row["alike"] else "tried" if row["tried"] else "practise"
        lines.append(
            f"{row['speed']:>+6.2f}{told}" + "".join(f"{peak:>8}" for peak in peaks) + f"  {rule}"
        )
    return "\n".join([*lines, "", *_in_words(table, names)])


def _decimals(values: pd.Series) -> int:
    """Decimals with which values of a condition are told apart."""
    return max(0, 2 - math.floor(math.log10(float(np.ptp(values)) or 1.0)))


def _in_words(table: pd.DataFrame, names: Sequence[str]) -> list[str]:
    lines = []
    for kind, what in (("known", "told of the conditions"), ("library", "estimating them")):
        ratio = _rms(table, kind) / _rms(table, "ilc")
        near = (ratio <= 1.0 + TOLERANCE).mean()
        worse = [table[f"{kind}_{joint}"] > table[f"model_{joint}"] for joint in COMPARED]
        lines.append(
            f"The library, {what}, is within {TOLERANCE:.0%} of practice there at {near:.0%} of "
            f"{len(table)} places\n(median {ratio.median():.2f}, worst {ratio.max():.2f}), and "
            f"worse than the model at {np.any(worse, axis=0).sum()}."
        )
    right = _rms(table, "library") <= (1.0 + TOLERANCE) * _rms(table, "ilc")
    for rule, words in (("alike", "touchdowns alike around it"), ("tried", "a trial")):
        said = table[rule].astype(bool)
        lines.append(
            f"The rule by {words}: reuse at {said.sum()}, of which practice would better "
            f"{(said & ~right).sum()} by more than\n{TOLERANCE:.0%}; practise at {(~said).sum()}, "
            f"of which {(~said & right).sum()} would gain less."
        )
    for name in names:
        told = (table[f"{name}_{when}"] - table[name] for when in ("early", "late"))
        off = [float(np.sqrt(np.mean(error**2))) for error in told]
        lines.append(
            f"{name}: estimated to {off[0]:.2g} after {TOLD_AFTER} strides, to {off[1]:.2g} at the "
            "end (root mean square)"
        )
    return lines


def _rms(table: pd.DataFrame, kind: str) -> pd.Series:
    squares = sum(table[f"{kind}_{joint}"] ** 2 for joint in COMPARED)
    return np.sqrt(squares / len(COMPARED))
