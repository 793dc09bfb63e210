"""Study of commanded speeds: does what was learned at constant speeds hold while they change, and
can it be learned while they do?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from ..._typing import Array
from ...control import (
    ControllerSpec,
    InitialFeedforward,
    SpeedCommand,
    SpeedProfile,
    TorqueLibrary,
    load_controller,
    model_feedforward,
)
from ...errors import InvalidInput
from ...gait import GaitLibrary, load_library
from ...robot import JOINTS, Robot, load_robot
from ..experiment import torque_library
from ..simulation import Progress, Schedule, Simulation, simulate
from ..world import Scenario
from .learning_runs import COMPARED, learn, mean_peaks

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

_SETTLED = 2.0
"""Time after which the start is over [s]."""


def measure_driving(
    commands: Sequence[str],
    scenario: Scenario,
    *,
    controllers: Sequence[str] = DRIVERS,
    robot: str = "a1",
    reference: str = "commanded",
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Learn at the shipped speeds that the commands span, then drive by them.

    Each controller drives one robot a command, side by side. Those that learn have no guard, whose
    memory is of one speed.

    Args:
        commands: Speed profiles, see `SpeedProfile.parse`.
        scenario: The scenario, of the learning and of the driving.
        controllers: Names of controllers with tapes: those of source "library" play what was
            learned.
        robot: Short name of the robot.
        reference: By which speed gaits are chosen, see `SpeedCommand`.
        progress: Called with the number of time steps done since the last call.

    Returns:
        A row for each controller, command and stride: `controller`, `command`, `time` of touchdown
        [s], `commanded`, `gait_speed` and mean `speed` of the trunk [m/s], peak stance errors
        `thigh` and `calf` from the true contact on, means over the legs [rad], and whether the
        robot is `upright`.

    Raises:
        InvalidInput: A command is no speed profile, or a controller cannot follow one.
        SpeedOutOfRange: A command is beyond the robot's gaits.
    """
    profiles = [SpeedProfile.parse(command) for command in commands]
    if not profiles:
        raise InvalidInput("no commands; give one or more, as '0 4s, 0->0.8 2s, 0.8 4s'")
    machine, library = load_robot(robot), load_library(robot)
    specs = [replace(load_controller(name), guard=None) for name in controllers]
    torques = _torques(specs, machine, library, profiles, scenario)
    longest = max(profile.duration for profile in profiles)
    tables = []
    for spec in specs:
        command = SpeedCommand(
            profiles, library, torque=torques.get(spec.source), reference=reference
        )
        initial = command.initial_feedforward
        simulation = Simulation(
            machine,
            command.first_gaits,
            spec,
            scenario,
            schedule=Schedule(0.5, 0.0, longest),
            rng=np.random.default_rng(0),
            feedforward=initial.feedforward,
            flight=initial.flight,
            command=command,
        )
        simulation.run(progress)
        for k, profile in enumerate(profiles):
            tables.append(_strides(spec, simulation, k, profile))
    return pd.concat(tables, ignore_index=True)


def _torques(
    specs: Sequence[ControllerSpec],
    robot: Robot,
    library: GaitLibrary,
    profiles: Sequence[SpeedProfile],
    scenario: Scenario,
) -> dict[str, TorqueLibrary]:
    """Feedforward by speed, of each source that is needed."""
    asked = [speed for profile in profiles for speed in profile.speeds]
    speeds = library.speeds
    first = max(int(np.searchsorted(speeds, min(asked), side="right")) - 1, 0)
    last = min(int(np.searchsorted(speeds, max(asked))), len(speeds) - 1)
    gaits = [library.at(float(speed)) for speed in speeds[first : last + 1]]
    sources, torques = {spec.source for spec in specs}, {}
    if "library" in sources:
        torques["library"] = torque_library(learn(robot, gaits, load_controller("ilc"), scenario))
    if "model" in sources:
        torque = model_feedforward(robot, gaits)
        torques["model"] = TorqueLibrary(
            np.array([gait.speed for gait in gaits]),
            torque,
            np.zeros_like(torque),
            np.array([gait.flight.duration for gait in gaits]),
        )
    if "identified" in sources:
        raise InvalidInput(
            "what is identified is of one speed at a time; choose controllers of the sources "
            "none, model and library"
        )
    return torques


