"""Running an experiment: cells side by side in processes, each saved as soon as it is done."""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from typing import Any

from tqdm import tqdm

from .._workers import follow_parent
from ..errors import InvalidInput, WorkerLost
from .experiment import Cell, Experiment, run_cell
from .results import Results
from .simulate import Progress

_steps_done: Synchronized[int] | None = None


def run_experiment(
    experiment: Experiment,
    folder: Path,
    *,
    workers: int | None = None,
    progress: bool = True,
) -> Results:
    """Run what is missing of an experiment, and write its summary.

    Args:
        experiment: What to run.
        folder: The results folder; one that holds part of the same experiment is completed.
        workers: Processes; by default one for each core. A script that asks for more than one must
            guard its own main code with `if __name__ == "__main__"`.
        progress: Show a progress bar.

    Raises:
        FileProblem: The folder cannot be written, or holds another experiment.
        WorkerLost: A process ended in the middle of its work.
    """
    workers = workers if workers is not None else os.cpu_count() or 1
    if workers < 1:
        raise InvalidInput(f"{workers} workers; at least one is needed")
    began = time.monotonic()
    results = Results.create(experiment, folder)
    robots = len(experiment.speeds)
    cells = [cell for cell in experiment.cells() if not results.has(cell)]
    with tqdm(
        total=sum(cell.steps * robots for cell in cells),
        desc=f"simulating {robots} robots x {len(cells)}",
        unit=" robot-steps",
        unit_scale=True,
        mininterval=0.5 if sys.stderr.isatty() else 10.0,
        disable=not progress or not cells,
    ) as bar:
        if workers == 1 or len(cells) <= 1:
            for cell in cells:
                _simulate(results, cell, lambda steps: bar.update(steps * robots))
        else:
            _in_processes(results, cells, workers, bar)
    results.summarize()
    if not cells and results.config.get("finished"):
        return results  # who made the strides stays on record
    results.write_config({"finished": True, "wall_time_s": round(time.monotonic() - began, 1)})
    return results


def _simulate(results: Results, cell: Cell, progress: Progress) -> None:
    practised = results.strides(cell.practised) if cell.practised else None
    results.save(cell, run_cell(cell, practised, progress))


def _in_processes(results: Results, cells: list[Cell], workers: int, bar: tqdm[Any]) -> None:
    """Cells in a pool of processes; a cell waits until the one it depends on is saved."""
    context = multiprocessing.get_context("spawn")
    counter = context.Value("q", 0)
    waiting, running = list(cells), set[Future[None]]()
    with ProcessPoolExecutor(
        min(workers, len(cells)), context, initializer=_begin_worker, initargs=(counter,)
    ) as pool:
        try:
            while waiting or running:
                for cell in [c for c in waiting if not c.practised or results.has(c.practised)]:
                    waiting.remove(cell)
                    running.add(pool.submit(_work, results, cell))
                done, running = wait(running, timeout=0.2, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                bar.update(counter.value - bar.n)
        except BrokenProcessPool as error:
            raise WorkerLost(results.folder) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()  # what they have not saved is simulated again next time
            raise
    bar.update(counter.value - bar.n)


def _begin_worker(counter: Synchronized[int]) -> None:
    """Set a worker up: it counts its steps, leaves Ctrl-C to the parent, and dies with it."""
    global _steps_done
    _steps_done = counter
    follow_parent()


def _work(results: Results, cell: Cell) -> None:
    def count(steps: int) -> None:
        if _steps_done is not None:
            with _steps_done.get_lock():
                _steps_done.value += steps * len(cell.speeds)

    _simulate(results, cell, count)
