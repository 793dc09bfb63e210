"""Worker pools: processes on this machine, or the workers of a dask scheduler.

Anything else that is a `concurrent.futures.Executor` can be passed to `run_experiment` itself.
"""

from __future__ import annotations

import importlib.metadata
import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass

from ..._checks import shown
from ..._workers import begin_worker
from ...errors import ExecutorUnavailable, InvalidInput
from ...storage import temporary_folder

_TIMEOUT = 10.0
"""Timeout of a scheduler's answer [s]."""


@dataclass(frozen=True)
class WorkerPool:
    """A pool of workers: its executor, and how to count, stop and judge its work.

    Attributes:
        executor: Whom cells are handed to.
        name: What it is, for the record.
        lost: Errors by which it tells that a worker was lost, and not that the work was wrong.
        steps: Robot-steps simulated so far; None where the workers do not tell.
        stop: Ends work that is under way, without waiting for it.
    """

    executor: Executor
    name: str
    lost: tuple[type[BaseException], ...] = (BrokenExecutor,)
    steps: Callable[[], int] | None = None
    stop: Callable[[], None] = lambda: None


@contextmanager
def processes(count: int) -> Iterator[WorkerPool]:
    """Start a pool of processes on this machine.

    Raises:
        FileProblem: There is no room for temporary files.
    """
    context = multiprocessing.get_context("spawn")
    counter = context.Value("q", 0)
    before = set(multiprocessing.active_children())

    def stop() -> None:
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()  # what they have not finished is simulated again next time

    with (
        temporary_folder() as folder,
        ProcessPoolExecutor(
            count, context, initializer=begin_worker, initargs=(str(folder), counter)
        ) as pool,
    ):
        name = f"{count} process{'es' if count > 1 else ''}"
        yield WorkerPool(pool, name, steps=lambda: counter.value, stop=stop)


def known_address(address: str) -> str:
    """HOST:PORT of a dask scheduler, from its address "dask://HOST:PORT".

    Raises:
        InvalidInput: Not such an address.
    """
    kind, _, place = address.partition("://")
    if kind != "dask" or ":" not in place:
        raise InvalidInput(
            f"executor {shown(address)} is not an address; give dask://HOST:PORT of a dask "
            "scheduler"
        )
    return place


@contextmanager
def connect(address: str) -> Iterator[WorkerPool]:
    """Connect to the workers of a dask scheduler.

    Args:
        address: "dask://HOST:PORT".

    Raises:
        InvalidInput: Not such an address.
        ExecutorUnavailable: dask is not installed, nobody answers, or the workers have not got
            this version of the package.
    """
    place = known_address(address)
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise ExecutorUnavailable(
            address, "dask.distributed is not installed", "pip install 'pronk-pin[dask]'"
        ) from error
    try:
        client = Client(f"tcp://{place}", timeout=_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ExecutorUnavailable(
            address, f"no scheduler answers ({error})", "start one with 'dask scheduler'"
        ) from error
    with client:
        workers = _check_workers(client, address)
        yield WorkerPool(
            client.get_executor(pure=False),
            f"{address}, {workers} worker{'s' if workers != 1 else ''}",
            lost=(BrokenExecutor, KilledWorker, CancelledError, OSError),
        )


def _check_workers(client: object, address: str) -> int:
    """Count the workers; every one must have our version of the package."""

    def installed() -> str | None:  # sent as it stands: a worker may not know this module
        from importlib.metadata import PackageNotFoundError, version

        try:
            return version("pronk-pin")
        except PackageNotFoundError:
            return None

    client.wait_for_workers(1, timeout=_TIMEOUT)  # type: ignore[attr-defined]
    versions: dict[str, str | None] = client.run(installed)  # type: ignore[attr-defined]
    own_version = importlib.metadata.version("pronk-pin")
    for worker, worker_version in sorted(versions.items()):
        if worker_version != own_version:
            raise ExecutorUnavailable(
                address,
                f"worker {worker} has pronk-pin {worker_version or 'not installed'}, "
                f"not {own_version}",
                "install the same version there",
            )
    return len(versions)
