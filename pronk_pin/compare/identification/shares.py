"""Decomposition of the learned torque by cause, joint by joint and over the phase.

With the mean of the recorded strides, and the model's torque along the reference,

    learned - model = sum of terms + gravity + deviation + internal forces + unexplained.

Learned is what the motors were told in the end: feedforward, and what is still left to feedback.
Gravity is what it takes on a slope along which the trunk is held, or where it is not the model's.
Deviation is what the URDF's robot would need for the measured motion instead of the reference.
In stance four feet leave ten of the twelve torques to themselves, in that they push the feet
against each other and the planar constraint: these internal forces make no motion, and no motion
tells why they are there. What does make motion is in the two other directions, with the least
torques: there the terms, gravity, the deviation and the rest are told apart. In flight nothing is
internal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from ..._typing import Array
from ...control import phase_grid
from ...gait import Gait
from ...inverse_dynamics import PLANAR_CONSTRAINT, feedforward
from ...robot import NB, Robot
from .equations import PhaseForces, explained_forces, settled_ticks, windowed
from .model_terms import Term
from .recording import PARTS

SAMPLES = 41
"""Samples of the phase."""
MODEL_FRICTION = 0.6
"""Friction coefficient that the model's torques are distributed with; the scenario has its own."""
BOUNCE = 0.03
"""Time after touchdown in which the feet bounce [s]."""
OTHERS = ("gravity", "deviation", "internal forces", "unexplained")
"""Causes that are no terms."""


def shares(
    robot: Robot,
    gaits: Sequence[Gait],
    phases: Sequence[Mapping[str, PhaseForces]],
    value: Array,
    terms: tuple[Term, ...],
) -> xr.Dataset:
    """Decompose the learned torques by cause.

    Args:
        robot: The robot as its URDF has it.
        gaits: The gait of each speed, which the strides were made with.
        phases: Its recorded phases, by part.
        value: Parameters of the terms.
        terms: The terms.

    Returns:
        `learned` and `model` torques, the `spread` of the learned over the strides, the part of it
        that `feedback` gave [N m], and `torque` by `cause`; dimensions speed, part, phase, joint.
        NaN where a phase is left out.
    """
    causes = [*dict.fromkeys(term.cause for term in terms), *OTHERS]
    shape = (len(gaits), len(PARTS), SAMPLES, robot.nu)
    learned, model, spread, feedback = np.full((4, *shape), np.nan)
    torque = np.full((len(causes), *shape), np.nan)
    for k, (gait, by_part) in enumerate(zip(gaits, phases, strict=True)):
        reference = feedforward(
            robot, gait, contact="rolling", friction=MODEL_FRICTION, constraint=PLANAR_CONSTRAINT
        )
        for part, phase in by_part.items():
            at = (k, PARTS.index(part))
            planned = gait.phase(part).duration
            on_ticks = _model_on_ticks(phase, getattr(reference, part), planned)
            parts = _apart(robot, phase, on_ticks, value, terms, causes)
            learned[at], model[at], spread[at], feedback[at], *causes_on_grid = (
                _on_grid(phase, values, planned) for values in parts
            )
            torque[(slice(None), *at)] = causes_on_grid
    dims = ("speed", "part", "phase", "joint")
    return xr.Dataset(
        {
            "learned": (dims, learned, {"units": "N m", "long_name": "torque told in the end"}),
            "model": (dims, model, {"units": "N m", "long_name": "feedforward of the model"}),
            "spread": (dims, spread, {"units": "N m", "long_name": "deviation over strides"}),
            "feedback": (dims, feedback, {"units": "N m", "long_name": "feedback in learned"}),
            "torque": (("cause", *dims), torque, {"units": "N m", "long_name": "explained by"}),
        },
        coords={
            "cause": causes,
            "speed": ("speed", [gait.speed for gait in gaits], {"units": "m/s"}),
            "part": list(PARTS),
            "phase": phase_grid(SAMPLES),
            **robot.joint_coordinates,
            "duration": (
                ("speed", "part"),
                [[gait.phase(part).duration for part in PARTS] for gait in gaits],
            ),
        },
    )


def _model_on_ticks(phase: PhaseForces, model: Array, planned: float) -> Array:
    """The model's torques (samples, 12) at the ticks of a phase that was planned so long [s]."""
    recording = phase.recording
    s = np.minimum(np.arange(recording.ticks) * recording.timestep / planned, 1.0)
    grid = np.linspace(0.0, 1.0, len(model))
    return np.stack([np.interp(s, grid, column) for column in model.T], axis=-1)


