"""Study of commanded speeds: does what was learned at constant speeds hold while they change, and
can it be learned while they do?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from ...control import InitialFeedforward, SpeedCommand, SpeedProfile, load_controller
from ...errors import InvalidInput
from ...gait import GaitLibrary
from ...robot import RobotSpec
from ..experiment import Experiment, run_cell, torque_library
from ..metrics import stride_table, summarize_commands
from ..simulation import Progress, Schedule, Simulation, simulate
from ..world import Scenario
from .learning_runs import COMPARED, LONG, learn, machine_and_gaits, mean_peaks

RAMPS = (
    *("0 4s, 0->0.8 8s, 0.8 4s, 0.8->0 8s, 0 4s", "0 4s, 0->0.8 2s, 0.8 4s, 0.8->0 2s, 0 4s"),
    *("0 4s, 0->0.8 0.8s, 0.8 4s, 0.8->0 0.8s, 0 4s", "0 4s, 0.3 4s, 0.6 4s, 0.3 4s, 0 4s"),
)
"""Ramps to 0.8 m/s and back, slower and faster, and steps of 0.3 m/s."""

DRIVERS = ("pd", "model", "library", "library+ilc")
"""Without feedforward, with the model's, with what was learned at constant speeds, and learning on
from there."""

SWEEPS = "0 4s, 0->0.8 8s, 0.8->-0.5 13s, -0.5->0.8 13s, 0.8->-0.5 13s, -0.5->0 5s"
"""A minute over all speeds, twice to and fro."""

_REPLAY = Schedule(0.5, 8.0, 0.0)

PUSHED = ("0 12s", "0.4 12s", "0.8 12s")
"""Constant speeds, at which a push is told best."""

_NEAR = 0.05
"""Difference to the command [m/s] within which a robot has settled."""


class Driving(NamedTuple):
    """What robots did that were driven by commands."""

    strides: pd.DataFrame
    """The strides of all controllers, see `compare.metrics.stride_table`."""
    summary: pd.DataFrame
    """The summary, see `compare.metrics.summarize_commands`, with `strides_to_settle`: until the
    mean speed stays within 0.05 m/s of the command, after the push, or the command's last change;
    NaN where it does not."""


def measure_driving(
    commands: Sequence[str],
    scenario: Scenario,
    *,
    controllers: Sequence[str] = DRIVERS,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
    references: Sequence[str] = ("commanded",),
    push: float = 0.0,
    progress: Progress | None = None,
) -> Driving:
    """Learn at the shipped speeds that the commands span, then drive by them.

    This is an `Experiment` with commands, with a longer learning beforehand, in which nobody is
    pushed.

    Args:
        commands: Speed profiles, see `SpeedProfile.parse`.
        scenario: The scenario, of the learning and of the driving.
        controllers: Names of controllers.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.
        references: By which speeds gaits are chosen, see `SpeedCommand`; controllers are named with
            theirs if there are several.
        push: Impulse of a push forward, once, after three fifths of the longest command [N s].
        progress: Called with the number of time steps done since the last call.

    Raises:
        InvalidInput: A command is no speed profile, or a controller cannot follow one.
        SpeedOutOfRange: A command is beyond the robot's gaits.
    """
    if not commands:
        raise InvalidInput("no commands; give one or more, as '0 4s, 0->0.8 2s, 0.8 4s'")
    experiment = Experiment(
        robot=robot,
        gaits=gaits,
        controllers=tuple(controllers),
        scenarios=(scenario,),
        schedule=LONG,
        commands=tuple(commands),
    )
    practised = [run_cell(cell, None, progress) for cell in experiment.cells() if cell.practice]
    longest = max(profile.duration for profile in experiment.profiles)
    pushed_after = LONG.startup + 0.6 * longest if push else np.nan
    if push:  # only once: a second one would come after the end
        scenario = replace(
            scenario,
            name=f"{scenario.name}-pushed",
            push_impulse=(push, 0.0, 0.0),
            push_period=pushed_after,
        )
    tables, summaries = [], []
    for reference in references:
        driven = replace(experiment, reference=reference, scenarios=(scenario,))
        for cell in driven.compared:
            needed = practised[0] if cell.depends_on is not None else None
            strides = run_cell(cell, needed, progress)
            if len(references) > 1:
                strides.attrs["controller"] = f"{cell.controller}, {reference}"
            tables.append(stride_table(strides))
            summaries += [summarize_commands(strides)]
            summaries += [_settling(summaries[-1], tables[-1], pushed_after - LONG.startup)]
    return Driving(pd.concat(tables, ignore_index=True), pd.concat(summaries, ignore_index=True))


def _settling(summary: pd.DataFrame, table: pd.DataFrame, pushed: float) -> pd.DataFrame:
    """Rows `strides_to_settle` of a summary."""
    rows = summary[summary["metric"] == "upright"].copy()
    rows["metric"] = "strides_to_settle"
    rows["value"] = [
        _strides_to_settle(
            table[table["command"] == command],
            _last_change(SpeedProfile.parse(command)) if np.isnan(pushed) else pushed,
        )
        for command in rows["command"]
    ]
    return rows


def _last_change(profile: SpeedProfile) -> float:
    """Time from which on a command stays as it is [s]."""
    changing = np.flatnonzero(np.array(profile.speeds) != profile.speeds[-1])
    return profile.times[changing[-1] + 1] if changing.size else 0.0


def _strides_to_settle(strides: pd.DataFrame, since: float) -> float:
    """Strides that begin after a time until the speed stays near the command; NaN if it does not.

    A stride in which something changes is the first.
    """
    after = strides[strides["time"] >= since - strides["time"].diff().median()]
    away = np.flatnonzero((after["speed"] - after["commanded"]).abs() > _NEAR)
    if not len(after) or (len(away) and away[-1] + 1 == len(after)):
        return float("nan")
    return float(away[-1] + 1) if len(away) else 0.0


def measure_wandering(
    command: str,
    scenario: Scenario,
    *,
    robot: str | RobotSpec = "a1",
    gaits: str | GaitLibrary = "pronk",
    reference: str = "commanded",
) -> pd.DataFrame:
    """Learn from nothing while the speed changes, then replay at each speed what was learned.

    Beside it what `ilc` learned at these speeds one by one, 28 s each, and no feedforward.

    Args:
        command: Speed profile of the learning, see `SpeedProfile.parse`.
        scenario: The scenario.
        robot: The robot, and
        gaits: its gaits, as an `Experiment` takes them.
        reference: By which speed gaits are chosen, see `SpeedCommand`.

    Returns:
        A row for each speed of the robot's gaits: `speed` [m/s], and mean peaks from the true
        contact on in calf and thigh, `none_calf`, `practised_calf`, `driven_calf` and the like
        [rad]; NaN where a robot fell.
    """
    profile = SpeedProfile.parse(command)
    machine, library = machine_and_gaits(robot, gaits)
    learner, replay = replace(load_controller("ilc"), guard=None), load_controller("library")
    following = SpeedCommand([profile], library, reference=reference)
    Simulation(
        machine,
        following.first_gaits,
        learner,
        scenario,
        schedule=Schedule(0.5, 0.0, profile.duration),
        rng=np.random.default_rng(0),
        command=following,
    ).run()
    played = [library.at(float(speed)) for speed in library.speeds]
    planned = np.array([gait.flight.duration for gait in played])
    memory = following.memory
    practised = torque_library(learn(machine, played, load_controller("ilc"), scenario))
    skills = {
        "none": InitialFeedforward(),
        "practised": InitialFeedforward(practised.torque, practised.flight),
        "driven": InitialFeedforward(memory.feedforward[0], memory.stretch[0] * planned),
    }
    table: dict[str, list[float]] = {"speed": library.speeds.tolist()}
    for name, skill in skills.items():
        strides = simulate(
            machine,
            played,
            replay,
            scenario,
            schedule=_REPLAY,
            rng=np.random.default_rng(0),
            initial=skill,
        )
        peaks = [mean_peaks(strides, k) for k in range(len(played))]
        for joint in COMPARED:
            table[f"{name}_{joint}"] = [float(peak[joint]) for peak in peaks]
    return pd.DataFrame(table)


def describe_wandering(table: pd.DataFrame) -> str:
    """The table of `measure_wandering` as text, and what it comes to."""
    kinds = ("none", "practised", "driven")
    lines = [
        "mean peaks of stance errors from the true contact on, calf and thigh [mrad]",
        f"{'speed [m/s]':>11}{'nothing learned':>18}{'one by one':>18}{'while driving':>18}",
    ]
    for row in table.to_dict("records"):
        cells = [f"{1e3 * row[f'{k}_calf']:.1f}, {1e3 * row[f'{k}_thigh']:.1f}" for k in kinds]
        lines.append(f"{row['speed']:>11g}{cells[0]:>18}{cells[1]:>18}{cells[2]:>18}")
    for joint in COMPARED[::-1]:
        none, practised, driven = (table[f"{kind}_{joint}"] for kind in kinds)
        share = ((none - driven) / (none - practised)).median()
        lines.append(
            f"{joint}: driving about took away {share:.0%} of what learning one by one did "
            f"(median over {len(table)} speeds; worst {1e3 * driven.max():.1f} mrad beside "
            f"{1e3 * practised.max():.1f})"
        )
    return "\n".join(lines)
