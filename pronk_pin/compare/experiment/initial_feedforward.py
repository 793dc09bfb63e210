"""Torques that a controller begins with: none, the model's, or what another cell has learned."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from ...control import (
    ControllerSpec,
    InitialFeedforward,
    TorqueLibrary,
    model_feedforward,
    phase_grid,
)
from ...errors import FileProblem, InvalidInput, SpeedOutOfRange
from ...gait import Gait
from ...robot import Robot
from ..metrics import steady

LIBRARY_VARIABLES = ("count", "learning", "feedforward", "feedback", "flight_reference")
"""What of a learned cell's strides the torque library is made of."""


def torque_library(strides: xr.Dataset) -> TorqueLibrary:
    """The torque library learned in a simulation: means over its steady strides (section III.B)."""
    end = steady(strides)
    torque, feedback = (
        end[name]
        .interp(phase=phase_grid(), method="cubic")
        .transpose("speed", "stride", "part", "phase", "joint")
        .to_numpy()
        for name in ("feedforward", "feedback")
    )
    flight = end["flight_reference"].transpose("speed", "stride").to_numpy()
    return TorqueLibrary.from_strides(strides["speed"].to_numpy(), torque, flight, feedback)


def initial_feedforward(
    spec: ControllerSpec,
    gaits: Sequence[Gait],
    *,
    model: Robot,
    learned: xr.Dataset | None = None,
    base: str = "locked",
) -> InitialFeedforward:
    """Torques that a controller begins with, by the source that its specification names.

    Args:
        spec: The controller.
        gaits: The gaits to be played, one for each robot.
        model: The robot as the model knows it: the identified one where that is the source.
        learned: Strides of the learning that a torque library is made of.
        base: How the trunk may move.

    Raises:
        InvalidInput: The torques are to be learned ones, and there are no strides.
    """
    if spec.source in ("model", "identified"):
        return InitialFeedforward(model_feedforward(model, gaits, base=base))
    if spec.source == "library":
        library = known_library(spec, model, learned)
        initial = library.initial_feedforward(np.array([gait.speed for gait in gaits]))
        return initial._replace(library=library) if library.conditions else initial
    return InitialFeedforward()


def feedforward_by_speed(
    spec: ControllerSpec, gaits: Sequence[Gait], *, model: Robot, learned: xr.Dataset | None = None
) -> TorqueLibrary | None:
    """Torques that a controller begins with, at the speeds of some gaits; None without any.

    Args:
        spec: The controller.
        gaits: The gaits, of increasing speeds.
        model: The robot as the model knows it: the identified one where that is the source.
        learned: Strides of the learning at these speeds.

    Raises:
        InvalidInput: The torques are to be learned ones, and there are no strides.
    """
    if spec.source == "none":
        return None
    if spec.source == "library":
        return known_library(spec, model, learned)
    torque = model_feedforward(model, gaits)
    return TorqueLibrary(
        np.array([gait.speed for gait in gaits]),
        torque,
        np.zeros_like(torque),
        np.array([gait.flight.duration for gait in gaits]),
    )


def known_library(spec: ControllerSpec, robot: Robot, learned: xr.Dataset | None) -> TorqueLibrary:
    """The torque library that a controller begins with: its file's, or that of some strides.

    Raises:
        FileProblem: The file is missing, damaged, or another one than it was.
        InvalidInput: There is no file, and there are no strides; or it is of another robot.
    """
    if not spec.library:
        return torque_library(learned_strides(spec, learned))
    library = TorqueLibrary.load(spec.library)
    if library.sha256 != spec.library_sha256:
        raise FileProblem(
            spec.library,
            f"another torque library than the one that controller '{spec.name}' was made with",
            "put that one back, or make the controller again, and use another results folder",
        )
    check_library(library, robot)
    return library


def check_library(
    library: TorqueLibrary,
    robot: Robot,
    planned: Callable[[Sequence[float]], Sequence[Gait]] | None = None,
) -> None:
    """Refuse torques that another robot has learned, or for other gaits.

    Args:
        library: The torques.
        robot: The robot.
        planned: Gaits at some speeds, as the robot is to play them; by default they are not looked
            at.

    Raises:
        InvalidInput: They are.
    """
    if planned is not None and library.gaits:
        try:
            here = tuple(gait.sha256 for gait in planned(library.speeds.tolist()))
        except SpeedOutOfRange:
            here = ()
        if here != library.gaits:
            raise InvalidInput(
                "this torque library was learned for other gaits than are played here: of another "
                "gait library, apex or base; build one for these, with pronk-pin ilc build-library"
            )
    joints = library.torque.shape[-1]
    if library.robot not in ("", robot.name) or joints != robot.nu:
        whose = f"of {library.robot}" if library.robot else f"for {joints} joints"
        raise InvalidInput(
            f"this torque library is {whose}, and the robot is {robot.name} with {robot.nu} "
            "joints; give one that it has learned itself"
        )


def learned_strides(spec: ControllerSpec, strides: xr.Dataset | None) -> xr.Dataset:
    """The strides that a controller's source of feedforward is learned from.

    Raises:
        InvalidInput: There are none.
    """
    if strides is None:
        raise InvalidInput(f"controller '{spec.name}' begins with what 'ilc' has learned; run it")
    return strides
