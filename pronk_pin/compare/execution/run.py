"""Running an experiment: cells side by side in any executor, each saved as soon as it is done.

The process that runs the experiment is the only one that writes: workers hand back the finished
file as bytes, so that they may sit on other machines and be killed at any moment.
"""

from __future__ import annotations

import pickle
import sys
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import xarray as xr
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from ..._checks import instance_of, path, worker_count
from ..._workers import count_steps, leave_main_to_parent, unguarded_script
from ...control import ControlTime
from ...errors import FileProblem, NoMainGuard, WorkerLost
from ..experiment import LIBRARY_VARIABLES, Cell, Experiment, run_cell
from ..metrics import CellSummary, join_summaries, summarize_cell
from ..results import (
    Results,
    check_completion,
    describe_run,
    encode,
    locked,
    make_folder,
    remove_if_empty,
)
from ..simulation import Progress
from .demand import check_demand, check_engines, check_libraries
from .executors import WorkerPool, connect, known_address, processes

MAX_RETRIES = 3
"""So often the workers may be lost before the run gives up."""

_one_at_a_time = threading.Lock()
"""Pinocchio's data belongs to the process: threads of one process take turns."""


def run_experiment(
    experiment: Experiment,
    folder: Path | str,
    *,
    workers: int | None = None,
    executor: Executor | str | None = None,
    progress: bool = True,
    resimulate: bool = False,
) -> Results:
    """Run what is missing of an experiment, and write its summary.

    The files are the same to the bit for any executor and any number of workers, and however often
    the run was killed and taken up again; only provenance.json tells.

    Args:
        experiment: What to run.
        folder: The results folder. One that holds a part is completed; one with other controllers,
            scenarios, speeds or seeds is extended, and keeps what it has.
        workers: Processes; by default one for each core. A script that asks for more than one must
            guard its own main code with `if __name__ == "__main__"`.
        executor: Who runs the cells instead of these processes: any `concurrent.futures.Executor`,
            or the address "dask://HOST:PORT" of a dask scheduler.
        progress: Show a progress bar.
        resimulate: Simulate again what the folder has damaged, or of something else; otherwise it
            is refused by name.

    Returns:
        The results, of everything that the folder has.

    Raises:
        FileProblem: The folder cannot be written, holds another experiment or strides of one, was
            begun with other versions or another MJCF, or another run is writing there; or the MJCF
            cannot be read.
        InvalidInput: The MJCF is not of this robot, no worker is allowed, or the experiment is too
            large, see `check_demand`; or an engine cannot simulate a scenario.
        MissingExtra: An engine is not installed.
        ExecutorUnavailable: The executor at that address cannot be used.
        WorkerLost: Workers ended in the middle of their work again and again.
        NoMainGuard: They ended at once, as the script that wants them guards no main code.
    """
    leave_main_to_parent()
    instance_of("experiment", experiment, Experiment)
    workers, folder = worker_count(workers), path("folder", folder)
    if executor is None:
        check_demand(experiment, workers)
    elif isinstance(executor, str):
        known_address(executor)
    else:
        instance_of("executor", executor, Executor, "an Executor, or an address dask://HOST:PORT")
    fresh = not folder.exists()
    results = Results.of(experiment, folder)
    make_folder(results, resimulate=resimulate)
    try:
        with locked(results.folder):
            _complete(results, workers, executor, progress=progress, resimulate=resimulate)
    except BaseException:
        if fresh:
            remove_if_empty(results.folder)
        raise
    return results


def _complete(
    results: Results,
    workers: int,
    executor: Executor | str | None,
    *,
    progress: bool,
    resimulate: bool,
) -> None:
    """Simulate what is missing, and summarize."""
    cells = _missing(results, resimulate=resimulate)
    if not cells and results.provenance["finished"]:
        _summarize(results, {})
        return  # who made the strides stays on record
    check_completion(results)
    robots = len(results.experiment.commands or results.experiment.speeds)
    check_engines(cells)
    check_libraries(cells)
    with tqdm(
        total=sum(map(_robot_steps, cells)),
        desc=f"simulating {robots} robots x {len(cells)}",
        unit=" robot-steps",
        unit_scale=True,
        mininterval=0.5 if sys.stderr.isatty() else 60.0,
        disable=not progress or not cells,
    ) as bar:
        run = _Run(results, bar, set(cells))
        if executor is None and (workers == 1 or len(cells) <= 1):
            run.here(cells)
        else:
            run.elsewhere(cells, _worker_pool(executor, min(workers, len(cells))))
    began = time.monotonic()
    _summarize(results, run.summaries)
    run.finish(summary=time.monotonic() - began)


def _summarize(results: Results, made: Mapping[Cell, CellSummary]) -> None:
    """Write the summary; the strides of cells that this run has not made are read for it."""
    results.write_summary(
        join_summaries(
            made[cell]
            if cell in made
            else summarize_cell(results.strides(cell), cell.experiment.own_metrics)
            for cell in results.experiment.compared
        )
    )


def _missing(results: Results, *, resimulate: bool) -> list[Cell]:
    """The cells that have to be simulated."""
    missing: list[Cell] = []
    for cell in results.experiment.cells():
        try:
            there = results.has(cell)
        except FileProblem:
            if not resimulate:
                raise
            results.path(cell).unlink(missing_ok=True)
            there = False
        if not there:
            missing.append(cell)
    return missing


def _worker_pool(
    executor: Executor | str | None, workers: int
) -> Callable[[], AbstractContextManager[WorkerPool]]:
    """What opens the executor, anew after its workers were lost."""
    if executor is None:
        return lambda: processes(workers)
    if isinstance(executor, str):
        address = executor
        return lambda: connect(address)
    user_executor = executor
    return lambda: nullcontext(WorkerPool(user_executor, type(user_executor).__name__))


