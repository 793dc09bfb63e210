"""A nonlinear program whose unknowns come in named blocks and whose constraints have names.

The names lead from the solver's long vectors back to what they mean: to the error that says which
constraints fight, and to the audit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ..._typing import Array
from ...errors import InvalidInput

QUIET: dict[str, Any] = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
}
"""Options of `casadi.nlpsol` with which IPOPT prints nothing, and a failure is no error."""


@dataclass(frozen=True, eq=False)
class Unknown:
    """A block of unknowns at some nodes.

    Attributes:
        where: The phase it belongs to.
        symbol: The unknowns, (rows, nodes).
        lower, upper: Bounds of the rows, shape (rows,).
        limits: The name of each row's bounds, "" where there are none.
    """

    where: str
    symbol: ca.SX
    lower: Array
    upper: Array
    limits: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Constraint:
    """A named block of constraints, ``lower <= expression <= upper``."""

    name: str
    where: str
    expression: ca.SX
    lower: float = 0.0
    upper: float = 0.0


class Violation(NamedTuple):
    """Worst violation of a constraint, and its place."""

    value: float
    """In the constraint's unit; 0 where it is met."""
    where: str
    """Phase and node where it is largest, or, where it is met, tightest; "" if nowhere."""


@dataclass(frozen=True, eq=False)
class Transcription:
    """A nonlinear program: minimise ``cost(x, p)`` within bounds on x and under constraints.

    Attributes:
        unknowns: The blocks of x, by name.
        parameters: p.
        cost: The cost, a scalar expression.
        constraints: The blocks of g, in their order.
        evaluate: ``(x, p) -> g``.
    """

    unknowns: Mapping[str, Unknown]
    parameters: ca.SX
    cost: ca.SX
    constraints: tuple[Constraint, ...]
    evaluate: ca.Function

    @classmethod
    def of(
        cls,
        unknowns: Mapping[str, Unknown],
        parameters: ca.SX,
        cost: ca.SX,
        constraints: tuple[Constraint, ...],
    ) -> Transcription:
        """Assemble a program from its blocks."""
        x, g = _stacked_unknowns(unknowns), _stacked_constraints(constraints)
        evaluate = ca.Function("evaluate", [x, parameters], [g])
        return cls(unknowns, parameters, cost, constraints, evaluate)

    @property
    def names(self) -> frozenset[str]:
        """Names of all constraints and bounds."""
        limits = {name for unknown in self.unknowns.values() for name in unknown.limits if name}
        return frozenset(limits | {constraint.name for constraint in self.constraints})

    @property
    def size(self) -> int:
        """Number of constraints."""
        return sum(int(constraint.expression.numel()) for constraint in self.constraints)

    @property
    def nlp(self) -> dict[str, Any]:
        """The program as `casadi.nlpsol` takes it."""
        x, g = _stacked_unknowns(self.unknowns), _stacked_constraints(self.constraints)
        return {"x": x, "p": self.parameters, "f": self.cost, "g": g}

    @property
    def bounds(self) -> dict[str, Array]:
        """Bounds of x and g as the solver takes them."""
        blocks = [(u.lower, u.upper, u.symbol.shape[1]) for u in self.unknowns.values()]
        sizes = [constraint.expression.numel() for constraint in self.constraints]
        return {
            "lbx": np.concatenate([np.tile(lower, nodes) for lower, _, nodes in blocks]),
            "ubx": np.concatenate([np.tile(upper, nodes) for _, upper, nodes in blocks]),
            "lbg": np.repeat([constraint.lower for constraint in self.constraints], sizes),
            "ubg": np.repeat([constraint.upper for constraint in self.constraints], sizes),
        }

    def pack(self, values: Mapping[str, Array]) -> Array:
        """x from the blocks' values, each (nodes, rows).

        Raises:
            InvalidInput: A block is missing, or has another shape.
        """
        for name, unknown in self.unknowns.items():
            size = unknown.symbol.numel()
            if name not in values or np.size(values[name]) != size:
                raise InvalidInput(
                    f"the guess for {name} is not {size} numbers; take `vertical_hop` of this "
                    "problem and change its values"
                )
        return np.concatenate([np.ravel(values[name]) for name in self.unknowns])

    def unpack(self, x: Array) -> dict[str, Array]:
        """The blocks' values, each (nodes, rows), from x."""
        shapes = [unknown.symbol.shape for unknown in self.unknowns.values()]
        parts = np.split(x, np.cumsum([rows * nodes for rows, nodes in shapes])[:-1])
        return {
            name: part.reshape(nodes, rows)
            for name, part, (rows, nodes) in zip(self.unknowns, parts, shapes, strict=True)
        }

    def violations(self, x: Array, p: Array) -> dict[str, Violation]:
        """The worst violation of each named constraint, bounds included."""
        worst_of: dict[str, Violation] = {}

        def note(name: str, excess: float, where: str) -> None:
            if name not in worst_of or excess > worst_of[name].value:
                worst_of[name] = Violation(excess, where)

        g, start = np.array(self.evaluate(x, p)).ravel(), 0
        for constraint in self.constraints:
            block = g[start : start + constraint.expression.numel()]
            excess = np.maximum(constraint.lower - block, block - constraint.upper)
            note(constraint.name, float(np.max(excess)), constraint.where)
            start += len(block)
        for name, values in self.unpack(x).items():
            unknown = self.unknowns[name]
            excess = np.maximum(unknown.lower - values, values - unknown.upper)  # (nodes, rows)
            nodes = np.argmax(excess, axis=0)
            for row, limit in enumerate(unknown.limits):
                if limit:
                    where = f"{unknown.where}, node {nodes[row]}"
                    note(limit, float(excess[nodes[row], row]), where)
        return {
            name: Violation(max(0.0, worst.value), worst.where) for name, worst in worst_of.items()
        }


def _stacked_unknowns(unknowns: Mapping[str, Unknown]) -> ca.SX:
    return ca.vertcat(*[ca.vec(unknown.symbol) for unknown in unknowns.values()])


def _stacked_constraints(constraints: tuple[Constraint, ...]) -> ca.SX:
    return ca.vertcat(*[ca.vec(constraint.expression) for constraint in constraints])
