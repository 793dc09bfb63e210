"""Checks of an audit, with their worst values, places and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from .._display import Displayed
from ..errors import InvalidInput

TOLERANCE = 1e-8
"""Largest violation of a constraint that passes, in the constraint's unit."""

UNITS = {
    "average speed": "m",
    "apex height": "m",
    "dynamics": "N or N m",
    "collocation": "m or rad",
    "contact height": "m",
    "contact acceleration": "m/s^2",
    "touchdown impact": "N s",
    "touchdown contact": "m/s",
    "foot clearance": "m",
    "phase continuity": "m or rad",
    "periodicity": "m or rad",
    "stride duration": "s",
    "phase durations": "s",
    "configuration limits": "rad",
    "hip limit": "rad",
    "pitch limit": "rad",
    "roll limit": "rad",
    "yaw limit": "rad",
    "side step": "m",
    "trunk height": "m",
    "velocity limits": "rad/s",
    "torque limits": "N m",
    "unilateral contact": "N",
    "friction cone": "N",
    "impulse cone": "N s",
}
"""Units of the constraints; where a constraint holds positions and velocities, the former's."""


class Limit(NamedTuple):
    """Unit and bounds of a check; None where the value only informs."""

    unit: str
    most: float | None = None
    least: float | None = None


CHECKS: Mapping[str, Limit] = {
    "18-DoF residual": Limit("N or N m", 1e-8),
    "guide": Limit("N or N m"),
    "mirror symmetry": Limit("m", 1e-10),
    "apex error": Limit("m", 1e-4),
    "contact height drift": Limit("m", 2e-6),
    "contact slip": Limit("m/s", 1e-4),
    "stance drift": Limit("rad", 2e-5),
    "stance foot drift": Limit("m", 2e-6),
    "flight drift": Limit("rad", 1e-3),
    "flight foot drift": Limit("m", 1e-4),
    "convergence order": Limit("", least=3.0),
    "bezier position": Limit("rad", 1e-3),
    "bezier velocity": Limit("rad/s"),
    "bezier torque": Limit("N m"),
    "torque use": Limit("of limit", 1.0),
    "velocity use": Limit("of limit", 1.0),
    "friction use": Limit("of limit", 1.0),
    "ground force": Limit("N"),
}
"""The independent checks: unit, and what passes."""

_COARSE = ("drift", "bezier", "contact slip", "convergence order", "apex error")

RESOLUTION = tuple(name for name in CHECKS if any(word in name for word in _COARSE))
"""The checks that a mesh or polynomials that are too coarse may fail."""

_ROUND_OFF = 1e-9
"""A limit that a gait uses in full is not exceeded by round-off [of it]."""

_VIOLATION = "violation: "


@dataclass(frozen=True)
class Check:
    """One checked claim.

    Attributes:
        name: What was checked.
        value: The worst value found.
        where: Where it was found.
        limit: Its unit, and what passes.
    """

    name: str
    value: float
    where: str
    limit: Limit

    @classmethod
    def of(cls, name: str, value: float, where: str = "") -> Check:
        """An independent check, by its name in `CHECKS`."""
        return cls(name, value, where, CHECKS[name])

    @classmethod
    def of_constraint(cls, name: str, violation: float, where: str = "") -> Check:
        """A constraint of the gait problem with its worst violation."""
        return cls(name, violation, where, Limit(UNITS[name], TOLERANCE))

    @property
    def unit(self) -> str:
        """Unit of the value."""
        return self.limit.unit

    @property
    def passed(self) -> bool:
        """Whether the value is within its limit."""
        most, least = self.limit.most, self.limit.least
        if most is not None and not self.value <= most * (1.0 + _ROUND_OFF):
            return False
        return least is None or self.value >= least

    def line(self) -> str:
        """The check as a line of a table."""
        most, least = self.limit.most, self.limit.least
        limit = f"<= {most:.0e}" if most is not None else f">= {least:g}" if least else ""
        note = self.where if self.passed else f"{self.where}  FAILED"
        return f"{self.name:<24}{self.value:>10.1e}  {self.unit:<12}{limit:>9}  {note}".rstrip()


@dataclass(frozen=True)
class StoredAudit:
    """An audit as a file keeps it.

    Attributes:
        motion: `Gait.sha256` of the gait.
        checks: For each check, by name, its worst value and where it was found.
    """

    motion: str
    checks: Mapping[str, tuple[float, str]]


@dataclass(frozen=True, repr=False)
class Audit(Displayed):
    """Result of the audit of one gait.

    Attributes:
        speed: Speed of the gait [m/s].
        motion: `Gait.sha256` of the gait.
        constraints: The named constraints of the problem with their worst violations.
        checks: The independent checks.
    """

    speed: float
    motion: str
    constraints: tuple[Check, ...]
    checks: tuple[Check, ...]

    def _title(self) -> str:
        return f"Audit of the gait at {self.speed:g} m/s: {'passed' if self.passed else 'FAILED'}"

    def _facts(self) -> dict[str, str]:
        worst = self.worst_violation if self.constraints else None
        return {
            "checks": f"{len(self.checks)}, and {len(self.constraints)} constraints",
            "failed": ", ".join(check.name for check in self.failures),
            "worst": f"{worst.name}, {worst.value:.1e} {worst.unit}" if worst else "",
            "motion": self.motion[:12],
        }

    @property
    def passed(self) -> bool:
        """Whether everything is within its limit."""
        return not self.failures

    @property
    def worst_violation(self) -> Check:
        """The constraint that is violated most."""
        return max(self.constraints, key=lambda check: check.value)

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that are not within their limit."""
        return tuple(check for check in (*self.constraints, *self.checks) if not check.passed)

    def __getitem__(self, name: str) -> Check:
        """The independent check of that name."""
        return next(check for check in self.checks if check.name == name)

    def as_json(self) -> dict[str, Any]:
        """What a file keeps: the motion's SHA-256, and for each check its value and place by name;
        constraints as "violation: name"."""
        named = [(_VIOLATION + check.name, check) for check in self.constraints]
        named += [(check.name, check) for check in self.checks]
        return {
            "motion": self.motion,
            "checks": {name: [check.value, check.where] for name, check in named},
        }

    @classmethod
    def from_stored(cls, speed: float, stored: StoredAudit) -> Audit:
        """The audit that a file keeps; what passes is decided anew.

        Raises:
            InvalidInput: A check that this version does not know, or one that is missing.
        """
        constraints, checks = [], []
        for full_name, (value, where) in stored.checks.items():
            name = full_name.removeprefix(_VIOLATION)
            if name not in (UNITS if name != full_name else CHECKS):
                raise InvalidInput(f"audit with a check '{full_name}' that is not known")
            if name != full_name:
                constraints.append(Check.of_constraint(name, value, where))
            else:
                checks.append(Check.of(name, value, where))
        missing = set(CHECKS) - {check.name for check in checks}
        if missing or not constraints:
            raise InvalidInput(f"audit without {', '.join(sorted(missing)) or 'constraints'}")
        return cls(speed, stored.motion, tuple(constraints), tuple(checks))

    def table(self) -> str:
        """The audit as text, one line a check."""
        header = f"{'check':<24}{'worst':>10}  {'unit':<12}{'passes':>9}  where"
        return "\n".join([header, *(c.line() for c in (*self.constraints, *self.checks))])