class FinishedCell(NamedTuple):
    """A finished cell, as a worker hands it back."""

    strides: bytes
    """Its file."""
    summary: CellSummary
    """What it gives to the summary."""
    simulation: float
    """How long the simulation took [s]."""
    control: float
    """How long the controller took of that, a robot and tick [us]."""
    encoding: float
    """How long it took to make the file of it [s]."""
    summarizing: float
    """How long its summary took [s]."""


@dataclass
class _Run:
    """A run that is under way, and what is on record of it."""

    results: Results
    bar: tqdm[Any]
    missing: set[Cell]
    began: float = field(default_factory=time.monotonic)
    summaries: dict[Cell, CellSummary] = field(default_factory=dict)
    """Of the cells that are finished."""

    def __post_init__(self) -> None:
        self._record = {**describe_run(), "executor": "one process", "cells": {}}
        self._earlier = self.results.provenance["runs"]
        self._write()

    def here(self, cells: list[Cell]) -> None:
        """Run cells one after the other in this process."""
        for cell in cells:
            robots = cell.robots
            done = _make(cell, self._needed(cell), lambda n, m=robots: self.bar.update(n * m))  # type: ignore[misc]
            self._save(cell, done)

    def elsewhere(
        self, cells: list[Cell], open_pool: Callable[[], AbstractContextManager[WorkerPool]]
    ) -> None:
        """Run cells in an executor; workers that are lost are replaced, and their cells repeated.

        Raises:
            WorkerLost: They were lost again and again.
            NoMainGuard: They cannot come to work.
        """
        for _ in range(MAX_RETRIES):
            with open_pool() as pool:
                self._record["executor"] = pool.name
                try:
                    return self._play(pool, [c for c in cells if c in self.missing])
                except pool.lost as error:
                    reason = error
                    if pool.steps is not None and (script := unguarded_script()):
                        raise NoMainGuard(script) from error
        of_script = b"__main__" in pickle.dumps(cells)
        raise WorkerLost(self.results.folder, of_script=of_script) from reason

    def _play(self, pool: WorkerPool, waiting: list[Cell]) -> None:
        """Hand cells out and save what comes back; one waits for what it depends on."""
        total, steps_left = int(self.bar.total or 0), sum(map(_robot_steps, waiting))
        running: dict[Future[FinishedCell], Cell] = {}
        try:
            while waiting or running:
                for cell in waiting.copy():
                    if cell.depends_on is None or cell.depends_on not in self.missing:
                        waiting.remove(cell)
                        running[pool.executor.submit(_work, cell, self._needed(cell))] = cell
                for future in wait(running, timeout=0.2, return_when=FIRST_COMPLETED)[0]:
                    self._save(running[future], future.result())
                    del running[future]
                unfinished = [*waiting, *running.values()]
                steps = (
                    pool.steps() if pool.steps else steps_left - sum(map(_robot_steps, unfinished))
                )
                self.bar.update(total - steps_left + steps - self.bar.n)
        except BaseException:
            self._give_up(running)
            pool.stop()
            raise

    def _give_up(self, running: dict[Future[FinishedCell], Cell]) -> None:
        """Call off what has not begun, and save what was finished meanwhile."""
        for future in running:
            future.cancel()
        with suppress(FileProblem):
            for future, cell in running.items():
                if future.done() and not future.cancelled() and not future.exception():
                    self._save(cell, future.result())

    def _needed(self, cell: Cell) -> xr.Dataset | None:
        if cell.depends_on is None:
            return None
        # Identification reads every tick; a library is made of a few variables.
        explains = cell.spec.source == "identified"
        return self.results.strides(cell.depends_on, None if explains else LIBRARY_VARIABLES)

    def _save(self, cell: Cell, finished: FinishedCell) -> None:
        self.results.save(cell, finished.strides)
        self.summaries[cell] = finished.summary
        self.missing.discard(cell)
        self._record["cells"][cell.name] = {
            "simulation_s": round(finished.simulation, 2),
            "control_us_per_tick": round(finished.control, 2),
            "encoding_s": round(finished.encoding, 2),
            "summary_s": round(finished.summarizing, 2),
        }
        self._write()

    def finish(self, *, summary: float) -> None:
        """The run is complete; to join its summary took so long [s]."""
        self._record["wall_time_s"] = round(time.monotonic() - self.began, 1)
        self._record["summary_s"] = round(summary, 2)
        self._write(finished=True)

    def _write(self, *, finished: bool = False) -> None:
        runs = [*self._earlier, self._record]
        self.results.write_provenance({"finished": finished, "runs": runs})


def _robot_steps(cell: Cell) -> int:
    return cell.steps * cell.robots


def _make(cell: Cell, dependency: xr.Dataset | None, progress: Progress) -> FinishedCell:
    # BLAS with several threads may add in another order, and workers side by side need no more.
    with _one_at_a_time, threadpool_limits(1):
        times = [time.perf_counter()]
        control_time = ControlTime()
        strides = run_cell(cell, dependency, progress, control_time)
        times.append(time.perf_counter())
        data = encode(strides)
        times.append(time.perf_counter())
        summary = summarize_cell(strides, cell.experiment.own_metrics)
        times.append(time.perf_counter())
    simulation, encoding, summarizing = (after - before for before, after in pairwise(times))
    return FinishedCell(data, summary, simulation, control_time.per_tick, encoding, summarizing)


def _work(cell: Cell, dependency: xr.Dataset | None) -> FinishedCell:
    """What a worker does."""
    return _make(cell, dependency, lambda steps: count_steps(steps * cell.robots))
