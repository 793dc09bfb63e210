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

APPROXIMATIONS = ("sap", "lagged", "similar", "tamsi")
"""Drake's approximations of the discrete contact problem."""


@dataclass(frozen=True)
class DrakeEngine(Engine):
    """Drake: contacts by a convex problem (SAP) or a lagged one, dry friction, implicit damping.

    Attributes:
        name: Short name.
        approximation: Of the discrete contact problem. "sap": convex, springs and dampers
            (Castro, Permenter, Han 2022). "lagged" and "similar": Hunt and Crossley's contact in
            convex problems (Castro, Han, Masterjohn 2024). "tamsi": the same, by Newton's method
            with friction that slips below 1 mm/s (Castro et al. 2020); three times as fast, and
            without dry friction in the joints.
    """

    name: str = "drake"
    approximation: str = "sap"

    def __post_init__(self) -> None:
        known_name("approximation", self.approximation, APPROXIMATIONS)

    def check(self, robot: Robot, scenario: Scenario, base: str) -> None:
        """See `Engine`."""
        known_name("base", base, BASES)
        beyond = ", ".join(self._beyond(robot, scenario))
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

    def _beyond(self, robot: Robot, scenario: Scenario) -> Iterator[str]:
        """Names of what a scenario has and Drake has not."""
        for name in ("ground_roughness", "step_height", "mjcf", "edit"):
            if getattr(scenario, name):
                yield name
        own = (robot.bare or robot).model.friction[-robot.nu :]
        dry = scenario.by_joint("coulomb", robot) + own
        if self.approximation == "tamsi" and dry.any():
            yield "coulomb by tamsi"