def _apart(
    robot: Robot,
    phase: PhaseForces,
    model: Array,
    value: Array,
    terms: tuple[Term, ...],
    causes: Sequence[str],
) -> list[Array]:
    """Learned, model, spread, feedback, and each cause's torque, at the ticks (ticks, 12)."""
    recording = phase.recording
    commanded = recording.torque[:, :-1].mean(axis=0)
    ahead = recording.feedforward[:, :-1].mean(axis=0)
    needed = phase.needed.mean(axis=0)
    columns = np.moveaxis(explained_forces(robot, phase, terms, value), -1, 0)  # (terms, ticks, 18)
    lean = phase.lean
    if phase.balance is None:
        moving, internal = commanded, np.zeros_like(commanded)
        needed, columns, lean = needed[:, NB:], columns[..., NB:], lean[:, NB:]
    else:
        balance = phase.balance.mean(axis=0)  # (ticks, 2, 18)
        least = np.linalg.pinv(balance[:, :, NB:])  # (ticks, 12, 2)
        motors = np.einsum("tij,tj->ti", balance[:, :, NB:], commanded)
        moving = np.einsum("tij,tj->ti", least, motors)
        internal = commanded - moving
        needed, columns, lean = (
            np.einsum("tij,tjk,...tk->...ti", least, balance, each, optimize=True)
            for each in (needed, columns, lean)
        )
    by_cause = dict.fromkeys(causes, np.zeros_like(commanded))
    for term, column in zip(terms, columns, strict=True):
        by_cause[term.cause] = by_cause[term.cause] + column
    by_cause["gravity"] = lean
    by_cause["deviation"] = needed - lean - model
    by_cause["internal forces"] = internal
    by_cause["unexplained"] = moving - needed - columns.sum(axis=0)
    spread = recording.torque[:, :-1].std(axis=0)
    return [commanded, model, spread, commanded - ahead, *(by_cause[cause] for cause in causes)]


def _on_grid(phase: PhaseForces, values: Array, planned: float) -> Array:
    """Values at the ticks, seen through the window, on the phase grid; NaN where left out."""
    recording = phase.recording
    ticks = settled_ticks(recording)
    seen = windowed(values[None], recording.timestep)[0]
    at = phase_grid(SAMPLES) * planned / recording.timestep
    on_grid = np.stack([np.interp(at, np.arange(len(seen)), c) for c in seen.T], axis=-1)
    on_grid[(at < ticks[0]) | (at > ticks[-1])] = np.nan
    return np.asarray(on_grid)


def share_table(shares: xr.Dataset) -> xr.DataArray:
    """Share `<tau_cause, d> / <d, d>` of the discrepancy d by cause, part and kind of joint.

    Sums are over speeds, legs and phases outside the bounce. Shares sum to 1 over the causes; they
    are negative where a cause works against the discrepancy.
    """
    return _projected(shares, shares["torque"])


def feedback_share(shares: xr.Dataset) -> xr.DataArray:
    """Share of the discrepancy that feedback still gave, by part and kind of joint."""
    return _projected(shares, shares["feedback"])


def discrepancy(shares: xr.Dataset) -> xr.DataArray:
    """Learned less model torque [N m]; NaN in the bounce after touchdown."""
    return _settled(shares, shares["learned"] - shares["model"])


def _projected(shares: xr.Dataset, torque: xr.DataArray) -> xr.DataArray:
    size, over = discrepancy(shares), ("speed", "phase")
    return _by_kind(_settled(shares, torque) * size).sum(over) / _by_kind(size**2).sum(over)


def explained(shares: xr.Dataset) -> xr.DataArray:
    """R^2 = 1 - |unexplained|^2 / |discrepancy|^2 by part and kind of joint, outside the bounce
    after touchdown."""
    residual, over = _settled(shares, shares["torque"].sel(cause="unexplained")), ("speed", "phase")
    return 1.0 - _by_kind(residual**2).sum(over) / _by_kind(discrepancy(shares) ** 2).sum(over)


def _settled(shares: xr.Dataset, values: xr.DataArray) -> xr.DataArray:
    time = shares["phase"] * shares["duration"]
    return values.where((shares["part"] != "stance") | (time > BOUNCE))


def _by_kind(values: xr.DataArray) -> xr.DataArray:
    """Sum over the legs: the axis `joint` of twelve becomes one of hip, thigh, calf."""
    kinds = values["kind"].to_numpy()
    summed = values.drop_vars(["leg", "kind"]).assign_coords(joint=kinds).groupby("joint").sum()
    return summed.sel(joint=list(dict.fromkeys(kinds)))
