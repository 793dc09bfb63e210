"""From speeds to a gait library: continuation outward from the slowest gait."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from .._typing import Array
from ..errors import GaitNotFound, InvalidInput
from ..robot import Robot
from .audit import Audit, audit
from .library import GaitLibrary
from .optimize import GaitSolution, optimize_gait
from .problem import GaitProblem

SPEEDS: tuple[float, ...] = tuple(np.round(np.arange(-5, 9) * 0.1, 1).tolist())
"""The paper's 14 speeds, -0.5 to 0.8 m/s."""

_PACKAGES = ("casadi", "pin", "numpy", "scipy", "example-robot-data")


def build_library(
    robot: Robot,
    speeds: Sequence[float] | Array = SPEEDS,
    *,
    apex: float = 0.34,
    path: Path | str | None = None,
    progress: bool = True,
) -> GaitLibrary:
    """Optimise and audit a gait for each speed.

    Args:
        robot: The robot.
        speeds: Speeds [m/s], in any order.
        apex: Greatest height of the trunk [m].
        path: Where to save the library; None does not save it.
        progress: Whether to show a progress bar.

    Raises:
        InvalidInput: There are no speeds.
        GaitNotFound: A speed has no gait, from its neighbour or from the crude guess.
        FileProblem: The library cannot be written.
    """
    if not len(speeds):
        raise InvalidInput("no speeds to build gaits for; give at least one")
    began = time.perf_counter()
    solved: dict[float, GaitSolution] = {}
    audits: dict[float, Audit] = {}
    for speed in tqdm(_outward(speeds), desc="gaits", unit="gait", disable=not progress):
        solved[speed] = _solve(GaitProblem(robot, speed, apex), solved)
        audits[speed] = audit(solved[speed])
    solutions = [solved[speed] for speed in sorted(solved)]
    library = GaitLibrary(
        gaits=tuple(solution.gait for solution in solutions),
        metadata=_metadata(robot, solutions, time.perf_counter() - began),
        audit=tuple(audits[speed].flat() for speed in sorted(audits)),
    )
    if path is not None:
        library.save(path)
    return library


def describe_library(library: GaitLibrary) -> str:
    """A table of the gaits and of what their audit found.

    Raises:
        InvalidInput: The library has no audit.
    """
    if len(library.audit) != len(library.gaits):
        raise InvalidInput("this gait library has no audit; build it with 'pronk-pin gaits build'")
    header = (
        "  speed  stance  flight  violation  18-DoF res.  stance drift      foot  flight drift"
        "    Bezier  torque  friction"
    )
    units = (
        "    m/s       s       s     (worst)       N, N m           rad         m           rad"
        "       rad  of lim.   of lim."
    )
    lines = [header, units]
    for gait, entries in zip(library.gaits, library.audit, strict=True):
        found = Audit.from_flat(gait.speed, entries)
        lines.append(
            f"{gait.speed:>+7.2f}{gait.stance.duration:>8.3f}{gait.flight.duration:>8.3f}"
            f"{found.worst_violation.value:>11.1e}{entries['18-DoF residual']:>13.1e}"
            f"{entries['stance drift']:>14.1e}{entries['stance foot drift']:>10.1e}"
            f"{entries['flight drift']:>14.1e}{entries['bezier position']:>10.1e}"
            f"{entries['torque use']:>9.0%}{entries['friction use']:>10.0%}"
            + ("" if found.passed else "  FAILED: " + ", ".join(c.name for c in found.failures))
        )
    return "\n".join(lines)


def describe_gait(library: GaitLibrary, speed: float) -> str:
    """One gait in detail: its form, and its audit where the speed is one of the library's.

    Raises:
        SpeedOutOfRange: The library does not cover the speed.
    """
    gait = library.at(speed)
    lines = [
        f"{gait.robot} pronking at {gait.speed:+.3g} m/s, apex {gait.apex:.3g} m, "
        f"{1.0 / gait.duration:.2f} strides/s"
    ]
    for phase in gait.phases:
        feet = ", ".join(phase.feet) or "no feet"
        order = phase.joints.shape[-1] - 1
        lines.append(f"  {phase.name}: {phase.duration:.3f} s on {feet}; Bezier order {order}")
    k = int(np.argmin(np.abs(library.speeds - speed)))
    if library.gaits[k] is gait and library.audit:
        lines += ["", Audit.from_flat(gait.speed, library.audit[k]).table()]
    elif library.gaits[k] is not gait:
        lines.append("  interpolated between its neighbours (eq. 13); the audit is theirs")
    return "\n".join(lines)


def _outward(speeds: Sequence[float] | Array) -> list[float]:
    """Each speed once, the slowest first, so that every other one has a solved neighbour."""
    unique = {float(speed) + 0.0 for speed in speeds}  # -0.0 is 0.0
    return sorted(unique, key=lambda speed: (abs(speed), speed))


def _solve(problem: GaitProblem, solved: Mapping[float, GaitSolution]) -> GaitSolution:
    """Start from the closest solved speed; where that fails, from the crude guess."""
    if solved:
        neighbour = min(solved, key=lambda speed: abs(speed - problem.speed))
        try:
            return optimize_gait(problem, initial=solved[neighbour])
        except GaitNotFound:
            pass
    return optimize_gait(problem)


def _metadata(robot: Robot, solutions: list[GaitSolution], seconds: float) -> dict[str, Any]:
    """How the library was made."""
    # Not `asdict`, which would copy the robot.
    problem = {
        item.name: getattr(solutions[0].problem, item.name)
        for item in dataclasses.fields(GaitProblem)
        if item.name not in ("robot", "speed")
    }
    return {
        "urdf_sha256": robot.sha256,
        "problem": problem,
        "solver": "IPOPT through CasADi, exact derivatives",
        "versions": {name: importlib.metadata.version(name) for name in _PACKAGES},
        "cost": [solution.cost for solution in solutions],
        "iterations": [solution.iterations for solution in solutions],
        "solve_time": [round(solution.solve_time, 4) for solution in solutions],
        "build_time": round(seconds, 2),
    }
