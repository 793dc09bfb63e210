"""What an experiment demands of the machine, before any of it is run."""

from __future__ import annotations

from collections.abc import Iterable

from ...errors import InvalidInput
from ...gait import Gait
from ..experiment import Cell, Experiment, check_stored_library
from ..simulation import SHORTER, check_memory, number_of_robots
from ..world import check_engine

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
        check_engine(cell.experiment.model, world, cell.experiment.base)


def check_libraries(cells: Iterable[Cell]) -> None:
    """Check that torque libraries in files, which controllers begin with, are there and fit.

    Raises:
        FileProblem, InvalidInput: One does not; see `check_stored_library`.
    """
    for cell in {cell.controller: cell for cell in cells}.values():
        check_stored_library(cell)


def check_demand(experiment: Experiment, workers: int) -> None:
    """Refuse an experiment that does not fit into memory, or takes longer than anybody waits.

    Args:
        experiment: The experiment.
        workers: Processes that share it.

    Raises:
        InvalidInput: It does not, or does.
    """
    cells = experiment.cells()
    longest = max(cells, key=lambda cell: cell.schedule.duration * cell.robots)
    gaits, duration = _gaits(longest), longest.schedule.duration
    check_memory(gaits, duration, at_once=min(workers, len(cells)))
    seconds = sum(cell.schedule.duration * cell.robots for cell in cells)
    days = seconds / _QUICK / workers / _DAY
    if days > LONGEST:
        raise InvalidInput(
            f"{len(cells)} simulations of {number_of_robots(gaits)} over {duration:g} s take about "
            f"{days:.3g} days on {workers} cores, beyond {LONGEST:g} days; {SHORTER}, "
            "--controllers, --scenarios or --seeds"
        )


def _gaits(cell: Cell) -> list[Gait]:
    """Gaits of the robots of a cell; of a command the shortest that it may be."""
    experiment = cell.experiment
    if not cell.commands:
        return experiment.planned_at(cell.speeds)
    return [min(experiment.planned, key=lambda gait: gait.duration)] * cell.robots
