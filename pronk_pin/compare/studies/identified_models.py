"""Evaluation of the identified model in closed loop, at speeds that were never learned.

The identified parameters go back into the model, the model into feedforward and gaits, and these
are simulated beside their competitors: the model as it was, learning itself, and the torque
library of the learned speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import xarray as xr
from tqdm import tqdm

from ..._typing import Array
from ...control import load_controller
from ...errors import InvalidInput
from ...gait import Gait, load_library, replan
from ...robot import Robot, load_robot
from ..experiment import initial_feedforward
from ..identification import Explanation
from ..metrics import by_joint
from ..simulation import Schedule, simulate
from ..world import Scenario, load_scenario

CONTROLLERS = ("model", "library", "ilc", "identified", "identified+gait")
"""Controllers that are compared."""
STRIDES = 10
"""Strides at the end that count."""
_MORE = 3.0
"""What the A1 carries more in the second world [kg]; others carry the same share of their mass."""
SCHEDULE = Schedule(baseline=6.0, learning=12.0)
"""By default; controllers that do not learn make the first part only."""


def close_loop(
    explanation: Explanation,
    strides: xr.Dataset,
    *,
    speeds: Sequence[float] | None = None,
    scenarios: Sequence[Scenario | str] | None = None,
    controllers: Sequence[str] = CONTROLLERS,
    schedule: Schedule = SCHEDULE,
    planned_at: Callable[[Sequence[float]], Sequence[Gait]] | None = None,
    rng: np.random.Generator | None = None,
    progress: bool = True,
) -> pd.DataFrame:
    """Simulate the identified model beside its competitors.

    Args:
        explanation: What learning found.
        strides: The strides that it was found in; the torque library comes from them.
        speeds: Speeds [m/s]; by default those halfway between the learned ones.
        scenarios: Worlds; by default the one of the strides, and one with 3 kg more on the A1, of
            others the same share of their mass, which the model was not identified in.
        controllers: What is compared.
        schedule: What happens when; the law is on in its second part, whatever the speeds.
        planned_at: Gives the planned gaits at some speeds, as `Experiment.planned_at` does; by
            default the shipped ones of the robot.
        rng: Source of the scatter at the start; by default one that starts at 0.
        progress: Show a progress bar.

    Returns:
        One row a scenario, controller and speed: the raw `thigh` and `calf` peak stance error, mean
        over the legs and the last strides [rad], and whether the robot stayed `upright`.

    Raises:
        SpeedOutOfRange: The library does not cover a speed.
        InvalidInput: The strides do not tell their scenario.
        GaitNotFound: The identified model cannot do a gait.
    """
    rng = np.random.default_rng(0) if rng is None else rng
    seed = int(rng.integers(2**31))
    learned_speeds = strides["speed"].to_numpy()
    speeds = tuple(_between(learned_speeds) if speeds is None else speeds)
    scenarios_ = _scenarios(explanation.robot, strides, scenarios)
    if planned_at is None:
        library = load_library(explanation.robot.name)
        gaits = [library.at(speed) for speed in speeds]
    else:
        gaits = list(planned_at(speeds))
    again = replan(explanation.identified, gaits) if "identified+gait" in controllers else gaits
    rows = []
    with tqdm(
        total=len(scenarios_) * len(controllers),
        desc="closing the loop",
        unit=" cells",
        mininterval=0.5,
        disable=not progress,
    ) as bar:
        for scenario in scenarios_:
            for name in controllers:
                spec = load_controller(name)
                played = again if spec.gait_model == "identified" else gaits
                identified = spec.source == "identified"
                model = explanation.identified if identified else explanation.robot
                simulated = simulate(
                    explanation.robot,
                    played,
                    spec,
                    scenario,
                    schedule=schedule if any(spec.laws) else replace(schedule, learning=0.0),
                    rng=np.random.default_rng(seed),
                    initial=initial_feedforward(spec, played, model=model, learned=strides),
                )
                rows += _rows(scenario.name, name, simulated)
                bar.update()
    return pd.DataFrame(rows)


def format_loop(table: pd.DataFrame) -> str:
    """Format the table: mean and worst over the speeds, by scenario and controller."""
    lines = [
        f"{'':<16}{'':>18}{'calf: peak [rad]':^18}{'thigh: peak [rad]':^18}{'stayed':>10}",
        f"{'scenario':<16}{'controller':>18}{'mean':>9}{'worst':>9}{'mean':>9}{'worst':>9}"
        f"{'upright':>10}",
    ]
    for (scenario, controller), rows in table.groupby(["scenario", "controller"], sort=False):
        cells = "".join(
            f"{value:9.4f}"
            for joint in ("calf", "thigh")
            for value in (rows[joint].mean(), rows[joint].max())
        )
        upright = f"{rows['upright'].sum():.0f} of {len(rows)}"
        lines.append(f"{scenario:<16}{controller:>18}{cells}{upright:>10}")
    return "\n".join(lines)


def _between(speeds: Array) -> Array:
    """Speeds halfway between neighbours."""
    if len(speeds) < 2:
        raise InvalidInput("one speed has none between it and others; give the speeds to try")
    return np.asarray((speeds[1:] + speeds[:-1]) / 2.0)


def _scenarios(
    robot: Robot, strides: xr.Dataset, scenarios: Sequence[Scenario | str] | None
) -> list[Scenario]:
    if scenarios is not None:
        return [
            load_scenario(scenario) if isinstance(scenario, str) else scenario
            for scenario in scenarios
        ]
    try:
        own = Scenario.from_json(strides.attrs["scenario_parameters"])
    except (KeyError, InvalidInput) as error:
        raise InvalidInput(
            "these strides do not tell the world they were made in; give the scenarios"
        ) from error
    share = (robot.bare or robot).mass / load_robot("a1").mass
    more = float(f"{_MORE * share:.2g}")
    return [own, replace(own, name=f"{own.name}+{more:g}kg", payload=own.payload + more)]


def _rows(scenario: str, controller: str, strides: xr.Dataset) -> list[dict[str, object]]:
    count = strides["count"].to_numpy()
    peaks = by_joint(strides["peak_error"])
    rows: list[dict[str, object]] = []
    for k, speed in enumerate(strides["speed"].to_numpy()):
        last = slice(max(0, int(count[k]) - STRIDES), int(count[k]))
        mean = peaks.isel(speed=k, stride=last).mean("stride")
        upright = bool(strides["upright"].isel(speed=k, stride=last).min() == 1.0)
        rows.append(
            {
                "scenario": scenario,
                "controller": controller,
                "speed": float(speed),
                "thigh": float(mean.sel(joint="thigh")),
                "calf": float(mean.sel(joint="calf")),
                "upright": upright,
            }
        )
    return rows
