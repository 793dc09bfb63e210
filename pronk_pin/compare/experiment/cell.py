"""Simulation of one cell of an experiment."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ..._checks import instance_of
from ...control import ControlTime, SpeedCommand, TorqueLibrary
from ...gait import Gait, GaitLibrary, replan
from ...robot import robot_attributes, with_rotors
from ..identification import explain
from ..simulation import Progress, simulate
from .definition import cell_definition, define, fingerprint, to_text
from .experiment import Cell
from .initial_feedforward import feedforward_by_speed, initial_feedforward, learned_strides


def run_cell(
    cell: Cell,
    dependency: xr.Dataset | None = None,
    progress: Progress | None = None,
    control_time: ControlTime | None = None,
) -> xr.Dataset:
    """Simulate a cell.

    Args:
        cell: Its description.
        dependency: The strides of `cell.depends_on`, where there is such a cell.
        progress: Called with the number of time steps done since the last call.
        control_time: Takes how long the controller computed.

    Returns:
        The strides: see `compare.simulation.dataset`.
    """
    instance_of("cell", cell, Cell, "a Cell, one of Experiment.cells()")
    experiment, spec = cell.experiment, cell.spec
    gaits, robot, base = experiment.planned_at(cell.speeds), experiment.model, experiment.base
    model = robot
    if spec.source == "identified":
        model = explain(learned_strides(spec, dependency), gaits=gaits).identified
    elif spec.gait_model == "datasheet":
        model = with_rotors(robot)
    if spec.gait_model != "urdf":
        gaits = replan(model, gaits, base="locked" if base == "locked" else "sagittal")
    command = None
    if cell.commands:
        command = _command(
            cell, gaits, feedforward_by_speed(spec, gaits, model=model, learned=dependency)
        )
        gaits, initial = command.first_gaits, command.initial_feedforward
        spec = dataclasses.replace(spec, guard=None)  # whose memory is of one speed
    else:
        initial = initial_feedforward(spec, gaits, model=model, learned=dependency, base=base)
    return simulate(
        robot,
        gaits,
        spec,
        cell.world,
        schedule=cell.schedule,
        # One stream a seed, the same for every controller: they start from the same postures.
        rng=np.random.default_rng(np.random.SeedSequence(cell.seed)),
        initial=initial,
        base=base,
        attributes=strides_attributes(cell),
        progress=progress,
        control_time=control_time,
        command=command,
    )


def _command(cell: Cell, gaits: Sequence[Gait], torque: TorqueLibrary | None) -> SpeedCommand:
    """The commands of a cell: gaits of its speeds take the library's place if they are others."""
    experiment = cell.experiment
    library, apex = experiment.library, experiment.apex
    if cell.spec.gait_model != "urdf":
        library, apex = GaitLibrary(tuple(gaits), library.metadata), None
    return SpeedCommand(
        experiment.profiles, library, torque=torque, reference=experiment.reference, apex=apex
    )


def strides_attributes(cell: Cell) -> dict[str, str | int | float]:
    """Attributes of a cell's strides: what they are of, and its fingerprint."""
    experiment, scenario = cell.experiment, cell.world
    definition = cell_definition(define(cell.alone), cell)
    return {
        **robot_attributes(experiment.model.spec),
        "base": experiment.base,
        "scenario": cell.scenario,
        "controller": cell.controller,
        "seed": cell.seed,
        "scenario_parameters": scenario.to_json(),
        "mjcf": experiment.mjcf,
        "mjcf_sha256": definition["mjcf_sha256"],
        "timestep": scenario.timestep,
        "switch": cell.schedule.baseline,
        "definition": to_text(definition),
        "fingerprint": fingerprint(definition),
    }
