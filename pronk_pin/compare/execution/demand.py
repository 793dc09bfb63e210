"""What an experiment demands of the machine, before any of it is run."""

from __future__ import annotations

from collections.abc import Iterable

from ...errors import InvalidInput
from ..experiment import Cell, Experiment
from ..simulation import SHORTER, check_memory, number_of_robots
from ..world import engine_of

LONGEST = 30.0
"""Days that an experiment may take, by a hopeful estimate."""

_QUICK = 25.0
"""Robot-seconds that a core simulates in a second, at 1 kHz with a locked base: `make compare`
takes a minute on two cores for 14 robots, 5 controllers and 40.5 s. Tick by tick it is less."""

_DAY = 86_400.0


def check_engines(cells: Iterable[Cell]) -> None:
    """Check that the engines of simulations are installed, and can do what is asked of them.

    Raises:
        UnknownName, InvalidInput, MissingExtra: One cannot; see `Engine.check`.
    """
    asked = {(cell.scenario, cell.seed): cell for cell in cells}
    for cell in asked.values():
        world = cell.world
        engine_of(world).check(cell.experiment.model, world, cell.experiment.base)


def check_demand(experiment: Experiment, workers: int) -> None:
    """Refuse an experiment that does not fit into memory, or takes longer than anybody waits.

    Args:
        experiment: The experiment.
        workers: Processes that share it.

    Raises:
        InvalidInput: It does not, or does.
    """
    gaits, cells = experiment.planned, len(experiment.cells())
    duration = experiment.schedule.duration
    check_memory(gaits, duration, at_once=min(workers, cells))
    days = duration * len(gaits) * cells / _QUICK / workers / _DAY
    if days > LONGEST:
        raise InvalidInput(
            f"{cells} simulations of {number_of_robots(gaits)} over {duration:g} s take about "
            f"{days:.3g} days on {workers} cores, beyond {LONGEST:g} days; {SHORTER}, "
            "--controllers, --scenarios or --seeds"
        )