def _strides(
    spec: ControllerSpec, simulation: Simulation, robot: int, profile: SpeedProfile
) -> pd.DataFrame:
    """The strides of one robot, as far as its command goes."""
    log = simulation.strides
    count = int(log.count[robot])
    peaks = log["peak_error"][robot, :count].reshape(count, -1, len(JOINTS)).mean(axis=1)
    table = pd.DataFrame(
        {
            "controller": spec.name,
            "command": str(profile),
            "time": log["start"][robot, :count],
            "commanded": log.commanded[robot, :count],
            "gait_speed": log.gait_speed[robot, :count],
            "speed": log["mean_speed"][robot, :count],
            **{joint: peaks[:, JOINTS.index(joint)] for joint in COMPARED},
            "upright": log["upright"][robot, :count] == 1.0,
        }
    )
    return table[table["time"] < profile.duration]


def summarize_driving(table: pd.DataFrame) -> pd.DataFrame:
    """What `measure_driving` found, by command and controller.

    Returns:
        Rows by `command` and `controller`: worst and mean peaks, `worst_calf`, `mean_calf` and the
        like [rad], root mean square of the mean speed's difference to the commanded one
        `speed_error` [m/s], and `upright`. The first two seconds do not count.
    """
    rows = []
    for (command, controller), strides in table.groupby(["command", "controller"], sort=False):
        late = strides[strides["time"] >= _SETTLED]
        rows.append(
            {
                "command": command,
                "controller": controller,
                **{f"worst_{joint}": late[joint].max() for joint in COMPARED},
                **{f"mean_{joint}": late[joint].mean() for joint in COMPARED},
                "speed_error": _rms((late["speed"] - late["commanded"]).to_numpy()),
                "upright": bool(strides["upright"].all()),
            }
        )
    return pd.DataFrame(rows)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def describe_driving(table: pd.DataFrame) -> str:
    """The table of `measure_driving` as text."""
    lines = [
        "peaks of stance errors from the true contact on, worst and mean of all strides [mrad];",
        "speed: root mean square of what the trunk's mean speed lacks of the command [m/s]",
    ]
    for command, rows in summarize_driving(table).groupby("command", sort=False):
        lines += ["", str(command)]
        lines.append(f"{'controller':<14}{'calf':>14}{'thigh':>14}{'speed':>8}")
        for row in rows.itertuples():
            calf, thigh = (
                f"{1e3 * worst:.1f}, {1e3 * mean:.1f}"
                for worst, mean in (
                    (row.worst_calf, row.mean_calf),
                    (row.worst_thigh, row.mean_thigh),
                )
            )
            fell = "" if row.upright else "  fell"
            lines.append(f"{row.controller:<14}{calf:>14}{thigh:>14}{row.speed_error:>8.3f}{fell}")
    return "\n".join(lines)


def measure_wandering(
    command: str, scenario: Scenario, *, robot: str = "a1", reference: str = "commanded"
) -> pd.DataFrame:
    """Learn from nothing while the speed changes, then replay at each speed what was learned.

    Beside it what `ilc` learned at these speeds one by one, 28 s each, and no feedforward.

    Args:
        command: Speed profile of the learning, see `SpeedProfile.parse`.
        scenario: The scenario.
        robot: Short name of the robot.
        reference: By which speed gaits are chosen, see `SpeedCommand`.

    Returns:
        A row for each speed of the robot's gaits: `speed` [m/s], and mean peaks from the true
        contact on in calf and thigh, `none_calf`, `practised_calf`, `driven_calf` and the like
        [rad]; NaN where a robot fell.
    """
    profile, machine, library = SpeedProfile.parse(command), load_robot(robot), load_library(robot)
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
    gaits = [library.at(float(speed)) for speed in library.speeds]
    planned = np.array([gait.flight.duration for gait in gaits])
    memory = following.memory
    practised = torque_library(learn(machine, gaits, load_controller("ilc"), scenario))
    skills = {
        "none": InitialFeedforward(),
        "practised": InitialFeedforward(practised.torque, practised.flight),
        "driven": InitialFeedforward(memory.feedforward[0], memory.stretch[0] * planned),
    }
    table: dict[str, list[float]] = {"speed": library.speeds.tolist()}
    for name, skill in skills.items():
        strides = simulate(
            machine,
            gaits,
            replay,
            scenario,
            schedule=_REPLAY,
            rng=np.random.default_rng(0),
            initial=skill,
        )
        peaks = [mean_peaks(strides, k) for k in range(len(gaits))]
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
