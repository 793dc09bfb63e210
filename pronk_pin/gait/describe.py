"""Text of a gait library for a terminal: one line for each gait, or one gait in detail."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import InvalidInput
from ..robot import Robot
from .library import GaitLibrary, known_library


def describe_library(library: GaitLibrary) -> str:
    """Format the gaits and their audits as a table.

    Raises:
        InvalidInput: The library has no audit.
    """
    known_library(library)
    if not library.audit:
        raise InvalidInput(
            "this gait library has no audit; build it anew with 'pronk-pin gaits build'"
        )
    lines = [
        "  speed   apex  stride  violation  18-DoF res.  stance drift      foot  flight drift"
        "  order    Bezier  torque  velocity  friction",
        "    m/s      m       s     (worst)       N, N m           rad         m           rad"
        "              rad  of lim.   of lim.   of lim.",
    ]
    for gait, result in zip(library.gaits, library.audit, strict=True):
        lines.append(
            f"{gait.speed:>+7.2f}{gait.apex:>7.3f}{gait.duration:>8.3f}"
            f"{result.worst_violation.value:>11.1e}{result['18-DoF residual'].value:>13.1e}"
            f"{result['stance drift'].value:>14.1e}{result['stance foot drift'].value:>10.1e}"
            f"{result['flight drift'].value:>14.1e}{result['convergence order'].value:>7.1f}"
            f"{result['bezier position'].value:>10.1e}{result['torque use'].value:>8.0%}"
            f"{result['velocity use'].value:>10.0%}{result['friction use'].value:>10.0%}"
            + ("" if result.passed else "  FAILED: " + ", ".join(c.name for c in result.failures))
        )
    times = library.metadata.get("solve_time", [])
    if times:
        lines += ["", f"{len(times)} gaits, solved in {sum(times):.1f} s"]
    return "\n".join([*lines, _verdict(library)])


def describe_gait(
    library: GaitLibrary, speed: float, apex: float | None = None, *, robot: Robot | None = None
) -> str:
    """Format one gait: its phases, residuals, and its audit if it is one of the library's.

    Args:
        library: The library.
        speed: Speed [m/s].
        apex: Greatest height of the trunk [m]; by default the library's own.
        robot: The robot; by default the one that is known by the library's name.

    Raises:
        SpeedOutOfRange: The library does not cover the speed.
        ApexOutOfRange: The library does not cover the apex.
    """
    gait = known_library(library).at(speed, apex)
    kind = library.metadata.get("gait", "pronk")
    lines = [
        f"{gait.robot}, {kind}, {library.base} base, {gait.speed:+.3g} m/s, "
        f"apex {gait.apex:.3g} m, {1.0 / gait.duration:.2f} strides/s"
    ]
    orders = library.metadata.get("bezier_orders", {})
    for phase in gait.phases:
        feet = ", ".join(phase.feet) or "no feet"
        order = phase.joints.shape[-1] - 1
        lines.append(f"  {phase.name}: {phase.duration:.3f} s on {feet}; Bezier order {order}")
        if phase.name in orders:
            lines.append(f"    {_why(orders[phase.name], order)}")
    residual = library.residual(speed, apex, robot=robot)
    lines.append(
        f"  in its Bezier form the equations of motion lack {residual.force:.2g} N, "
        f"{residual.moment:.2g} N m; feet {1e3 * residual.height:.2g} mm off the ground"
    )
    k = next((i for i, other in enumerate(library.gaits) if other is gait), None)
    if k is None:
        lines.append("  interpolated between its neighbours (eq. 13); the audit is theirs")
        lines += [_verdict(library)] if library.audit else []
    elif library.audit:
        failed = ", ".join(check.name for check in library.audit[k].failures)
        lines += ["", library.audit[k].table(), ""]
        lines.append(f"The gait fails: {failed}." if failed else "The gait passes all its checks.")
    return "\n".join(lines)


def _verdict(library: GaitLibrary) -> str:
    """Whether all gaits of a library pass their audits, in one line."""
    failed = [
        gait for gait, audit in zip(library.gaits, library.audit, strict=True) if audit.failures
    ]
    if not failed:
        return f"All {len(library.gaits)} gaits pass all their checks."
    which = ", ".join(f"{gait.speed:+.2f} m/s at {gait.apex:.3f} m" for gait in failed)
    return f"{len(failed)} of {len(library.gaits)} gaits fail: {which}."


def _why(losses: Sequence[Any], order: int) -> str:
    """Worst errors of the order and its neighbours over the whole library."""
    near = [loss for loss in losses if abs(loss[0] - order) <= 2]
    parts = [f"{int(n)}: {joints:.1e} rad, {1e3 * feet:.2g} mm" for n, joints, feet in near]
    return "worst loss of joints and feet by order, " + "; ".join(parts)
