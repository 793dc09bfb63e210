"""Diagnosis of infeasible gait problems: demands made elastic, laws of motion kept.

The laws of motion, contact and continuity are not negotiable; what is asked of the gait is. Each
demand may give way by one number, in its own unit and in all its rows alike, and what gives way,
each over a typical size, is made as small as can be: its sum, which names few demands, or where the
solver does not manage that, its squares. What has to give is what fights.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from ..._typing import Array
from ..._workers import heeding_signals
from .transcription import QUIET, Constraint, Transcription, Unknown

DEMANDS: Mapping[str, tuple[float, str]] = {
    "average speed": (0.1, "ask for a speed nearer to zero"),
    "apex height": (0.02, "ask for another apex"),
    "foot clearance": (0.02, "lower the clearance"),
    "stride duration": (0.05, "widen stride"),
    "phase durations": (0.05, "widen the durations of the sequence's phases"),
    "configuration limits": (0.2, "check the joint limits of the URDF"),
    "hip limit": (0.1, "raise hip_limit"),
    "pitch limit": (0.1, "raise pitch_limit"),
    "roll limit": (0.1, "raise roll of trunk"),
    "yaw limit": (0.1, "raise yaw of trunk"),
    "side step": (0.05, "raise side of trunk"),
    "trunk height": (0.05, "lower trunk_height"),
    "velocity limits": (5.0, "raise velocity_use, or lower the apex or the clearance"),
    "torque limits": (5.0, "raise torque_use, or lengthen the stance"),
    "friction cone": (20.0, "raise friction"),
    "impulse cone": (1.0, "raise friction"),
}
"""Demands that may give way: their typical sizes, in their units, and remedies. The demand
"average speed" is kept as a distance over the stride [m]."""

_ARGUMENTS = (
    *("clearance", "stride", "sequence", "hip_limit", "pitch_limit", "trunk_height"),
    *("velocity_use", "torque_use", "friction"),
)
"""What remedies name that is no option of `gaits build`, but an argument of `build_library`."""

_REGULAR = 0.1
"""Weight of the gait's own cost, beside what gives way: the problem needs some curvature."""

_OPTIONS: dict[str, Any] = {
    "ipopt.max_iter": 150,
    "ipopt.tol": 1e-5,
    "ipopt.constr_viol_tol": 1e-6,
}
_SLOW: dict[str, Any] = {"ipopt.mu_strategy": "monotone", "ipopt.mu_init": 0.1}
_QUICK: dict[str, Any] = {"ipopt.mu_strategy": "adaptive"}

_ATTEMPTS = ((False, _SLOW), (True, _SLOW), (False, _QUICK), (True, _QUICK))
"""Whether to square what gives way, and how the solver goes about it, until one succeeds."""

NOTABLE = 0.02
"""Share of a demand's size below which it does not count as giving way."""


def find_conflicts(program: Transcription, start: Array, p: Array) -> dict[str, float] | None:
    """Find the demands that conflict, and by how much each has to give way, the worst first.

    Args:
        program: The program without a solution.
        start: Where to begin.
        p: Its parameters.

    Returns:
        Empty where nothing has to: then there is a gait, which the solver did not find. None where
        this has no answer either.
    """
    names = [name for name in DEMANDS if name in program.names]
    slack = ca.SX.sym("slack", len(names))
    room = {name: DEMANDS[name][0] * slack[i] for i, name in enumerate(names)}
    constraints: list[Constraint] = []
    for c in program.constraints:
        constraints += _elastic(c, room[c.name]) if c.name in room else [c]
    unknowns = {}
    for key, unknown in program.unknowns.items():
        low, high = unknown.lower.copy(), unknown.upper.copy()
        for row, name in enumerate(unknown.limits):
            if name in room:
                values = unknown.symbol[row, :]
                bounded = Constraint(name, "", values, float(low[row]), float(high[row]))
                constraints += _elastic(bounded, room[name])
                low[row], high[row] = -np.inf, np.inf
        unknowns[key] = replace(unknown, lower=low, upper=high)
    ones = np.ones(len(names))
    unknowns["slack"] = Unknown("", slack, 0.0 * ones, np.inf * ones, ("",) * len(names))
    elastic = Transcription.of(unknowns, program.parameters, program.cost, tuple(constraints))
    for squares, strategy in _ATTEMPTS:
        measure = 10.0 * ca.sumsqr(slack) if squares else 100.0 * ca.sum1(slack)
        cost = measure + (_REGULAR / 10 if squares else _REGULAR) * program.cost
        options = QUIET | _OPTIONS | strategy
        solver = ca.nlpsol("elastic", "ipopt", replace(elastic, cost=cost).nlp, options)
        with heeding_signals():
            result = solver(x0=np.concatenate([start, ones]), **elastic.bounds, p=p)
        if solver.stats()["success"]:
            slacks = np.array(result["x"]).ravel()[-len(names) :]
            conflicting = [i for i in np.argsort(-slacks) if slacks[i] > NOTABLE]
            return {names[i]: float(slacks[i] * DEMANDS[names[i]][0]) for i in conflicting}
    return None


def remedies(conflicts: Mapping[str, float] | None) -> list[str]:
    """What to try, each remedy once."""
    advice = list(dict.fromkeys(DEMANDS[name][1] for name in conflicts or ()))
    names = [item for item in _ARGUMENTS if any(item in words for words in advice)]
    if names:
        advice[-1] += f" (in Python: {', '.join(names)} of build_library)"
    return advice


def _elastic(constraint: Constraint, room: ca.SX) -> list[Constraint]:
    """A constraint that holds within some room on either side."""
    name, where = constraint.name, constraint.where
    parts = []
    if np.isfinite(constraint.lower):
        above = constraint.expression - constraint.lower + room
        parts.append(Constraint(name, where, above, upper=np.inf))
    if np.isfinite(constraint.upper):
        below = constraint.upper + room - constraint.expression
        parts.append(Constraint(name, where, below, upper=np.inf))
    return parts
