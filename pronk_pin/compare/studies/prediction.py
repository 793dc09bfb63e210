"""Predicted errors of learning, by lifted model and rehearsal, beside the measured ones."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from ..._checks import Interval, reals, whole
from ..._typing import Array
from ...control import (
    Controller,
    ControllerSpec,
    LiftedModel,
    PlanarStrides,
    StrideRecord,
    StrideSettings,
    lifted_model,
    phase_grid,
)
from ...control.prediction import Analysis, analyze, predict, rehearse
from ...dynamics import Rotors
from ...errors import InvalidInput
from ...gait import Gait, GaitLibrary, load_library
from ...robot import JOINTS, RobotSpec, recorded_robot
from ..report import number
from ..results import Results
from ..simulation import Schedule, simulate
from ..world import Scenario
from .learning_runs import learning_law, machine_and_gaits

_BASELINE = 6.0
_WIDTH = 96


@dataclass(frozen=True)
class Prediction:
    """Errors of the strides of learning, predicted and measured.

    Attributes:
        controller: Short name of the controller.
        speed: Desired speed [m/s].
        analysis: What linear algebra says of the law along the gait.
        predicted: RMS of the stance error by the lifted model, of hip, thigh and calf [rad],
            shape (strides + 1, 3); the first is the stride before learning.
        rehearsed: The same by the model's own learning; NaN from where it does not go on.
        measured: The same as it happened.
    """

    controller: str
    speed: float
    analysis: Analysis
    predicted: Array
    rehearsed: Array
    measured: Array

    @property
    def factor(self) -> Array:
        """Ratio >= 1 of predicted and measured error, thigh and calf together, by stride."""
        return _factor(self.predicted, self.measured)

    @property
    def rehearsed_factor(self) -> Array:
        """The same for the rehearsal."""
        return _factor(self.rehearsed, self.measured)


STRIDES = Interval(1, 100_000)
"""Strides of learning that can be predicted."""


def simulate_learning(
    spec: ControllerSpec,
    speeds: Sequence[float],
    scenario: Scenario,
    *,
    robot: str | RobotSpec,
    strides: int,
    gaits: str | GaitLibrary = "pronk",
) -> xr.Dataset:
    """Simulate a short learning run, with the law of the stance only, and flights as planned.

    Raises:
        InvalidInput: The controller does not learn in stance.
    """
    learning_law(spec)
    speeds, strides = reals("speeds", speeds), whole("strides", strides, STRIDES)
    if not speeds:
        raise InvalidInput("no speeds; give at least one")
    machine, library = machine_and_gaits(robot, gaits)
    played = [library.at(speed) for speed in speeds]
    longest = max(gait.duration for gait in played)
    return simulate(
        machine,
        played,
        replace(spec, flight_law=None, timing=None),
        scenario,
        schedule=Schedule(baseline=_BASELINE, learning=1.25 * (strides + 2) * longest),
        rng=np.random.default_rng(0),
    )


def stored_learning(
    results: Results, spec: ControllerSpec, speeds: Sequence[float], scenario: Scenario
) -> xr.Dataset:
    """Load the strides of learning from a results folder, for comparison with a prediction.

    The prediction covers a law of the stance, with flights as planned, on a trunk that is locked.

    Args:
        results: The results.
        spec: The controller that learned.
        speeds: Speeds that are asked for [m/s].
        scenario: In which world.

    Raises:
        InvalidInput: More was learned than the prediction covers, or elsewhere.
    """
    learning_law(spec)
    results.check_constant("the prediction")
    experiment = results.experiment
    if not _covered(spec):
        suitable = [
            name for name in experiment.controller_names if _covered(experiment.controller(name))
        ]
        remedy = (
            f"choose {' or '.join(suitable)}, which this result has"
            if suitable
            else "make a result with 'pronk-pin compare --controllers ilc-stance', or leave "
            "--result out, and a learning in stance only is simulated"
        )
        raise InvalidInput(
            f"controller '{spec.name}' has learned in flight, too, or how long a flight lasts, and "
            f"the prediction covers the stance only; {remedy}"
        )
    if experiment.base != "locked":
        raise InvalidInput(
            f"this result has base '{experiment.base}', and the prediction a locked one; make one "
            "with --base locked"
        )
    for speed in speeds:
        if not np.isclose(experiment.speeds, speed, atol=1e-6).any():
            there = ", ".join(f"{available:g}" for available in experiment.speeds)
            raise InvalidInput(f"this result has no speed {speed:g} m/s; choose from {there}")
    return results.all_strides(controller=spec.name, scenario=scenario.name)


def compare_prediction(
    spec: ControllerSpec,
    strides: xr.Dataset,
    speed: float,
    scenario: Scenario,
    *,
    number: int,
    gait: Gait | None = None,
) -> Prediction:
    """Predict the errors of learning from the last stride before it, beside the measured ones.

    The model has the rotors and the viscous friction of the scenario, as data sheets tell them;
    a law that needs a model has one of its own without them, as on the robot.

    Args:
        spec: The controller that learned.
        strides: Its strides, see `compare.simulation.dataset`.
        speed: Which robot [m/s].
        scenario: The scenario that they were made in.
        number: Strides of learning; fewer if there are fewer.
        gait: The gait that was played; by default the shipped one.

    Raises:
        InvalidInput: The controller does not learn, or there are no strides before its learning.
    """
    learning_law(spec)  # it has one
    robot = recorded_robot(strides.attrs)
    gait = load_library(robot.name).at(speed) if gait is None else gait
    of_stance = replace(spec, flight_law=None, tick_controller=None)
    law = Controller(robot, [gait], of_stance, timestep=scenario.timestep).laws[0]
    assert law is not None
    settings = StrideSettings(
        spec.gains_of(robot), spec.regulator, spec.speed_filter, spec.touchdown_ticks
    )
    rotors = Rotors(*(scenario.by_joint(name, robot) for name in ("armature", "damping")))
    model = lifted_model(robot, gait, settings, rotors=rotors)
    of_speed = strides.sel(speed=speed, method="nearest").sel(part="stance")
    count = int(of_speed["count"])
    first = int(np.argmax(of_speed["learning"].to_numpy()[:count] == 1))
    if first == 0:
        raise InvalidInput("no strides before the learning; give the learning some seconds")
    error = of_speed["error"].to_numpy()[first - 1 : min(count, first + number)]
    begin = _record(of_speed.isel(stride=first - 1), model)
    planar = PlanarStrides(robot, gait, settings, rotors)
    kept = slice(None, None, (model.shape[0] - 1) // (error.shape[1] - 1))
    return Prediction(
        spec.name,
        speed,
        analyze(law, model, begin, robot=robot),
        predicted=_by_joint(predict(law, model, begin, len(error) - 1)[:, kept]),
        rehearsed=_by_joint(rehearse(planar, law, begin, len(error) - 1)[:, kept]),
        measured=_by_joint(error),
    )


def describe_prediction(prediction: Prediction) -> str:
    """Format the analysis and the comparison for a terminal."""
    analysis = prediction.analysis
    quasi = analysis.quasi_static
    stable = "stable" if analysis.radius < 1.0 else "unstable"
    removed = 1.0 - quasi.left
    lines = [
        f"{prediction.controller} at {prediction.speed:g} m/s",
        f"  spectral radius           {analysis.radius:8.3f}  ({stable})",
        f"  with every stride reset   {analysis.stride_radius:8.3f}",
        f"  largest singular value    {analysis.largest_gain:8.3f}",
        f"  transient growth          {analysis.transient:8.3f}",
        "  error left in the limit   "
        + ", ".join(
            f"{joint} {number(value, '.1%')}"
            for joint, value in zip(JOINTS, analysis.limit, strict=True)
        ),
        "  radius with other motors  "
        + ", ".join(
            f"x{factor:g} {radius:.3f}" for factor, radius in analysis.with_gain_error.items()
        ),
        "  radius with delay         "
        + ", ".join(
            f"{delay} samples {radius:.3f}" for delay, radius in analysis.with_delay.items()
        ),
        "",
        textwrap.fill(_in_words(quasi.gain, quasi.memory, quasi.multiplier, removed), _WIDTH),
        "",
        "           measured [rad]    lifted model [rad]        rehearsed [rad]",
        "  stride    thigh    calf     thigh    calf  factor     thigh    calf  factor",
    ]
    ways = (
        ("lifted model", prediction.predicted, prediction.factor),
        ("rehearsal", prediction.rehearsed, prediction.rehearsed_factor),
    )
    for k, measured in enumerate(prediction.measured):
        row = f"  {k:6d}  {measured[1]:7.4f} {measured[2]:7.4f}"
        for _, rms, factor in ways:
            row += f"   {rms[k, 1]:7.4f} {rms[k, 2]:7.4f} {factor[k]:7.2f}"
        lines.append(row)
    lines.append("")
    for name, _, factor in ways:
        worst = int(np.argmax(np.nan_to_num(factor, nan=-1.0)))
        lines.append(f"{name}: worst factor {factor[worst]:.2f}, in stride {worst}")
    return "\n".join(lines)


def _factor(one: Array, other: Array) -> Array:
    """Ratio >= 1 of two RMS errors, thigh and calf together, shape (strides,)."""
    a, b = (np.sqrt((rms[:, 1:] ** 2).mean(axis=1)) for rms in (one, other))
    return np.asarray(np.maximum(a / b, b / a))


def _covered(spec: ControllerSpec) -> bool:
    """Whether the law of the stance is all that a controller learns by."""
    return spec.law is not None and spec.flight_law is None and spec.timing is None


def _in_words(gain: float, memory: float, multiplier: float, less: float) -> str:
    text = (
        f"On a joint that moves slowly the law adds {gain:.2f} times the feedback torque and keeps "
        f"{memory:.2f} of its memory, so that a stride multiplies the error's distance from its "
        f"limit by {memory:.2f} (1 - {gain:.2f}) = {multiplier:.2f}"
    )
    if abs(multiplier) > 1.0 - 1e-3:
        return text + ": it does not converge."
    return text + f", and {less:.0%} of the error is gone in the limit."


def _record(stride: xr.Dataset, model: LiftedModel) -> StrideRecord:
    """The record of a stored stride, on the grid of the control."""
    curves = {
        name: stride[name].transpose("phase", "joint").interp(phase=phase_grid()).to_numpy()[None]
        for name in ("error", "feedback", "feedforward")
    }
    gains, joints = model.gains, model.shape[1]
    damped = curves["feedback"] - gains.proportional(joints) * curves["error"]
    rate = damped / gains.derivative(joints)
    return StrideRecord.of(
        curves["error"].astype(float),
        rate.astype(float),
        curves["feedback"].astype(float),
        curves["feedforward"].astype(float),
    )


def _by_joint(error: Array) -> Array:
    """RMS over the phase and the legs: (strides, samples, 12) becomes (strides, 3)."""
    legs = error.reshape(*error.shape[:2], -1, len(JOINTS)).astype(float)
    return np.asarray(np.sqrt((legs**2).mean(axis=(1, 2))))
