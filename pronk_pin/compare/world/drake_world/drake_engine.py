"""Drake as an engine, and what it cannot do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec

from ...._checks import known_name
from ....control import Gains
from ....errors import InvalidInput, MissingExtra
from ....robot import BASES, Robot
from ..engine import Engine, World
from ..scenario import Scenario

APPROXIMATIONS = ("lagged", "similar", "sap")
"""Drake's approximations of the discrete contact problem."""


@dataclass(frozen=True)
class DrakeEngine(Engine):
    """Drake: discrete steps with compliant contacts, dry friction in the joints, implicit damping.

    Attributes:
        name: Short name.
        approximation: Of the discrete contact problem, each of them convex. "lagged", Drake's own
            default: Hunt and Crossley's contact, with friction that knows the normal force of the
            step before. "similar": the same without that lag, but feet that slide are lifted a
            little (both: Castro, Han, Masterjohn 2023, arXiv:2312.03908). "sap": springs and
            dampers in its place, lifted likewise (Castro, Permenter, Han 2022, arXiv:2110.10107).
    """

    name: str = "drake"
    approximation: str = "sap"

    def __post_init__(self) -> None:
        known_name("approximation", self.approximation, APPROXIMATIONS)

    def check(self, robot: Robot, scenario: Scenario, base: str) -> None:
        """See `Engine`."""
        known_name("base", base, BASES)
        beyond = ", ".join(_beyond(scenario))
        if beyond:
            raise InvalidInput(
                f"scenario '{scenario.name}': {self.name} cannot simulate {beyond}; leave that "
                "out, or take engine mujoco"
            )
        if find_spec("pydrake") is None:
            raise MissingExtra("drake", "drake")

    def world(
        self, robot: Robot, scenario: Scenario, n: int, *, base: str, servo: Gains | None = None
    ) -> World:
        """See `Engine`."""
        self.check(robot, scenario, base)
        from .drake_world import DrakeWorld  # which imports Drake

        return DrakeWorld(
            robot, scenario, n, base=base, servo=servo, approximation=self.approximation
        )


def _beyond(scenario: Scenario) -> Iterator[str]:
    """Names of what a scenario has and Drake has not."""
    for name in ("ground_roughness", "step_height", "mjcf", "edit"):
        if getattr(scenario, name):
            yield name
